"""The exact periodic motion next to a truncated one, by shooting (THEORY.md section 12).

A balance gives a motion in a few harmonics. Where these are too few to decide its stability, Newton's method on the
period map finds the motion in time. The derivative of that map has the multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slipstick.analysis.stability.dynamics import Dynamics
from slipstick.analysis.stability.linear_systems import (
    Combinations,
    FrictionPorts,
    friction_batches,
    friction_values,
    slider_batches,
)
from slipstick.analysis.stability.monodromy import multipliers_of
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.state_sequence import Timeline
from slipstick.analysis.time_domain.event_integrator import ChatteringError, Stepper
from slipstick.analysis.time_domain.initial_state import periodic_memory, with_forces
from slipstick.analysis.time_domain.law_in_time import LawsInTime
from slipstick.analysis.time_domain.piecewise import Combination, FrictionSystem, PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import system_of
from slipstick.analysis.time_domain.shooting import one_period, relative_change
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail
from slipstick.errors import InputError
from slipstick.structure.protocol import TimeEquations
from slipstick.typing import Array, ComplexArray, IntArray

FARTHEST = 0.25
"""Distance from the truncated motion, over its size, beyond which a motion found is another one."""

_LARGEST_SHIFT = 2e-3
"""Relative shift of the frequency that is allowed: next to a fold the motion may end a little before the truncated."""

_CLOSED, _CLOSED_WITH_MEMORY = 1e-11, 1e-9
"""Relative change over a period that counts as closed; the equations of a memory may have corners within a step."""

_MOST_ITERATIONS, _SLOW_RATIO, _MOST_SLOW = 12, 0.7, 2
"""Newton's method ends unsuccessfully after so many iterations, or where more than two reduce the change less."""

_FREQUENCY_STEP = 1e-7
"""Relative difference of the frequency in the derivative of the period map by it."""

_FEWEST_STEPS, _FEWEST_SMOOTH, _STEP_ANGLE = 96, 24, 1.5
"""Steps a period with and without friction contacts, and the angle of the fastest motion in one."""

