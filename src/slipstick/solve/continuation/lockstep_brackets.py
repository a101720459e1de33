"""Maxima between two solved points of many branches, on both sides of corners: ``brackets.py`` for tables."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slipstick.solve.continuation.brackets import (
    MOST,
    SHARES,
    STALLED,
    TINY,
    Chord,
    is_known,
    is_plain,
    is_within,
    leads_on,
    share_of,
)
from slipstick.solve.continuation.corrector import is_near
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.lockstep import Correctors, Numbers, Points, Solutions, Solved, Table
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array, BoolArray

Observed = Callable[[Array, Array], tuple[Array, Array]]
"""Heights and slopes (k,) of the quantity of a maximum, from states and tangents (k, N + 1)."""


@dataclass(kw_only=True)
class Ends(Solutions):
    """Solutions with the height of the quantity of a maximum and its slope, (k,) or (k, n_outputs).

    Attributes
    ----------
    factors
        As of ``Points``; -1 of a trial, few of which become points.
    normals
        Normals (k, N + 1) of the planes of the trials.
    """

    normals: Array
    factors: Numbers
    heights: Array
    slopes: Array

    @classmethod
    def of(cls, points: Points, which: Numbers, heights: Array, slopes: Array) -> Ends:
        """Some points of a branch."""
        normals, factors = points.tangents[which], points.factors[which]
        return cls(**points.columns(which), normals=normals, factors=factors, heights=heights, slopes=slopes)

    @classmethod
    def found(cls, solved: Solved, normals: Array, which: Numbers, observed: Observed) -> Ends:
        """Some of the solutions."""
        states, tangents = solved.states[which], solved.tangents[which]
        heights, slopes = observed(states, tangents) if which.size else (np.empty(0), np.empty(0))
        factors = np.full(which.size, -1)
        return cls(**solved.columns(which), normals=normals[which], factors=factors, heights=heights, slopes=slopes)

    def of_output(self, i: int) -> Ends:
        """With the height and the slope of one output."""
        return replace(self, heights=self.heights[:, i], slopes=self.slopes[:, i])

    @property
    def points(self) -> tuple[Array, Array]:
        """States and tangents."""
        return self.states, self.tangents

    @classmethod
    def chosen(cls, first: BoolArray, one: Ends, other: Ends) -> Ends:
        """Rows of the one where ``first``, else of the other."""
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
        Metric of each.
    """

    segment: Numbers
    branch: Numbers
    metric: Metric
    low: Ends
    high: Ends

    def of_output(self, i: int) -> Brackets:
        """With the heights and slopes of one output."""
        return replace(self, low=self.low.of_output(i), high=self.high.of_output(i))

    @property
    def falls(self) -> BoolArray:
        """Where the slope falls through zero between them."""
        return np.asarray((self.low.slopes > 0.0) & (self.high.slopes <= 0.0))

    @property
    def cubics(self) -> HermiteSegment:
        """Between both solutions."""
        return HermiteSegment.of(self.metric, self.low.points, self.high.points)

    @property
    def chord(self) -> Chord:
        """Between both solutions."""
        return Chord(self.metric, self.low.points, self.high.points)

    def plain(self) -> BoolArray:
        """Whether heights differ little from parabolas, (k, n_outputs)."""
        low, high = self.low, self.high
        before, after = (end.slopes / self.metric.length(end.tangents)[:, None] for end in (low, high))
        return np.asarray(is_plain(before, after, low.heights, high.heights, self.cubics.length[:, None]))

    def holds(self, solved: Solved, room: Array) -> BoolArray:
        """Whether solutions lie between their ends, and on their branch."""
        on = leads_on(solved.orientation, self.low.orientation, self.high.orientation)
        return np.asarray(on & is_within(self.metric, solved.states, self.low.states, self.high.states, room))

    def narrow(self, correctors: Correctors, options: NewtonOptions, observed: Observed, tolerance: float) -> None:
        """``narrowing`` of each to its last."""
        room, live = self.chord.room, np.arange(self.branch.size)
        bisect, rooms = np.zeros(live.size, dtype=bool), deque[Array](maxlen=STALLED)
        for _ in range(MOST):
            live = live[room[live] > tolerance]
            if len(rooms) == STALLED:
                live = live[room[live] <= 0.5 * rooms[0][live]]
            if not live.size:
                return
            rooms.append(room.copy())
            here, length = self.at(live), room[live]
            share = share_of(here.low.slopes, here.high.slopes, bisect[live], length, tolerance)
            inside, found = here.inside(correctors, options, observed, length, share)
            live = live[found]
            if not live.size:
                return
            inside.slopes[inside.slopes == 0.0] = TINY  # a plateau continues the slope before it
            rises = inside.slopes > 0.0
            self.low.put(live[rises], inside.at(rises))
            self.high.put(live[~rises], inside.at(~rises))
            before, room[live] = room[live], self.at(live).chord.room
            bisect[live] = ~bisect[live] & (room[live] > 0.5 * before)

    def inside(
        self, correctors: Correctors, options: NewtonOptions, observed: Observed, room: Array, share: Array
    ) -> tuple[Ends, Numbers]:
        """Solutions between the ends, and their brackets: from the cubics, else by steps from the ends."""
        turns = self.chord.turns
        parts, of = list[Ends](), list[Numbers]()
        rest = np.arange(share.size)
        for trial in range(1 + 2 * len(SHARES)):
            number, second = divmod(trial - 1, 2)
            tried = rest if trial == 0 or number > 0 else rest[turns[rest]]
            if not tried.size:
                continue
            here, across = self.at(tried), np.zeros(tried.size, dtype=bool)
            if trial == 0:
                cubics = here.cubics
                guess, normal = cubics.point(share), cubics.derivative(share)
            else:
                guess, normal = here.chord.beside(SHARES[number], nearer=bool(second))
            solved = correctors.correct(
                here.branch, guess, normal, across, here.metric, forward=normal, options=options
            )
            with np.errstate(invalid="ignore"):
                near = is_near(here.metric, solved.states - guess, room[tried])
            good = solved.found & near & here.holds(solved, room[tried])
            parts.append(Ends.found(solved, normal, np.flatnonzero(good), observed))
            of.append(tried[good])
            rest = np.setdiff1d(rest, tried[good])
        return Ends.joined(parts), np.concatenate(of)

    def tops(self, tolerance: float) -> tuple[Ends, BoolArray]:
        """The higher end of each, and whether the maximum is located there."""
        low, high = self.low, self.high
        top = Ends.chosen(low.heights >= high.heights, low, high)
        return top, np.asarray(is_known(top.heights, low.slopes, high.slopes, self.chord.room, tolerance))
