"""The periodic state of a piecewise linear friction system: period by period, or by Newton on the period map.

The derivative of the period map is the product of the pieces' exponentials; at a state change z is continuous but for
the memory of the friction spring, whose jump adds the saltation term
``J + (A+ z+ - J A- z-) g / (g A- z-)`` with ``g`` the row of the switching function. Where velocities jump, because
the structure answers forces at once, a change may bring another one about: that comes when the first one does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from slipstick.analysis.time_domain.event_integrator import ChatteringError, Piece, StateChange, Stepper, spring_memory
from slipstick.analysis.time_domain.piecewise import Combination, State
from slipstick.analysis.time_domain.slow_modes import SlowModes
from slipstick.typing import Array

_MARCH_BEFORE_NEWTON = 2
_LONGEST_MARCH = 32
_NEARER = 0.99
_FOR_RATIO = 8
"""Periods whose changes tell how fast marching ends."""
_PERIODIC_FEW, _MOST_FEW = 1e-9, 60
"""How closely a period of the slow modes alone comes back, and in how many periods."""
_STALLED = 0.5
_BROUGHT_ABOUT = -1e-9
"""Value of a switching function beside its size that is no rounding."""


@dataclass(frozen=True, kw_only=True)
class PeriodEnd:
    """State at the end of a period; ``change`` is its distance from the start, relative to the motion's size.

    ``error`` estimates its distance from the periodic state: from where a correction leads to, and where none is made
    from how fast the changes become smaller. nan where neither tells it.
    """

    period: int
    z: Array
    states: Combination
    change: float
    error: float


def saltation(stepper: Stepper, item: StateChange, Phi: Array, earlier: Array | None = None) -> tuple[Array, Array]:
    """Derivative of z just after a state change by what ``Phi`` is the derivative of, and how much earlier it comes.

    ``earlier`` is that of a change at the same instant that brought this one about: both come together.
    """
    system, z = stepper.model.system, item.z.copy()
    if item.contact >= system.n_contacts:
        own, kept = _regime_begins(stepper, item, z)
    else:
        own, kept = _friction_begins(stepper, item, z)
    after = stepper.model.rate(stepper.model(item.states), z[None])[0]
    jump = np.zeros(len(z))
    jump[own] = after[own] - kept @ item.rate
    if stepper.model.at_once:  # velocities jump, and what others remember follows them
        others = np.setdiff1d(np.arange(system.memory.start, system.memory.stop), own)
        jump[others] = (after - item.rate)[others]
    out = Phi.copy()
    out[own] = kept @ Phi
    if earlier is None:
        slope = item.margin @ item.rate
        earlier = item.margin @ Phi / slope if slope != 0.0 else np.zeros(Phi.shape[1])
    return out + np.outer(jump, earlier), earlier


def _friction_begins(stepper: Stepper, item: StateChange, z: Array) -> tuple[Array, Array]:
    """Where z has what a friction contact remembers, and the rows that give it after; writes it into z."""
    model, e = stepper.model, 2 * stepper.model.system.n + item.contact
    kept = np.zeros((1, len(z)))
    z[e] = 0.0
    if item.after is State.STICK:
        linear, after = item.linear, model(item.states)
        force = linear.fx[item.contact] @ model.seen(linear, item.z[None])[0]
        z[e] = spring_memory(model, item.states, item.contact, z, float(force))
        before, law = (
            model.by_state(piece, piece.fx[item.contact], at) for piece, at in ((linear, item.z), (after, z))
        )
        kept[0] = (before - law) / law[e]
        kept[0, e] = before[e] / law[e]
    return np.array([e]), kept


def _regime_begins(stepper: Stepper, item: StateChange, z: Array) -> tuple[Array, Array]:
    """The same of a contact whose law switches, where it goes over into another regime."""
    model, number = stepper.model, item.contact - stepper.model.system.n_contacts
    contact = model.system.laws.switching[number]
    at = contact.at(*model.law_motion(item.linear, item.z[None]))
    before, after = int(item.before), int(item.after)
    own = model.system.memory.start + contact.memory
    z[own] = contact.regimes.reset(before, after, at)[:, 0, 0]
    rows = model.law_rows_of(item.linear, number, item.z)
    return own, contact.regimes.reset_slopes(before, after, at) @ rows


def one_period(stepper: Stepper, z: Array, states: Combination, derivative: bool, tau: float = 0.0) -> Array | None:
    """Carries z over one period from ``tau`` (result in the stepper); the derivative of the period map if asked."""
    if not derivative:
        for _ in stepper.period(z, states, tau):
            pass
        return None
    Phi, linear, length = np.eye(len(z))[:, : stepper.model.system.n_dynamic], None, 0.0
    earlier: Array | None = None
    for item in stepper.period(z, states, tau):
        if isinstance(item, Piece) and not item.linear.smooth and (linear is None or item.linear is linear):
            linear, length, earlier = item.linear, length + item.fraction, None
            continue
        if linear is not None:
            Phi, linear, length = stepper.propagate(linear, Phi, length), None, 0.0
        if isinstance(item, StateChange):
            Phi, earlier = saltation(stepper, item, Phi, earlier if item.value < _BROUGHT_ABOUT else None)
        else:
            Phi, earlier = stepper.carried(item, Phi), None
    return Phi if linear is None else stepper.propagate(linear, Phi, length)


def relative_change(stepper: Stepper, before: Array, after: Array, states: Combination) -> float:
    """Distance of two states relative to the size of the motion and of the friction forces."""
    system = stepper.model.system
    n, linear = system.n, stepper.model(states)
    motion = np.abs(after - before)[: 2 * n].max() / max(np.abs(after[: 2 * n]).max(), 1e-300)
    seen = stepper.model.seen(linear, np.stack([before, after]))
    limit = np.abs(system.mu * (linear.fy @ seen[1]))
    force = np.abs(linear.fx @ (seen[1] - seen[0])) / np.maximum(limit, 1e-300)
    stuck = [state is State.STICK for state in states[: system.n_contacts]]
    moved, size, angles = stepper.difference(before, after, states)[system.memory], np.abs(after[system.memory]), []
    if system.laws.switching:
        angles = system.laws.angles(linear.regimes)
    kept = np.delete(np.abs(moved), angles).max(initial=0.0) / np.delete(size, angles).max(initial=1e-300)
    turned = np.abs(moved[angles]).max(initial=0.0)
    return float(max(motion, kept, turned, force[stuck].max(initial=0.0)))


def periods(stepper: Stepper, z: Array, states: Combination, *, shooting: bool) -> Iterator[PeriodEnd]:
    """Periods one after another; with ``shooting``, a Newton correction of the start is made between them.

    Of a structure with many fast modes the start is corrected by its slow modes first, as far as that leads.
    """
    slow, done = SlowModes.of(stepper) if shooting else None, 0
    if slow is not None:
        for end in _by_slow_modes(slow, z, states):
            yield end
            z, states, done = end.z, end.states, end.period
    for end in _periods(stepper, z, states, shooting=shooting):
        yield replace(end, period=done + end.period)


def _periods(stepper: Stepper, z: Array, states: Combination, *, shooting: bool) -> Iterator[PeriodEnd]:
    """The same with the derivative of the whole period map.

    A correction that takes the state no nearer to periodic still leaves one of the right size: more and more periods go
    by before the next is tried.
    """
    patience = wait = _MARCH_BEFORE_NEWTON
    best, period, changes = np.inf, 0, [np.inf]
    while True:
        newton = shooting and wait <= 0
        Phi = one_period(stepper, z, states, newton)
        period, wait = period + 1, wait - 1
        same, corrected = stepper.states == states, None
        change = relative_change(stepper, z, stepper.z, stepper.states) if same else np.inf
        if Phi is not None and same and np.all(np.isfinite(Phi)):  # a rate that jumps has no slope
            corrected = _newton_start(stepper, z, states, Phi)
            error = relative_change(stepper, corrected, stepper.z, states)
        else:
            earlier = changes[-_FOR_RATIO:]
            ratio = (change / earlier[0]) ** (1.0 / len(earlier)) if max(earlier) < np.inf else np.nan
            error = change * ratio / (1.0 - ratio) if ratio < 1.0 else np.nan
        changes.append(change)
        yield PeriodEnd(period=period, z=stepper.z, states=stepper.states, change=change, error=error)
        if corrected is not None and change < _NEARER * best:
            best, z = change, corrected
        else:
            if newton:
                best, wait, patience = np.inf, patience, min(2 * patience, _LONGEST_MARCH)
            z, states = stepper.z, stepper.states


def _by_slow_modes(slow: SlowModes, z: Array, states: Combination) -> Iterator[PeriodEnd]:
    """Periods of the whole structure whose starts are corrected by the slow modes, as long as that brings them nearer.

    None where the slow modes alone do not become periodic.
    """
    try:
        for end in _periods(slow.stepper, slow.restricted(z, states), states, shooting=True):
            if end.change < _PERIODIC_FEW:
                break
            if end.period >= _MOST_FEW:
                return
        states = end.states
        Phi = one_period(slow.stepper, end.z, states, True)
        assert Phi is not None
        z, stepper, before = slow.followed(end.z, states), slow.whole, np.inf
        for period in count(1):
            shares: dict[Combination, float] = {}
            for item in stepper.period(z, states):
                if isinstance(item, Piece):
                    shares[item.states] = shares.get(item.states, 0.0) + item.fraction / stepper.steps
            same = stepper.states == states
            change = relative_change(stepper, z, stepper.z, stepper.states) if same else np.inf
            if not change < _STALLED * before:
                return
            before, z = change, slow.corrected(z, stepper.z, states, Phi, shares)
            error = relative_change(stepper, z, stepper.z, states)
            yield PeriodEnd(period=period, z=stepper.z, states=states, change=change, error=error)
    except ChatteringError:
        return


def _newton_start(stepper: Stepper, z: Array, states: Combination, Phi: Array) -> Array:
    keep = stepper.model.system.unknowns(states)
    matrix = np.eye(len(keep)) - Phi[np.ix_(keep, keep)]
    # a contact stuck all period keeps any residual traction: least squares changes it least
    step = np.linalg.lstsq(matrix, stepper.difference(z, stepper.z, states)[keep], rcond=1e-13)[0]
    out = z.copy()
    out[keep] += step
    return out
