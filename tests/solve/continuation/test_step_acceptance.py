"""What is said of two neighbouring points: from the points and their tangents alone."""

import numpy as np
import pytest

from slipstick.solve.continuation.metric import ArclengthScaling, Metric
from slipstick.solve.continuation.step_control import is_kink

N = 6


@pytest.mark.parametrize("seed", range(5))
def test_two_points_on_the_sides_of_one_corner_are_told_from_points_of_two_branches(seed):
    """The way from one to the other is a sum of positive multiples of both tangents, and of nothing else."""
    rng = np.random.default_rng(seed)
    metric = Metric(ArclengthScaling(x=1.0, adaptive=False, weight=1.0), np.ones(N), 1.0)
    a = rng.standard_normal(N + 1)
    b = a + 0.6 * rng.standard_normal(N + 1)
    aside = rng.standard_normal(N + 1)
    aside -= np.column_stack([a, b]) @ np.linalg.lstsq(np.column_stack([a, b]), aside, rcond=None)[0]
    state = rng.standard_normal(N + 1)

    def kink(chord):
        return is_kink(metric, (state, a), (state + chord, b))

    assert kink(0.3 * a + 0.7 * b)
    assert not kink(-0.3 * a + 0.7 * b)
    assert not kink(0.3 * a - 0.7 * b)
    assert not kink(0.3 * a + 0.7 * b + 0.3 * aside)


def test_among_few_unknowns_no_corner_is_told():
    metric = Metric(ArclengthScaling(x=1.0, adaptive=False, weight=1.0), np.ones(3), 1.0)
    a, b = np.array([1.0, 0.0, 0.0, 1.0]), np.array([1.0, 0.5, 0.0, 1.0])
    assert not is_kink(metric, (0.0 * a, a), (a + b, b))
