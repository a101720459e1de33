"""The periodic motion that exists beside a truncated one, by shooting: exact but for rounding (THEORY.md section 12).

The motion of a balance is the picture of a motion in some harmonics. Where the picture is too coarse to judge by, the
motion itself is found from it by Newton's method on the period map, and judged by the derivative of that map.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slipstick.analysis.stability.dynamics import Dynamics
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.state_sequence import Timeline
from slipstick.analysis.stability.switched_system import FrictionPorts
from slipstick.analysis.time_domain.event_integrator import ChatteringError, Stepper
from slipstick.analysis.time_domain.initial_state import with_forces
from slipstick.analysis.time_domain.piecewise import Combination, FrictionSystem, PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import system_of
from slipstick.analysis.time_domain.shooting import one_period, relative_change
from slipstick.balance.ports import Balance
from slipstick.balance.residual import Detail
from slipstick.errors import InputError
from slipstick.structure.protocol import TimeEquations
from slipstick.typing import Array, ComplexArray

FARTHEST = 0.25
"""Distance from the truncated motion, over its size, beyond which another motion was found."""

_SHIFT = 2e-3
"""Shift of the frequency, over itself, within which a motion still stands for the truncated one beside a fold."""

_CLOSED = 1e-11
_MOST = 12
_STALLED = 0.7
_FEWEST_STEPS = 96
_MOST_WORK = 2e8
"""Steps a period times the size of the system cubed: seconds for the periods that Newton's method takes."""

_NUDGE = 1e-7


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion and the derivative of its period map."""

    matrix: Array
    """(k, k): motion, velocities and memories of contacts stuck where the period begins, but not all through it."""
    distance: float
    """From the truncated motion, over its size."""

    @property
    def multipliers(self) -> ComplexArray:
        """Eigenvalues, the largest first."""
        found = np.linalg.eigvals(self.matrix).astype(complex)
        return found[np.lexsort((-found.imag, -np.abs(found).round(12)))]


def orbit_beside(
    balance: Balance, detail: Detail, motion: SmoothMotion, line: Timeline, structure: Dynamics,
    contacts: FrictionPorts, *, free: bool,
) -> Orbit | None:  # fmt: skip
    """The periodic motion nearest to an iterated one; None where none is found.

    ``free``: nothing prescribes the frequency of the motion, it is found with it. Beside a fold the motion may end a
    little before the truncated one does: then the nearest one at a slightly other frequency is taken.
    """
    system = _system(balance, detail, structure, contacts)
    first = line.intervals[0]
    tau = 0.0 if first.change is None else first.change.time - first.length
    q, rate, size = _answer(balance, detail, motion, structure, contacts, tau)
    try:
        stepper = _stepper(system)
        z = np.zeros(system.size)
        z[: system.n], z[system.n : 2 * system.n] = q, rate
        z[system.n_dynamic :] = system.forcing(tau)
        friction = motion.force[0] @ motion.harmonics.H_minus(tau)
        z, states = with_forces(stepper, z, tuple(State(code) for code in line.cut), friction)
        found = (None if free else _closed(stepper, z, states, tau, free=False)) or _closed(
            stepper, z, states, tau, free=True
        )
    except (ChatteringError, InputError, np.linalg.LinAlgError):
        return None
    if found is None:
        return None
    end, Phi, omega = found
    if not free and abs(omega / system.omega - 1.0) > _SHIFT:
        return None
    changing = {interval.change.contact for interval in line.intervals if interval.change is not None}
    stuck = [2 * system.n + j for j, state in enumerate(states) if state is State.STICK and j in changing]
    kept = [*range(2 * system.n), *stuck]
    away = float(np.linalg.norm((end - z)[: 2 * system.n])) / size
    return Orbit(Phi[np.ix_(kept, kept)], away) if away < FARTHEST else None


def within_reach(balance: Balance, detail: Detail, structure: Dynamics, contacts: FrictionPorts) -> bool:
    """Whether the motion can be sought in time within seconds."""
    system = _system(balance, detail, structure, contacts)
    return _steps(PiecewiseLinear(system)) * float(system.size) ** 3 <= _MOST_WORK


def _steps(model: PiecewiseLinear) -> int:
    """As few a period as the fastest motion allows."""
    return max(_FEWEST_STEPS, int(np.ceil(2.0 * np.pi * model.fastest() / 1.5)))


def _stepper(system: FrictionSystem) -> Stepper:
    model = PiecewiseLinear(system)
    return Stepper(model, _steps(model))


def _closed(
    stepper: Stepper, z: Array, states: Combination, tau: float, *, free: bool
) -> tuple[Array, Array, float] | None:
    """Start, derivative of the period map and frequency of the periodic motion; None where Newton's method fails."""
    before, slow = np.inf, 0
    for _ in range(_MOST):
        Phi = one_period(stepper, z, states, True, tau)
        if Phi is None or stepper.states != states or not np.all(np.isfinite(Phi)):
            return None
        change = relative_change(stepper, z, stepper.z, states)
        if change < _CLOSED:
            return z, Phi, stepper.model.system.omega
        slow += change > _STALLED * before
        if slow > 2:
            return None
        before = change
        z, stepper = _corrected(stepper, z, states, Phi, tau, free)
    return None


