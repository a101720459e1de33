"""Jacobians known by their products against dense ones, with a preconditioner that is only near."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear import iterative as module
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.iterative import IterativeJacobian, gmres
from slipstick.solve.linear.jacobian import Jacobian


class Near(IterativeJacobian):
    """A matrix, preconditioned by itself changed in a few directions."""

    def __init__(self, A, rank=3, seed=0):
        rng = np.random.default_rng(seed)
        n = len(A)
        self.A = A
        self.P = A @ (np.eye(n) + rng.standard_normal((n, rank)) @ rng.standard_normal((rank, n)) / n)

    @property
    def size(self):
        return len(self.A)

    def multiply(self, x, *, transposed=False):
        return (self.A.T if transposed else self.A) @ x

    def precondition(self, x, *, transposed=False):
        return np.linalg.solve(self.P.T if transposed else self.P, x)

    @property
    def preconditioner_sign(self):
        return int(np.linalg.slogdet(self.P)[0])

    def bound(self, x):
        return np.abs(self.A) @ np.abs(x)


@pytest.fixture(params=range(6))
def both(request):
    A = np.random.default_rng(request.param).standard_normal((12, 12))
    return Near(A, seed=request.param), DenseJacobian(A)


def test_is_a_jacobian(both):
    assert isinstance(both[0], Jacobian)
    assert isinstance(both[0].bordered(np.ones(12), np.ones(13)), Jacobian)


@pytest.mark.parametrize("transposed", [False, True])
def test_the_same_answers_as_a_dense_one(both, transposed):
    rng = np.random.default_rng(1)
    column, row = rng.standard_normal(12), rng.standard_normal(13)
    for iterative, dense in (both, tuple(J.bordered(column, row) for J in both)):
        n = dense.size
        for right in (rng.standard_normal(n), rng.standard_normal((n, 2))):
            expected = dense.solve(right, transposed=transposed)
            np.testing.assert_allclose(iterative.solve(right, transposed=transposed), expected, atol=1e-7)
            np.testing.assert_allclose(
                iterative.multiply(right, transposed=transposed), dense.multiply(right, transposed=transposed),
                atol=1e-13,
            )  # fmt: skip
        np.testing.assert_allclose(iterative.bound(right[:, 0]), dense.bound(right[:, 0]))
        assert iterative.size == dense.size
        assert not iterative.singular


def test_the_preconditioner_with_a_border_is_the_bordered_one(both):
    """Exact where the inner one is; its transpose is its transpose. A wrong one would only be slower."""
    J, dense = both
    rng = np.random.default_rng(2)
    column, row, x, y = rng.standard_normal(12), rng.standard_normal(13), *rng.standard_normal((2, 13))
    bordered = J.bordered(column, row)
    assert bordered.precondition(x) @ y == pytest.approx(x @ bordered.precondition(y, transposed=True), rel=1e-9)
    J.P = J.A
    exact = J.bordered(column, row)
    for transposed in (False, True):
        right = dense.bordered(column, row).multiply(x, transposed=transposed)
        np.testing.assert_allclose(exact.precondition(right, transposed=transposed), x, atol=1e-9)
        before = exact.products
        exact.solve(right, transposed=transposed)
        assert exact.products - before <= 2
    assert exact.preconditioner_sign == dense.bordered(column, row).sign()


@pytest.mark.parametrize("seed", range(30))
def test_the_sign_of_the_determinant(seed):
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((12, 12))
    column, row = rng.standard_normal(12), rng.standard_normal(13)
    assert Near(A, seed=seed).sign() == DenseJacobian(A).sign()
    assert Near(A, seed=seed).bordered(column, row).sign() == DenseJacobian(A).bordered(column, row).sign()


def test_bordered_solves_where_the_jacobian_is_singular():
    rng = np.random.default_rng(5)
    U, s, V = np.linalg.svd(rng.standard_normal((12, 12)))
    s[-1] = 0.0
    A = U @ np.diag(s) @ V
    J = Near(A)
    J.P = A + 0.1 * np.outer(U[:, -1], V[-1])
    column, row = rng.standard_normal(12), rng.standard_normal(13)
    right = rng.standard_normal(13)
    expected = DenseJacobian(A).bordered(column, row).solve(right)
    np.testing.assert_allclose(J.bordered(column, row).solve(right), expected, atol=1e-7)


class Nearby(Near):
    """With products of a matrix that is much nearer than its preconditioner."""

    has_nearby = True

    def __init__(self, A, seed=0, apart=1e-4):
        super().__init__(A, rank=8, seed=seed)
        self.B = A + apart * np.random.default_rng(seed + 1).standard_normal(A.shape)

    def nearby(self, x):
        return self.B @ x


@pytest.mark.parametrize("seed", range(6))
def test_what_is_near_saves_products_and_no_digits(seed):
    """Columns together, of sizes apart, with a border whose units are not those of the matrix."""
    rng = np.random.default_rng(seed)
    A = np.eye(40) + 0.1 * rng.standard_normal((40, 40))
    column, row = 1e-6 * rng.standard_normal(40), np.append(1e3 * rng.standard_normal(40), 1.0)
    own, dense = (J.bordered(column, row) for J in (Nearby(A, seed), DenseJacobian(A)))
    right = rng.standard_normal((41, 3)) * np.array([1e-6, 0.0, 1.0])
    right[:, 2] = np.eye(41)[-1]
    expected = dense.solve(right)
    for solve, error in ((own.solve, 1e-7), (own.solve_correction, 1e-5)):
        before, found = own.products, solve(right)
        assert own.products - before <= (3 if error < 1e-6 else 2)
        for one, other in zip(found.T, expected.T, strict=True):
            assert np.linalg.norm((one - other)[:-1]) <= error * np.linalg.norm(other[:-1])
            assert abs(one[-1] - other[-1]) <= error * abs(other[-1])
    assert own.sign() == dense.sign()


@pytest.mark.parametrize("seed", range(6))
def test_what_was_seen_to_be_near_is_taken_without_a_product(seed):
    """Not before a first solution, nor to more digits than that one promised; of another Jacobian where it is told."""
    rng = np.random.default_rng(seed)
    A, right = np.eye(40) + 0.1 * rng.standard_normal((40, 40)), rng.standard_normal((40, 3))
    J, expected = Nearby(A, seed, apart=1e-5), np.linalg.solve(A, right)

    def taken(J, to):
        before, found = J.products, J.solve_correction(right, to)
        assert np.all(np.linalg.norm(found - expected, axis=0) <= 10.0 * to * np.linalg.norm(expected, axis=0))
        return J.products - before

    assert J.leaves is None
    assert taken(J, 0.03) == 1
    left = np.linalg.norm(right - A @ np.linalg.solve(J.B, right), axis=0) / np.linalg.norm(right, axis=0)
    assert J.leaves == pytest.approx(left.max(), rel=0.5, abs=1e-4)
    assert taken(J, 0.03) == 0
    assert taken(J, 1e-6) >= 1
    told, again, far = (Nearby(A, seed, apart=1e-5) for _ in range(3))
    told.take_over(J)
    assert taken(told, 0.03) == 0
    again.take_over(told)
    assert taken(again, 0.03) == 0
    J.leaves = 0.01
    far.take_over(J)
    assert taken(far, 0.03) == 1


@pytest.mark.parametrize("apart", [3e-3, np.nan])
def test_what_was_seen_to_be_far_takes_products_still(apart):
    A, right = np.eye(30) + 0.1 * np.random.default_rng(6).standard_normal((30, 30)), np.ones(30)
    J = Nearby(A, apart=apart)
    for _ in range(2):
        before, found = J.products, J.solve_correction(right, 0.03)
        assert J.products > before
        np.testing.assert_allclose(found, np.linalg.solve(A, right), rtol=0, atol=0.1)
    assert np.isnan(J.leaves) if np.isnan(apart) else J.leaves > 1e-3


def test_the_tangent_of_a_curve_is_as_good_as_its_point():
    """A one in the last equation, in units of its own: the others are as exact as if it had theirs."""
    rng = np.random.default_rng(3)
    A = np.eye(30) + 0.02 * rng.standard_normal((30, 30))
    J = Near(A)
    J.P = np.eye(30)
    column, row = 1e-9 * rng.standard_normal(30), np.eye(31)[-1]
    found, expected = (one.bordered(column, row).solve(row) for one in (J, DenseJacobian(A)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected[:-1]).max())


@pytest.mark.parametrize("apart", [1.0, np.nan])
def test_what_is_not_near_enough_is_left_for_the_preconditioner(apart):
    A = np.random.default_rng(4).standard_normal((30, 30))
    J = Nearby(A, apart=apart)
    right = np.random.default_rng(5).standard_normal((30, 2))
    np.testing.assert_allclose(J.solve(right), np.linalg.solve(A, right), atol=1e-6)
    assert np.isnan(apart) or J.sign() == DenseJacobian(A).sign()


def test_the_sign_takes_one_search_more_where_the_approximation_is_not_solved(monkeypatch):
    """Solutions that are cut short are no linear map: J itself is searched, once."""
    monkeypatch.setattr(module, "_APPROXIMATE", 0.0)
    A = np.random.default_rng(4).standard_normal((30, 30))
    J, searched = Nearby(A), []
    monkeypatch.setattr(module, "gmres", lambda *of, **how: searched.append(how) or gmres(*of, **how))
    assert J.sign() == DenseJacobian(A).sign()
    assert len(searched) == 2


def test_a_preconditioner_of_no_use_gives_nan_and_no_wrong_number():
    A = np.roll(np.eye(400), 1, axis=0)
    J = Near(A)
    J.P = np.eye(400)
    assert np.all(np.isnan(J.solve(np.eye(400)[0])))


@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_solutions_are_those_of_lu(n):
    rng = np.random.default_rng(n)
    A, b = np.eye(n) + 0.3 * rng.standard_normal((n, n)), rng.standard_normal(n)
    found = gmres(lambda x: A @ x, b, tolerance=1e-13, most=n)
    np.testing.assert_allclose(found.x, np.linalg.solve(A, b), rtol=0, atol=1e-10)
    assert found.products <= n


def test_few_products_where_few_eigenvalues_lie_apart():
    rng = np.random.default_rng(3)
    n, apart = 500, np.array([-3.0, 0.01, 20.0])
    U, _ = np.linalg.qr(rng.standard_normal((n, n)))
    A = U @ np.diag(np.r_[apart, np.ones(n - 3)]) @ U.T
    found = gmres(lambda x: A @ x, rng.standard_normal(n), tolerance=1e-12, most=50)
    assert found.products == 4
    np.testing.assert_allclose(np.sort(found.ritz.real), [-3.0, 0.01, 1.0, 20.0], rtol=1e-8)


def test_zero_and_infinite_right_hand_sides_end_at_once():
    for right in (np.zeros(3), np.full(3, np.inf)):
        assert gmres(lambda x: x, right, tolerance=1e-10, most=5).products == 0


def test_what_it_could_not_reach_is_told():
    A = np.roll(np.eye(30), 1, axis=0)  # a shift: no progress before the last product
    found = gmres(lambda x: A @ x, np.eye(30)[0], tolerance=1e-10, most=10)
    assert found.residual == pytest.approx(1.0)
    assert found.products == 10


@pytest.mark.parametrize("border", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_solutions_beside_stiff_contacts_have_the_digits_asked_for(seed, border):
    """``I + A K`` with stiff K answers most right-hand sides with little: a residual small beside them says nothing."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((40, 20))
    J, x = Near(np.eye(40) + 1e7 * root @ root.T, seed=seed), rng.standard_normal(40)
    dense = DenseJacobian(J.A)
    right = 1e7 * root @ (root.T @ x)
    if border:
        column, row = rng.standard_normal(40), rng.standard_normal(41)
        J, dense, right = J.bordered(column, row), dense.bordered(column, row), np.append(right, 1.0)
    expected = dense.solve(right)
    for found, error in ((J.solve(right), 1e-6), (J.solve_correction(right, 1e-6), 1e-4)):
        assert np.linalg.norm(found - expected) <= error * np.linalg.norm(expected)
