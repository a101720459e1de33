"""The norm is numpy's, and infinite for what is no vector of numbers."""

import numpy as np
import pytest

from slipstick.solve.norm import norm


def test_norm():
    x = np.random.default_rng(0).normal(size=50)
    assert norm(x) == pytest.approx(np.linalg.norm(x), rel=1e-15)
    assert norm(np.array([])) == 0.0
    for bad in (np.nan, np.inf, -np.inf):
        assert norm(np.array([1.0, bad])) == np.inf
