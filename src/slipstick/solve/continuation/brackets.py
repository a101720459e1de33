"""Extremes and roots between two solved points of a branch, on both sides of a corner where there is one.

Formulas hold for one branch and for k. The iterations over them are ``narrowing`` here and ``lockstep_brackets.py`` for
many branches: on tables of one row each trial of a single curve would take six times as long.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from math import copysign, inf, sqrt
from typing import NamedTuple

import numpy as np

from slipstick.solve.continuation.corrector import Corrector, Step
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import Marks, Metric, Scalars, chosen, column, dots, larger, norms, smaller
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array

# Numbers of trials.
MOST, STALLED = 100, 12
"""Largest number of trials to narrow a bracket, and that of trials that together do not halve it: usually two do. Where
solutions end within the bracket, as two branches that meet, the rest would narrow it no further."""
SECANTS = 8
"""Largest number of secant steps from the place where the segment has its sign change."""
PARTINGS = 5
"""Largest number of times that an inaccurate segment is halved to find maxima between its ends."""
_MINIMUM_TRIALS = 12
"""Largest number of trials for a minimum."""

# Trials beside corners.
SHARES = (0.95, 0.5, 0.125, 0.03, 0.008, 0.002)
"""Steps from an end that are tried: parts of the distance to a corner and, but for the first, of a bracket."""
_PARALLEL = 1e-12
"""Square of the sine of an angle below which two tangents are parallel: a few digits above rounding."""
_CORNER_MARGIN = 0.02
"""Least distance of a trial from the place where tangents meet, over the tolerance."""
_MISFITS = 2.0
"""Distance of a trial from the place where tangents meet, over the distance by which they miss each other."""
_CORNER_OFFSET = 0.02
"""Distance of a trial from the corner, over that of the end; doubled each time that it is on the other side."""

# Accuracy of extremes, relative to their heights.
_HEIGHT_ERROR = 1e-6
"""Error of a maximum that is located, however narrow its bracket is."""
_HIDDEN_HEIGHT = 2e-4
"""Height over the ends of a maximum that may be missed between two solutions."""
_STEEP_HEIGHT = 6e-4
"""Height up to which ``_PARABOLA_ERROR`` decides."""
_PARABOLA_ERROR = 0.05
"""Difference of a monotone gain from that of a parabola, over the gain, up to which it hides no maximum."""
DIP = 2e-5
"""Error of a minimum: the heights of the maxima on both sides above it, their prominence, depend on it."""
DEEP = 1.1e-3
"""Depth of a minimum below which its exact value does not matter."""
_FLAT_BOTTOM = 10.0
"""Error of a minimum estimated by the slope at the side closer to it, over ``DIP``, at which the search ends."""

# Accuracy of places, over the tolerance.
_TURNING_POINT_ERROR = 100.0
"""Error of a turning point where no closer solution is found."""
_SAME = 10.0
"""Largest distance of two locations of one maximum."""
_JUMPS = 0.5
"""Ratio of a slope between two solutions to that at one of them above which the slope may jump between them."""
_JUMP = 1e-3
"""Value of a function at its root, over the difference of values around, above which it may jump there."""
_SAME_PLACE = 1e-13
"""Distance of two places of a segment that is rounding."""

TINY = float(np.finfo(float).tiny)
"""Stands for a positive slope of unknown size, and for that of a plateau."""

Guess = tuple[Array, Array]
"""Guess of a solution, and the direction of the branch there."""
Both = tuple[float, float]
Known = tuple[Step, float]
"""A solution with the value of an event function."""
Located = tuple[float, Step] | None
"""Place ``u`` on the segment and the solution there."""


class Chord:
    """The line between two solutions, each a state and a tangent (..., N + 1).

    Attributes
    ----------
    turns
        Whether the branch turns by more than a right angle.
    before, after
        Distances from both ends to the intersection of their tangents; 0 where it does not turn.
    gap, room
        Scaled length of the line, and of the branch between both, which is longer where it turns back.
    """

    def __init__(self, metric: Metric, low: tuple[Array, Array], high: tuple[Array, Array]) -> None:
        self._metric, self._low, self._high = metric, low, high
        (state, tangent), (other, direction) = low, high
        a, b = tangent * metric.weights, direction * metric.weights
        self._a, self._b = a / column(norms(a)), b / column(norms(b))
        self._chord = (other - state) * metric.weights
        g, p, q = self._products = dots(self._a, self._b), dots(self._a, self._chord), dots(self._b, self._chord)
        square_of_sine = 1.0 - g * g
        self.turns = (g < 0.0) & (square_of_sine >= _PARALLEL)
        over = chosen(self.turns, square_of_sine, inf)
        self.before, self.after = abs(p - g * q) / over, abs(q - g * p) / over
        self.gap = norms(self._chord)
        self.room = larger(self.gap, self.before + self.after)

    def part(self, state: Array, tangent: Array) -> float:
        """Position along one branch of a solution between the ends, to order solutions by."""
        w = self._metric.weights
        after, before = (state - self._low[0]) * w, (self._high[0] - state) * w
        if not self.turns:
            return float(after.dot(self._chord))
        tangent = tangent * w
        if tangent.dot(self._a) > tangent.dot(self._b):
            return float(after.dot(self._a)) - self.before
        return self.after - float(before.dot(self._b))

    def at_corner(self, margin: float) -> Iterator[Guess]:
        """A guess on the longer side of the corner at which the tangents of both ends meet, if they do.

        It is so far from the corner that it lies on that side, as far as both sides are straight; at least a
        ``margin``.
        """
        g, p, q = self._products
        square_of_sine = 1.0 - g * g
        if square_of_sine < _PARALLEL:
            return
        before, after = (p - g * q) / square_of_sine, (q - g * p) / square_of_sine
        misfit = norms(self._chord - before * self._a - after * self._b) / sqrt(square_of_sine)
        side, (state, tangent) = (before, self._low) if before > after else (-after, self._high)
        way = abs(side) - max(_MISFITS * float(misfit), margin)
        if min(before, after) >= 0.0 and way > 0.5 * abs(side):
            unit = tangent / self._metric.length(tangent)
            yield state + copysign(way, side) * unit, unit

    def beside(self, part: float, *, nearer: bool) -> Guess:
        """A guess at a part of the distance from the end farther from the corner, or from the ``nearer`` one."""
        before, after = chosen(self.turns, self.before, self.gap), chosen(self.turns, self.after, self.gap)
        from_low = (after > before) == nearer
        state, tangent = (
            chosen(column(from_low), one, other) for one, other in zip(self._low, self._high, strict=True)
        )
        direction = tangent / column(self._metric.length(tangent))
        return state + column(part * chosen(from_low, before, -after)) * direction, direction


def leads_on(orientation: Scalars, before: Scalars, after: Scalars) -> Marks:
    """Whether a solution between two others is on their branch, neither on another nor on its way back."""
    return (orientation * before >= 0) | (orientation * after >= 0)


def is_within(metric: Metric, state: Array, low: Array, high: Array, room: Scalars) -> Marks:
    """Whether a state lies between two others on a branch of length ``room`` between them."""
    before, after = metric.length(state - low), metric.length(state - high)
    return (before > 0.0) & (before < room) & (after > 0.0) & (after < room)


def share_of(rising: Scalars, falling: Scalars, bisect: Marks, room: Scalars, tolerance: float) -> Scalars:
    """The part of a bracket at which a function vanishes by a secant, or half; not within the tolerance of an end."""
    edge = smaller(0.5, 0.5 * tolerance / room)
    return smaller(1.0 - edge, larger(edge, chosen(bisect, 0.5, rising / (rising - falling))))


def is_known(height: Scalars, rising: Scalars, falling: Scalars, room: Scalars, tolerance: float) -> Marks:
    """Whether no maximum in a bracket, with these slopes at its ends, exceeds the higher end."""
    return (room <= tolerance) | (larger(rising, -falling) * room <= _HEIGHT_ERROR * height)


def crossing(before: Scalars, down: Scalars, after: Scalars, up: Scalars, length: Scalars) -> Scalars:
    """Distance from the first of two points, ``length`` apart, to the crossing of their tangents."""
    return smaller(larger(0.0, (before - after + up * length) / (down + up)), length)


def fall(before: Scalars, down: Scalars, after: Scalars, up: Scalars, length: Scalars) -> Scalars:
    """Depth of the crossing of the tangents of two points, ``length`` apart, below the lower point.

    No minimum between is deeper, smooth or at a corner, if the height falls from the one at a rate ``down`` at most and
    rises to the other at a rate ``up`` at most. Infinite where such a rate is unknown, at a maximum.
    """
    known = smaller(down, up) > TINY
    way = crossing(before, chosen(known, down, inf), after, up, length)
    return chosen(known, smaller(before, after) - smaller(before - down * way, after - up * (length - way)), inf)


def is_bottom(least: Scalars, rest: Scalars, ends: Scalars) -> Marks:
    """Whether the ``least`` height solved for is as good as a minimum: the branch falls by no more than ``rest``, or it
    is so much lower than the ``ends`` that more need not be known."""
    return (rest <= DIP * least) | (least < (1.0 - DEEP) * ends)


def is_plain(before: Scalars, after: Scalars, low: Scalars, high: Scalars, length: Scalars) -> Marks:
    """Whether a height is as good as a parabola between two solutions, by its slopes ``before`` and ``after`` and its
    values ``low`` and ``high`` at both: no maximum hides there."""
    gain, height = high - low, larger(low, high)
    hidden = smaller(abs(gain - 0.5 * length * (before + after)), larger(abs(before), abs(after)) * length)
    steady = smaller(before * gain, after * gain) > 0.0
    limit = chosen(steady, smaller(_PARABOLA_ERROR * abs(gain), _STEEP_HEIGHT * height), 0.0)
    return hidden <= larger(_HIDDEN_HEIGHT * height, limit)


@dataclass(frozen=True)
class Bracket:
    """Two solutions, the event function positive at the first and not at the second: an extreme or a root is between.

    ``begin`` and ``end`` are their places on a segment.
    """

    metric: Metric
    low: Step
    rising: float
    high: Step
    falling: float
    begin: float
    end: float

    @cached_property
    def chord(self) -> Chord:
        """From the one to the other."""
        return Chord(self.metric, (self.low.state, self.low.tangent), (self.high.state, self.high.tangent))

    @property
    def room(self) -> float:
        """Length of the branch between them."""
        return float(self.chord.room)

    def with_inside(self, step: Step, value: float) -> Bracket:
        """The part of the bracket that still holds the sign change, given a solution between its ends."""
        before, after = (self.metric.length(step.state - end.state) for end in (self.low, self.high))
        place = self.begin + (self.end - self.begin) * before / (before + after)
        if value > 0.0:
            return replace(self, low=step, rising=value, begin=place)
        return replace(self, high=step, falling=value, end=place)

    def holds(self, step: Step) -> bool:
        """Whether a solution lies between the ends on this branch."""
        low, high = self.low, self.high
        return bool(
            leads_on(step.orientation, low.orientation, high.orientation)
            and is_within(self.metric, step.state, low.state, high.state, self.room)
        )

    def top(self, event: BranchEvent, tolerance: float) -> tuple[float, Step]:
        """The place and the solution of the higher end; of kind "near ..." where the extreme may be higher."""
        assert event.height is not None
        ends = [(event.height(step), place, step) for step, place in ((self.low, self.begin), (self.high, self.end))]
        height, place, step = max(ends, key=lambda end: end[0])
        if event.maximum:
            known = is_known(height, self.rising, self.falling, self.room, tolerance)
        else:
            known = self.room <= _TURNING_POINT_ERROR * tolerance
        return place, step.named(event.kind if known else f"near {event.kind}", event.name)

    def root(self, event: BranchEvent, tolerance: float) -> tuple[float, Step] | None:
        """The place and the solution of the end with the smaller value; None where an exact event is not exact."""
        if event.exact and self.room > tolerance:
            return None
        place, step = (self.begin, self.low) if self.rising < -self.falling else (self.end, self.high)
        return place, step.named(event.kind, event.name)


def narrowing(corrector: Corrector, event: BranchEvent, bracket: Bracket, tolerance: float) -> Iterator[Bracket]:
    """The bracket, then narrower ones, to the scaled ``tolerance`` if there are solutions between the ends.

    Every trial lies on a cubic between the present ends: each is closer to the branch than the one before, on both
    sides of a corner. Where there is no solution close to it, ever shorter steps are taken from the ends.
    """
    bisect = corner = False
    rooms = deque[float](maxlen=STALLED)
    yield bracket
    for _ in range(MOST):
        room = bracket.room
        if room <= tolerance or (len(rooms) == STALLED and room > 0.5 * rooms[0]):
            return
        rooms.append(room)
        guesses = guesses_of(corrector, bracket, share_of(bracket.rising, bracket.falling, bisect, room, tolerance))
        if corner:
            guesses = chain(bracket.chord.at_corner(_CORNER_MARGIN * tolerance), guesses)
        narrower = with_inside(corrector, event, bracket, guesses, corrector.exact)
        if narrower is None:
            return
        rises = narrower.high is bracket.high
        jumps = narrower.rising > _JUMPS * bracket.rising if rises else narrower.falling < _JUMPS * bracket.falling
        slow = narrower.room > 0.5 * room
        bracket = narrower
        yield bracket
        # secants approach a smooth maximum from one side; a slope that does not fall indicates a corner
        bisect, corner = not bisect and slow, jumps and not (corner and slow)


def with_inside(
    corrector: Corrector, event: BranchEvent, bracket: Bracket, guesses: Iterable[Guess], options: NewtonOptions
) -> Bracket | None:
    """The bracket narrowed by a solution between its ends; None where there is none close to any guess."""
    for guess, normal in guesses:
        step, _ = corrector.correct(guess.copy(), normal, event.kind, name=event.name, options=options)
        near = step is not None and corrector.near(step.state - guess, bracket.room)
        if step is not None and near and bracket.holds(step):
            value = float(event.function(step)) or TINY  # a plateau continues the slope before it
            return bracket.with_inside(step, value)
    return None


def guesses_of(corrector: Corrector, bracket: Bracket, share: float) -> Iterator[Guess]:
    """Guesses of solutions in a bracket, first at a ``share`` of it."""
    segment, chord = corrector.segment(bracket.low, bracket.high), bracket.chord
    yield segment.point(share), segment.derivative(share)
    for part in SHARES if chord.turns else SHARES[1:]:
        yield chord.beside(part, nearer=False)
        yield chord.beside(part, nearer=True)


class _Placed(NamedTuple):
    """A solution at a place of a segment, and the Newton tolerance it was found to."""

    u: float
    step: Step
    tolerance: float


class Maxima:
    """Solutions on the segment between two neighbours, and the sign changes and maxima that they bracket."""

    def __init__(self, corrector: Corrector, tolerance: float) -> None:
        self.corrector, self.tolerance = corrector, tolerance
        self._middles: dict[tuple[int, int], tuple[Step, Step, Known | None]] = {}
        self._orientations: tuple[int, int] = (0, 0)
        self._segment: HermiteSegment | None = None
        self._solutions: list[_Placed] = []
        self._exact: list[Step] = []

    def begin(self, first: Step, second: Step, segment: HermiteSegment) -> None:
        """Set the two neighbours and the segment between them."""
        self._middles.clear()
        self._solutions.clear()
        self._exact.clear()
        self._orientations, self._segment = (first.orientation, second.orientation), segment

    def elsewhere(self, step: Step) -> bool:
        """Whether a solution is on another branch, or on the way back of this one."""
        return not leads_on(step.orientation, *self._orientations)

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
        """A sign change close to that of the segment: by secants, else ``between`` solutions on both sides of it."""
        margin = at[1] - at[0]
        room = (max(0.0, at[0] - margin), min(1.0, at[1] + margin))
        expected = event.along is not None or event.maximum
        located = self.by_secants(event, segment, at, of, room) if expected and second[0].smooth else None
        if located is None and (margin < 1.0 or event.maximum):
            ends = ({0.0: first, 1.0: second}.get(u) or self.solved(event, segment, u) for u in room)
            located = between(event, room, *ends)
        return located

    def solved(
        self,
        event: BranchEvent,
        segment: HermiteSegment,
        u: float,
        options: NewtonOptions | None = None,
        guess: Array | None = None,
    ) -> tuple[Step, float] | None:
        """The solution on the plane across the segment at ``u``, expected there or at a ``guess``, and its function.

        With the ``exact`` options of the corrector unless others are given. A solution that is already known there
        serves the other events too: those of outputs in symmetric places have the same trials.
        """
        options, here = options or self.corrector.exact, segment is self._segment
        for known in self._solutions if here else ():
            if abs(known.u - u) <= _SAME_PLACE and known.tolerance <= options.tolerance:
                return known.step.named(event.kind, event.name), float(event.function(known.step))
        guess = segment.point(u) if guess is None else guess
        step, _ = self.corrector.correct(
            guess.copy(), segment.derivative(u), event.kind, name=event.name, options=options
        )
        if step is None or not self.corrector.near(step.state - guess, segment.length) or self.elsewhere(step):
            return None
        if here:
            self._solutions.append(_Placed(u, step, options.tolerance))
        if options is self.corrector.exact:
            self._exact.append(step)
        return step, float(event.function(step))

    def by_secants(self, event: BranchEvent, segment: HermiteSegment, at: Both, of: Both, room: Both) -> Located:
        """By secants from the expected sign change; None where they leave the ``room``, two places.

        They begin at solutions that were found for other events, where some are in the ``room``: the amplitudes of one
        mode have their peaks close to each other.
        """
        rate = (of[1] - of[0]) / (at[1] - at[0])
        u, last, own = at[0] - of[0] / rate, None, None
        closest = self._closest(event, rate, room) if segment is self._segment else []
        for _ in range(SECANTS):
            if closest:
                here, value = closest.pop()
            else:
                options = self.corrector.rough if last is None else self.corrector.exact
                solved = self.solved(
                    event, segment, u, options, None if last is None else self._guess(segment, last[0], u)
                )
                if solved is None:
                    return None
                here, value = _Placed(u, solved[0], options.tolerance), solved[1]
                if own is not None:
                    own.release()  # many outputs make many trials
                own = here.step
            if last is not None and here.u != last[0].u:
                slope = (value - last[1]) / (here.u - last[0].u)
                if slope * rate <= 0.0:
                    return None
                rate = slope
            last = here, value
            shift = -value / rate
            exact = here.tolerance <= self.corrector.exact.tolerance and abs(value) <= _JUMP * abs(of[1] - of[0])
            if exact and abs(shift) * segment.length < self.tolerance:
                return here.u, here.step.named(event.kind, event.name)
            u = here.u + shift
            if not closest and not room[0] <= u <= room[1]:
                return None
        return None

    def _closest(self, event: BranchEvent, rate: float, room: Both) -> list[tuple[_Placed, float]]:
        """The solution on the segment closest to a sign change, with its value, and the one next to it if the secant
        through both has the sign of the ``rate``."""
        known = [(one, float(event.function(one.step))) for one in self._solutions if room[0] <= one.u <= room[1]]
        closest = sorted(known, key=lambda one: abs(one[1]))[:2]
        if len(closest) == 2:
            (one, value), (other, far) = closest
            return closest if (other.u - one.u) * (far - value) * rate > 0.0 else closest[:1]
        return closest

    def _guess(self, segment: HermiteSegment, near: _Placed, u: float) -> Array:
        """The solution expected at ``u``, along the tangent of one on the segment."""
        along, weights = segment.derivative(near.u), self.corrector.metric.weights
        across = along * weights * weights
        tangent = near.step.tangent * (across.dot(along) / across.dot(near.step.tangent))
        return segment.point(u) + (near.step.state - segment.point(near.u)) + (u - near.u) * (tangent - along)

    def top(self, event: BranchEvent, places: Both, low: Known | None, high: Known | None) -> Located:
        """The extreme between two solutions, at ``places`` on the segment, that bracket one."""
        if low is None or high is None or not event.crossed(low[1], high[1]):
            return None
        bracket = self._known(event, places, low, high)
        if bracket.room > self.tolerance and (located := self._smooth_top(event, bracket)) is not None:
            return located
        narrow = self.narrowed(event, places, low, high)
        place, step = narrow.top(event.falling(low[1]), self.tolerance)
        if any(np.array_equal(step.state, end.state) for end, _ in (low, high)):  # it may be rough
            better, _ = self.corrector.correct(
                step.state.copy(), step.tangent, step.kind, name=step.name, options=self.corrector.exact
            )
            step = better or step
        return place, step

    def _smooth_top(self, event: BranchEvent, bracket: Bracket) -> Located:
        """The extreme in a bracket by secants; None where these do not lead to one, as at a corner.

        The function of the ``event`` falls.
        """
        if min(bracket.rising, -bracket.falling) <= TINY:
            return None
        segment, slopes = self.corrector.segment(bracket.low, bracket.high), (bracket.rising, bracket.falling)
        located = self.by_secants(event, segment, (0.0, 1.0), slopes, (0.0, 1.0))
        if located is None:
            return None
        return bracket.begin + located[0] * (bracket.end - bracket.begin), located[1].named(event.kind, event.name)

    def bottom(self, event: BranchEvent, bracket: Bracket, *, corner: bool = False) -> Located:
        """The minimum between two solutions as an ordinary point; None where it is one of them.

        The height falls from the first and rises to the second. Trials are where the slope vanishes by a secant. At a
        ``corner`` the slopes hardly change: trials are then where the tangents cross, from the end farther from it.
        """
        height, metric, falling = event.height, self.corrector.metric, event.falling(-1.0)
        assert height is not None
        least, found, now = min(height(bracket.low), height(bracket.high)), None, bracket
        best, known, bends, misses = least, [False, False], [0.0, 0.0], 0
        for _ in range(_MINIMUM_TRIALS):
            room, slopes, heights = now.room, (now.rising, -now.falling), (height(now.low), height(now.high))
            if room == 0.0:  # beside a large mean, neighbours may differ by less than rounding
                break
            down, up = (slope + bend * room for slope, bend in zip(slopes, bends, strict=True))
            lowest = min(heights) - fall(heights[0], down, heights[1], up, room)
            flat = min(slopes) * room <= _FLAT_BOTTOM * DIP * best
            if is_bottom(best, best - lowest if all(known) or flat else inf, least):
                break
            share = slopes[0] / sum(slopes) if lowest > -inf else 0.5
            beside, from_low = list[Guess](), True
            if corner and min(slopes) > TINY:
                way = crossing(heights[0], slopes[0], heights[1], slopes[1], room)
                part, from_low = max(1.0 - _CORNER_OFFSET * 2.0**misses, 0.5), way > 0.5 * room
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
        """The narrowed bracket of two solutions between which an event function changes its sign."""
        bracket, known = self._known(event, places, low, high), len(self._exact)
        for narrower in narrowing(self.corrector, event.falling(low[1]), bracket, self.tolerance):
            if narrower is not bracket:
                self._exact.append(narrower.high if narrower.low is bracket.low else narrower.low)
                bracket = narrower
        for step in self._exact[known:]:
            if step is not bracket.low and step is not bracket.high:
                step.release()
        return bracket

    def _known(self, event: BranchEvent, places: Both, low: Known, high: Known) -> Bracket:
        """The narrowest bracket by solutions that were found for other events: at a corner all have their extremes."""
        seen = event.falling(low[1])
        bracket = Bracket(self.corrector.metric, low[0], abs(low[1]), high[0], -abs(high[1]), *places)
        for step in self._exact:
            if bracket.holds(step):
                bracket = bracket.with_inside(step, float(seen.function(step)) or TINY)
        return bracket

    def maxima(
        self, event: BranchEvent, segment: HermiteSegment, crossed: list[tuple[Both, Both]], first: Known, second: Known
    ) -> list[Located]:
        """The maxima between two neighbours.

        They are expected where the slope of the segment falls through zero. An inaccurate segment is divided by
        solutions instead, until the slopes at these show all maxima.
        """
        located: list[Located] = []
        if second[0].smooth:
            located = [self.near(event, segment, *change, first, second, self.top) for change in crossed]
        if not any(located) and (event.crossed(first[1], second[1]) or not second[0].smooth):
            parts = self.parted(event, (0.0, 1.0), first, second)
            located = [self.top(event, *part) for part in parts]
        return self.apart(located)

    def parted(
        self, event: BranchEvent, places: Both, low: Known, high: Known, times: int = PARTINGS
    ) -> list[tuple[Both, Known, Known]]:
        """Parts of the branch between two solutions, with their places, over which the slope falls through zero."""
        if times and not self._plain(event, low, high):
            key = (id(low[0]), id(high[0]))
            if key not in self._middles:
                between = self.solved(event, self.corrector.segment(low[0], high[0]), 0.5, self.corrector.rough)
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
        """Whether the height differs little from a parabola between two solutions."""
        assert event.height is not None
        before, after = (slope / self.corrector.metric.length(step.tangent) for step, slope in (low, high))
        length = self.corrector.segment(low[0], high[0]).length
        return bool(is_plain(before, after, event.height(low[0]), event.height(high[0]), length))

    def apart(self, located: list[Located]) -> list[Located]:
        """Located points without duplicates: the brackets of neighbouring places overlap."""
        kept: list[Located] = []
        for one in located:
            if one is None or all(
                other is None or self.corrector.metric.length(one[1].state - other[1].state) > _SAME * self.tolerance
                for other in kept
            ):
                kept.append(one)
        return kept


def carried(values: list[float]) -> list[float]:
    """Slopes in which a zero has the sign of the one before it."""
    out = values[:1]
    for value in values[1:]:
        out.append(value or copysign(TINY, out[-1]))
    return out
