"""Located points between two neighbouring points of a branch: events and requested parameter values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from math import copysign

import numpy as np

from slipstick.solve.continuation.brackets import (
    DIP,
    TINY,
    Both,
    Bracket,
    Chord,
    Known,
    Located,
    Maxima,
    carried,
    fall,
    is_bottom,
    narrowing,
)  # fmt: skip
from slipstick.solve.continuation.corrector import Corrector, Step
from slipstick.solve.continuation.events import BracketedRoot, BranchEvent, Watched
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.typing import Array

_PLACES = HermiteBasis(np.linspace(0.0, 1.0, 9))
_AT: list[float] = _PLACES.u.tolist()
"""Places on a segment at which event functions are expected: enough for a cubic, with two extremes at most."""
_MAX_TRIALS = 60
"""Largest number of trials for the root of an event function: bisection alone would need about as many."""
BOTTOM_SECANTS = 3
"""Number of trials for a minimum from the segment, before it is bracketed."""
_NEARLY = 0.5
"""Ratio to both ends below which an event function on a segment is computed exactly: it may change its sign."""
_EXCEEDS = 1e-6
"""Relative excess over the largest value so far at which a watched maximum is located."""


class Locator:
    """Finds events and requested parameter values by solving again on the segment between two points.

    Parameters
    ----------
    corrector
        Solver of the branch.
    events, requested
        Events and parameter values to locate.
    tolerance
        Scaled arclength to which an event is located.
    watched
        Quantities of which only the largest values are located: a point is inserted where one exceeds all before.
    """

    def __init__(
        self,
        corrector: Corrector,
        events: Sequence[BranchEvent],
        requested: Array,
        tolerance: float,
        watched: Watched | None = None,
    ) -> None:
        self._corrector, self._events, self._requested, self._tolerance = corrector, events, requested, tolerance
        self._watched = watched
        self.values: tuple[float, ...] = ()
        """Largest values so far of watched quantities, then event functions at the last point."""
        self._maxima = Maxima(corrector, tolerance)

    def begin(self, first: Step) -> None:
        """Evaluate the event functions at the first point."""
        values = [(event, float(event.function(first))) for event in self._events]
        slopes = (value or TINY if event.maximum else value for event, value in values)
        self.values = (*(self._watched.heights(first).tolist() if self._watched else ()), *slopes)

    def between(self, first: Step, second: Step) -> list[Step]:
        """Located points between two neighbours in order along the branch."""
        wanted = self._events or self._watched or self._requested.size
        segment = self._corrector.segment(first, second) if wanted else None
        if segment is None:
            return []
        located_points: list[tuple[float, Step]] = []
        ends, maxima = [], list[tuple[BranchEvent, list[float], list[Located]]]()
        self._maxima.begin(first, second, segment)
        watched = len(self.values) - len(self._events)
        for event, before in zip(self._events, self.values[watched:], strict=True):
            places, values = self._expected(event, before, first, second, segment)
            if event.maximum:
                values = carried(values)
            ends.append(values[-1])
            crossed = _crossed(event, places, values)
            if event.place is not None:
                located = [self._jump(event, segment, event.place(first, second, segment)) for _ in crossed]
            elif event.maximum:
                located = self._maxima.maxima(event, segment, crossed, (first, before), (second, values[-1]))
                maxima.append((event, values, located))
            else:
                located = self._changes(event, segment, crossed, (first, before), (second, values[-1]))
            located_points += [step for step in located if step is not None]
        minima = [self._bottoms(event, segment, values, located, first, second) for event, values, located in maxima]
        located_points += chain.from_iterable(minima)
        others = self._in_order(first, second, located_points)
        for (event, values, located), dips in zip(maxima, minima, strict=True):
            if others and not any(located):
                located = self._beside(event, (first, values[0]), others, (second, values[-1]))
                located_points += [step for step in located if step is not None]
                if any(located) and not dips:
                    dips = self._bottoms(event, segment, values, located, first, second)
                    located_points += dips
            located_points += self._dips(event, values, located, dips, first, second)
        if self._watched is not None:
            largest = self._exceed(
                self._watched, np.array(self.values[:watched]), located_points, segment, first, second
            )
            self.values = (*largest.tolist(), *ends)
        else:
            self.values = tuple(ends)
        if self._requested.size:
            located_points += self._passages(first, second, self._in_order(first, second, located_points), segment)
        located_points = self._in_order(first, second, located_points)
        for _, step in located_points:
            step.arclength = first.arclength + self._corrector.metric.length(step.state - first.state)
        return [step for _, step in located_points]

    def _beside(
        self, event: BranchEvent, first: Known, others: list[tuple[float, Step]], second: Known
    ) -> list[Located]:
        """Maxima between the located points of other events: at a corner all have their extremes."""
        known = [(0.0, first), *((u, (step, float(event.function(step)))) for u, step in others), (1.0, second)]
        assert event.height is not None
        located = list[Located]()
        for (u, low), (v, high) in pairwise(known):
            parts = [((u, v), low, high)] if event.crossed(low[1], high[1]) else []
            if low[1] * high[1] > 0.0:
                before, after = event.height(low[0]), event.height(high[0])
                gain = after - before
                if gain * low[1] < 0.0 and abs(gain) > _EXCEEDS * before:  # heights contradict the slopes
                    parts = self._maxima.parted(event, (u, v), low, high)
            located += [self._maxima.top(event, *part) for part in parts]
        return located

    def _bottoms(
        self,
        event: BranchEvent,
        segment: HermiteSegment,
        values: list[float],
        maxima: list[Located],
        first: Step,
        second: Step,
    ) -> list[tuple[float, Step]]:
        """Ordinary points at minima of an accurate segment: the prominence of maxima depends on them."""
        minima = shown(values) if second.smooth else []
        if not minima:
            return []
        height, located = event.height, list[Located]()
        assert height is not None
        tops = sorted([top for top in maxima if top is not None], key=lambda top: top[0])
        ends = [(0.0, first, -values[0]), *((u, step, 0.0) for u, step in tops), (1.0, second, -values[-1])]
        least = min(height(first), height(second))
        for minimum in minima:
            after = next((i for i, end in enumerate(ends) if end[0] > minimum.u), len(ends) - 1)
            (begin, low, falling), (end, high, rising) = ends[after - 1], ends[after]
            known = [falling >= 0.0, rising <= 0.0]
            room = (end - begin) * segment.length
            deep = fall(height(low), minimum.down, height(high), minimum.up, room) > DIP * height(high)
            if deep or not all(known):
                whole = Bracket(self._corrector.metric, low, max(falling, TINY), high, min(rising, -TINY), begin, end)
                located.append(self._bottom(event, segment, whole, known, minimum, least))
        return [one for one in located if one is not None]

    def _bottom(
        self,
        event: BranchEvent,
        segment: HermiteSegment,
        bracket: Bracket,
        known: list[bool],
        minimum: Minimum,
        least: float,
    ) -> Located:
        """A minimum of a segment, between two solutions.

        ``known`` says whether the height falls from the first and rises to the second: a maximum of the segment next
        to the minimum may not be one of the branch. The segment does not show a corner, at which the slope jumps. The
        minimum is located once the slopes at solutions on both sides prove that the branch falls no further.
        """
        height = event.height
        assert height is not None
        u, slopes = minimum.u, [minimum.down, minimum.up]
        best: Located = None
        corner = False
        for _ in range(BOTTOM_SECANTS):
            solved = self._maxima.solved(event, segment, u, self._corrector.usual)
            if solved is None:
                break
            step, slope = solved
            if best is None or height(step) < height(best[1]):
                best = u, step.named("regular", "")
            if slope < 0.0:
                bracket = replace(bracket, low=step, rising=-slope, begin=u)
            else:
                bracket = replace(bracket, high=step, falling=min(-slope, -TINY), end=u)
            side = int(slope >= 0.0)
            corner, slopes[side], known[side] = abs(slope) > 0.5 * slopes[side], abs(slope), True
            rest = fall(height(bracket.low), slopes[0], height(bracket.high), slopes[1], bracket.room)
            if is_bottom(height(best[1]), rest, least):
                return best
            u -= slope / minimum.rate
            if corner or not bracket.begin < u < bracket.end:
                break
        return (self._maxima.bottom(event, bracket, corner=corner) if all(known) else None) or best

    def _dips(
        self,
        event: BranchEvent,
        values: list[float],
        maxima: list[Located],
        known: list[tuple[float, Step]],
        first: Step,
        second: Step,
    ) -> list[tuple[float, Step]]:
        """Further minima between maxima and their neighbours.

        They are looked for where the segment is inaccurate, or where an end is higher than the maximum next to it.
        """
        tops = self._in_order(first, second, [top for top in maxima if top is not None])
        if second.smooth and not tops:
            return []
        points = [(0.0, first), *tops, (1.0, second)]
        height, last, dips = event.height, len(points) - 1, list[Located]()
        assert height is not None
        for i, (low, high) in enumerate(pairwise(points)):
            falls, rises = i > 0 or values[0] < 0.0, i + 1 < last or values[-1] >= 0.0
            higher = (i == 0) != (i + 1 == last) and (height(low[1]) > height(high[1])) == (i == 0)
            if any(low[0] < u < high[0] for u, _ in known):
                continue
            if (falls and rises and not second.smooth) or higher:
                ends = TINY if i or values[0] >= 0.0 else -values[0], -values[-1] if i + 1 == last and rises else -TINY
                between = Bracket(self._corrector.metric, low[1], ends[0], high[1], ends[1], low[0], high[0])
                dips.append(self._maxima.bottom(event, between))
        return [dip for dip in dips if dip is not None]

    def _in_order(self, first: Step, second: Step, points: list[tuple[float, Step]]) -> list[tuple[float, Step]]:
        """Located points in order along the branch; their places give it only where the segment is accurate."""
        if len(points) < 2:
            return points
        whole = Chord(self._corrector.metric, (first.state, first.tangent), (second.state, second.tangent))
        return sorted(points, key=lambda located: whole.part(located[1].state, located[1].tangent))

    def _expected(
        self, event: BranchEvent, before: float, first: Step, second: Step, segment: HermiteSegment
    ) -> tuple[list[float], list[float]]:
        """Places on the segment, both ends included, and the event function there, exact at the ends."""
        if event.along is None:
            return [0.0, 1.0], [before, float(event.function(second))]
        values = [before, *event.along(first, second, segment, _PLACES).tolist()[1:]]
        parted = event.maximum and not second.smooth
        if not parted and (min(values) > 0.0 or max(values) < 0.0):
            self._refine_near_miss(event, segment, values)
        return _AT, values

    def _refine_near_miss(self, event: BranchEvent, segment: HermiteSegment, values: list[float]) -> None:
        """Compute values of one sign exactly where the sign nearly changes: the cubic is not that accurate."""
        size, positive = [abs(value) for value in values], values[0] > 0.0
        smallest = min(size[1:-1])
        if not smallest < _NEARLY * min(size[0], size[-1]):
            return
        nearest = size.index(smallest, 1)
        for i in (nearest, max(nearest - 1, 1), min(nearest + 1, len(values) - 2)):
            solved = self._maxima.solved(event, segment, _AT[i], self._corrector.rough)
            if solved is not None:
                values[i] = solved[1]
                if (values[i] > 0.0) != positive:
                    return

    def _exceed(
        self,
        watched: Watched,
        largest: Array,
        points: list[tuple[float, Step]],
        segment: HermiteSegment,
        first: Step,
        second: Step,
    ) -> Array:
        """Add to ``points`` the maxima of watched quantities that exceed all before; the new ``largest`` values.

        Points that are located already often are the largest of several quantities to the tolerance.
        """
        for step in (second, *(step for _, step in points)):
            largest = np.maximum(largest, watched.heights(step))
        slopes, expected = watched.expected(first, second, segment, _PLACES)
        for i in np.flatnonzero(expected > largest * (1.0 + _EXCEEDS)).tolist():
            if expected[i] <= largest[i] * (1.0 + _EXCEEDS):
                continue
            event, values = watched.events[i], carried([slopes[0, i] or TINY, *slopes[1:, i].tolist()])
            crossed = _crossed(event, _AT, values)
            for located in self._maxima.maxima(event, segment, crossed, (first, values[0]), (second, values[-1])):
                if located is not None:
                    points.append(located)
                    largest = np.maximum(largest, watched.heights(located[1]))
        return largest

    def _changes(
        self, event: BranchEvent, segment: HermiteSegment, crossed: list[tuple[Both, Both]], first: Known, second: Known
    ) -> list[Located]:
        """The sign changes between two neighbours.

        They are expected where the function changes its sign on the segment. Where that is not known to be near the
        branch they are believed once solutions on both sides show them.
        """

        def change(event: BranchEvent, places: Both, low: Known | None, high: Known | None) -> Located:
            return self._change(event, segment, places, low, high)

        located = [self._maxima.near(event, segment, *pair, first, second, change) for pair in crossed]
        every = [one for one in located if one is not None]
        apart = self._maxima.apart(list(every))
        same = first[1] * second[1] > 0.0  # between slopes of one sign there are two extremes, or none
        if event.height is not None and len(apart) == 1 and (same or len(every) > 1):
            return [*apart, self._other(event, apart[0], first, second)]
        if not any(located):
            located = [change(event, (0.0, 1.0), first, second)]
        return located

    def _other(self, event: BranchEvent, located: Located, first: Known, second: Known) -> Located:
        """The second of two extremes between two neighbours, of which one was located: before it or behind it."""
        assert located is not None
        at, step = located
        for places, low, high in (
            ((0.0, at), first, (step, -copysign(TINY, first[1]))),
            ((at, 1.0), (step, -copysign(TINY, second[1])), second),
        ):
            other = self._maxima.top(event, places, low, high)
            if len(self._maxima.apart([located, other])) > 1:
                return other
        return None

    def _change(
        self, event: BranchEvent, segment: HermiteSegment, places: Both, low: Known | None, high: Known | None
    ) -> Located:
        """The sign change between two solutions, at ``places`` on the segment."""
        if event.height is not None:
            return self._maxima.top(event, places, low, high)
        if low is None or high is None or not event.crossed(low[1], high[1]):
            return None
        change = self._event(event, segment, (places[0], low[1]), (places[1], high[1]))
        if change is None:
            change = self._maxima.narrowed(event, places, low, high).root(event, self._tolerance)
        return change

    def _passages(
        self, first: Step, second: Step, points: list[tuple[float, Step]], segment: HermiteSegment
    ) -> list[tuple[float, Step]]:
        """Points at the requested parameter values; turning points in between (already found) part the passages."""
        passages = []
        for low, high in pairwise([(0.0, first), *points, (1.0, second)]):
            values, p0, p1 = self._requested, low[1].parameter, high[1].parameter
            inside = values[(values > p0) & (values <= p1)] if p1 > p0 else values[(values < p0) & (values >= p1)]
            for value in inside.tolist():
                if second.kind == "end" and value == second.parameter:
                    continue
                passage = self._passage(value, segment, low, high)
                if passage is not None:
                    passages.append(passage)
        return passages

    def _passage(
        self, value: float, segment: HermiteSegment, low: tuple[float, Step], high: tuple[float, Step]
    ) -> Located:
        """Solve at the exact parameter, from the segment or else from both ends of narrower brackets."""
        u = segment.where(value, low[0], high[0])
        step = self._at(value, segment.point(u), (low[1], high[1]), segment.length)
        if step is not None:
            return u, step
        before, after = (end[1].parameter - value for end in (low, high))
        event = BranchEvent(name="", kind="requested", function=lambda point: point.parameter - value).falling(before)
        metric = self._corrector.metric
        bracket = Bracket(metric, low[1], abs(before), high[1], -abs(after), low[0], high[0])
        for narrower in narrowing(self._corrector, event, bracket, self._tolerance):
            ends, room = (narrower.low, narrower.high), narrower.room
            for end in sorted(ends, key=lambda end: abs(end.parameter - value)):
                shift = (value - end.parameter) / (end.tangent_parameter or np.inf)
                step = self._at(value, end.state + shift * end.tangent, ends, room)
                if step is not None and all(metric.length(step.state - one.state) <= room for one in ends):
                    part = metric.length(step.state - narrower.low.state) / room
                    return narrower.begin + part * (narrower.end - narrower.begin), step
        return None

    def _at(self, value: float, guess: Array, ends: tuple[Step, Step], length: float) -> Step | None:
        """The solution at a value of the parameter between two others, if it is the one that is expected."""
        guess[-1] = value
        way = np.zeros(guess.size)
        way[-1] = ends[1].parameter - ends[0].parameter
        step, _ = self._corrector.correct(guess, None, "requested", forward=way, options=self._corrector.patient)
        if step is None or not self._corrector.near(step.state - guess, length):
            return None
        return None if self._maxima.elsewhere(step) else step

    def _jump(self, event: BranchEvent, segment: HermiteSegment, u: float) -> Located:
        """The solution at a place on the segment."""
        guess = segment.point(u)
        step, _ = self._corrector.correct(guess, segment.derivative(u), event.kind, name=event.name)
        if step is None or not self._corrector.near(step.state - guess, segment.length):
            return None
        return u, step

    def _event(
        self, event: BranchEvent, segment: HermiteSegment, low: tuple[float, float], high: tuple[float, float]
    ) -> Located:
        """Solve on the segment until the place of the sign change is known to the tolerance; None where that ends."""
        metric = self._corrector.metric
        root = BracketedRoot(*low, *high)
        best: tuple[float, float, Step] | None = None
        for _ in range(_MAX_TRIALS):
            u = root.trial
            solved = self._maxima.solved(event, segment, u)
            if solved is None:
                return None
            step, value = solved
            shift = np.inf if best is None else metric.length(step.state - best[2].state)
            if best is None or abs(value) <= abs(best[1]):
                best = (u, value, step)
            root.update(u, value, self._tolerance)
            if value == 0.0 or shift < self._tolerance or root.width * segment.length < self._tolerance:
                break
        return None if best is None else (best[0], best[2])


@dataclass(frozen=True)
class Minimum:
    """A minimum that slopes along a segment show: its place, the ``rate`` of the slope there, and how steeply the
    height falls ``down`` to it and rises ``up`` behind it at most."""

    u: float
    rate: float
    down: float
    up: float


def shown(values: list[float]) -> list[Minimum]:
    """The minima that slopes at the places of a segment show."""
    minima = list[Minimum]()
    for k, (a, b) in enumerate(pairwise(values)):
        if a < 0.0 <= b:
            begin = next((i + 1 for i in range(k, -1, -1) if values[i] >= 0.0), 0)
            end = next((i for i in range(k + 1, len(values)) if values[i] < 0.0), len(values))
            rate = (b - a) / (_AT[k + 1] - _AT[k])
            minima.append(Minimum(_AT[k] - a / rate, rate, -min(values[begin : k + 1]), max(values[k + 1 : end])))
    return minima


def _crossed(event: BranchEvent, places: list[float], values: list[float]) -> list[tuple[Both, Both]]:
    """Neighbouring places, and the values there, between which the event is."""
    if min(values) > 0.0 or max(values) < 0.0:
        return []
    changes = zip(pairwise(places), pairwise(values), strict=True)
    return [(at, of) for at, of in changes if event.crossed(*of)]
