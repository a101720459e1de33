"""Factors of sparse symmetric matrices, real or complex (``A = A^T``, not Hermitian), by the solver at hand.

In the order of the automatic choice: ``rslab`` (LDL^T with inertia), ``pardiso`` (MKL, through the ``pypardiso``
package, LDL^T with inertia) and ``superlu`` (SciPy, LU, always there, no inertia). All run with one BLAS thread around
them: more threads slow the many small dense kernels of a sparse factorisation down.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from slipstick.errors import InputError
from slipstick.typing import AnyArray, Sparse

_SINGULAR = 1e-14
"""Product of a matrix scaled to unit rows with a vector, over its size, below which the matrix counts as singular."""


class SingularMatrixError(InputError):
    """The matrix has no inverse to working accuracy; ``null_vector`` (n,) is a motion it does not resist, if known."""

    def __init__(self, problem: str, null_vector: AnyArray | None = None) -> None:
        super().__init__(problem)
        self.null_vector = null_vector


class Inertia(NamedTuple):
    """Numbers of positive, negative and zero eigenvalues (Sylvester)."""

    positive: int
    negative: int
    zero: int


@dataclass(frozen=True)
class Factorisation:
    """A factorised square matrix of n rows, whoever factorised it.

    Attributes
    ----------
    name
        The solver's name, for the results.
    solver
        Solves (n, n_columns) of ``dtype``, that of the matrix.
    memory
        Bytes held by the factors, estimated.
    inertia
        Numbers of eigenvalues by sign; None when the solver does not tell or the matrix is complex.
    ordering
        What the solver found out about the pattern alone; serves other matrices of the pattern. None if nothing.
    """

    name: str
    solver: Callable[[AnyArray], AnyArray]
    memory: int
    inertia: Inertia | None = None
    dtype: Any = np.float64
    ordering: Any = None

    def solve(self, B: AnyArray) -> AnyArray:
        """Solution X of ``A X = B``; B is (n,) or (n, n_columns), real or complex, X has its shape."""
        B = np.asarray(B)
        if np.iscomplexobj(B) and not np.issubdtype(self.dtype, np.complexfloating):
            return self.solve(B.real) + 1j * self.solve(B.imag)
        columns = np.asarray(B if B.ndim == 2 else B[:, None], dtype=self.dtype)
        if columns.shape[1] == 0:
            return columns.reshape(B.shape)
        with one_blas_thread():
            return np.asarray(self.solver(columns)).reshape(B.shape)


def one_blas_thread() -> AbstractContextManager[Any]:
    """Context in which numpy's and MKL's linear algebra use one thread."""
    limit: AbstractContextManager[Any] = blas_libraries().limit(limits=1, user_api="blas")
    return limit


@cache
def blas_libraries() -> Any:
    """Those that are loaded. Finding them takes milliseconds: once, and again (``cache_clear``) when one is loaded."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def factorise(A: Sparse, *, solver: str | None = None, check: bool = True, ordering: Any = None) -> Factorisation:
    """Factorise a sparse symmetric matrix (n, n), real or complex symmetric.

    ``solver`` names one of :func:`available_solvers`; None or "auto" takes the first.
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
        require_regular(matrix, factors)
    return factors


def shifted(K: Sparse, M: Sparse, shift: complex) -> Any:
    """``K - shift M`` by rows; without the work of joining patterns when both are stored alike."""
    K, M = sparse.csr_array(K), sparse.csr_array(M)
    alike = (
        K.nnz == M.nnz
        and K.dtype == M.dtype
        and np.array_equal(K.indptr, M.indptr)
        and np.array_equal(K.indices, M.indices)
    )
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


def require_regular(A: Sparse, factors: Factorisation) -> None:
    """Two steps of inverse iteration on the matrix with rows scaled to one: what it nearly annihilates.

    Raises SingularMatrixError for what is annihilated to working accuracy.
    """
    scale = np.sqrt(_row_maximum(A))
    x = np.random.default_rng(0).standard_normal(A.shape[0])
    for _ in range(2):
        x = factors.solve(scale * x)
        size = np.linalg.norm(scale * x)
        if not np.isfinite(size):
            raise SingularMatrixError("the matrix is singular: its solution is not finite")
        x = x * (scale / size)
        left = np.linalg.norm((A @ (x / scale)) / scale)
    if left < _SINGULAR:
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


Solver = Callable[[Any, Any], Factorisation]
"""Factorises a matrix stored by columns; takes an ``ordering`` known from another matrix too, or None."""


def available_solvers() -> tuple[str, ...]:
    """Names of the direct solvers installed here, the preferred one first.

    >>> "superlu" in available_solvers()
    True
    """
    return tuple(name for name, (package, _) in _SOLVERS.items() if find_spec(package) is not None)


def solver_named(solver: str | None) -> Solver:
    """The function of a solver; None or "auto" takes the first there is."""
    available = available_solvers()
    name = available[0] if solver in (None, "auto") else str(solver)
    if name not in _SOLVERS:
        raise InputError(f"solver '{name}' is not known; choose one of {', '.join(_SOLVERS)} or leave it out")
    package, function = _SOLVERS[name]
    if name not in available:
        raise InputError(f"solver '{name}' is not installed: pip install {package}, or choose {' or '.join(available)}")
    return function


@cache
def _home() -> int:
    """The process that has rslab's threads: in one forked from it they are gone, and waiting for them never ends."""
    return os.getpid()


