"""Guesses ahead, and the ends of a range in both directions."""

from types import SimpleNamespace

import numpy as np
import pytest

from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import ArclengthScaling, Metric
from slipstick.solve.continuation.step_control import Span, predict


@pytest.mark.parametrize(("start", "stop"), [(1.0, 5.0), (5.0, 1.0)])
def test_ends_of_a_range(start, stop):
    span = Span(start, stop)
    assert span.passed(3.0) is None
    for value in (1.0, 0.5):
        assert span.passed(value) == 1.0
    for value in (5.0, 6.0):
        assert span.passed(value) == 5.0


def test_along_the_tangent_and_no_further_than_the_end():
    metric = Metric(ArclengthScaling(x=1.0, adaptive=False, weight=1.0), np.ones(1), 1.0)
    last = SimpleNamespace(state=np.array([0.0, 1.0]), tangent=np.array([3.0, 4.0]))
    found = predict(metric, Span(0.0, 10.0), last, None, 0.5)
    np.testing.assert_allclose(found.guess, [0.3, 1.4])
    assert not found.at_end
    found = predict(metric, Span(0.0, 1.2), last, None, 0.5)
    np.testing.assert_allclose(found.guess, [0.15, 1.2])
    assert found.at_end


def test_along_the_cubic():
    """Points of a parabola: the cubic through two of them is the parabola."""
    curve, slope = (lambda t: np.array([t * t, t])), (lambda t: np.array([2 * t, 1.0]))
    metric = Metric(ArclengthScaling(x=1.0, adaptive=False, weight=1.0), np.ones(1), 1.0)
    segment = HermiteSegment(curve(0.0), slope(0.0), curve(0.2), slope(0.2), 0.2)
    last = SimpleNamespace(state=curve(0.2), tangent=slope(0.2))
    found = predict(metric, Span(0.0, 10.0), last, segment, 0.1)
    np.testing.assert_allclose(found.guess, curve(found.guess[-1]), atol=1e-13)
    found = predict(metric, Span(0.0, 0.25), last, segment, 0.1)
    np.testing.assert_allclose(found.guess, curve(0.25), atol=1e-12)
    assert found.at_end
