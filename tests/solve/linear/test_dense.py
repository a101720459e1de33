"""Dense Jacobians against numpy: plain, bordered, bordered twice."""

import numpy as np
import pytest

from slipstick.solve.linear import dense
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


@pytest.mark.parametrize("filled", [[], [0], [7, 8, 9], [3, 20, 39], [109], range(24)])
def test_only_filled_columns_are_factorised(filled):
    """As the whole matrix gives them, alone and with borders; the factors have the size of what is filled."""
    random = np.random.default_rng(5)
    n, marks = 110, np.zeros(110, dtype=bool)
    marks[filled] = True
    matrix = np.eye(n)
    matrix[:, marks] += random.standard_normal((n, np.count_nonzero(marks)))

    def write(out):
        out[:n, :n] = matrix
        return np.append(marks, np.zeros(len(out) - n, dtype=bool))

    jacobian, whole = DenseJacobian(write, n), matrix
    for border in range(3):
        for x in (random.standard_normal(n + border), random.standard_normal((n + border, 3))):
            for transposed, A in ((False, whole), (True, whole.T)):
                np.testing.assert_allclose(A @ jacobian.solve(x, transposed=transposed), x, atol=1e-9)
        assert jacobian.sign() == np.sign(np.linalg.det(whole))
        assert len(jacobian._factors()._lu) <= len(filled) + border + 1
        column, row = random.standard_normal(n + border), random.standard_normal(n + border + 1)
        whole = np.vstack([np.column_stack([whole, column]), row])
        jacobian = jacobian.bordered(column, row)


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
    assert np.shares_memory(seen[0], jacobian._factors()._lu)


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


@pytest.fixture
def factorised(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Sizes of the matrices that were factorised; neighbours refine from 20 unknowns on."""
    sizes, made = list[int](), dense.dgetrf
    monkeypatch.setattr(dense, "REFINED_FROM", 20)
    monkeypatch.setattr(dense, "dgetrf", lambda a, **named: (sizes.append(len(a)), made(a, **named))[1])
    return sizes


@pytest.mark.parametrize("bordered", [False, True])
def test_solutions_are_refined_by_the_factors_of_a_neighbour(factorised: list[int], bordered: bool) -> None:
    n, border = 40, (RNG.standard_normal(40), RNG.standard_normal(41))
    first = np.eye(n) + 0.3 * RNG.standard_normal((n, n))
    second = first + 1e-4 * RNG.standard_normal((n, n))
    one, other = (DenseJacobian(matrix) for matrix in (first, second))
    near, far = (J.bordered(*border) if bordered else J for J in (one, other))
    whole = np.vstack([np.column_stack([second, border[0]]), border[1]]) if bordered else second
    near.solve(np.ones(len(whole)))
    far.take_over(near)
    x = RNG.standard_normal((len(whole), 3))
    assert not far.singular
    for right in (x, x[:, 0]):
        np.testing.assert_allclose(far.solve(right), np.linalg.solve(whole, right), rtol=1e-9, atol=1e-11)
    rough, exact = far.solve_correction(x[:, 0], 1e-3), np.linalg.solve(whole, x[:, 0])
    assert np.linalg.norm(rough - exact) <= 1e-3 * np.linalg.norm(exact)
    assert far.sign() == np.sign(np.linalg.det(whole))
    assert factorised == [len(whole)]


def test_a_jacobian_that_is_no_neighbour_has_factors_of_its_own(factorised: list[int]) -> None:
    first, second = (np.eye(30) + 0.3 * RNG.standard_normal((30, 30)) for _ in range(2))
    near, far = DenseJacobian(first), DenseJacobian(second)
    near.solve(np.ones(30))
    far.take_over(near)
    np.testing.assert_allclose(second @ far.solve(np.ones(30)), np.ones(30), atol=1e-9)
    assert factorised == [30, 30]


def test_a_determinant_that_changes_its_sign_beside_all_solutions(factorised: list[int]) -> None:
    """One eigenvalue passes zero, and the right-hand side has no part along its vector: the sign tells all the same."""
    values = np.linspace(1.0, 2.0, 30)
    values[4] = 1e-3
    near, right = DenseJacobian(np.diag(values)), np.ones(30)
    right[4], values[4] = 0.0, -1e-4
    far = DenseJacobian(np.diag(values))
    assert near.sign() == 1
    far.take_over(near)
    np.testing.assert_allclose(far.solve_correction(right), right / values, rtol=1e-6)
    assert factorised == [30]
    assert far.sign() == -1
    np.testing.assert_allclose(far.solve(right), right / values, rtol=1e-14)


def test_released_factors_are_made_again(factorised: list[int]) -> None:
    matrix, right = np.eye(30) + 0.3 * RNG.standard_normal((30, 30)), RNG.standard_normal(30)
    jacobian = DenseJacobian(matrix)
    before = jacobian.solve(right)
    jacobian.release()
    assert jacobian.solve(right).tolist() == before.tolist()
    assert factorised == [30, 30]
