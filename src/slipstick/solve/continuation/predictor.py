"""The guess for the next point of a branch, clipped to the range that is followed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import Marks, Metric, Scalars, column
from slipstick.solve.continuation.step import Step
from slipstick.typing import Array

_STRAIGHT = 0.7
"""Cosine between the tangent and the cubic ahead, below which the cubic is not trusted: it has turned by 45 degrees."""


@dataclass(frozen=True)
class Span:
    """The range of the parameter, in the order in which it is followed; values are floats, or (k,) of k states."""

    start: float
    stop: float

    def beyond(self, parameter: Scalars) -> Marks:
        """Whether ``parameter`` lies beyond ``stop``, or on it."""
        return (parameter - self.stop) * (self.stop - self.start) >= 0.0

    def behind(self, parameter: Scalars) -> Marks:
        """Whether ``parameter`` lies behind ``start``, or on it."""
        return (parameter - self.start) * (self.stop - self.start) <= 0.0

    def outside(self, parameter: Scalars) -> Marks:
        """Whether ``parameter`` lies outside of the range, or on an end."""
        return (parameter - self.start) * (parameter - self.stop) >= 0.0

    def passed(self, parameter: float) -> float | None:
        """The end which one ``parameter`` lies beyond, or on."""
        if self.beyond(parameter):
            return self.stop
        return self.start if self.behind(parameter) else None


class Prediction(NamedTuple):
    """A guess (N + 1,) and the direction of the branch there; ``at_end``: its parameter is an end of the range."""

    guess: Array
    direction: Array
    at_end: bool


def along_tangent(metric: Metric, state: Array, tangent: Array, length: Scalars) -> tuple[Array, Array]:
    """Guess and direction (..., N + 1) at an arc ``length`` along the tangent."""
    direction = tangent / column(metric.length(tangent))
    return state + column(length) * direction, direction


def place_ahead(metric: Metric, segment: HermiteSegment, tangent: Array, length: Scalars) -> Scalars:
    """Place ``u`` at an arc ``length`` beyond the second end of a segment, which has that tangent."""
    return 1.0 + length / (metric.length(tangent) * segment.length)


def goes_on(metric: Metric, direction: Array, tangent: Array) -> Marks:
    """Whether the cubic ahead goes on in the direction of the tangent."""
    return metric.cosine(direction, tangent) >= _STRAIGHT


def shortened(state: Array, guess: Array, end: float) -> Array:
    """The place (..., N + 1) on the line from a state to a guess where the parameter is ``end``."""
    way = guess - state
    return state + column((end - state[..., -1]) / way[..., -1]) * way


def predict(metric: Metric, span: Span, last: Step, segment: HermiteSegment | None, length: float) -> Prediction:
    """Predict the point ``length`` ahead of ``last``, along the ``segment`` that ends there or else the tangent."""
    if segment is None:
        guess, direction = along_tangent(metric, last.state, last.tangent, length)
    else:
        u = place_ahead(metric, segment, last.tangent, length)
        guess, direction = segment.point(u), segment.derivative(u)
        if not goes_on(metric, direction, last.tangent):
            return predict(metric, span, last, None, length)
    end = span.passed(guess[-1])
    if end is None:
        return Prediction(guess, direction, False)
    guess = shortened(last.state, guess, end) if segment is None else segment.point(segment.where(end, 1.0, u))
    guess[-1] = end
    return Prediction(guess, direction, True)
