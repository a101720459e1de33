"""Factors of sparse symmetric matrices, real or complex (``A = A^T``, not Hermitian), by the solver at hand.

All solvers run with one BLAS thread around them: more threads slow the many small dense kernels of a sparse
factorisation down.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from slipstick.solve.linear.factors import Factorisation, SingularMatrixError, one_blas_thread
from slipstick.solve.linear.solvers import Solver, solver_named
from slipstick.typing import AnyArray, Sparse

_ANNIHILATED = 1e-14
"""A matrix scaled to unit rows is called singular when some vector is annihilated to this relative size."""


def factorise(A: Sparse, *, solver: str | None = None, check: bool = True, ordering: Any = None) -> Factorisation:
    """Factorise a sparse symmetric matrix (n, n), real or complex symmetric.

    ``solver`` names one of :func:`slipstick.solve.linear.solvers.available_solvers`; None or "auto" takes the first.
    ``ordering`` is that of factors made before: where the pattern is the same, it is not sought again.
    With ``check`` two solutions are spent on making sure that the matrix is not singular to working accuracy. Raises
    SingularMatrixError (an InputError) for a singular matrix and InputError for an unknown or missing solver.

    >>> from scipy import sparse
    >>> factorise(sparse.diags_array([2.0, -4.0], format="csr")).solve(np.array([1.0, 1.0]))
    array([ 0.5 , -0.25])
    """
    function = solver_named(solver)
    matrix = sparse.csr_array(A)
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    matrix = matrix.T  # stored by columns without a copy: A is symmetric
    _require_no_empty_row(matrix)
    try:
        with one_blas_thread():
            factors = function(matrix, ordering)
    except SingularMatrixError as error:
        raise SingularMatrixError(str(error), _free_motion(matrix, function)) from error
    if check:
        _require_regular(matrix, factors)
    return factors


def shifted(K: Sparse, M: Sparse, shift: complex) -> Any:
    """``K - shift M`` by rows; without the work of joining patterns when both are stored alike."""
    K, M = sparse.csr_array(K), sparse.csr_array(M)
    alike = K.nnz == M.nnz and np.array_equal(K.indptr, M.indptr) and np.array_equal(K.indices, M.indices)
    if not alike:
        return K - shift * M
    data = M.data * -shift
    data += K.data
    return sparse.csr_array((data, K.indices, K.indptr), shape=K.shape)


def _require_no_empty_row(A: Sparse) -> None:
    empty = np.flatnonzero(np.diff(A.indptr) == 0)
    if len(empty):
        null = np.zeros(A.shape[0])
        null[empty] = 1.0
        raise SingularMatrixError(f"the matrix is singular: {len(empty)} rows are empty, the first is {empty[0]}", null)


def _require_regular(A: Sparse, factors: Factorisation) -> None:
    """Two steps of inverse iteration on the matrix with rows scaled to one: what it nearly annihilates."""
    scale = np.sqrt(_row_maximum(A))
    x = np.random.default_rng(0).standard_normal(A.shape[0])
    for _ in range(2):
        x = factors.solve(scale * x)
        size = np.linalg.norm(scale * x)
        if not np.isfinite(size):
            raise SingularMatrixError("the matrix is singular: its solution is not finite")
        x = x * (scale / size)
        left = np.linalg.norm((A @ (x / scale)) / scale)
    if left < _ANNIHILATED:
        raise SingularMatrixError(
            f"the matrix is singular to working accuracy: it annihilates a motion to {left:.0e}", np.asarray(x / scale)
        )


def _free_motion(A: Sparse, function: Solver) -> AnyArray | None:
    """What a singular matrix annihilates: inverse iteration with a trace of stiffness added; None if that fails too."""
    added = sparse.diags_array(1e-10 * _row_maximum(A), format="csc")
    try:
        factors = function(sparse.csc_array(A + added), None)
    except SingularMatrixError:
        return None
    x = np.random.default_rng(0).standard_normal(A.shape[0])
    for _ in range(3):
        x = factors.solve(x)
        x = x / np.abs(x).max()
    return x


def _row_maximum(A: Sparse) -> NDArray[np.float64]:
    largest = np.maximum.reduceat(np.abs(A.data), A.indptr[:-1])
    return np.where(largest > 0.0, largest, 1.0)
