"""Dense Jacobians against numpy: plain, bordered, bordered twice."""

import numpy as np
import pytest

from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.jacobian import Jacobian

RNG = np.random.default_rng(2)


def pairs(n):
    """Jacobians and their matrices."""
    matrix = RNG.standard_normal((n, n))
    jacobian = DenseJacobian(matrix if n % 2 else np.asfortranarray(matrix))
    yield jacobian, matrix
    for _ in range(2):
        size = len(matrix)
        column, row = RNG.standard_normal(size), RNG.standard_normal(size + 1)
        matrix = np.vstack([np.column_stack([matrix, column]), row])
        jacobian = jacobian.bordered(column, row)
        yield jacobian, matrix


@pytest.mark.parametrize("n", range(1, 9))
def test_against_the_matrix(n):
    for jacobian, matrix in pairs(n):
        size = len(matrix)
        assert isinstance(jacobian, Jacobian)
        assert jacobian.size == size
        assert not jacobian.singular
        assert jacobian.sign() == np.sign(np.linalg.det(matrix))
        for x in (RNG.standard_normal(size), RNG.standard_normal((size, 3))):
            for transposed, A in ((False, matrix), (True, matrix.T)):
                np.testing.assert_allclose(jacobian.multiply(x, transposed=transposed), A @ x, atol=1e-13)
                np.testing.assert_allclose(A @ jacobian.solve(x, transposed=transposed), x, atol=1e-9)
        np.testing.assert_allclose(jacobian.bound(x[:, 0]), np.abs(matrix) @ np.abs(x[:, 0]), rtol=1e-13)


def test_the_matrix_is_not_written_on():
    for matrix in (RNG.standard_normal((4, 4)), np.asfortranarray(RNG.standard_normal((4, 4)))):
        before, column, row = matrix.copy(), np.ones(4), np.ones(5)
        jacobian = DenseJacobian(matrix)
        inner = jacobian.bordered(column, row)
        inner.solve(np.ones(5))
        jacobian.solve(np.ones(4))
        assert np.array_equal(matrix, before)
        assert np.array_equal(column, np.ones(4))
        assert np.array_equal(row, np.ones(5))


def test_singular_alone_but_not_bordered():
    """A fold point: the border makes it regular."""
    fold = DenseJacobian([[0.0]])
    assert fold.singular
    bordered = fold.bordered(np.array([1.0]), np.array([1.0, 0.0]))
    assert not bordered.singular
    assert bordered.sign() == -1
    assert bordered.solve(np.array([0.0, 1.0])).tolist() == [1.0, 0.0]


def test_a_border_is_assembled_once_and_factorised_in_its_memory(monkeypatch):
    from slipstick.solve.linear import dense

    seen = []
    factorise = dense.dgetrf
    monkeypatch.setattr(dense, "dgetrf", lambda a, **kw: seen.append(a) or factorise(a, **kw))
    jacobian = DenseJacobian(np.eye(3)).bordered(np.ones(3), np.ones(4))
    assert not seen
    assert not jacobian.singular
    jacobian.solve(np.ones(4))
    jacobian.sign()
    assert len(seen) == 1
    assert np.shares_memory(seen[0], jacobian._factors()[0])


def test_a_matrix_is_written_when_it_is_asked_for():
    made = []

    def write(out):
        made.append(len(out))
        out[:2, :2] = np.diag([2.0, 4.0])

    jacobian = DenseJacobian(write, 2)
    bordered = jacobian.bordered(np.ones(2), np.array([1.0, 1.0, 0.0]))
    assert jacobian.size == 2
    assert not made
    assert jacobian.solve(np.ones(2)).tolist() == [0.5, 0.25]
    assert bordered.solve(np.array([3.0, 5.0, 2.0])).tolist() == [1.0, 1.0, 1.0]
    assert made == [2, 3]
    assert np.diag(jacobian.matrix).tolist() == [2.0, 4.0]
    assert jacobian.multiply(np.ones(2)).tolist() == [2.0, 4.0]
    assert made == [2, 3, 2]
