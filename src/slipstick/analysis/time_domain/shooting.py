"""The periodic state of a piecewise linear friction system: period by period, or by Newton on the period map.

The derivative of the period map is the product of the pieces' exponentials; at a state change z is continuous but for
the memory of the friction spring, whose jump adds the saltation term
``J + (A+ z+ - J A- z-) g / (g A- z-)`` with ``g`` the row of the switching function. Where velocities jump, because
the structure answers forces at once, a change may bring another one about: that comes when the first one does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from slipstick.analysis.time_domain.event_integrator import ChatteringError, Piece, StateChange, Stepper, spring_memory
from slipstick.analysis.time_domain.initial_state import with_forces
from slipstick.analysis.time_domain.piecewise import Combination, PiecewiseLinear, State
from slipstick.typing import Array, IntArray

_MARCH_BEFORE_NEWTON, _LONGEST_MARCH, _IMPROVED = 2, 32, 0.99
"""Periods before Newton's first correction, and most between later ones.

They double after each correction that leaves more than 0.99 of the smallest change so far."""

_FOR_RATIO = 8
"""Periods whose changes give the rate of convergence of marching."""

_FAST, _FEWEST_FAST = 64.0, 24
"""Frequency of fast modes over that of the fastest forcing; with fewer fast modes, slow modes alone save little."""

_PERIODIC_SLOW, _MOST_SLOW, _STALLED = 1e-9, 60, 0.5
"""Relative change over a period of the slow modes that counts as periodic, and most periods for it.

Slow modes are given up where a corrected period of all modes changes by more than half of the one before."""

_CAUSED = -1e-9
"""Value of a switching function over its size, below which it is not rounding: another change caused this one."""


@dataclass(frozen=True, kw_only=True)
class PeriodEnd:
    """State at the end of a period; ``change`` is its distance from the start, relative to the motion's size.

    ``error`` estimates its distance from the periodic state: by Newton's correction, and without one by the rate of
    convergence of the changes. nan where neither is available.
    """

    period: int
    z: Array
    states: Combination
    change: float
    error: float


def saltation(stepper: Stepper, item: StateChange, Phi: Array, earlier: Array | None = None) -> tuple[Array, Array]:
    """Derivatives just after a state change: of z from ``Phi`` just before it, and of the advance of its instant.

    ``earlier`` is the advance of another change at the same instant that caused this one: both come together.
    """
    system, z = stepper.model.system, item.z.copy()
    if item.contact >= system.n_contacts:
        own, rows = _regime_begins(stepper, item, z)
    else:
        own, rows = _friction_begins(stepper, item, z)
    after = stepper.model.rate(stepper.model(item.states), z[None])[0]
    jump = np.zeros(len(z))
    jump[own] = after[own] - rows @ item.rate
    if stepper.model.at_once:  # velocities jump, and what others remember follows them
        others = np.setdiff1d(np.arange(system.memory.start, system.memory.stop), own)
        jump[others] = (after - item.rate)[others]
    out = Phi.copy()
    out[own] = rows @ Phi
    if earlier is None:
        slope = item.margin @ item.rate
        earlier = item.margin @ Phi / slope if slope != 0.0 else np.zeros(Phi.shape[1])
    return out + np.outer(jump, earlier), earlier


def _friction_begins(stepper: Stepper, item: StateChange, z: Array) -> tuple[Array, Array]:
    """Places in z of the memory of a friction contact, and its rows after the change; writes its value into z."""
    model, e = stepper.model, 2 * stepper.model.system.n + item.contact
    rows = np.zeros((1, len(z)))
    z[e] = 0.0
    if item.after is State.STICK:
        linear, after = item.linear, model(item.states)
        force = linear.fx[item.contact] @ model.extended(linear, item.z[None])[0]
        z[e] = spring_memory(model, item.states, item.contact, z, float(force))
        before, law = (
            model.gradient(piece, piece.fx[item.contact], at) for piece, at in ((linear, item.z), (after, z))
        )
        rows[0] = (before - law) / law[e]
        rows[0, e] = before[e] / law[e]
    return np.array([e]), rows


def _regime_begins(stepper: Stepper, item: StateChange, z: Array) -> tuple[Array, Array]:
    """As ``_friction_begins``, of a contact whose law switches its regime."""
    model, number = stepper.model, item.contact - stepper.model.system.n_contacts
    contact = model.system.laws.switching[number]
    at = contact.at(*model.law_motion(item.linear, item.z[None]))
    before, after = int(item.before), int(item.after)
    own = model.system.memory.start + contact.memory
    z[own] = contact.regimes.reset(before, after, at)[:, 0, 0]
    rows = model.law_rows_of(item.linear, number, item.z)
    return own, contact.regimes.reset_slopes(before, after, at) @ rows


def one_period(stepper: Stepper, z: Array, states: Combination, derivative: bool, tau: float = 0.0) -> Array | None:
    """Carries z over one period from ``tau`` (result in the stepper); the derivative of the period map on request."""
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
            Phi, earlier = saltation(stepper, item, Phi, earlier if item.value < _CAUSED else None)
        else:
            Phi, earlier = stepper.carried(item, Phi), None
    return Phi if linear is None else stepper.propagate(linear, Phi, length)


def relative_change(stepper: Stepper, before: Array, after: Array, states: Combination) -> float:
    """Distance of two states relative to the size of the motion and of the friction forces."""
    system = stepper.model.system
    n, linear = system.n, stepper.model(states)
    motion = np.abs(after - before)[: 2 * n].max() / max(np.abs(after[: 2 * n]).max(), 1e-300)
    extended = stepper.model.extended(linear, np.stack([before, after]))
    limit = np.abs(system.mu * (linear.fy @ extended[1]))
    force = np.abs(linear.fx @ (extended[1] - extended[0])) / np.maximum(limit, 1e-300)
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
    """As ``periods``, with the derivative of the whole period map.

    A correction that does not improve the state still leaves one of the right size: more and more periods are marched
    before the next is tried.
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
        if corrected is not None and change < _IMPROVED * best:
            best, z = change, corrected
        else:
            if newton:
                best, wait, patience = np.inf, patience, min(2 * patience, _LONGEST_MARCH)
            z, states = stepper.z, stepper.states


