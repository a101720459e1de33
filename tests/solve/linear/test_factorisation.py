"""What the solvers share: shapes kept, complex columns of a real matrix in two parts."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csc_array

from slipstick.errors import InputError
from slipstick.solve.linear import factorisation
from slipstick.solve.linear.factorisation import (
    Factorisation,
    SingularMatrixError,
    available_solvers,
    factorise,
    one_blas_thread,
    shifted,
    solver_named,
)

A = np.diag([4.0, 5.0, 6.0]) + np.ones((3, 3))


@pytest.mark.parametrize("solver", available_solvers())
@pytest.mark.parametrize("shape", [(3,), (3, 1), (3, 5), (3, 0)])
@pytest.mark.parametrize("factor", [1.0, 1.0 + 2.0j])
def test_every_solver_solves_every_shape(solver, shape, factor):
    factors = solver_named(solver)(csc_array(A), None)
    assert isinstance(factors, Factorisation)
    B = factor * np.random.default_rng(0).normal(size=shape)
    np.testing.assert_allclose(A @ factors.solve(B), B, atol=1e-13)
    assert factors.solve(B).shape == shape
    assert factors.memory > 0
    if factors.inertia is not None:
        assert (factors.inertia.positive, factors.inertia.negative, factors.inertia.zero) == (3, 0, 0)


def test_complex_columns_are_solved_in_two_parts():
    asked = []
    factors = Factorisation("own", lambda B: asked.append(B.dtype) or 2.0 * B, memory=1)
    np.testing.assert_array_equal(factors.solve(np.array([1.0 + 3.0j])), [2.0 + 6.0j])
    assert asked == [np.float64, np.float64]


def test_choice():
    assert "superlu" in available_solvers()
    assert solver_named(None) is solver_named("auto") is solver_named(available_solvers()[0])
    with pytest.raises(InputError, match="solver 'umfpack' is not known"):
        solver_named("umfpack")


def test_a_zero_pivot_is_a_singular_matrix():
    with pytest.raises(SingularMatrixError, match="the matrix is singular"):
        solver_named("superlu")(csc_array(np.array([[1.0, 1.0], [1.0, 1.0]])), None)


SOLVERS = available_solvers()


def grid(n: int, seed: int = 0) -> sparse.csr_array:
    """Springs of random stiffness on an n x n grid, grounded along one side; positive definite."""
    random = np.random.default_rng(seed)
    index = np.arange(n * n).reshape(n, n)
    pairs = np.vstack(
        [
            np.column_stack([index[:-1].ravel(), index[1:].ravel()]),
            np.column_stack([index[:, :-1].ravel(), index[:, 1:].ravel()]),
        ]
    )
    k = random.uniform(1.0, 3.0, len(pairs))
    B = sparse.csr_array(
        (np.tile([1.0, -1.0], len(pairs)), (np.repeat(np.arange(len(pairs)), 2), pairs.ravel())),
        shape=(len(pairs), n * n),
    )
    ground = np.zeros(n * n)
    ground[index[0]] = 1.0
    return sparse.csr_array(B.T @ sparse.diags_array(k) @ B + sparse.diags_array(ground))


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", ["definite", "indefinite", "complex"])
def test_solutions_satisfy_the_equations(solver: str, kind: str) -> None:
    A = grid(20)
    A = {
        "definite": A,
        "indefinite": A - 1.7 * sparse.eye_array(400),
        "complex": A * (1 + 0.01j) - sparse.eye_array(400),
    }[kind]
    random = np.random.default_rng(1)
    factors = factorise(A, solver=solver)
    assert isinstance(factors, Factorisation)
    assert factors.name == solver
    assert factors.memory > 0
    for B in (
        random.standard_normal(400),
        random.standard_normal((400, 3)),
        random.standard_normal((400, 2)) * (1 + 2j),
    ):
        X = factors.solve(B)
        assert X.shape == B.shape
        # conditioning of these matrices is below 1e5
        assert np.linalg.norm(A @ X - B) < 1e-10 * np.linalg.norm(B)


@pytest.mark.parametrize("solver", [name for name in SOLVERS if name != "superlu"])
def test_inertia_counts_eigenvalues_by_sign(solver: str) -> None:
    A = grid(12)
    eigenvalues = np.linalg.eigvalsh(A.toarray())
    for shift in (0.0, 0.5, 3.0, 20.0):
        inertia = factorise(shifted(A, sparse.eye_array(144), shift), solver=solver).inertia
        assert inertia is not None
        assert inertia.negative == np.count_nonzero(eigenvalues < shift)
        assert inertia.positive == np.count_nonzero(eigenvalues > shift)


@pytest.mark.parametrize("solver", SOLVERS)
def test_singular_matrices_are_refused_with_the_free_motion(solver: str) -> None:
    A = grid(10)
    free = A - sparse.diags_array(A @ np.ones(100))  # ground springs taken away
    with pytest.raises(SingularMatrixError, match="singular") as error:
        factorise(free, solver=solver)
    null = error.value.null_vector
    if null is not None:
        assert np.ptp(null) < 1e-6 * np.abs(null).max()


def test_an_empty_row_is_singular() -> None:
    with pytest.raises(InputError, match=r"1 rows are empty, the first is 2"):
        factorise(sparse.csr_array(np.diag([1.0, 2.0, 0.0])))


@pytest.mark.parametrize("solver", SOLVERS)
def test_stiff_and_soft_parts_together_are_not_called_singular(solver: str) -> None:
    A = sparse.block_diag([grid(8), 1e18 * grid(8), sparse.csr_array([[1e-12]])], format="csr")
    b = np.ones(129)
    assert factorise(A, solver=solver).solve(b)[-1] == pytest.approx(1e12)


def test_duplicates_are_summed_and_the_matrix_given_is_left_alone() -> None:
    rows, columns, data = np.array([0, 0, 1, 1]), np.array([0, 0, 1, 1]), np.array([1.0, 1.0, 2.0, 2.0])
    A = sparse.csr_array((data, columns, np.array([0, 2, 4])), shape=(2, 2))
    assert len(rows) == A.nnz
    np.testing.assert_allclose(factorise(A).solve(np.ones(2)), [0.5, 0.25])
    np.testing.assert_array_equal(A.data, data)
    assert A.nnz == 4


def test_unknown_and_missing_solvers_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="solver 'mumps' is not known"):
        factorise(grid(3), solver="mumps")
    real = importlib.util.find_spec
    monkeypatch.setattr(factorisation, "find_spec", lambda name: None if name in ("rslab", "pypardiso") else real(name))
    assert available_solvers() == ("superlu",)
    assert factorise(grid(3)).name == "superlu"
    with pytest.raises(InputError, match="solver 'rslab' is not installed: pip install rslab"):
        factorise(grid(3), solver="rslab")


def test_shifted_joins_different_patterns() -> None:
    K, M = grid(5), sparse.eye_array(25, format="csr")
    np.testing.assert_allclose(shifted(K, M, 2.0).toarray(), K.toarray() - 2.0 * np.eye(25))
    np.testing.assert_allclose(shifted(K, 3.0 * K, 2.0).toarray(), -5.0 * K.toarray())


def test_one_blas_thread_around_the_solver() -> None:
    from threadpoolctl import threadpool_info

    with one_blas_thread():
        assert all(pool["num_threads"] == 1 for pool in threadpool_info() if pool["user_api"] == "blas")


def test_the_libraries_are_looked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """That takes milliseconds, longer than a small solution."""

    def looked() -> None:
        raise AssertionError

    factors = factorise(grid(5))
    monkeypatch.setattr("threadpoolctl.ThreadpoolController", looked)
    np.testing.assert_allclose(grid(5) @ factors.solve(np.ones(25)), 1.0)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("shift", [0.0, 1.7])
def test_an_ordering_serves_every_matrix_of_its_pattern_and_no_other(solver: str, shift: float) -> None:
    A, b = grid(12), np.ones(144)
    ordering = factorise(A, solver=solver).ordering
    alike, other = shifted(A, sparse.eye_array(144), shift), grid(12) @ grid(12)
    for matrix in (alike, other, alike * (1 + 0.1j), grid(9)):
        given = factorise(matrix, solver=solver, ordering=ordering)
        own = factorise(matrix, solver=solver)
        n = matrix.shape[0]
        np.testing.assert_allclose(given.solve(b[:n]), own.solve(b[:n]), rtol=1e-9)
        assert given.inertia == own.inertia
    assert factorise(alike, solver=solver, ordering=ordering).ordering is ordering
