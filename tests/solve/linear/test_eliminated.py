from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.eliminated import Eliminated
from slipstick.solve.linear.jacobian import Jacobian

rng = np.random.default_rng(0)


def bordered(n: int = 6, k: int = 2) -> tuple[Eliminated, np.ndarray]:
    whole = rng.standard_normal((n + k, n + k))
    return Eliminated(DenseJacobian(whole[:n, :n].copy()), whole[:n, n:].copy(), whole[n:].copy()), whole


@pytest.mark.parametrize("transposed", [False, True])
def test_it_is_the_matrix_with_its_borders(transposed):
    J, whole = bordered()
    matrix, x = (whole.T if transposed else whole), rng.standard_normal(8)
    assert isinstance(J, Jacobian)
    assert (J.size, J.singular) == (8, False)
    assert np.allclose(J.multiply(x, transposed=transposed), matrix @ x)
    assert np.allclose(J.solve(matrix @ x, transposed=transposed), x)
    assert np.allclose(J.multiply(np.eye(8), transposed=transposed), matrix)
    assert np.allclose(J.solve(matrix, transposed=transposed), np.eye(8))
    assert J.sign() == np.sign(np.linalg.det(whole))
    assert np.allclose(J.bound(x), np.abs(whole) @ np.abs(x))


def test_a_further_border():
    J, whole = bordered()
    column, row = rng.standard_normal(8), rng.standard_normal(9)
    larger = np.vstack([np.column_stack([whole, column]), row])
    found = J.bordered(column, row)
    assert np.allclose(found.multiply(np.eye(9)), larger)
    assert np.allclose(found.solve(larger), np.eye(9))
    assert found.sign() == np.sign(np.linalg.det(larger))


def test_a_singular_corner_shows():
    J = Eliminated(DenseJacobian(np.eye(2)), np.ones((2, 1)), np.array([[1.0, 1.0, 2.0]]))
    assert J.singular
    assert Eliminated(DenseJacobian(np.zeros((2, 2))), np.ones((2, 1)), np.ones((1, 3))).singular
