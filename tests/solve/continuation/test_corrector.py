"""The corrector's own judgement of two neighbouring points."""

from types import SimpleNamespace

import numpy as np
import pytest

from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.metric import ArclengthScaling, Metric
from slipstick.solve.newton import NewtonOptions

N = 6


@pytest.mark.parametrize("seed", range(5))
def test_two_points_on_the_sides_of_one_corner_are_told_from_points_of_two_branches(seed):
    """The way from one to the other is a sum of positive multiples of both tangents, and of nothing else."""
    rng = np.random.default_rng(seed)
    metric = Metric(ArclengthScaling(x=1.0, adaptive=False, weight=1.0), np.ones(N), 1.0)
    corrector = Corrector(None, N, metric, NewtonOptions())
    a = rng.standard_normal(N + 1)
    b = a + 0.6 * rng.standard_normal(N + 1)
    aside = rng.standard_normal(N + 1)
    aside -= np.column_stack([a, b]) @ np.linalg.lstsq(np.column_stack([a, b]), aside, rcond=None)[0]
    first = SimpleNamespace(state=rng.standard_normal(N + 1), tangent=a)

    def kink(chord):
        return corrector.is_kink(first, SimpleNamespace(state=first.state + chord, tangent=b))

    assert kink(0.3 * a + 0.7 * b)
    assert not kink(-0.3 * a + 0.7 * b)
    assert not kink(0.3 * a - 0.7 * b)
    assert not kink(0.3 * a + 0.7 * b + 0.3 * aside)
