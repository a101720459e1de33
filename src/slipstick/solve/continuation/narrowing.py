"""A maximum between two solved points of a branch: where its slope passes zero, or jumps through it at a corner."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.continuation.step import Step
from slipstick.typing import Array

_TINY = float(np.finfo(float).tiny)
_MOST = 100
_SHORTEN = 4.0
_SHORTEST = 1e-3
"""Part of a bracket below which a step from one of its ends is not tried any more."""
_KNOWN = 1e-6
"""Part of a height to which it must be known, however narrow the bracket is."""


@dataclass(frozen=True)
class Bracket:
    """Two solutions, the slope positive at the first and not at the second: a maximum is between them.

    ``begin`` and ``end`` are their places on an arc.
    """

    low: Step
    rising: float
    high: Step
    falling: float
    begin: float
    end: float

    def with_inside(self, step: Step, slope: float, metric: Metric) -> Bracket:
        """The part of it that a solution between its ends leaves."""
        before, after = metric.length(step.state - self.low.state), metric.length(self.high.state - step.state)
        place = self.begin + (self.end - self.begin) * before / (before + after)
        if slope > 0.0:
            return replace(self, low=step, rising=slope, begin=place)
        return replace(self, high=step, falling=slope, end=place)

    def top(self, event: BranchEvent, metric: Metric, tolerance: float) -> tuple[float, Step]:
        """The place and the solution of its higher end; of kind "near ..." where the maximum may be higher."""
        assert event.height is not None
        ends = [(event.height(step), place, step) for step, place in ((self.low, self.begin), (self.high, self.end))]
        height, place, step = max(ends, key=lambda end: end[0])
        gap = metric.length(self.high.state - self.low.state)
        known = gap <= tolerance or max(self.rising, -self.falling) * gap <= _KNOWN * height
        return place, step.named(event.kind if known else f"near {event.kind}", event.name)


def narrowed(corrector: Corrector, event: BranchEvent, bracket: Bracket, tolerance: float) -> Bracket:
    """The bracket around a maximum, narrower than the scaled ``tolerance`` if there are solutions between its ends.

    Every trial lies on a cubic between the present ends: each is nearer to the branch than the one before, on both
    sides of a corner. Where no solution is near it, shorter and shorter steps are taken from the ends.
    """
    metric = corrector.metric
    gap, before, bisect = metric.length(bracket.high.state - bracket.low.state), float("inf"), False
    for _ in range(_MOST):
        if gap <= tolerance:
            break
        share = 0.5 if bisect else bracket.rising / (bracket.rising - bracket.falling)
        edge = min(0.5, 0.5 * tolerance / gap)
        inside = _inside(corrector, event, bracket, min(max(share, edge), 1.0 - edge), gap)
        if inside is None:
            break
        value = float(event.function(inside)) or _TINY  # a plateau goes on as what comes before
        bracket = bracket.with_inside(inside, value, metric)
        before, gap = gap, metric.length(bracket.high.state - bracket.low.state)
        # secants approach a smooth maximum from one side; a second slow one in a row is a corner
        bisect = not bisect and gap > 0.5 * before
    return bracket


def _inside(corrector: Corrector, event: BranchEvent, bracket: Bracket, share: float, gap: float) -> Step | None:
    """A solution between the ends of a bracket that is ``gap`` wide."""
    length = corrector.metric.length
    for guess, normal in _guesses(corrector, bracket, share, gap):
        step, _ = corrector.correct(guess.copy(), normal, event.kind, name=event.name, options=corrector.exact)
        if step is None or not corrector.near(step.state - guess, gap):
            continue
        if 0.0 < length(step.state - bracket.low.state) < gap and 0.0 < length(bracket.high.state - step.state) < gap:
            return step
    return None


def _guesses(corrector: Corrector, bracket: Bracket, share: float, gap: float) -> Iterator[tuple[Array, Array]]:
    """Where solutions may be, and the direction of the branch there."""
    low, high = bracket.low, bracket.high
    arc = corrector.arc(low, high)
    yield arc.point(share), arc.derivative(share)
    length = 0.5 * gap
    while length > _SHORTEST * gap:
        for end, side in ((low, 1.0), (high, -1.0)):
            unit = end.tangent / corrector.metric.length(end.tangent)
            yield end.state + side * length * unit, unit
        length /= _SHORTEN
