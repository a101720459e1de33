"""Arclength: what counts as one, for solutions of any size and in any units."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.solve.continuation.metric import ArclengthScaling, Metric

X = np.array([3.0, 4.0])


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e9])
def test_lengths_do_not_depend_on_the_unit_of_the_unknowns(unit):
    one, other = Metric(ArclengthScaling(x=2.0), X, 10.0), Metric(ArclengthScaling(x=2.0 * unit), unit * X, 10.0)
    z = np.array([0.1, -0.2, 3.0])
    scaled = z * [unit, unit, 1.0]
    assert other.length(scaled) == pytest.approx(one.length(z))
    ahead = np.array([1.0, 0.0, 1.0])
    assert other.cosine(scaled, ahead * [unit, unit, 1.0]) == pytest.approx(one.cosine(z, ahead))


def test_what_counts_as_one():
    """The range of the parameter; the solution's own size counts as the weight."""
    metric = Metric(ArclengthScaling(weight=0.1), X, 10.0)
    assert metric.length(np.array([0.0, 0.0, 10.0])) == pytest.approx(1.0)
    assert metric.length(np.array([*X, 0.0])) == pytest.approx(0.1)
    metric = metric.renewed(100.0 * X)
    assert metric.length(np.array([*(100.0 * X), 0.0])) == pytest.approx(0.1)
    fixed = Metric(ArclengthScaling(x=1.0, adaptive=False, weight=1.0), X, 10.0)
    fixed = fixed.renewed(100.0 * X)
    assert fixed.length(np.array([*X, 0.0])) == pytest.approx(5.0)


def test_a_metric_is_a_value_and_brought_back_by_its_measure():
    metric = Metric(ArclengthScaling(), X, 10.0)
    weights = metric.weights.copy()
    renewed = metric.renewed(50.0 * X)
    assert not np.array_equal(renewed.weights, weights)
    np.testing.assert_array_equal(metric.weights, weights)
    np.testing.assert_array_equal(renewed.measuring(metric.measure).weights, weights)


@pytest.mark.parametrize("given", [{"x": 0.0}, {"x": [1.0, -1.0]}, {"parameter": np.inf}, {"floor": 0}, {"weight": -1}])
def test_what_is_no_size(given):
    with pytest.raises(InputError, match="expected positive finite numbers"):
        ArclengthScaling(**given)


def test_corrections_of_what_varies_beside_a_large_constant_part():
    """They are measured by their own size, a hundredfold; those of an ordinary solution by its whole size."""
    scaling = ArclengthScaling(rows=2, judged=np.array([False, True, True]))
    x = np.array([3e9, 3.0, 0.0, 4e9, 0.0, 4.0])
    inverse = Metric(scaling, x, 10.0).inverse
    np.testing.assert_allclose(1.0 / inverse[[0, 3]], 5e9)
    np.testing.assert_allclose(1.0 / inverse[[1, 2, 4, 5]], 500.0)
    few = Metric(scaling, x * [1e-9, 1.0, 1.0, 1e-9, 1.0, 1.0], 10.0).inverse
    np.testing.assert_array_equal(few[:-1], few[0])
    none = Metric(scaling, x * [1.0, 0.0, 0.0, 1.0, 0.0, 0.0], 10.0).inverse
    np.testing.assert_allclose(1.0 / none[1], 50.0)  # no less than rounding
