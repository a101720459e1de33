"""The guess for the next point of a branch, clipped to the range that is followed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.continuation.step import Step
from slipstick.typing import Array

_STRAIGHT = 0.7


@dataclass(frozen=True)
class Span:
    """The range of the parameter, in the order in which it is followed."""

    start: float
    stop: float

    def passed(self, parameter: float) -> float | None:
        """The end which ``parameter`` lies beyond, or on."""
        forward = 1.0 if self.stop > self.start else -1.0
        if (parameter - self.stop) * forward >= 0:
            return self.stop
        if (parameter - self.start) * forward <= 0:
            return self.start
        return None


class Prediction(NamedTuple):
    """A guess (N + 1,) and the direction of the branch there; ``at_end``: its parameter is an end of the range."""

    guess: Array
    direction: Array
    at_end: bool


def predict(metric: Metric, span: Span, last: Step, segment: HermiteSegment | None, length: float) -> Prediction:
    """``length`` ahead of ``last``: along the cubic ``segment`` that ends there, or along the tangent."""
    ratio = metric.length(last.tangent)
    if segment is None:
        direction = last.tangent / ratio
        guess = last.state + length * direction
    else:
        u = 1.0 + length / (ratio * segment.length)
        guess, direction = segment.point(u), segment.derivative(u)
        if metric.cosine(direction, last.tangent) < _STRAIGHT:
            return predict(metric, span, last, None, length)
    end = span.passed(guess[-1])
    if end is None:
        return Prediction(guess, direction, False)
    share = (end - last.state[-1]) / (guess[-1] - last.state[-1])
    guess = last.state + share * (guess - last.state) if segment is None else segment.point(segment.where(end, 1.0, u))
    guess[-1] = end
    return Prediction(guess, direction, True)
