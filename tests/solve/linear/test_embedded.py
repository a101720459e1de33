"""Unknowns held at zero change nothing of the others; the whole matrix is what it says."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.embedded import EmbeddedJacobian

ACTIVE = np.array([True, False, True, True, False])


def whole(inner: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    out = np.eye(6)
    out[np.ix_(np.flatnonzero(ACTIVE), np.flatnonzero(ACTIVE))] = inner
    out[:-1, -1], out[-1] = column, row
    return out


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("columns", [(), (3,)])
def test_against_the_whole_matrix(transposed: bool, columns: tuple[int, ...]) -> None:
    rng = np.random.default_rng(2)
    inner, row, column = rng.normal(size=(3, 3)), rng.normal(size=6), np.where(ACTIVE, rng.normal(size=5), 0.0)
    J = EmbeddedJacobian(DenseJacobian(inner), ACTIVE).bordered(column, row)
    full, right = whole(inner, column, row), rng.normal(size=(6, *columns))
    own = full.T if transposed else full
    assert J.size == 6
    assert not J.singular
    assert J.sign() == np.sign(np.linalg.det(full))
    np.testing.assert_allclose(J.multiply(right, transposed=transposed), own @ right, rtol=1e-12)
    np.testing.assert_allclose(J.solve(right, transposed=transposed), np.linalg.solve(own, right), rtol=1e-9)
    x = rng.normal(size=6)
    assert np.all(J.bound(x) >= np.abs(full) @ np.abs(x) - 1e-12)


def test_without_a_border() -> None:
    rng = np.random.default_rng(3)
    inner, right = rng.normal(size=(3, 3)), rng.normal(size=5)
    J = EmbeddedJacobian(DenseJacobian(inner), ACTIVE)
    found = J.solve(right)
    np.testing.assert_array_equal(found[~ACTIVE], right[~ACTIVE])
    np.testing.assert_allclose(found[ACTIVE], np.linalg.solve(inner, right[ACTIVE]), rtol=1e-12)