def _corrected(
    stepper: Stepper, z: Array, states: Combination, Phi: Array, tau: float, free: bool
) -> tuple[Array, Stepper]:
    """Newton's correction of the start, and of the frequency where that is free."""
    system = stepper.model.system
    kept = [*range(2 * system.n), *(2 * system.n + j for j, s in enumerate(states) if s is State.STICK)]
    matrix, defect = np.eye(len(kept)) - Phi[np.ix_(kept, kept)], (stepper.z - z)[kept]
    if free:
        beside = Stepper(PiecewiseLinear(replace(system, omega=system.omega * (1.0 + _NUDGE))), stepper.steps)
        one_period(beside, z, states, False, tau)
        matrix = np.column_stack([matrix, (stepper.z - beside.z)[kept] / _NUDGE])
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


def _system(balance: Balance, detail: Detail, d: Dynamics, contacts: FrictionPorts) -> FrictionSystem:
    """What is integrated in time at a point: the structure and contacts that its multipliers are of."""
    has, (given,), values = contacts.normal >= 0, detail.inputs.batches, detail.responses[0].values
    order = np.concatenate([contacts.tangential, contacts.normal[has]])
    equations = TimeEquations(
        M=np.eye(d.size), C=d.C, K=d.K, rows=d.rows[order], columns=np.hstack([d.columns[:, order], d.loads]),
        feedthrough=np.hstack([d.R[np.ix_(order, order)], d.load_compliance[order]]),
    )  # fmt: skip
    h, driven = balance.harmonics, balance.problem.load_columns
    return system_of(
        equations, detail.omega, h, rubbing=given.motion[0], approach=given.motion[1],
        loads=driven.forces(detail.inputs.P, h.orders[1:], detail.omega), velocity=given.speed(detail.omega)[0],
        has_normal=has, kt=values["kt"], mu=values["mu"], kn=values["kn"], gap=values["gap"],
    )  # fmt: skip


def _answer(
    balance: Balance, detail: Detail, motion: SmoothMotion, d: Dynamics, contacts: FrictionPorts, tau: float
) -> tuple[Array, Array, float]:
    """q and dq/dtau of the structure (r,) at ``tau`` under the forces that the iteration began with, and their size."""
    wide, h, has = motion.harmonics, balance.harmonics, contacts.normal >= 0
    loads = balance.problem.load_columns.forces(detail.inputs.P, h.orders[1:], detail.omega)
    P = np.zeros((len(loads), wide.size))
    P[:, [0, *(wide.index(m, part) for m in h.orders[1:] for part in ("c", "s"))]] = loads
    Fx, Fy = motion.force
    f = d.loads @ P - d.columns[:, contacts.tangential] @ Fx - d.columns[:, contacts.normal[has]] @ Fy[has]
    hat, w = f[:, 1::2] - 1j * f[:, 2::2], wide.m * detail.omega
    Z = d.K + 1j * w[:, None, None] * d.C - (w * w)[:, None, None] * np.eye(d.size)
    q = np.linalg.solve(Z, hat.T[:, :, None])[:, :, 0] * np.exp(1j * wide.m * tau)[:, None]
    rate = 1j * wide.m[:, None] * q
    # the mean motion: of a free structure as the contacts stand
    stand = np.concatenate([motion.X[:, 0] - motion.own[0][:, 0], (motion.Y[:, 0] - motion.own[1][:, 0])[has]])
    order = np.concatenate([contacts.tangential, contacts.normal[has]])
    force = np.concatenate([Fx[:, 0], Fy[has, 0]])
    still = stand + d.R[np.ix_(order, order)] @ force - d.load_compliance[order] @ P[:, 0]
    scale = np.abs(d.K).max() or 1.0
    mean = np.linalg.lstsq(np.vstack([d.K / scale, d.rows[order]]), np.append(f[:, 0] / scale, still), rcond=None)[0]
    size = float(np.sqrt(0.5 * np.sum(np.abs(q) ** 2 + np.abs(rate) ** 2)))
    return mean + q.sum(axis=0).real, rate.sum(axis=0).real, size or float(np.linalg.norm(mean)) or 1.0