def _by_slow_modes(slow: SlowModes, z: Array, states: Combination) -> Iterator[PeriodEnd]:
    """Periods of the whole structure with starts corrected by the slow modes, as long as that reduces their change.

    Empty where the slow modes alone do not become periodic.
    """
    try:
        for end in _periods(slow.stepper, slow.restricted(z, states), states, shooting=True):
            if end.change < _PERIODIC_SLOW:
                break
            if end.period >= _MOST_SLOW:
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
    keep = stepper.model.system.unknowns(states, stepper.changed)  # one that sticks all period keeps its traction
    matrix = np.eye(len(keep)) - Phi[np.ix_(keep, keep)]
    step = np.linalg.lstsq(matrix, stepper.difference(z, stepper.z, states)[keep], rcond=1e-13)[0]
    out = z.copy()
    out[keep] += step
    return out


@dataclass(frozen=True, eq=False)
class SlowModes:
    """The slow modes of a system, its fast ones as static flexibilities, for Newton's method (THEORY.md (12.3)).

    Modes far above the forcing follow the forces on them nearly statically, and without them the period map is small.
    Its periodic state, with the fast modes added, is carried over a period of the whole structure. Missing motion is
    corrected by the derivative of the small map, and mode by mode for the vibration of the fast ones. This is repeated
    until the period of the whole structure closes: the reduction costs periods, not accuracy.
    """

    whole: Stepper
    stepper: Stepper
    """Integrator of the slow modes."""
    slow: IntArray
    """Numbers of the slow modes, (k,)."""
    fast: IntArray
    stiffness: Array
    """Stiffness of the fast modes, per unit of tau, (n - k,)."""
    damping: Array

    @classmethod
    def of(cls, whole: Stepper) -> SlowModes | None:
        """None where few modes are fast, damping or stiffness couples modes, or laws other than friction act.

        Those laws are not possible where a structure answers at once.
        """
        system = whole.model.system
        own = whole.model.modal_rates
        if own is None or system.laws:
            return None
        K, C = own
        is_fast = (_FAST * max(1, *system.orders, 1)) ** 2 < K
        fast, slow = np.flatnonzero(is_fast), np.flatnonzero(~is_fast)
        if len(fast) < max(_FEWEST_FAST, len(slow)):
            return None
        e = system.equations
        left = e.columns[fast] / (system.omega**2 * K[fast, None])
        equations = replace(
            e, M=e.M[np.ix_(slow, slow)], C=e.C[np.ix_(slow, slow)], K=e.K[np.ix_(slow, slow)], rows=e.rows[:, slow],
            columns=e.columns[slow], feedthrough=e.feedthrough + e.rows[:, fast] @ left,
        )  # fmt: skip
        few = Stepper(PiecewiseLinear(replace(system, equations=equations)))
        return cls(whole, few, slow, fast, K[fast], C[fast])

    def restricted(self, z: Array, states: Combination) -> Array:
        """The small state, with the friction forces that contacts have."""
        return with_forces(self.stepper, self._parts(z)[0], states, self.whole.model(states).fx @ z)[0]

    def followed(self, few: Array, states: Combination) -> Array:
        """The state of all modes whose fast ones follow the forces on them."""
        linear = self.stepper.model(states)
        left = self.whole.model.loaded_columns[self.fast] / self.stiffness[:, None]
        forces = linear.acting @ np.stack([few, linear.A @ few], axis=1)
        return self._joined(few, (left @ forces).T.reshape(-1))

    def corrected(
        self, z: Array, end: Array, states: Combination, Phi: Array, shares: Mapping[Combination, float]
    ) -> Array:
        """Start of a period that closes better than one from z to ``end``.

        ``Phi`` is the derivative of the small period map, ``shares`` how much of the period each combination takes.
        """
        (few, fast), (few_end, fast_end) = self._parts(z), self._parts(end)
        keep = self.stepper.model.system.unknowns(states, self.stepper.changed)
        step = np.zeros(len(few))
        matrix, missing = np.eye(len(keep)) - Phi[np.ix_(keep, keep)], few_end - few
        step[keep] = np.linalg.lstsq(matrix, missing[keep], rcond=1e-13)[0]
        return self._joined(few + step, fast + self._alone(shares, fast_end - fast))

    def _alone(self, shares: Mapping[Combination, float], missing: Array) -> Array:
        """Start of free vibrations of the fast modes, each for itself, that change by ``-missing`` in a period."""
        from scipy.linalg import expm

        model, count = self.whole.model, len(self.fast)
        loaded, stiffness = model.loaded_columns[self.fast], self.stiffness.copy()
        for states, share in shares.items():
            stiffness -= share * np.sum(loaded * model(states).acting[:, self.fast].T, axis=1)
        A = np.zeros((count, 2, 2))
        A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = 1.0, -stiffness, -self.damping
        matrix = np.eye(2) - expm(2.0 * np.pi * A)
        return np.linalg.solve(matrix, missing.reshape(2, count).T[:, :, None])[:, :, 0].T.reshape(-1)

    def _parts(self, z: Array) -> tuple[Array, Array]:
        """The small state, and motion and velocity of the fast modes."""
        n = self.whole.model.system.n
        few = np.concatenate([z[self.slow], z[n + self.slow], z[2 * n :]])
        return few, np.concatenate([z[self.fast], z[n + self.fast]])

    def _joined(self, few: Array, fast: Array) -> Array:
        n, k, out = self.whole.model.system.n, len(self.slow), np.empty(self.whole.model.system.size)
        out[self.slow], out[n + self.slow], out[2 * n :] = few[:k], few[k : 2 * k], few[2 * k :]
        out[self.fast], out[n + self.fast] = np.split(fast, 2)
        return out
