"""Roots from far away: where Newton's method diverges the homotopy ends at the root."""

import numpy as np
import pytest

from slipstick.solve.homotopy import homotopy
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation, newton


def saturation(x):
    return Evaluation(np.arctan(x), DenseJacobian(np.diag(1.0 / (1.0 + x * x))))


@pytest.mark.parametrize("start", [3.0, 50.0, -400.0])
def test_far_from_a_saturated_root(start):
    found = homotopy(saturation, [start], scale=abs(start))
    assert found.converged
    assert found.x[0] == pytest.approx(0.0, abs=1e-8)


def test_round_turning_points():
    """A cubic with two extremes between the guess and its only root."""

    def cubic(x):
        return Evaluation(x**3 - 3.0 * x + 10.0, DenseJacobian(np.diag(3.0 * x * x - 3.0)))

    found = homotopy(cubic, [4.0], scale=4.0)
    assert found.converged
    assert found.x[0] ** 3 - 3.0 * found.x[0] + 10.0 == pytest.approx(0.0, abs=1e-8)
    assert found.evaluations > newton(cubic, np.array([-3.0])).evaluations
