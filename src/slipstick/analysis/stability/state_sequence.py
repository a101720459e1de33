"""The states of all contacts over one period on one time axis, cut open in the middle of the longest interval.

The exact elements give the states of each contact with their times. From these follow the intervals in which no
contact changes its state, and the change at the end of each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.stability.linear_systems import Combinations, StateCodes
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.contact.forces import element_intervals
from slipstick.contact.friction_law import is_friction
from slipstick.contact.kernel.tuples import SEPARATION, SLIP_PLUS, STICK
from slipstick.contact.law import Interval
from slipstick.contact.rest import rest_of
from slipstick.trig.basis import TWO_PI
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance
    from slipstick.balance.inputs import Inputs

StateOrder = tuple[tuple[int | str, ...], ...]
"""Codes or names of the states of each contact in their order over a period, begun so that the tuple is smallest."""


@dataclass(frozen=True, slots=True)
class Change:
    """A contact begins another state."""

    time: float
    """Phase, rad."""
    contact: int
    """Number of the contact: friction contacts come first, then those whose law switches."""
    state: int
    origin: int
    """State code before a stick, which says how it begins; the regime before, of a law that switches."""


@dataclass(frozen=True, slots=True)
class StateInterval:
    """An interval of ``length`` (rad) without a change of state, and the change at its end.

    None ends the last interval: there the period is cut.
    """

    states: StateCodes
    length: float
    change: Change | None


@dataclass(frozen=True)
class Timeline:
    """The intervals of one period in their order, and the contacts that never change their state."""

    intervals: tuple[StateInterval, ...]
    neutral: tuple[int, ...]
    """Contacts stuck all period."""

    @property
    def changing(self) -> set[int]:
        """Contacts that change their state."""
        return {interval.change.contact for interval in self.intervals if interval.change is not None}

    @property
    def cut(self) -> StateCodes:
        """States where the period begins and ends."""
        return self.intervals[0].states


def timeline(motion: SmoothMotion) -> Timeline:
    """The states of a motion's contacts over one period."""
    return timelines([motion])[0]


def timelines(motions: Sequence[SmoothMotion]) -> list[Timeline]:
    """As ``timeline``, of several motions of the same contacts in the same harmonics."""
    count, h = len(motions[0].X), motions[0].harmonics
    if not count:
        return [_timeline(motion, [], np.empty(0), np.empty(0, dtype=int)) for motion in motions]
    arguments = [{"X": motion.X, "Y": motion.Y, **motion.values} for motion in motions]
    if len(motions) > 1:
        arguments = [{name: np.concatenate([one[name] for one in arguments]) for name in arguments[0]}]
    intervals = element_intervals(h, **arguments[0])
    totals = intervals.totals.tolist()
    return [
        _timeline(motion, totals[i : i + count], intervals.at[i : i + count], intervals.code[i : i + count])
        for i, motion in zip(range(0, len(totals), count), motions, strict=True)
    ]


def _timeline(motion: SmoothMotion, totals: Sequence[int], at: Array, code: IntArray) -> Timeline:
    """The timeline of one motion.

    ``totals`` (n,) counts the intervals of its friction contacts; ``at`` (n, any, 3) and ``code`` (n, any, 2) are their
    places and state codes.
    """
    changes: list[Change] = []
    first: list[int] = []
    neutral = _of_friction(motion, totals, at, code, changes, first)
    for own, states in zip(motion.laws.switching, law_states(motion), strict=True):
        regimes = [own.regimes.regime_of(name) for *_, name in states]
        i = len(first)
        first.append(regimes[-1])
        if len(states) == 1:
            neutral = (*neutral, i) if regimes[0] in own.regimes.neutral else neutral
            continue
        changes += [
            Change(start % TWO_PI, i, regime, regimes[k - 1])
            for k, ((start, *_), regime) in enumerate(zip(states, regimes, strict=True))
        ]
    changes.sort(key=lambda change: change.time)
    return Timeline(_intervals(changes, first), neutral)