def _rslab(A: Sparse, known: Any) -> Factorisation:
    threads = {} if _home() == os.getpid() else {"threads": 1}
    try:
        factors, ordering = _ordered(A, known, threads)
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    inertia = None if np.iscomplexobj(A.data) else Inertia(*factors.inertia)
    bytes_held = int(factors.factor_nnz) * (A.dtype.itemsize + 4)
    return Factorisation("rslab", factors.solve_many, bytes_held, inertia, A.dtype, ordering)


def _ordered(A: Sparse, known: Any, threads: dict[str, int]) -> tuple[Any, Any]:
    """Factors and the ordering they were made with: the one known where A has its pattern, else its own."""
    import rslab

    if known is not None:
        try:
            return known.factor(A, **threads), known
        except ValueError:  # another pattern
            pass
    ordering = rslab.analyze(A, path="ldlt", **threads)
    return ordering.factor(A, **threads), ordering


def _pardiso(A: Sparse, known: Any) -> Factorisation:
    factors = Pardiso(A)
    return Factorisation("pardiso", factors.solve, factors.memory, factors.inertia, A.dtype)


def _superlu(A: Sparse, known: Any) -> Factorisation:
    from scipy.sparse.linalg import splu

    try:
        factors = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    return Factorisation("superlu", factors.solve, int(factors.nnz) * (A.dtype.itemsize + 4), None, A.dtype)


_SOLVERS: dict[str, tuple[str, Solver]] = {
    "rslab": ("rslab", _rslab),
    "pardiso": ("pypardiso", _pardiso),
    "superlu": ("scipy", _superlu),
}

_REAL_SYMMETRIC, _COMPLEX_SYMMETRIC = -2, 6
_FACTORISE, _SOLVE, _RELEASE = 12, 33, -1


class Pardiso:
    """LDL^T of a sparse symmetric matrix (n, n) by MKL, through the library that ``pypardiso`` brings and finds."""

    def __init__(self, A: Sparse) -> None:
        from pypardiso import PyPardisoSolver

        self._call = PyPardisoSolver().libmkl["pardiso"]  # a fresh handle: no argument types set
        blas_libraries.cache_clear()  # MKL is one of them now
        self._matrix = _upper(A)
        self._type = _COMPLEX_SYMMETRIC if np.iscomplexobj(A.data) else _REAL_SYMMETRIC
        self._handle = np.zeros(64, dtype=np.int64)
        self._options = np.zeros(64, dtype=np.int32)
        # these hold; nested dissection; no refinement; perturbed pivots 1e-13; scaling and matching; zero-based indices
        for place, value in {0: 1, 1: 2, 9: 13, 10: 1, 12: 1, 17: -1, 20: 1, 34: 1}.items():
            self._options[place] = value
        self._run(_FACTORISE, np.zeros((0, 1), dtype=self._matrix.dtype))
        self.memory = 1024 * int(self._options[15] + self._options[16])

    @property
    def inertia(self) -> Inertia | None:
        """None for a complex matrix."""
        if self._type == _COMPLEX_SYMMETRIC:
            return None
        positive, negative = int(self._options[21]), int(self._options[22])
        return Inertia(positive, negative, self._matrix.shape[0] - positive - negative)

    def solve(self, B: AnyArray) -> AnyArray:
        """Solution of ``A X = B``, B (n, n_columns)."""
        return self._run(_SOLVE, np.asfortranarray(B, dtype=self._matrix.dtype))

    def _run(self, phase: int, B: AnyArray) -> AnyArray:
        X = np.empty_like(B, order="F")
        A, error, permutation = self._matrix, ctypes.c_int32(0), np.zeros(1, dtype=np.int32)
        numbers = [ctypes.byref(ctypes.c_int32(k)) for k in (1, 1, self._type, phase, A.shape[0])]
        arrays = [a.ctypes.data_as(ctypes.c_void_p) for a in (A.data, A.indptr, A.indices, permutation)]
        columns, quiet = ctypes.byref(ctypes.c_int32(B.shape[1])), ctypes.byref(ctypes.c_int32(0))
        tail = [a.ctypes.data_as(ctypes.c_void_p) for a in (B, X)]
        options = self._options.ctypes.data_as(ctypes.c_void_p)
        handle = self._handle.ctypes.data_as(ctypes.c_void_p)
        self._call(handle, *numbers, *arrays, columns, options, quiet, *tail, ctypes.byref(error))
        if error.value:
            raise InputError(f"PARDISO refused the matrix (its error {error.value}); choose another solver")
        return X

    def __del__(self) -> None:
        if getattr(self, "_handle", None) is not None and self._handle.any():
            self._run(_RELEASE, np.zeros((0, 1), dtype=self._matrix.dtype))


def _upper(A: Sparse) -> Any:
    """Upper triangle in rows, every diagonal entry stored, as PARDISO wants it."""
    coordinates = sparse.triu(A).tocoo()
    rows = np.concatenate([coordinates.row, np.arange(A.shape[0])])
    columns = np.concatenate([coordinates.col, np.arange(A.shape[0])])
    values = np.concatenate([coordinates.data, np.zeros(A.shape[0], dtype=A.dtype)])
    full = sparse.csr_array((values, (rows, columns)), shape=A.shape)
    full.sum_duplicates()
    full.sort_indices()
    return sparse.csr_array((full.data, full.indices.astype(np.int32), full.indptr.astype(np.int32)), shape=A.shape)
