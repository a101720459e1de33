"""Jacobians made of another one, against the whole matrix."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear.block_bordered import BlockBordered
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.iterative import IterativeJacobian
from slipstick.solve.linear.jacobian import Eliminated, EmbeddedJacobian, Jacobian, Scaled


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


def test_how_many_digits_are_asked_for_is_passed_on() -> None:
    class Asked(DenseJacobian):
        def solve_correction(self, right, to):
            asked.append(to)
            return self.solve(right)

    asked: list[float] = []
    inner, right = np.diag([2.0, 4.0, 8.0]), np.ones(5)
    J = EmbeddedJacobian(Asked(inner), ACTIVE)
    found = J.solve_correction(right, 0.03)
    np.testing.assert_allclose(found, [0.5, 1.0, 0.25, 0.125, 1.0])
    assert asked == [0.03]


def test_what_serves_another_is_taken_over_where_the_same_unknowns_are_active() -> None:
    class Taking(DenseJacobian):
        def take_over(self, other):
            taken.append(other)

    taken: list[object] = []
    one, other = Taking(np.eye(3)), DenseJacobian(np.eye(3))
    EmbeddedJacobian(one, ACTIVE).take_over(EmbeddedJacobian(other, ACTIVE))
    assert taken == [other]
    for beside in (EmbeddedJacobian(other, ACTIVE[::-1]), other):
        EmbeddedJacobian(one, ACTIVE).take_over(beside)
    other.take_over(EmbeddedJacobian(one, ACTIVE))
    assert taken == [other]


class Iterated(IterativeJacobian):
    """A matrix known by its products, with another one near it as the preconditioner."""

    def __init__(self, A: np.ndarray) -> None:
        self.A, self.P = A, A + 0.05 * np.random.default_rng(3).standard_normal(A.shape)

    @property
    def size(self) -> int:
        return len(self.A)

    def multiply(self, x, *, transposed=False):
        return (self.A.T if transposed else self.A) @ x

    def precondition(self, x, *, transposed=False):
        return np.linalg.solve(self.P.T if transposed else self.P, x)

    @property
    def preconditioner_sign(self) -> int:
        return int(np.linalg.slogdet(self.P)[0])

    def bound(self, x):
        return np.abs(self.A) @ np.abs(x)


@pytest.mark.parametrize("seed", range(4))
def test_a_block_of_borders_is_solved_with_the_rest(seed):
    """Also where the first further equation alone would be singular, as that of a mode at its resonance."""
    rng = np.random.default_rng(seed)
    A, s = rng.standard_normal((9, 9)), np.exp(rng.standard_normal(9))
    columns, rows = rng.standard_normal((9, 3)), rng.standard_normal((3, 12))
    rows[0, 9] = rows[0, :9] @ np.linalg.solve(A * s / s[:, None], columns[:, 0])
    whole = np.vstack([np.column_stack([A * s / s[:, None], columns]), rows])
    J = BlockBordered(Iterated(A), s, columns, rows)
    column, row = rng.standard_normal(12), rng.standard_normal(13)
    larger = np.vstack([np.column_stack([whole, column]), row])
    for found, matrix in ((J, whole), (J.bordered(column, row), larger)):
        n = len(matrix)
        x, eye = rng.standard_normal(n), np.eye(n)
        assert (found.size, found.singular) == (n, False)
        assert found.multiply(eye) == pytest.approx(matrix)
        assert found.multiply(x, transposed=True) == pytest.approx(matrix.T @ x)
        for right in (x, eye):
            expected = np.linalg.solve(matrix, right)
            assert found.solve(right) == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
        assert matrix.T @ found.solve(x, transposed=True) == pytest.approx(x, abs=1e-5)
        assert found.sign() == np.sign(np.linalg.det(matrix))
        assert np.all(found.bound(x) >= np.abs(matrix) @ np.abs(x) * (1.0 - 1e-12))