def law_states(motion: SmoothMotion) -> list[list[Interval]]:
    """Intervals of every contact whose law switches."""
    out: list[list[Interval]] = []
    for law, ports, _, places in motion.laws.each:
        if places.stop > places.start:
            intervals = law.law.states(
                motion.of_law(law, ports), {name: value[:, 0] for name, value in law.values.items()}
            )
            out += intervals or [[] for _ in law.elements]
    return out


def _of_friction(
    motion: SmoothMotion, totals: Sequence[int], at: Array, code: IntArray, changes: list[Change], first: list[int]
) -> tuple[int, ...]:
    """Contacts stuck all period; appends the changes, and the state of each friction contact before its first."""
    for i, n in enumerate(totals):
        codes = code[i, :n].tolist()
        first.append(codes[-1][0])
        if n > 1:
            starts = at[i, :n, 0].tolist()
            changes += [Change(t % TWO_PI, i, *pair) for t, pair in zip(starts, codes, strict=True)]
    sticky = motion.values["kt"] > 0
    return tuple(i for i, n in enumerate(totals) if n == 1 and first[i] == STICK and sticky[i])


def _intervals(changes: Sequence[Change], states: list[int]) -> tuple[StateInterval, ...]:
    """The intervals between sorted changes; ``states`` are those before the first change of each contact."""
    if not changes:
        return (StateInterval(tuple(states), TWO_PI, None),)
    for change in changes:  # the states after a whole period
        states[change.contact] = change.state
    times = [change.time for change in changes]
    gaps = [b - a for a, b in pairwise([*times, times[0] + TWO_PI])]
    longest = int(np.argmax(gaps))
    changes = [*changes[longest + 1 :], *changes[: longest + 1]]
    gaps = [*gaps[longest + 1 :], *gaps[: longest + 1]]
    for change in changes:
        states[change.contact] = change.state
    out = [StateInterval(tuple(states), 0.5 * gaps[-1], changes[0])]
    for change, gap, after in zip(changes, gaps[:-1], changes[1:], strict=False):
        states[change.contact] = change.state
        out.append(StateInterval(tuple(states), gap, after))
    states[changes[-1].contact] = changes[-1].state
    return (*out, StateInterval(tuple(states), 0.5 * gaps[-1], None))


_SHORTEST = 1e-6
"""Shortest state (rad) that counts: equal contacts change together but for rounding."""


def state_order(harmonics: Harmonics, X: Array, Y: Array, values: Mapping[str, Array]) -> StateOrder:
    """The order of the states of every contact over a period of a motion (n, L)."""
    intervals = element_intervals(harmonics, X, Y, **values)
    return tuple(
        _cyclic(code[:total, 0][at[:total, 1] - at[:total, 0] > _SHORTEST].tolist())
        for total, at, code in zip(intervals.totals.tolist(), intervals.at, intervals.code, strict=True)
    )


def state_order_at(
    balance: Balance,
    x: Array,
    omega: float,
    inputs: Inputs,
    values: Sequence[Mapping[str, Array]] | None = None,
    at_once: bool = True,
) -> StateOrder:
    """The order of all contacts with friction at a motion (N,).

    ``values`` are the parameters of the batches there, those of the inputs by default. ``at_once`` tells slip all
    period from stick all period where one can follow the other directly.
    """
    order: StateOrder = ()
    for k, batch in enumerate(balance.batches):
        own = inputs.batches[k].values if values is None else values[k]
        if is_friction(batch.law):
            motion = balance.layout.motion(k, x, omega, inputs.batches[k])
            own = {**rest_of(own)[0], "v": motion.drift[0]}
            order = (*order, *state_order(balance.harmonics, motion.Q[0], motion.Q[1], own))
        elif batch.law.regimes is not None:
            intervals = batch.law.states(balance.layout.motion(k, x, omega, inputs.batches[k]), own)
            orders = [_cyclic([name for a, b, name in states if b - a > _SHORTEST]) for states in intervals or ()]
            if batch.law.slips_at_once and not at_once:
                orders = [("slip",) if one == ("stick",) else one for one in orders]
            order = (*order, *orders)
    return order


