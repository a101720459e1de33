"""The norm is numpy's, and infinite for what is no vector of numbers."""

import numpy as np
import pytest

from slipstick.solve.norm import norm, relative


def test_norm():
    x = np.random.default_rng(0).normal(size=50)
    assert norm(x) == pytest.approx(np.linalg.norm(x), rel=1e-15)
    assert norm(np.array([])) == 0.0
    for bad in (np.nan, np.inf, -np.inf):
        assert norm(np.array([1.0, bad])) == np.inf


def test_a_relative_residual_leaves_entries_without_terms_as_they_are():
    assert relative(np.array([3.0, 8.0, 0.0]), np.array([1.0, 2.0, 0.0])) == 5.0
    assert relative(np.array([3.0, 4.0]), np.zeros(2)) == 5.0
