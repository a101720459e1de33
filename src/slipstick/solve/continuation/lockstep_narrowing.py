"""Maxima between two solved points of many branches, on both sides of corners: ``narrowing.py`` for arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.lockstep import Correctors, Numbers, Points, Solved
from slipstick.solve.continuation.maxima import TINY
from slipstick.solve.continuation.metric import Metric, dots
from slipstick.solve.continuation.narrowing import _KNOWN, _MOST, _REVERSED, _SHARES
from slipstick.solve.continuation.step_acceptance import is_near
from slipstick.solve.continuation.tables import Table
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array, BoolArray

Observed = Callable[[Array, Array], tuple[Array, Array]]
"""Heights and slopes (k,) of what is largest at a maximum, from states and tangents (k, N + 1)."""


@dataclass(kw_only=True)
class Ends(Table):
    """Solutions on k branches, with the height there of what is largest at a maximum, and its slope (k,).

    States, tangents, inverse, orientation and iterations are those of ``Points``.
    """

    states: Array
    tangents: Array
    inverse: Numbers
    orientation: Numbers
    iterations: Numbers
    heights: Array
    slopes: Array

    @classmethod
    def of(cls, points: Points, which: Numbers, heights: Array, slopes: Array) -> Ends:
        """Points that are known."""
        return cls(
            states=points.states[which], tangents=points.tangents[which], inverse=points.inverse[which],
            orientation=points.orientation[which], iterations=points.iterations[which], heights=heights, slopes=slopes,
        )  # fmt: skip

    @classmethod
    def found(cls, correctors: Correctors, solved: Solved, which: Numbers, observed: Observed) -> Ends:
        """Some of what was solved for."""
        states, tangents = solved.states[which], solved.tangents[which]
        heights, slopes = observed(states, tangents) if which.size else (np.empty(0), np.empty(0))
        return cls(
            states=states, tangents=tangents, inverse=correctors.inverses.add(solved.inverse, which),
            orientation=solved.orientation[which], iterations=solved.iterations[which], heights=heights, slopes=slopes,
        )  # fmt: skip

    @classmethod
    def chosen(cls, first: BoolArray, one: Ends, other: Ends) -> Ends:
        """Where ``first`` the one, else the other."""
        out = other.at(np.arange(first.size))
        out.put(np.flatnonzero(first), one.at(first))
        return out


@dataclass(kw_only=True)
class Brackets(Table):
    """``Bracket`` of k maxima: solutions, the slope positive at the first and not at the second.

    Attributes
    ----------
    segment, branch
        Number of the segment that each is on, and of its branch.
    metric
        In which they are measured.
    """

    segment: Numbers
    branch: Numbers
    metric: Metric
    low: Ends
    high: Ends

    @property
    def falls(self) -> BoolArray:
        """Where the slope falls through zero between them."""
        return np.asarray((self.low.slopes > 0.0) & (self.high.slopes <= 0.0))

    @property
    def cubics(self) -> HermiteSegment:
        """From the one to the other."""
        ends = [(end.states, end.tangents) for end in (self.low, self.high)]
        return HermiteSegment.of(self.metric, ends[0], ends[1])

    def ways(self) -> tuple[BoolArray, Array, Array]:
        """Which branches turn by more than a right angle; ways from both ends to where their tangents meet, else 0."""
        scaled = [end.tangents * self.metric.weights for end in (self.low, self.high)]
        a, b = (vector / np.sqrt(dots(vector, vector))[:, None] for vector in scaled)
        chord = (self.high.states - self.low.states) * self.metric.weights
        g, p, q = dots(a, b), dots(a, chord), dots(b, chord)
        rest = 1.0 - g * g
        turns = (g < 0.0) & (rest >= _REVERSED)
        over = np.where(turns, rest, 1.0)
        return turns, np.where(turns, np.abs(p - g * q) / over, 0.0), np.where(turns, np.abs(q - g * p) / over, 0.0)

    def rooms(self) -> Array:
        """Lengths (k,) of the branches between them."""
        _, before, after = self.ways()
        return np.maximum(self.metric.length(self.high.states - self.low.states), before + after)

    def holds(self, solved: Solved, room: Array) -> BoolArray:
        """Whether solutions lie between their ends, and on their branch."""
        elsewhere = (solved.orientation * self.low.orientation < 0) & (solved.orientation * self.high.orientation < 0)
        away = [self.metric.length(solved.states - end.states) for end in (self.low, self.high)]
        return np.asarray(~elsewhere & np.logical_and.reduce([(way > 0.0) & (way < room) for way in away]))

    def narrow(self, correctors: Correctors, options: NewtonOptions, observed: Observed, tolerance: float) -> None:
        """``narrowing`` of each to its last."""
        room, live = self.rooms(), np.arange(self.branch.size)
        bisect = np.zeros(live.size, dtype=bool)
        for _ in range(_MOST):
            live = live[room[live] > tolerance]
            if not live.size:
                return
            here, reach = self.at(live), room[live]
            share = np.where(bisect[live], 0.5, here.low.slopes / (here.low.slopes - here.high.slopes))
            edge = np.minimum(0.5, 0.5 * tolerance / reach)
            share = np.minimum(np.maximum(share, edge), 1.0 - edge)
            inside, found = here.inside(correctors, options, observed, reach, share)
            live = live[found]
            if not live.size:
                return
            inside.slopes[inside.slopes == 0.0] = TINY  # a plateau goes on as what comes before
            rises = inside.slopes > 0.0
            self.low.put(live[rises], inside.at(rises))
            self.high.put(live[~rises], inside.at(~rises))
            before, room[live] = room[live], self.at(live).rooms()
            bisect[live] = ~bisect[live] & (room[live] > 0.5 * before)

    def inside(
        self, correctors: Correctors, options: NewtonOptions, observed: Observed, room: Array, share: Array
    ) -> tuple[Ends, Numbers]:
        """Solutions between the ends, and of which brackets: from the cubics, else from shorter steps from the ends."""
        turns, *ways = self.ways()
        gap = self.metric.length(self.high.states - self.low.states)
        before, after = (np.where(turns, way, gap) for way in ways)
        parts, of = list[Ends](), list[Numbers]()
        rest = np.arange(share.size)
        for trial in range(1 + 2 * len(_SHARES)):
            number, second = divmod(trial - 1, 2)
            tried = rest if trial == 0 or number > 0 else rest[turns[rest]]
            if not tried.size:
                continue
            here, across = self.at(tried), np.zeros(tried.size, dtype=bool)
            if trial == 0:
                cubics = here.cubics
                guess, normal = cubics.point(share), cubics.derivative(share)
            else:
                from_low = (after[tried] > before[tried]) == bool(second)
                end = Ends.chosen(from_low, here.low, here.high)
                normal = end.tangents / here.metric.length(end.tangents)[:, None]
                way = np.where(from_low, before[tried], -after[tried])
                guess = end.states + (_SHARES[number] * way)[:, None] * normal
            solved = correctors.correct(
                here.branch, guess, normal, across, here.metric, forward=normal, options=options
            )
            with np.errstate(invalid="ignore"):
                near = is_near(here.metric, solved.states - guess, room[tried])
            good = solved.found & near & here.holds(solved, room[tried])
            parts.append(Ends.found(correctors, solved, np.flatnonzero(good), observed))
            of.append(tried[good])
            rest = np.setdiff1d(rest, tried[good])
        return Ends.joined(parts), np.concatenate(of)

    def tops(self, tolerance: float) -> tuple[Ends, BoolArray]:
        """The higher end of each, and whether the maximum is known to be there."""
        room = self.rooms()
        top = Ends.chosen(self.low.heights >= self.high.heights, self.low, self.high)
        steepest = np.maximum(self.low.slopes, -self.high.slopes)
        return top, np.asarray((room <= tolerance) | (steepest * room <= _KNOWN * top.heights))