def _cyclic(states: list[Any]) -> tuple[Any, ...]:
    """States of a period in their order, without repetition, begun so that the tuple is smallest."""
    distinct = [state for i, state in enumerate(states) if state != states[i - 1]] or states[:1]
    return min((tuple(distinct[i:] + distinct[:i]) for i in range(len(distinct))), default=())


class StickStarts:
    """Rows that give the memory of a stick that begins, ``dc = row [q, q'/scale, dc]`` (THEORY.md (13.2))."""

    def __init__(self, motion: SmoothMotion, combinations: Combinations) -> None:
        self._motion, self._contacts, self._combinations = motion, combinations.contacts, combinations

    def row(
        self, change: Change, before: StateCodes, moved: Array | None = None,
        rates: tuple[float, float] | None = None,
    ) -> Array:  # fmt: skip
        """``-kt dx + fac dy`` at a change to stick; ``before`` is the combination that ends.

        ``moved`` (rows of the ports' motion) and ``rates`` (``x' + u' + v`` and ``y'``) are given where other laws act
        on both.
        """
        c, i = self._contacts, change.contact
        rows = self._combinations(before).motion if moved is None else moved
        if c.tangential[i] < 0:
            return np.zeros(rows.shape[1])
        row: Array = -c.kt[i] * rows[c.tangential[i]]
        if c.normal[i] >= 0 and (factor := self.factor(change, before, rates)):
            row += factor * rows[c.normal[i]]
        return row

    def factor(self, change: Change, before: StateCodes, rates: tuple[float, float] | None = None) -> float:
        """``fac`` of a stick that begins."""
        c, i = self._contacts, change.contact
        if change.origin != SEPARATION:
            return float(c.mu[i] * c.kn[i]) * (1.0 if change.origin == SLIP_PLUS else -1.0)
        sliding, closing = self._rates(change, before) if rates is None else rates
        return float(c.kt[i]) * sliding / closing if closing > 0.0 else 0.0

    def _rates(self, change: Change, before: StateCodes) -> tuple[float, float]:
        """``x' + u' + v`` and ``y'`` just before a contact closure, per radian."""
        m, i, h = self._motion, change.contact, self._motion.harmonics
        v = float(m.values["v"][i])
        if not np.any(self._combinations.dynamics.R):
            slope = slope_at(h.m, change.time)
            return float(m.X[i] @ slope) + v, float(m.Y[i] @ slope)
        return self._rates_from_modes(change, before)

    def _rates_from_modes(self, change: Change, before: StateCodes) -> tuple[float, float]:
        """As ``_rates`` where velocities jump at changes of state: from the motion of the modes, which is smooth."""
        m, c, piece = self._motion, self._contacts, self._combinations(before)
        slope, R = slope_at(m.harmonics.m, change.time), self._combinations.dynamics.R
        rubbing, total, force = np.zeros((3, c.n_ports))
        for ports, *along in zip((c.tangential, c.normal), m.rubbing, (m.X, m.Y), m.force, strict=True):
            there = ports >= 0
            moved, whole, pushed = ((coefficients @ slope)[there] for coefficients in along)
            rubbing[ports[there]], total[ports[there]] = moved, whole
            np.add.at(force, ports[there], pushed)
        smooth = total - rubbing + R @ force
        sliding = piece.E @ (c.kt * m.values["v"])
        rates = piece.relative @ (smooth - R @ (piece.D @ rubbing + sliding))
        i = change.contact
        x, y = c.tangential[i], c.normal[i]
        return float(rates[x] + rubbing[x] + m.values["v"][i]), float(rates[y] + rubbing[y])


def slope_at(orders: IntArray, time: float) -> Array:
    """Derivatives of ``1, cos m tau, sin m tau, ...`` by tau."""
    out = np.zeros(2 * len(orders) + 1)
    out[1::2], out[2::2] = -orders * np.sin(orders * time), orders * np.cos(orders * time)
    return out
