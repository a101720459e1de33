"""GMRES against direct solutions, and the eigenvalues it meets."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear.gmres import gmres


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
