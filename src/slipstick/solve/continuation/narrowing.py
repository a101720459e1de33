"""Extremes and roots between two solved points of a branch, on both sides of a corner where there is one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.continuation.step import Step
from slipstick.solve.newton import NewtonOptions
from slipstick.solve.norm import norm
from slipstick.typing import Array

_TINY = float(np.finfo(float).tiny)
_MOST = 100
_SHARES = (0.95, 0.5, 0.125, 0.03, 0.008, 0.002)
"""Parts of the way to a corner, and of a bracket (but the first), by which steps from an end are tried."""
_KNOWN = 1e-6
"""Part of a height to which it must be known, however narrow the bracket is."""
_ENOUGH = 100.0
"""Tolerances to which a turning point must be known where no nearer solution is found."""
_REVERSED = 1e-12
"""Square of the sine of an angle below which two tangents are on one line."""

Guess = tuple[Array, Array]
"""Where a solution may be, and the direction of the branch there."""


@dataclass(frozen=True)
class Bracket:
    """Two solutions, the event function positive at the first and not at the second: an extreme or a root is between.

    ``begin`` and ``end`` are their places on a segment.
    """

    low: Step
    rising: float
    high: Step
    falling: float
    begin: float
    end: float

    def _scaled(self, metric: Metric) -> tuple[Array, Array, Array]:
        """Unit tangents at both ends, and the chord."""
        a, b = self.low.tangent * metric.weights, self.high.tangent * metric.weights
        return a / norm(a), b / norm(b), (self.high.state - self.low.state) * metric.weights

    def ways(self, metric: Metric) -> tuple[float, float] | None:
        """Where the branch turns by more than a right angle: ways from both ends to where their tangents meet."""
        a, b, chord = self._scaled(metric)
        g, p, q = float(a.dot(b)), float(a.dot(chord)), float(b.dot(chord))
        if g >= 0.0 or 1.0 - g * g < _REVERSED:
            return None
        return abs(p - g * q) / (1.0 - g * g), abs(q - g * p) / (1.0 - g * g)

    def room(self, metric: Metric) -> float:
        """Length of the branch between them: their distance, or more where it turns back."""
        return max(metric.length(self.high.state - self.low.state), sum(self.ways(metric) or (0.0,)))

    def part(self, step: Step, metric: Metric) -> float:
        """How far along the branch a solution between the ends is: larger the further."""
        w, (a, b, chord), ways = metric.weights, self._scaled(metric), self.ways(metric)
        after, before = (step.state - self.low.state) * w, (self.high.state - step.state) * w
        if ways is None:
            return float(after.dot(chord))
        tangent = step.tangent * w
        if tangent.dot(a) > tangent.dot(b):
            return float(after.dot(a)) - ways[0]
        return ways[1] - float(before.dot(b))

    def with_inside(self, step: Step, value: float, metric: Metric) -> Bracket:
        """The part of it that a solution between its ends leaves."""
        before, after = metric.length(step.state - self.low.state), metric.length(self.high.state - step.state)
        place = self.begin + (self.end - self.begin) * before / (before + after)
        if value > 0.0:
            return replace(self, low=step, rising=value, begin=place)
        return replace(self, high=step, falling=value, end=place)

    def holds(self, step: Step, metric: Metric) -> bool:
        """Whether a solution lies between its ends, and on this branch."""
        ends = self.low.orientation, self.high.orientation
        if all(step.orientation * orientation < 0 for orientation in ends):
            return False
        room = self.room(metric)
        return all(0.0 < metric.length(step.state - end.state) < room for end in (self.low, self.high))

    def top(self, event: BranchEvent, metric: Metric, tolerance: float) -> tuple[float, Step]:
        """The place and the solution of its higher end; of kind "near ..." where the extreme may be higher."""
        assert event.height is not None
        ends = [(event.height(step), place, step) for step, place in ((self.low, self.begin), (self.high, self.end))]
        height, place, step = max(ends, key=lambda end: end[0])
        room = self.room(metric)
        if event.maximum:
            known = room <= tolerance or max(self.rising, -self.falling) * room <= _KNOWN * height
        else:
            known = room <= _ENOUGH * tolerance
        return place, step.named(event.kind if known else f"near {event.kind}", event.name)

    def root(self, event: BranchEvent, metric: Metric, tolerance: float) -> tuple[float, Step] | None:
        """The place and the solution of the end with the smaller value; None where that is not good enough."""
        if event.exact and self.room(metric) > tolerance:
            return None
        place, step = (self.begin, self.low) if self.rising < -self.falling else (self.end, self.high)
        return place, step.named(event.kind, event.name)


def narrowed(corrector: Corrector, event: BranchEvent, bracket: Bracket, tolerance: float) -> Bracket:
    """The last of ``narrowing``."""
    *_, last = narrowing(corrector, event, bracket, tolerance)
    return last


def narrowing(corrector: Corrector, event: BranchEvent, bracket: Bracket, tolerance: float) -> Iterator[Bracket]:
    """The bracket, then narrower ones, to the scaled ``tolerance`` if there are solutions between the ends.

    Every trial lies on a cubic between the present ends: each is nearer to the branch than the one before, on both
    sides of a corner. Where no solution is near it, shorter and shorter steps are taken from the ends.
    """
    metric = corrector.metric
    room, before, bisect = bracket.room(metric), float("inf"), False
    yield bracket
    for _ in range(_MOST):
        if room <= tolerance:
            return
        share = 0.5 if bisect else bracket.rising / (bracket.rising - bracket.falling)
        edge = min(0.5, 0.5 * tolerance / room)
        guesses = guesses_of(corrector, bracket, min(max(share, edge), 1.0 - edge))
        narrower = with_inside(corrector, event, bracket, guesses, corrector.exact)
        if narrower is None:
            return
        bracket = narrower
        yield bracket
        before, room = room, bracket.room(metric)
        # secants approach a smooth maximum from one side; a second slow one in a row is a corner
        bisect = not bisect and room > 0.5 * before


def with_inside(
    corrector: Corrector, event: BranchEvent, bracket: Bracket, guesses: Iterable[Guess], options: NewtonOptions
) -> Bracket | None:
    """The part of a bracket that a solution between its ends leaves; None where there is none near any guess."""
    room = bracket.room(corrector.metric)
    for guess, normal in guesses:
        step, _ = corrector.correct(guess.copy(), normal, event.kind, name=event.name, options=options)
        near = step is not None and corrector.near(step.state - guess, room)
        if step is not None and near and bracket.holds(step, corrector.metric):
            value = float(event.function(step)) or _TINY  # a plateau goes on as what comes before
            return bracket.with_inside(step, value, corrector.metric)
    return None


def guesses_of(corrector: Corrector, bracket: Bracket, share: float) -> Iterator[Guess]:
    """Where solutions may be, at a ``share`` of a bracket first."""
    low, high, metric = bracket.low, bracket.high, corrector.metric
    segment, ways = corrector.segment(low, high), bracket.ways(metric)
    yield segment.point(share), segment.derivative(share)
    gap = metric.length(high.state - low.state)
    ends = [(low, ways[0] if ways else gap), (high, -ways[1] if ways else -gap)]
    if abs(ends[1][1]) > abs(ends[0][1]):
        ends.reverse()
    for part in _SHARES if ways else _SHARES[1:]:
        for end, way in ends:
            unit = end.tangent / metric.length(end.tangent)
            yield end.state + part * way * unit, unit
