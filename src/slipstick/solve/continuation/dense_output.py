"""The branch between corrected points: the cubic through them, halved by another where it is not good enough."""

from __future__ import annotations

from functools import lru_cache
from math import ceil

import numpy as np

from slipstick.solve.continuation.arc import Arc, ArcPlaces
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.predictor import Span
from slipstick.solve.continuation.step import Step
from slipstick.solve.norm import norm
from slipstick.typing import Array

_LONGER = 1.1
"""Arcs are a little longer than the steps that were taken along them."""


class DenseOutput:
    """Points so near to each other that a line through them looks smooth.

    Parameters
    ----------
    step
        Scaled arclength between two of them.
    tolerance
        Largest error of an interpolated solution over its size: measured in the middle of each arc, where the error of
        a cubic between two points is largest, by one Newton correction. Where another cubic that is as good at one end
        is that near in the middle, nothing is measured: a kink anywhere between would have parted them.
    """

    def __init__(self, corrector: Corrector, span: Span, step: float, tolerance: float) -> None:
        self._corrector, self._span, self._step, self._tolerance = corrector, span, _LONGER * step, tolerance

    def halves(self, first: Step, second: Step, apart: float) -> list[Step]:
        """Corrected points between two neighbours, so that the cubics meet the tolerance; both ends left out.

        ``apart`` is the distance of the cubic from another one in the middle, see ``Corrector.apart``.
        """
        corrector, arc = self._corrector, self._corrector.arc(first, second)
        second.smooth = apart <= self._tolerance
        if second.smooth or arc.length <= self._step:
            return []
        guess, direction, half = arc.point(0.5), arc.derivative(0.5), 0.5 * arc.length
        middle = self._middle(arc, guess, direction, second)
        if middle is None or middle.orientation * first.orientation < 0:
            return []
        middle.arclength = first.arclength + corrector.metric.length(middle.state - first.state)
        before, after = (corrector.apart(middle, guess, direction, way) for way in (half, -half))
        return [*self.halves(first, middle, before), middle, *self.halves(middle, second, after)]

    def _middle(self, arc: Arc, guess: Array, direction: Array, second: Step) -> Step | None:
        """The corrected point in the middle, where the arc turns out not to be near enough."""
        corrector = self._corrector
        off = corrector.off(guess, second)
        if off is None:
            return None
        second.smooth = norm(off * corrector.metric.judging(second.state)) <= self._tolerance
        if second.smooth:
            return None
        middle, _ = corrector.correct(guess - off if corrector.near(off, arc.length) else guess, direction, "regular")
        if middle is None or not corrector.near(middle.state - guess, arc.length):
            return None
        return None if self._span.passed(middle.parameter) is not None else middle

    def points(self, first: Step, second: Step) -> list[Step]:
        """Interpolated points between two neighbours, whose cubic has met the tolerance."""
        arc, metric = self._corrector.arc(first, second), self._corrector.metric
        count = ceil(arc.length / self._step)
        if count < 2:
            return []
        places = _evenly(count)
        states, slopes = arc.points(places), arc.derivatives(places)
        tangents = slopes / metric.lengths(slopes)[:, None]
        ways = (first.arclength + metric.lengths(states - first.state)).tolist()
        return [
            Step.interpolated(state, tangent, (first, second, arc, at), way)
            for state, tangent, at, way in zip(states, tangents, places.u.tolist(), ways, strict=True)
            if self._span.passed(state[-1]) is None
        ]


@lru_cache(maxsize=64)
def _evenly(count: int) -> ArcPlaces:
    """Places that part an arc into ``count`` pieces."""
    return ArcPlaces(np.arange(1, count) / count)
