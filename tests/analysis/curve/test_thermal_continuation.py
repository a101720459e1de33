"""Temperatures carried from point to point; residuals over the size of their own terms."""

from types import SimpleNamespace

import numpy as np
import pytest

from slipstick.analysis.curve.thermal_continuation import relative_residual
from slipstick.solve.norm import norm


def step(residual, x, terms):
    residual, x = np.asarray(residual), np.asarray(x)
    value = SimpleNamespace(residual=residual, terms=lambda: np.asarray(terms))
    return SimpleNamespace(evaluation=value, x=x, residual_norm=norm(residual))


def test_a_residual_is_over_the_size_of_its_terms():
    assert relative_residual(step([1e-3, 0.0], [1.0, 1.0], [10.0, 1.0])) == pytest.approx(1e-4)
    assert relative_residual(step([1e-3, 2e-3], [1.0, 0.0], [1.0, 1.0])) == pytest.approx(np.hypot(1e-3, 2e-3))


def test_rounding_of_the_motion_is_an_upper_bound():
    assert relative_residual(step([1e-12, 0.0], [2.0, 0.0], [0.0, 0.0])) == pytest.approx(5e-13)
    assert relative_residual(step([0.0], [0.0], [0.0])) == 0.0
