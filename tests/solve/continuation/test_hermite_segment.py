"""The cubic between two points: exact for cubics, of fourth order on others."""

import numpy as np
import pytest

from slipstick.solve.continuation.hermite_segment import HermiteSegment


def segment(curve, slope, a, b):
    return HermiteSegment(curve(a), slope(a), curve(b), slope(b), b - a)


def test_a_cubic_is_itself_also_beyond_its_ends():
    c = np.random.default_rng(0).normal(size=(4, 3))
    curve = lambda t: np.array([1, t, t**2, t**3]) @ c  # noqa: E731
    slope = lambda t: np.array([0, 1, 2 * t, 3 * t**2]) @ c  # noqa: E731
    found = segment(curve, slope, 0.5, 2.0)
    for u in (-0.5, 0.0, 0.3, 1.0, 1.7):
        t = 0.5 + 1.5 * u
        np.testing.assert_allclose(found.point(u), curve(t), atol=1e-12)
        np.testing.assert_allclose(found.derivative(u), 1.5 * slope(t), atol=1e-12)
        assert found.parameter(u) == pytest.approx(curve(t)[-1])


def test_prediction_is_of_fourth_order():
    curve, slope = (lambda t: np.array([np.cos(t), np.sin(t)])), (lambda t: np.array([-np.sin(t), np.cos(t)]))
    errors = [np.linalg.norm(segment(curve, slope, 0.0, h).point(2.0) - curve(2 * h)) for h in (0.1, 0.05)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.1)


def test_where_the_parameter_is_passed():
    curve, slope = (lambda t: np.array([0.0, np.exp(-t)])), (lambda t: np.array([0.0, -np.exp(-t)]))
    found = segment(curve, slope, 0.0, 0.2)
    u = found.where(0.9, 0.0, 1.0)
    assert found.parameter(u) == pytest.approx(0.9, abs=1e-14)
