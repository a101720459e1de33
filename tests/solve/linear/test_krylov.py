"""Block Lanczos: the basis stays orthonormal and its relation holds, through restarts and dead directions."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array, diags_array

from slipstick.errors import InputError
from slipstick.solve.linear import krylov

N = 60
K = np.diag(np.full(N, 2.0)) - np.eye(N, k=1) - np.eye(N, k=-1)
M = np.diag(np.linspace(1.0, 3.0, N))
Iteration = next(value for value in vars(krylov).values() if isinstance(value, type) and hasattr(value, "ritz"))


def iteration(block=4, mass=M, start=None):
    return Iteration(lambda B: np.linalg.solve(K, B), csr_array(mass), block, start)


def assert_relation(it):
    """``K^-1 M V = V H + Q coupling E^T`` and ``V^T M V = 1``."""
    V = it.V[:, : it.m]
    np.testing.assert_allclose(V.T @ M @ V, np.eye(it.m), atol=1e-11)
    right = V @ it.H
    right[:, it.m - it.coupling.shape[1] :] += it.Q @ it.coupling
    np.testing.assert_allclose(np.linalg.solve(K, M @ V), right, atol=1e-9)


def test_relation_and_ritz_values():
    it = iteration()
    for _ in range(8):
        it.make_room(40, 12)
        it.step()
        assert_relation(it)
    theta, _, residual = it.ritz()
    exact = 1.0 / eigh(K, M, eigvals_only=True)
    good = residual < 1e-8
    assert good.sum() >= 3
    np.testing.assert_allclose(theta[good], exact[: good.sum()], rtol=1e-10)


def test_a_restart_keeps_the_relation():
    it = iteration()
    for _ in range(12):
        it.make_room(20, 8)
        it.step()
    assert it.m <= 24
    theta, Y, residual = it.ritz()
    V = it.V[:, : it.m]
    shapes = V @ Y[:, :3]
    found = np.linalg.norm(np.linalg.solve(K, M @ shapes) - shapes * theta[:3], axis=0) / theta[:3]
    assert found.max() < 10 * max(residual[:3].max(), 1e-9)


def test_directions_that_vanish_become_random_ones():
    """A start of equal columns has rank one; the block is full all the same."""
    it = iteration(start=np.ones((N, 4)))
    np.testing.assert_allclose(it.Q.T @ M @ it.Q, np.eye(4), atol=1e-10)


def test_an_indefinite_mass_is_said():
    with pytest.raises(InputError, match="the mass matrix is indefinite"):
        iteration(mass=np.diag(np.linspace(-3.0, 1.0, N)))


def test_a_restart_of_a_large_basis_goes_piece_by_piece():
    """20 000 rows in more than one piece: the basis stays orthonormal and keeps the best Ritz vectors."""
    n = 20_000
    stiffness, mass = np.arange(1.0, n + 1.0), np.linspace(1.0, 2.0, n)
    it = Iteration(lambda B: B / stiffness[:, None], diags_array(mass).tocsr(), 4)
    for _ in range(8):
        it.make_room(16, 8)
        it.step()
    V = it.V[:, : it.m]
    np.testing.assert_allclose(V.T @ (mass[:, None] * V), np.eye(it.m), atol=1e-10)
    theta, Y, _ = it.ritz()
    np.testing.assert_allclose(theta[:2], np.sort(mass / stiffness)[::-1][:2], rtol=1e-6)
    first = V @ Y[:, 0]
    assert abs(first[0]) * np.sqrt(mass[0]) == pytest.approx(1.0, rel=1e-6)
