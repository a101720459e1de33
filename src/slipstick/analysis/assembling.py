"""From a problem to the piecewise linear system that is integrated in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.piecewise import FrictionSystem
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem

Array = NDArray[np.float64]

HELD = ("mu", "kt", "kn", "gap")
"""Contact parameters that can be given instead of the problem's."""


def friction_system(problem: Problem, omega: float, held: Mapping[str, Array] | None = None) -> FrictionSystem:
    """Structure, contacts and forcing of a problem at one principal frequency, rad/s.

    ``held`` gives contact parameters (n_contacts,) by name instead of the problem's own, see ``HELD``.

    Raises
    ------
    InputError
        If a name in ``held`` is unknown, or the contacts heat up and their friction coefficients are not held.
    """
    held = dict(held or {})
    _check(problem, held)
    pairs = problem.contacts
    tangential = [pair.directions[0] for pair in pairs]
    normal = [pair.directions[1] for pair in pairs]
    has_normal = np.array([direction is not None for direction in normal], dtype=bool)
    contact = problem.direction_matrix([*tangential, *(direction for direction in normal if direction is not None)])
    dofs, shapes = problem.load_targets
    forces = problem.direction_matrix({dof: 1.0} for dof in dofs)
    outputs = problem.direction_matrix({name: 1.0} for name in problem.outputs or ())
    equations = problem.structure.time_equations(np.hstack([contact, outputs]), np.hstack([contact, forces]), shapes)
    rubbing, loads, h = problem.rubbing_coefficients(), problem.load_coefficients(), problem.harmonics
    moving = np.abs(np.vstack([rubbing, loads])).max(axis=0, initial=0.0)
    orders = tuple(m for k, m in enumerate(h.orders[1:]) if moving[1 + 2 * k : 3 + 2 * k].any())
    kept = [0, *(i for m in orders for i in (h.index(m, "c"), h.index(m, "s")))]
    values = {name: np.asarray(held.get(name, problem.contact_values(name)), dtype=float) for name in HELD}
    return FrictionSystem(
        equations=equations, omega=omega, velocity=problem.contact_values("velocity"), has_normal=has_normal,
        orders=orders, rubbing=rubbing[:, kept], loads=loads[:, kept], **values,
    )  # fmt: skip


def _check(problem: Problem, held: Mapping[str, Array]) -> None:
    problems = [
        f"time integration, held: found '{name}'; expected one of {', '.join(HELD)}" for name in set(held) - set(HELD)
    ]
    n = len(problem.contacts)
    problems += [
        f"time integration, held '{name}': found shape {np.shape(value)}; expected ({n},)"
        for name, value in held.items()
        if np.shape(value) != (n,)
    ]
    if problem.heated is not None and "mu" not in held:
        problems.append(
            "time integration: friction heats these contacts, and heat is not integrated in time; "
            "give their hot parameters by held={'mu': ..., 'kt': ..., 'kn': ...}"
        )
    if problems:
        raise InputError(problems)
