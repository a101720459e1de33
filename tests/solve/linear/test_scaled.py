from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.scaled import Scaled


def test_it_is_the_matrix_with_scaled_rows_and_columns():
    rng = np.random.default_rng(5)
    J, s = rng.standard_normal((6, 6)), np.exp(rng.standard_normal(6))
    scaled, written = Scaled(DenseJacobian(J), s), J * s / s[:, None]
    for x in (rng.standard_normal(6), rng.standard_normal((6, 2))):
        assert scaled.multiply(x) == pytest.approx(written @ x)
        assert scaled.multiply(x, transposed=True) == pytest.approx(written.T @ x)
        assert scaled.solve(x) == pytest.approx(np.linalg.solve(written, x))
        assert scaled.solve(x, transposed=True) == pytest.approx(np.linalg.solve(written.T, x))
    assert scaled.sign() == np.sign(np.linalg.det(written))
    assert scaled.size == 6
    assert not scaled.singular
    x = rng.standard_normal(6)
    assert np.all(scaled.bound(x) >= np.abs(written) @ np.abs(x) * (1.0 - 1e-12))
    column, row = rng.standard_normal(6), rng.standard_normal(7)
    bordered = np.vstack([np.column_stack([written, column]), row])
    assert scaled.bordered(column, row).solve(row) == pytest.approx(np.linalg.solve(bordered, row))
