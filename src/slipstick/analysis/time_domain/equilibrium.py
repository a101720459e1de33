"""The equilibrium from which motion in time begins where contacts know where they were at rest, as after a preload.

It is that of the balance in harmonic 0 alone: static loads, gaps and friction springs at their motion at rest, without
any rubbing motion, velocity or vibrating load.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from slipstick.analysis.time_domain.piecewise_model import friction_elements, held_values, sticks_and_slips
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import detail
from slipstick.balance.inputs import Inputs
from slipstick.balance.problem import Problem
from slipstick.balance.start import FirstPoint
from slipstick.contact.friction_law import is_friction
from slipstick.errors import Fault, InputError
from slipstick.html import some
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_NAMED = 5
"""Contacts that a message names, at most."""


@dataclass(frozen=True, kw_only=True)
class Equilibrium:
    """Motion and forces of contacts: of n friction contacts (n,), and at P ports of other laws (P,).

    Both are in the order of ``FrictionSystem``.
    """

    tangential: Array
    friction: Array
    normal: Array
    """Normal forces."""
    ports: Array
    forces: Array


def equilibrium(problem: Problem, omega: float, held: Mapping[str, Array] | None = None) -> Equilibrium | None:
    """The equilibrium at a fundamental frequency, rad/s; None where no contact knows its motion at rest.

    ``held`` gives contact parameters as in ``friction_system``.

    Raises
    ------
    InputError
        If there is none.
    """
    remembering = problem.preloaded_elements
    if not remembering:
        return None
    static = problem.narrowed(Harmonics([0]))
    if static.thermal is not None or static.states:
        static = replace(static, thermal=None, states=())
    given = {name: np.asarray(values, dtype=float) for name, values in (held or {}).items()}
    inputs, balance = _without_velocity(static, given), Balance(static)
    x = FirstPoint(balance, inputs, omega).find()
    if x is None:
        raise InputError(
            Fault(
                "time integration",
                f"there is no equilibrium under the static loads from which it could begin, with the preload of "
                f"{some([name for name in problem.elements if name in remembering], _NAMED)}",
                remedy="compute the load steps with the structure and the contacts as they are, or begin from a point "
                "of a branch: branch.check_in_time",
            )
        )
    responses = detail(balance, x, omega, inputs).responses
    motion, friction, normal = np.zeros((3, len(problem.elements)))
    ports, forces = [np.zeros(0)], [np.zeros(0)]
    for k, (batch, response) in enumerate(zip(balance.batches, responses, strict=True)):
        Q = balance.layout.motion(k, x, omega, inputs.batches[k]).Q
        moved = np.stack([q[:, 0] for q in Q])
        acting = np.stack([response.force[i][:, 0] for i in range(len(Q))])
        if sticks_and_slips(batch.law):
            motion[batch.elements] = moved[0]
            # contacts of sliders have no limit that follows a normal force: they begin in contact, without force
            friction[batch.elements], normal[batch.elements] = acting if is_friction(batch.law) else (0.0, 1.0)
        else:
            ports.append(moved.reshape(-1))
            forces.append(acting.reshape(-1))
    of = friction_elements(problem)
    return Equilibrium(
        tangential=motion[of], friction=friction[of], normal=normal[of], ports=np.concatenate(ports),
        forces=np.concatenate(forces),
    )  # fmt: skip


def _without_velocity(problem: Problem, held: Mapping[str, Array]) -> Inputs:
    """Inputs of contacts that do not rub, with the given parameters."""
    inputs = problem.inputs
    for k, (batch, own) in enumerate(zip(problem.batches, inputs.batches, strict=True)):
        still = {name: np.zeros_like(own.velocity) for name in ("velocity", "velocity_per_omega")}
        inputs = inputs.with_batch(k, **still, **held_values(batch, own.values, held))
    return inputs