_MOST_WORK = 2e8
"""Steps a period times the size of the system cubed; Newton's method takes seconds with that."""


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion and the derivative of its period map."""

    matrix: Array
    """(k, k): motion, velocities, and memories of contacts stuck where the period begins, but not all period."""
    distance: float
    """Distance from the truncated motion, over its size."""

    @property
    def multipliers(self) -> ComplexArray:
        """Eigenvalues, the largest first."""
        return multipliers_of(self.matrix)


def nearest_orbit(
    balance: Balance, detail: Detail, motion: SmoothMotion, line: Timeline, combinations: Combinations,
    law_ports: IntArray, *, free: bool,
) -> Orbit | None:  # fmt: skip
    """The periodic motion nearest to an iterated one; None where none is found.

    ``free`` says that the frequency is an unknown. Next to a fold the motion may end a little before the truncated one
    does: the nearest motion at a slightly different frequency is taken then.
    """
    structure, contacts = _with_idle_port(combinations.dynamics), combinations.contacts
    system = _system(balance, detail, structure, contacts, motion.laws, law_ports)
    first = line.intervals[0]
    tau = 0.0 if first.change is None else first.change.time - first.length
    q, rate, size = _response(balance, detail, motion, structure, contacts, law_ports, tau)
    try:
        stepper = _stepper(system)
        z = np.zeros(system.size)
        z[: system.n], z[system.n : 2 * system.n] = q, rate
        z[system.n_dynamic :] = system.forcing(tau)
        if system.laws.n_memory:
            z[system.memory] = periodic_memory(system, lambda phases: motion.law_arguments(tau + phases))[0]
        friction = motion.force[0] @ motion.harmonics.H_minus(tau)
        states: Combination = tuple(State(code) for code in line.cut[: system.n_contacts])
        z, states = with_forces(stepper, z, states, friction, motion.law_force @ motion.harmonics.H_minus(tau))
        for held_free in (True,) if free else (False, True):
            try:
                with np.errstate(over="raise"):
                    found = _shooting(stepper, z, states, tau, free=held_free)
            except FloatingPointError:  # at a fold, where the frequency has to be free, motion may run away
                continue
            orbit = None if found is None else _accepted(found, z, line, size, system.omega, free=free)
            if orbit is not None:
                return orbit
    except (ChatteringError, InputError, np.linalg.LinAlgError):
        pass
    return None


def _accepted(
    found: tuple[Array, Combination, Array, Stepper], z: Array, line: Timeline, size: float, omega: float, *,
    free: bool,
) -> Orbit | None:  # fmt: skip
    """The orbit, if it lies near the motion from which it was sought."""
    end, states, Phi, stepper = found
    system = stepper.model.system
    if not free and abs(system.omega / omega - 1.0) > _LARGEST_SHIFT:
        return None
    kept = system.unknowns(states, line.changing)
    distance = float(np.linalg.norm((end - z)[: 2 * system.n])) / size
    return Orbit(Phi[np.ix_(kept, kept)], distance) if distance < FARTHEST else None


def is_affordable(
    balance: Balance, detail: Detail, motion: SmoothMotion, combinations: Combinations, law_ports: IntArray
) -> bool:
    """Whether shooting takes seconds at most."""
    structure = _with_idle_port(combinations.dynamics)
    system = _system(balance, detail, structure, combinations.contacts, motion.laws, law_ports)
    return _steps(PiecewiseLinear(system)) * float(system.size) ** 3 <= _MOST_WORK


def _steps(model: PiecewiseLinear) -> int:
    """Fewest steps a period that the fastest motion allows."""
    fewest = _FEWEST_STEPS if model.system.n_contacts else _FEWEST_SMOOTH
    return max(fewest, int(np.ceil(2.0 * np.pi * model.fastest() / _STEP_ANGLE)))


def _stepper(system: FrictionSystem) -> Stepper:
    model = PiecewiseLinear(system)
    return Stepper(model, _steps(model))


def _shooting(
    stepper: Stepper, z: Array, states: Combination, tau: float, *, free: bool
) -> tuple[Array, Combination, Array, Stepper] | None:
    """Start with its states, derivative of the period map, and the stepper; None where Newton's method fails.

    The memory of other laws at the start is a guess: where they end the first period in another regime, the next one
    starts from there.
    """
    before, slow, guessed = np.inf, 0, bool(stepper.model.system.laws.switching)
    for _ in range(_MOST_ITERATIONS):
        Phi = one_period(stepper, z, states, True, tau)
        if Phi is None or not np.all(np.isfinite(Phi)) or (stepper.states != states and not guessed):
            return None
        if stepper.states != states:
            z, states, guessed = stepper.z.copy(), stepper.states, False
            continue
        change = relative_change(stepper, z, stepper.z, states)
        if change < (_CLOSED_WITH_MEMORY if stepper.model.system.laws.n_memory else _CLOSED):
            return z, states, Phi, stepper
        slow += change > _SLOW_RATIO * before
        if slow > _MOST_SLOW:
            return None
        before = change
        z, stepper = _corrected(stepper, z, states, Phi, tau, free)
    return None


def _corrected(
    stepper: Stepper, z: Array, states: Combination, Phi: Array, tau: float, free: bool
) -> tuple[Array, Stepper]:
    """Newton's correction of the start, and of the frequency where that is free."""
    system = stepper.model.system
    kept = system.unknowns(states)
    matrix, defect = np.eye(len(kept)) - Phi[np.ix_(kept, kept)], stepper.difference(z, stepper.z, states)[kept]
    if free:
        shifted = Stepper(PiecewiseLinear(replace(system, omega=system.omega * (1.0 + _FREQUENCY_STEP))), stepper.steps)
        one_period(shifted, z, states, False, tau)
        matrix = np.column_stack([matrix, stepper.difference(shifted.z, stepper.z, states)[kept] / _FREQUENCY_STEP])
    # a free phase, and the residual traction of a contact stuck all period: least squares changes them least
    step = np.linalg.lstsq(matrix, defect, rcond=1e-13)[0]
    out = z.copy()
    out[kept] += step[: len(kept)]
    if not free:
        return out, stepper
    omega = system.omega * (1.0 + step[-1])
    if not omega > 0.0:
        raise InputError("a period below zero")
    return out, Stepper(PiecewiseLinear(replace(system, omega=omega)), stepper.steps)


def _with_idle_port(d: Dynamics) -> Dynamics:
    """The structure with one more port that never moves, which the index -1 (no port) selects."""
    return replace(
        d, rows=np.vstack([d.rows, np.zeros(d.size)]), columns=np.hstack([d.columns, np.zeros((d.size, 1))]),
        R=np.pad(d.R, (0, 1)), load_compliance=np.pad(d.load_compliance, ((0, 1), (0, 0))),
    )  # fmt: skip


