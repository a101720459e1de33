"""The fraction of a correction that is taken: whole where it helps, less where it overshoots, none where none helps."""

import numpy as np
import pytest

from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation, NewtonOptions, newton


def scalar(f, slope):
    return lambda x: Evaluation(np.array([f(x[0])]), DenseJacobian(np.array([[slope(x[0])]])))


@pytest.mark.parametrize("start", [1.0, 2.0, 20.0])
def test_an_overshooting_correction_is_shortened(start):
    """Newton's method alone diverges from the root of arctan beyond 1.39."""
    found = newton(scalar(np.arctan, lambda x: 1 / (1 + x * x)), np.array([start]))
    assert found.converged
    assert abs(found.x[0]) < 1e-9


def test_a_whole_correction_is_taken_where_it_helps():
    """Quadratic convergence: few evaluations, none wasted on fractions."""
    found = newton(scalar(lambda x: x * x - 2.0, lambda x: 2 * x), np.array([1.5]))
    assert found.converged
    assert found.x[0] == pytest.approx(np.sqrt(2.0))
    assert found.evaluations <= found.iterations + 1


def test_without_a_root_it_ends_with_a_reason():
    options = NewtonOptions(non_monotone=0)
    found = newton(scalar(lambda x: x * x + 1.0, lambda x: 2 * x), np.array([0.5]), options=options)
    assert not found.converged
    assert found.reason.text
