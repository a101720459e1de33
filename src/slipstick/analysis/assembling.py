"""From a problem to the piecewise linear system that is integrated in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.piecewise import FrictionSystem
from slipstick.trig.harmonics import Harmonics

if TYPE_CHECKING:
    from slipstick.balance.problem import ContactPair, Problem

Array = NDArray[np.float64]


def friction_system(problem: Problem, omega: float) -> FrictionSystem:
    """Structure, contacts and forcing of a problem at one principal frequency, rad/s."""
    from slipstick.balance.problem import direction_vectors

    dofs, pairs = tuple(problem.structure.dofs), problem.contacts
    tangential = [_cosines(pair.tangential) for pair in pairs]
    normal = [_cosines(pair.normal) for pair in pairs if pair.normal is not None]
    contact = np.hstack([direction_vectors(dofs, tangential), direction_vectors(dofs, normal)])
    outputs = direction_vectors(dofs, [{name: 1.0} for name in problem.outputs or ()])
    points = [load for load in problem.loads if load.dof is not None]
    shaped = [load for load in problem.loads if load.shape is not None]
    forces = direction_vectors(dofs, [{str(load.dof): 1.0} for load in points])
    equations = problem.structure.time_equations(
        np.hstack([contact, outputs]), np.hstack([contact, forces]), [str(load.shape) for load in shaped]
    )
    load_orders = {load.harmonic * problem.load_order for load in problem.loads}
    rubbing_orders = {m * problem.rubbing_order for pair in pairs for m in pair.rubbing.orders}
    orders = tuple(sorted((load_orders | rubbing_orders) - {0}))
    h = Harmonics((0, *orders))
    loads = np.zeros((len(points) + len(shaped), h.size))
    for row, load in zip(loads, (*points, *shaped), strict=True):
        m = load.harmonic * problem.load_order
        row[h.index(m, "c")] += problem.load * load.cos
        if m:
            row[h.index(m, "s")] += problem.load * load.sin
    return FrictionSystem(
        equations=equations, omega=omega, orders=orders, loads=loads,
        kt=_each(pairs, "kt"), mu=problem.friction * _each(pairs, "mu"), kn=_each(pairs, "kn"),
        gap=_each(pairs, "gap"), velocity=np.array([float(np.asarray(p.rubbing.velocity)) for p in pairs]),
        has_normal=np.array([pair.normal is not None for pair in pairs], dtype=bool),
        rubbing=np.array([p.rubbing.coefficients(h, problem.rubbing_order) for p in pairs]).reshape(-1, h.size),
    )  # fmt: skip


def _cosines(direction: str | Mapping[str, float]) -> Mapping[str, float]:
    return {direction: 1.0} if isinstance(direction, str) else direction


def _each(pairs: Sequence[ContactPair], name: str) -> Array:
    return np.array([float(np.asarray(getattr(pair.contact, name))) for pair in pairs])