def _system(
    balance: Balance, detail: Detail, d: Dynamics, contacts: FrictionPorts, laws: LawsInTime, law_ports: IntArray
) -> FrictionSystem:
    """The system to integrate in time at a point, with the structure and contacts of its multipliers."""
    has, h, driven = contacts.normal >= 0, balance.harmonics, balance.problem.load_columns
    order = np.concatenate([contacts.tangential, contacts.normal[has], law_ports])
    equations = TimeEquations(
        M=np.eye(d.size), C=d.C, K=d.K, rows=d.rows[order], columns=np.hstack([d.columns[:, order], d.loads]),
        feedthrough=np.hstack([d.R[np.ix_(order, order)], d.load_compliance[order]]),
    )  # fmt: skip
    friction, sliders, omega = friction_batches(balance), slider_batches(balance), detail.omega
    values = friction_values(balance, detail)
    moved, velocity = np.zeros((2, 0, h.size)), np.zeros(0)
    for k in friction:
        inputs = detail.inputs.batches[k]
        moved, velocity = np.concatenate([moved, inputs.motion], axis=1), np.append(velocity, inputs.speed(omega)[0])
    for k in sliders:
        inputs, count = detail.inputs.batches[k], balance.batches[k].law.slider_count
        along = np.repeat(inputs.motion[0], count, axis=0)
        moved = np.concatenate([moved, np.stack([along, np.zeros_like(along)])], axis=1)
        velocity = np.append(velocity, np.repeat(inputs.speed(omega)[0], count))
    others = [inputs for k, inputs in enumerate(detail.inputs.batches) if k not in (*friction, *sliders)]
    return system_of(
        equations, omega, h, rubbing=moved[0], approach=moved[1],
        loads=driven.forces(detail.inputs.P, h.orders[1:], omega), velocity=velocity,
        has_normal=has, kt=values["kt"], mu=values["mu"], kn=values["kn"], gap=values["gap"], laws=laws,
        law_motion=np.concatenate([np.zeros((0, h.size)), *(inputs.motion.reshape(-1, h.size) for inputs in others)]),
        law_velocity=np.concatenate([np.zeros(0), *(inputs.speed(omega).reshape(-1) for inputs in others)]),
    )  # fmt: skip


def _response(
    balance: Balance, detail: Detail, motion: SmoothMotion, d: Dynamics, contacts: FrictionPorts, law_ports: IntArray,
    tau: float,
) -> tuple[Array, Array, float]:  # fmt: skip
    """q and dq/dtau of the structure (r,) at ``tau`` under the contact forces of a motion, and their size."""
    wide, h, has = motion.harmonics, balance.harmonics, contacts.normal >= 0
    loads = balance.problem.load_columns.forces(detail.inputs.P, h.orders[1:], detail.omega)
    P = np.zeros((len(loads), wide.size))
    P[:, wide.columns(h.orders)] = loads
    order = np.concatenate([contacts.tangential, contacts.normal[has], law_ports])
    forces = np.concatenate([motion.force[0], motion.force[1][has], motion.law_force])
    f = d.loads @ P - d.columns[:, order] @ forces
    hat, w = f[:, 1::2] - 1j * f[:, 2::2], wide.m * detail.omega
    Z = d.K + 1j * w[:, None, None] * d.C - (w * w)[:, None, None] * np.eye(d.size)
    q = np.linalg.solve(Z, hat.T[:, :, None])[:, :, 0] * np.exp(1j * wide.m * tau)[:, None]
    rate = 1j * wide.m[:, None] * q
    # the mean motion: of a free structure as the contacts stand
    moved = [motion.X - motion.rubbing[0], (motion.Y - motion.rubbing[1])[has], motion.law_motion - motion.law_rubbing]
    stand = np.concatenate(moved)[:, 0]
    still = stand + d.R[np.ix_(order, order)] @ forces[:, 0] - d.load_compliance[order] @ P[:, 0]
    scale = np.abs(d.K).max() or 1.0
    mean = np.linalg.lstsq(np.vstack([d.K / scale, d.rows[order]]), np.append(f[:, 0] / scale, still), rcond=None)[0]
    size = float(np.sqrt(0.5 * np.sum(np.abs(q) ** 2 + np.abs(rate) ** 2)))
    return mean + q.sum(axis=0).real, rate.sum(axis=0).real, size or float(np.linalg.norm(mean)) or 1.0
