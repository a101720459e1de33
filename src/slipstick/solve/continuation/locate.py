"""Located points between two neighbouring points of a branch: events and requested parameter values."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import copysign

import numpy as np

from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import BracketedRoot, BranchEvent, Watched
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.solve.continuation.narrowing import Bracket, narrowed, narrowing
from slipstick.solve.continuation.step import Step
from slipstick.typing import Array

_MAX_TRIALS = 60
_TINY = float(np.finfo(float).tiny)
_PLACES = HermiteBasis(np.linspace(0.0, 1.0, 9))
_AT: list[float] = _PLACES.u.tolist()
_NEARLY = 0.5
"""An event function that falls to this share between the ends of an arc nearly changes its sign there."""
_SECANTS = 8
_PARTINGS = 5
"""Times that an arc which is not near the branch is halved to see maxima between its ends."""
_HIDDEN = 2e-4
"""Part of a height that a maximum may stand out by unseen there."""
_STEADY = 0.05
"""Part of the gain that a monotone one may differ by from that of a parabola."""
_EXCEEDS = 1e-6
"""Part by which a watched quantity is expected to exceed all before where a point is put."""
_SAME = 10.0
"""Tolerances apart that two locations of one maximum are at most."""


Both = tuple[float, float]
Known = tuple[Step, float]


class Locator:
    """Finds events and requested parameter values by solving again on the arc between two points.

    Parameters
    ----------
    corrector
        Solver of the branch.
    events, requested
        What to look for; ``requested`` are parameter values.
    tolerance
        Scaled arclength to which an event is located.
    watched
        Quantities of which the largest value is sought alone: points are put where one exceeds all before.
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
        """Largest values so far of what is watched, then event functions at the last point."""
        self._middles: dict[tuple[int, int], tuple[Step, Step, Known | None]] = {}
        self._orientations: tuple[int, int] = (0, 0)

    def begin(self, first: Step) -> None:
        """Take note of the event functions at the first point."""
        values = [(event, float(event.function(first))) for event in self._events]
        slopes = (value or _TINY if event.maximum else value for event, value in values)
        self.values = (*(self._watched.heights(first).tolist() if self._watched else ()), *slopes)

    def between(self, first: Step, second: Step) -> list[Step]:
        """Located points between two neighbours in order along the branch."""
        wanted = self._events or self._watched or self._requested.size
        arc = self._corrector.arc(first, second) if wanted else None
        if arc is None:
            return []
        located_points: list[tuple[float, Step]] = []
        ends = []
        self._middles.clear()
        self._orientations = first.orientation, second.orientation
        watched = len(self.values) - len(self._events)
        for event, before in zip(self._events, self.values[watched:], strict=True):
            places, values = self._expected(event, before, first, second, arc)
            if event.maximum:
                values = _carried(values)
            ends.append(values[-1])
            changes = zip(pairwise(places), pairwise(values), strict=True)
            crossed = [(at, of) for at, of in changes if event.crossed(*of)]
            if event.place is not None:
                located = [self._jump(event, arc, event.place(first, second, arc)) for _ in crossed]
            elif event.maximum:
                located = self._maxima(event, arc, crossed, (first, before), (second, values[-1]))
            else:
                located = self._changes(event, arc, crossed, (first, before), (second, values[-1]))
            located_points += [step for step in located if step is not None]
        if self._watched is not None:
            largest = self._exceed(self._watched, np.array(self.values[:watched]), located_points, arc, first, second)
            self.values = (*largest.tolist(), *ends)
        else:
            self.values = tuple(ends)
        if self._requested.size:
            located_points += self._passages(first, second, self._in_order(first, second, located_points), arc)
        located_points = self._in_order(first, second, located_points)
        for _, step in located_points:
            step.arclength = first.arclength + self._corrector.metric.length(step.state - first.state)
        return [step for _, step in located_points]

    def _in_order(self, first: Step, second: Step, points: list[tuple[float, Step]]) -> list[tuple[float, Step]]:
        """What was located, in order along the branch: their places tell it only where the arc is near to that."""
        if len(points) < 2:
            return points
        whole = Bracket(first, 1.0, second, -1.0, 0.0, 1.0)
        return sorted(points, key=lambda located: whole.part(located[1], self._corrector.metric))

    def _expected(
        self, event: BranchEvent, before: float, first: Step, second: Step, arc: HermiteSegment
    ) -> tuple[list[float], list[float]]:
        """Places on the arc, its ends among them, and the event function there: exact at the ends."""
        if event.along is None:
            return [0.0, 1.0], [before, float(event.function(second))]
        values = [before, *event.along(first, second, arc, _PLACES).tolist()[1:]]
        parted = event.maximum and not second.smooth
        if not parted and (min(values) > 0.0 or max(values) < 0.0):
            self._see_to_near_miss(event, arc, values)
        return _AT, values

    def _see_to_near_miss(self, event: BranchEvent, arc: HermiteSegment, values: list[float]) -> None:
        """Make values of one sign exact where it nearly changes: the cubic is not as near to the branch as that."""
        size, positive = [abs(value) for value in values], values[0] > 0.0
        nearest = min(range(1, len(size) - 1), key=size.__getitem__)
        if not size[nearest] < _NEARLY * min(size[0], size[-1]):
            return
        for i in (nearest, max(nearest - 1, 1), min(nearest + 1, len(values) - 2)):
            solved = self._solved(event, arc, _AT[i], 0.0, exact=False)
            if solved is not None:
                values[i] = solved[1]
                if (values[i] > 0.0) != positive:
                    return

    def _exceed(
        self,
        watched: Watched,
        largest: Array,
        points: list[tuple[float, Step]],
        arc: HermiteSegment,
        first: Step,
        second: Step,
    ) -> Array:
        """Add to ``found`` where something watched exceeds all before; the ``largest`` values that leaves.

        What was solved for already often is the largest of several to the tolerance, and costs nothing then.
        """
        for step in (second, *(step for _, step in points)):
            largest = np.maximum(largest, watched.heights(step))
        slopes, expected = watched.expected(first, second, arc, _PLACES)
        for i in np.flatnonzero(expected > largest * (1.0 + _EXCEEDS)).tolist():
            if expected[i] <= largest[i] * (1.0 + _EXCEEDS):
                continue
            event, values = watched.events[i], _carried([slopes[0, i] or _TINY, *slopes[1:, i].tolist()])
            changes = zip(pairwise(_AT), pairwise(values), strict=True)
            crossed = [(at, of) for at, of in changes if event.crossed(*of)]
            for located in self._maxima(event, arc, crossed, (first, values[0]), (second, values[-1])):
                if located is not None:
                    points.append(located)
                    largest = np.maximum(largest, watched.heights(located[1]))
        return largest

    def _maxima(
        self, event: BranchEvent, arc: HermiteSegment, crossed: list[tuple[Both, Both]], first: Known, second: Known
    ) -> list[tuple[float, Step] | None]:
        """The maxima between two neighbours.

        They are expected where the slope of the arc falls through zero. An arc that is not known to be near the branch
        is parted by solutions instead, until the slopes at their ends tell what is between.
        """
        located: list[tuple[float, Step] | None] = []
        if second[0].smooth:
            for at, of in crossed:
                margin = at[1] - at[0]
                room = (max(0.0, at[0] - margin), min(1.0, at[1] + margin))
                top = self._quickly(event, arc, at, of, room)
                if top is None:
                    ends = ({0.0: first, 1.0: second}.get(u) or self._solved(event, arc, u, 0.0) for u in room)
                    top = self._top(event, room, *ends)
                located.append(top)
        if not any(located) and (event.crossed(first[1], second[1]) or not second[0].smooth):
            parts = self._parted(event, (0.0, 1.0), first, second, _PARTINGS)
            located = [self._top(event, *part) for part in parts]
        return self._apart(located)

    def _parted(
        self, event: BranchEvent, places: Both, low: Known, high: Known, times: int
    ) -> list[tuple[Both, Known, Known]]:
        """Parts of the branch between two solutions, with their places, over which the slope falls through zero."""
        if times and not self._plain(event, low, high):
            key = (id(low[0]), id(high[0]))
            if key not in self._middles:
                self._middles[key] = (
                    low[0],
                    high[0],
                    self._solved(event, self._corrector.arc(low[0], high[0]), 0.5, 0.0, exact=False),
                )
            middle = self._middles[key][2]
            if middle is not None:
                value = float(event.function(middle[0]))
                at, known = 0.5 * (places[0] + places[1]), (middle[0], _carried([low[1], value])[1])
                return [
                    *self._parted(event, (places[0], at), low, known, times - 1),
                    *self._parted(event, (at, places[1]), known, high, times - 1),
                ]
        return [(places, low, high)] if event.crossed(low[1], high[1]) else []

    def _plain(self, event: BranchEvent, low: Known, high: Known) -> bool:
        """Whether what is largest at maxima is as good as a parabola between two solutions."""
        assert event.height is not None
        heights, length = (event.height(low[0]), event.height(high[0])), self._corrector.arc(low[0], high[0]).length
        before, after = (slope / self._corrector.metric.length(step.tangent) for step, slope in (low, high))
        gain = heights[1] - heights[0]
        hidden = min(abs(gain - 0.5 * length * (before + after)), max(abs(before), abs(after)) * length)
        steady = min(before * gain, after * gain) > 0.0
        return hidden <= max(_HIDDEN * max(heights), _STEADY * abs(gain) if steady else 0.0)

    def _apart(self, located: list[tuple[float, Step] | None]) -> list[tuple[float, Step] | None]:
        """What was located, each once: the brackets of neighbouring places overlap."""
        kept: list[tuple[float, Step] | None] = []
        for one in located:
            if one is None or all(
                other is None or self._corrector.metric.length(one[1].state - other[1].state) > _SAME * self._tolerance
                for other in kept
            ):
                kept.append(one)
        return kept

    def _top(
        self, event: BranchEvent, places: Both, low: Known | None, high: Known | None
    ) -> tuple[float, Step] | None:
        """The extreme between two solutions, at ``places`` on the arc, that bracket one."""
        if low is None or high is None or not event.crossed(low[1], high[1]):
            return None
        return self._narrowed(event, places, low, high).top(
            event.falling(low[1]), self._corrector.metric, self._tolerance
        )

    def _narrowed(self, event: BranchEvent, places: Both, low: Known, high: Known) -> Bracket:
        """What two solutions between which an event function changes its sign are narrowed to."""
        seen = event.falling(low[1])
        bracket = Bracket(low[0], abs(low[1]), high[0], -abs(high[1]), *places)
        return narrowed(self._corrector, seen, bracket, self._tolerance)

    def _changes(
        self, event: BranchEvent, arc: HermiteSegment, crossed: list[tuple[Both, Both]], first: Known, second: Known
    ) -> list[tuple[float, Step] | None]:
        """The sign changes between two neighbours.

        They are expected where the function changes its sign on the arc. Where that is not known to be near the branch
        they are believed once solutions on both sides show them.
        """
        located: list[tuple[float, Step] | None] = []
        for at, of in crossed:
            margin = at[1] - at[0]
            room = (max(0.0, at[0] - margin), min(1.0, at[1] + margin))
            change = self._quickly(event, arc, at, of, room) if event.along and second[0].smooth else None
            if change is None and margin < 1.0:
                ends = ({0.0: first, 1.0: second}.get(u) or self._solved(event, arc, u, 0.0) for u in room)
                change = self._change(event, arc, room, *ends)
            located.append(change)
        if not any(located):
            located = [self._change(event, arc, (0.0, 1.0), first, second)]
        return located

    def _change(
        self, event: BranchEvent, arc: HermiteSegment, places: Both, low: Known | None, high: Known | None
    ) -> tuple[float, Step] | None:
        """The sign change between two solutions, at ``places`` on the arc."""
        if event.height is not None:
            return self._top(event, places, low, high)
        if low is None or high is None or not event.crossed(low[1], high[1]):
            return None
        change = self._event(event, arc, (places[0], low[1]), (places[1], high[1]))
        if change is None:
            change = self._narrowed(event, places, low, high).root(event, self._corrector.metric, self._tolerance)
        return change

    def _quickly(
        self, event: BranchEvent, arc: HermiteSegment, at: Both, of: Both, room: Both
    ) -> tuple[float, Step] | None:
        """By secants from where the sign change is expected; None where they lead out of the ``room``."""
        rate = (of[1] - of[0]) / (at[1] - at[0])
        u, off, known = at[0] - of[0] / rate, np.zeros(1), None
        for _ in range(_SECANTS):
            solved = self._solved(event, arc, u, off)
            if solved is None:
                return None
            step, value = solved
            if known is not None and u != known[0]:
                slope = (value - known[1]) / (u - known[0])
                if slope * rate <= 0.0:
                    return None
                rate = slope
            known, off = (u, value), step.state - arc.point(u)
            shift = -value / rate
            if abs(shift) * arc.length < self._tolerance:
                return u, step
            u += shift
            if not room[0] <= u <= room[1]:
                return None
        return None

    def _solved(
        self, event: BranchEvent, arc: HermiteSegment, u: float, off: Array | float, *, exact: bool = True
    ) -> tuple[Step, float] | None:
        """The solution on the plane across the arc at ``u``, expected ``off`` it, and the event function there.

        ``exact``: as exactly as a located point is known, else as every point of the branch.
        """
        guess, options = arc.point(u) + off, self._corrector.exact if exact else None
        step, _ = self._corrector.correct(guess, arc.derivative(u), event.kind, name=event.name, options=options)
        if step is None or not self._corrector.near(step.state - guess, arc.length):
            return None
        if all(
            step.orientation * orientation < 0 for orientation in self._orientations
        ):  # of another branch, or the way back of this
            return None
        return step, float(event.function(step))

    def _passages(
        self, first: Step, second: Step, points: list[tuple[float, Step]], arc: HermiteSegment
    ) -> list[tuple[float, Step]]:
        """Points at the requested parameter values; turning points in between (already found) part the passages."""
        passages = []
        for low, high in pairwise([(0.0, first), *points, (1.0, second)]):
            values, p0, p1 = self._requested, low[1].parameter, high[1].parameter
            inside = values[(values > p0) & (values <= p1)] if p1 > p0 else values[(values < p0) & (values >= p1)]
            for value in inside.tolist():
                if second.kind == "end" and value == second.parameter:
                    continue
                passage = self._passage(value, arc, low, high)
                if passage is not None:
                    passages.append(passage)
        return passages

    def _passage(
        self, value: float, arc: HermiteSegment, low: tuple[float, Step], high: tuple[float, Step]
    ) -> tuple[float, Step] | None:
        """Solve at the exact parameter, from the arc or else from both sides, which solutions between bring nearer."""
        u = arc.where(value, low[0], high[0])
        step = self._at(value, arc.point(u), (low[1], high[1]), arc.length)
        if step is not None:
            return u, step
        before, after = (end[1].parameter - value for end in (low, high))
        event = BranchEvent(name="", kind="requested", function=lambda point: point.parameter - value).falling(before)
        bracket, metric = Bracket(low[1], abs(before), high[1], -abs(after), low[0], high[0]), self._corrector.metric
        for narrower in narrowing(self._corrector, event, bracket, self._tolerance):
            ends, room = (narrower.low, narrower.high), narrower.room(metric)
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
        return None if all(step.orientation * orientation < 0 for orientation in self._orientations) else step

    def _jump(self, event: BranchEvent, arc: HermiteSegment, u: float) -> tuple[float, Step] | None:
        """The solution at a place on the arc."""
        guess = arc.point(u)
        step, _ = self._corrector.correct(guess, arc.derivative(u), event.kind, name=event.name)
        if step is None or not self._corrector.near(step.state - guess, arc.length):
            return None
        return u, step

    def _event(
        self, event: BranchEvent, arc: HermiteSegment, low: tuple[float, float], high: tuple[float, float]
    ) -> tuple[float, Step] | None:
        """Solve on the arc until the place of the sign change is known to the tolerance; None where that ends."""
        metric = self._corrector.metric
        root = BracketedRoot(*low, *high)
        best: tuple[float, float, Step] | None = None
        for _ in range(_MAX_TRIALS):
            u = root.trial
            solved = self._solved(event, arc, u, 0.0)
            if solved is None:
                return None
            step, value = solved
            shift = np.inf if best is None else metric.length(step.state - best[2].state)
            if best is None or abs(value) <= abs(best[1]):
                best = (u, value, step)
            root.update(u, value, self._tolerance)
            if value == 0.0 or shift < self._tolerance or root.width * arc.length < self._tolerance:
                break
        return None if best is None else (best[0], best[2])


def _carried(values: list[float]) -> list[float]:
    """Slopes of which a plateau, where they are 0, has the sign of those before it."""
    out = values[:1]
    for value in values[1:]:
        out.append(value or copysign(_TINY, out[-1]))
    return out
