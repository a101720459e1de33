"""Sparse matrices condensed to few rows, against dense algebra; sectors of rings against their matrices by phase."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import sparse

from slipstick.solve.linear.condensation import Condensed, DenseFactors, dissect, negative_eigenvalues
from slipstick.solve.linear.cyclic import SectorFactors
from slipstick.solve.linear.factorisation import SingularMatrixError


def grid(*sizes: int) -> Any:
    """Stiffness of a grid of springs, each mass to its neighbours and weakly to the ground, two directions a mass."""
    A = sparse.csr_array((1, 1))
    for n in sizes:
        line = sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n))
        A = sparse.kron(A, sparse.eye_array(n)) + sparse.kron(sparse.eye_array(A.shape[0]), line)
    return sparse.csr_array(sparse.kron(A + 0.01 * sparse.eye_array(A.shape[0]), np.array([[2.0, 0.5], [0.5, 1.0]])))


@pytest.mark.parametrize("shift", [0.0, 1.37])
def test_what_is_left_is_the_schur_complement(shift: float) -> None:
    A = sparse.csr_array(grid(9, 8, 7) - shift * sparse.eye_array(1008))
    kept = np.arange(0, 1008, 19)
    ordering = dissect(A, kept)
    assert len(ordering.fronts) > 10
    condensed, schur = Condensed.of(A, ordering, solve=True)
    dense, inner = A.toarray(), np.setdiff1d(np.arange(1008), kept)
    inside = dense[np.ix_(inner, inner)]
    exact = dense[np.ix_(kept, kept)] - dense[np.ix_(kept, inner)] @ np.linalg.solve(inside, dense[np.ix_(inner, kept)])
    assert np.allclose(schur, exact, rtol=0, atol=1e-12 * np.abs(exact).max())
    assert condensed.negative == np.count_nonzero(np.linalg.eigvalsh(inside) < 0.0)
    assert bool(condensed.negative) == bool(shift)
    b = np.random.default_rng(1).standard_normal((1008, 3))
    X = b[ordering.order]
    condensed.forward(X)
    X[len(inner) :] = np.linalg.solve(schur, X[len(inner) :])
    condensed.backward(X)
    assert np.allclose(A[ordering.order] @ _scattered(X, ordering.order), b[ordering.order], rtol=0, atol=1e-10)


def _scattered(X: Any, order: Any) -> Any:
    x = np.empty_like(X)
    x[order] = X
    return x


def test_parts_that_do_not_touch_and_parts_that_are_not_there() -> None:
    A = sparse.csr_array(sparse.diags_array(np.arange(1.0, 301.0)))
    condensed, schur = Condensed.of(A, dissect(A, np.array([3, 7])), solve=False)
    assert np.array_equal(schur, np.diag([4.0, 8.0]))
    assert condensed.memory == 0
    assert np.array_equal(Condensed.of(A, dissect(A, np.arange(300)), solve=True)[1], A.toarray())


@pytest.mark.parametrize("shift", [0.0, 0.9])
@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi])
def test_a_sector_at_a_phase(angle: float, shift: float) -> None:
    across = sparse.csr_array((-2.0 * np.ones(24), (np.arange(600 - 24, 600), np.arange(24))), shape=(600, 600))
    K0, M0 = grid(25, 12) + 2.0 * sparse.eye_array(600), sparse.eye_array(600, format="csr")
    axis = np.array([300, 301])  # two rows that only one combination of which is left
    vector = np.array([1.0, 1.0j if angle == 0.7 else -1.0]) / np.sqrt(2.0)
    places = np.concatenate([np.setdiff1d(np.arange(600), axis), axis])
    left = sparse.csr_array((np.r_[np.ones(598), vector], (places, np.r_[np.arange(598), 598, 598])), shape=(600, 599))
    phase = {0.0: 1.0, np.pi: -1.0}.get(angle, np.exp(-1j * angle))
    sector = SectorFactors((K0, across), (M0, 0.1 * across), axis)
    for projection in (None, left):
        A = (K0 - shift * M0) + phase * (1.0 - 0.1 * shift) * across
        A = (A + np.conj(phase) * (1.0 - 0.1 * shift) * across.T).toarray()
        A = A if projection is None else projection.conj().T @ A @ projection.toarray()
        factors = sector.at(shift, phase, projection)
        b = np.random.default_rng(2).standard_normal((len(A), 2))
        assert np.allclose(A @ factors.solve(b), b, rtol=0, atol=1e-10)
        exact = np.linalg.eigvalsh(A)
        assert factors.inertia == (np.count_nonzero(exact > 0.0), np.count_nonzero(exact < 0.0), 0)
        assert sector.at(shift, phase, projection, solve=False).inertia == factors.inertia


def test_a_sector_whose_faces_are_held() -> None:
    K, none = grid(9, 8), sparse.csr_array((144, 144))
    sector = SectorFactors((K, none), (sparse.eye_array(144, format="csr"), none), np.zeros(0, dtype=np.int64))
    b = np.ones((144, 1))
    assert np.allclose(K @ sector.at(0.0, np.exp(-1j), None).solve(b), b, rtol=0, atol=1e-10)
    assert sector.at(1.0, 1.0, None, solve=False).inertia.negative == np.count_nonzero(
        np.linalg.eigvalsh(K.toarray()) < 1.0
    )


@pytest.mark.parametrize("what", [DenseFactors, negative_eigenvalues])
def test_a_zero_pivot_is_told(what: Any) -> None:
    with pytest.raises(SingularMatrixError, match="a pivot is zero"):
        what(np.diag([1.0, 0.0, -1.0]))


@pytest.mark.parametrize("dtype", [float, complex])
def test_negative_eigenvalues_are_counted(dtype: Any) -> None:
    random = np.random.default_rng(3)
    for n in (1, 2, 30, 31):
        A = random.standard_normal((n, n)).astype(dtype)
        A = A + (1j * random.standard_normal((n, n)) if dtype is complex else 0.0)
        A = np.asfortranarray(A + A.conj().T)
        exact = np.count_nonzero(np.linalg.eigvalsh(A) < 0.0)
        b = random.standard_normal((n, 2))
        factors = DenseFactors(A)
        assert np.allclose(A @ factors.solve(b), b, rtol=0, atol=1e-9)
        assert factors.negative == exact == negative_eigenvalues(A)
