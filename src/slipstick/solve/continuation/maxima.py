"""Sign changes between two neighbouring points of a branch, and the maxima that may hide between them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
from math import copysign, inf

import numpy as np

from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.narrowing import Bracket, Guess, guesses_of, narrowed, with_inside
from slipstick.solve.continuation.step import Step
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array

TINY = float(np.finfo(float).tiny)
_SECANTS = 8
_PARTINGS = 5
"""Times that a segment which is not near the branch is halved to see maxima between its ends."""
_HIDDEN = 2e-4
"""Part of a height that a maximum may stand out by unseen there."""
_STEADY = 0.05
"""Part of the gain that a monotone one may differ by from that of a parabola."""
_STEEP = 6e-4
"""Part of a height up to which that holds."""
DIP = 2e-5
"""Part of its height to which a minimum is known: it tells how far the maxima on both sides stand out."""
DEEP = 1.1e-3
"""Part of a height by which a minimum is deeper where more need not be known of it."""
_TRIALS = 12
"""Solutions that are sought for a minimum."""
_BESIDE = 0.02
"""Part of the way to a corner by which it is tried beside it; twice as much each time that this is the other side."""
_FLAT = 10.0
"""Times further than it is known that a minimum may be, by the slope at the side next to it."""
_SAME = 10.0
"""Tolerances apart that two locations of one maximum are at most."""

Both = tuple[float, float]
Known = tuple[Step, float]
Located = tuple[float, Step] | None


class Maxima:
    """Solutions on the segment between two neighbours, and the sign changes and maxima that they bracket."""

    def __init__(self, corrector: Corrector, tolerance: float) -> None:
        self.corrector, self.tolerance = corrector, tolerance
        self._middles: dict[tuple[int, int], tuple[Step, Step, Known | None]] = {}
        self._orientations: tuple[int, int] = (0, 0)

    def begin(self, first: Step, second: Step) -> None:
        """Take two other neighbours."""
        self._middles.clear()
        self._orientations = first.orientation, second.orientation

    def elsewhere(self, step: Step) -> bool:
        """Whether a solution is of another branch, or of the way back of this one."""
        return all(step.orientation * orientation < 0 for orientation in self._orientations)

    def near(
        self,
        event: BranchEvent,
        segment: HermiteSegment,
        at: Both,
        of: Both,
        first: Known,
        second: Known,
        between: Callable[[BranchEvent, Both, Known | None, Known | None], Located],
    ) -> Located:
        """A sign change near where the segment has one: by secants, else ``between`` solutions on both sides of it."""
        margin = at[1] - at[0]
        room = (max(0.0, at[0] - margin), min(1.0, at[1] + margin))
        expected = event.along is not None or event.maximum
        located = self.quickly(event, segment, at, of, room) if expected and second[0].smooth else None
        if located is None and (margin < 1.0 or event.maximum):
            ends = ({0.0: first, 1.0: second}.get(u) or self.solved(event, segment, u, 0.0) for u in room)
            located = between(event, room, *ends)
        return located

    def solved(
        self,
        event: BranchEvent,
        segment: HermiteSegment,
        u: float,
        off: Array | float,
        options: NewtonOptions | None = None,
    ) -> tuple[Step, float] | None:
        """The solution on the plane across the segment at ``u``, expected ``off`` it, and the event function there.

        As exactly as a located point is known unless there are other ``options``.
        """
        guess, options = segment.point(u) + off, options or self.corrector.exact
        step, _ = self.corrector.correct(guess, segment.derivative(u), event.kind, name=event.name, options=options)
        if step is None or not self.corrector.near(step.state - guess, segment.length):
            return None
        return None if self.elsewhere(step) else (step, float(event.function(step)))

    def quickly(self, event: BranchEvent, segment: HermiteSegment, at: Both, of: Both, room: Both) -> Located:
        """By secants from where the sign change is expected; None where they lead out of the ``room``."""
        rate = (of[1] - of[0]) / (at[1] - at[0])
        u, off, known = at[0] - of[0] / rate, np.zeros(1), None
        for trial in range(_SECANTS):
            solved = self.solved(event, segment, u, off, None if trial else self.corrector.rough)
            if solved is None:
                return None
            step, value = solved
            if known is not None and u != known[0]:
                slope = (value - known[1]) / (u - known[0])
                if slope * rate <= 0.0:
                    return None
                rate = slope
            known, off = (u, value), step.state - segment.point(u)
            shift = -value / rate
            if trial and abs(shift) * segment.length < self.tolerance:
                return u, step
            u += shift
            if not room[0] <= u <= room[1]:
                return None
        return None

    def top(self, event: BranchEvent, places: Both, low: Known | None, high: Known | None) -> Located:
        """The extreme between two solutions, at ``places`` on the segment, that bracket one."""
        if low is None or high is None or not event.crossed(low[1], high[1]):
            return None
        narrow = self.narrowed(event, places, low, high)
        place, step = narrow.top(event.falling(low[1]), self.corrector.metric, self.tolerance)
        if any(np.array_equal(step.state, end.state) for end, _ in (low, high)):  # it may be known roughly only
            better, _ = self.corrector.correct(
                step.state.copy(), step.tangent, step.kind, name=step.name, options=self.corrector.exact
            )
            step = better or step
        return place, step

    def bottom(self, event: BranchEvent, bracket: Bracket, *, corner: bool = False) -> Located:
        """The minimum between two solutions, the height falling from the first and rising to the second: as an ordinary
        point, None where it is one of them. ``corner``: it seems to be one.

        Sought where the slope vanishes by a secant; while the slopes hardly change, where the tangents cross, from the
        side that is further away: there the corner is.
        """
        height, metric, falling = event.height, self.corrector.metric, event.falling(-1.0)
        assert height is not None
        least, found, now = min(height(bracket.low), height(bracket.high)), None, bracket
        best, known, bends, misses = least, [False, False], [0.0, 0.0], 0
        for _ in range(_TRIALS):
            room, slopes, heights = now.room(metric), (now.rising, -now.falling), (height(now.low), height(now.high))
            down, up = (slope + bend * room for slope, bend in zip(slopes, bends, strict=True))
            lowest = min(heights) - fall(heights[0], down, heights[1], up, room)
            flat = min(slopes) * room <= _FLAT * DIP * best
            if best < (1.0 - DEEP) * least or ((all(known) or flat) and best - lowest <= DIP * best):
                break
            share = slopes[0] / sum(slopes) if lowest > -inf else 0.5
            beside, from_low = list[Guess](), True
            if corner and min(slopes) > TINY:
                way = _crossing(heights[0], slopes[0], heights[1], slopes[1], room)
                part, from_low = max(1.0 - _BESIDE * 2.0**misses, 0.5), way > 0.5 * room
                share = part * way / room if from_low else 1.0 - part * (1.0 - way / room)
                end, along = (now.low, share * room) if from_low else (now.high, (share - 1.0) * room)
                unit = end.tangent / metric.length(end.tangent)
                beside.append((end.state + along * unit, unit))
            edge = min(0.25, 0.5 * self.tolerance / room)
            guesses = chain(beside, guesses_of(self.corrector, now, min(max(share, edge), 1.0 - edge)))
            narrower = with_inside(self.corrector, falling, now, guesses, self.corrector.usual)
            if narrower is None:
                break
            side = int(narrower.low is now.low)
            misses = misses + 1 if beside and from_low != (side == 0) else 0
            old, new = (now.low, now.high)[side], (narrower.low, narrower.high)[side]
            slope = (narrower.rising, -narrower.falling)[side]
            bends[side] = max(0.0, (slope - slopes[side]) / metric.length(new.state - old.state))
            corner, known[side], now = slope > 0.5 * slopes[side] > TINY, True, narrower
            if height(new) < best:
                best, found = height(new), ((now.begin, now.end)[side], new)
        return None if found is None else (found[0], found[1].named("regular", ""))

    def narrowed(self, event: BranchEvent, places: Both, low: Known, high: Known) -> Bracket:
        """What two solutions between which an event function changes its sign are narrowed to."""
        seen = event.falling(low[1])
        bracket = Bracket(low[0], abs(low[1]), high[0], -abs(high[1]), *places)
        return narrowed(self.corrector, seen, bracket, self.tolerance)

    def maxima(
        self, event: BranchEvent, segment: HermiteSegment, crossed: list[tuple[Both, Both]], first: Known, second: Known
    ) -> list[Located]:
        """The maxima between two neighbours.

        They are expected where the slope of the segment falls through zero. A segment that is not known to be near the
        branch is parted by solutions instead, until the slopes at their ends tell what is between.
        """
        located: list[Located] = []
        if second[0].smooth:
            located = [self.near(event, segment, *change, first, second, self.top) for change in crossed]
        if not any(located) and (event.crossed(first[1], second[1]) or not second[0].smooth):
            parts = self.parted(event, (0.0, 1.0), first, second)
            located = [self.top(event, *part) for part in parts]
        return self.apart(located)

    def parted(
        self, event: BranchEvent, places: Both, low: Known, high: Known, times: int = _PARTINGS
    ) -> list[tuple[Both, Known, Known]]:
        """Parts of the branch between two solutions, with their places, over which the slope falls through zero."""
        if times and not self._plain(event, low, high):
            key = (id(low[0]), id(high[0]))
            if key not in self._middles:
                between = self.solved(event, self.corrector.segment(low[0], high[0]), 0.5, 0.0, self.corrector.rough)
                self._middles[key] = low[0], high[0], between
            middle = self._middles[key][2]
            if middle is not None:
                value = float(event.function(middle[0]))
                at, known = 0.5 * (places[0] + places[1]), (middle[0], carried([low[1], value])[1])
                return [
                    *self.parted(event, (places[0], at), low, known, times - 1),
                    *self.parted(event, (at, places[1]), known, high, times - 1),
                ]
        return [(places, low, high)] if event.crossed(low[1], high[1]) else []

    def _plain(self, event: BranchEvent, low: Known, high: Known) -> bool:
        """Whether what is largest at maxima is as good as a parabola between two solutions."""
        assert event.height is not None
        heights, length = (event.height(low[0]), event.height(high[0])), self.corrector.segment(low[0], high[0]).length
        before, after = (slope / self.corrector.metric.length(step.tangent) for step, slope in (low, high))
        gain = heights[1] - heights[0]
        hidden = min(abs(gain - 0.5 * length * (before + after)), max(abs(before), abs(after)) * length)
        steady = min(before * gain, after * gain) > 0.0
        limit = min(_STEADY * abs(gain), _STEEP * max(heights)) if steady else 0.0
        return hidden <= max(_HIDDEN * max(heights), limit)

    def apart(self, located: list[Located]) -> list[Located]:
        """What was located, each once: the brackets of neighbouring places overlap."""
        kept: list[Located] = []
        for one in located:
            if one is None or all(
                other is None or self.corrector.metric.length(one[1].state - other[1].state) > _SAME * self.tolerance
                for other in kept
            ):
                kept.append(one)
        return kept


def _crossing(before: float, down: float, after: float, up: float, length: float) -> float:
    """The way from the first of two points, some ``length`` apart, to where their tangents cross."""
    return min(max((before - after + up * length) / (down + up), 0.0), length)


def fall(before: float, down: float, after: float, up: float, length: float) -> float:
    """How much lower than the lower of two points, some ``length`` apart, the branch is where their tangents cross.

    No minimum between is deeper, smooth or at a corner, if the height falls from the one at a rate ``down`` at most and
    rises to the other at a rate ``up`` at most. Infinite where such a rate is not known, beside a maximum.
    """
    if min(down, up) <= TINY:
        return inf
    way = _crossing(before, down, after, up, length)
    return min(before, after) - min(before - down * way, after - up * (length - way))


def carried(values: list[float]) -> list[float]:
    """Slopes of which a plateau, where they are 0, has the sign of those before it."""
    out = values[:1]
    for value in values[1:]:
        out.append(value or copysign(TINY, out[-1]))
    return out
