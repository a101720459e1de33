"""One small protocol over sparse direct solvers for symmetric matrices, real or complex (``A = A^T``, not Hermitian).

Solvers, in the order of the automatic choice: ``rslab`` (LDL^T with inertia), ``pardiso`` (MKL, through the
``pypardiso`` package, LDL^T with inertia) and ``superlu`` (SciPy, LU, always there, no inertia). All run with one BLAS
thread around them: more threads slow the many small dense kernels of a sparse factorisation down.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from slipstick.errors import InputError

SINGULAR = 1e-14
"""A matrix scaled to unit rows is called singular when some vector is annihilated to this relative size."""


class SingularMatrixError(InputError):
    """The matrix has no inverse to working accuracy; ``null_vector`` (n,) is a motion it does not resist, if known."""

    def __init__(self, problem: str, null_vector: NDArray[Any] | None = None) -> None:
        super().__init__(problem)
        self.null_vector = null_vector


@dataclass(frozen=True, kw_only=True)
class Inertia:
    """Numbers of positive, negative and zero eigenvalues (Sylvester)."""

    positive: int
    negative: int
    zero: int


@runtime_checkable
class Factorisation(Protocol):
    """A factorised square matrix of n rows."""

    @property
    def name(self) -> str:
        """The solver's name, for the results."""
        ...

    @property
    def inertia(self) -> Inertia | None:
        """Numbers of eigenvalues by sign; None when the solver does not tell or the matrix is complex."""
        ...

    @property
    def memory(self) -> int:
        """Bytes held by the factors, estimated."""
        ...

    def solve(self, B: NDArray[Any]) -> NDArray[Any]:
        """Solution X of ``A X = B``; B is (n,) or (n, n_columns), X has its shape."""
        ...


class _Solved:
    """What the three solvers share: a name, an inertia, a size, and a function that solves (n, n_columns)."""

    def __init__(
        self,
        name: str,
        solve: Callable[[NDArray[Any]], NDArray[Any]],
        memory: int,
        inertia: Inertia | None = None,
        dtype: Any = np.float64,
    ) -> None:
        self.name = name
        self.memory = memory
        self.inertia = inertia
        self._solve = solve
        self._dtype = dtype

    def solve(self, B: NDArray[Any]) -> NDArray[Any]:
        B = np.asarray(B)
        if np.iscomplexobj(B) and not np.issubdtype(self._dtype, np.complexfloating):
            return self.solve(B.real) + 1j * self.solve(B.imag)
        columns = np.asarray(B if B.ndim == 2 else B[:, None], dtype=self._dtype)
        if columns.shape[1] == 0:
            return columns.reshape(B.shape)
        with one_blas_thread():
            return np.asarray(self._solve(columns)).reshape(B.shape)


def one_blas_thread() -> Any:
    """Context in which numpy's and MKL's linear algebra use one thread."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=1, user_api="blas")


def available_solvers() -> tuple[str, ...]:
    """Names of the direct solvers installed here, the preferred one first.

    >>> "superlu" in available_solvers()
    True
    """
    return tuple(name for name, (module, _) in _SOLVERS.items() if find_spec(module) is not None)


def factorise(A: Any, *, solver: str | None = None, check: bool = True) -> Factorisation:
    """Factorise a sparse symmetric matrix (n, n), real or complex symmetric.

    ``solver`` names one of :func:`available_solvers`; None or "auto" takes the first. With ``check`` two solutions are
    spent on making sure that the matrix is not singular to working accuracy. Raises SingularMatrixError (an
    InputError) for a singular matrix and InputError for an unknown or missing solver.

    >>> from scipy import sparse
    >>> factorise(sparse.diags_array([2.0, -4.0], format="csr")).solve(np.array([1.0, 1.0]))
    array([ 0.5 , -0.25])
    """
    module, function = _SOLVERS[_choose(solver)]
    del module
    matrix = sparse.csr_array(A)
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    matrix = matrix.T  # stored by columns without a copy: A is symmetric
    _require_no_empty_row(matrix)
    try:
        with one_blas_thread():
            factors = function(matrix)
    except SingularMatrixError as error:
        raise SingularMatrixError(str(error), _free_motion(matrix, function)) from error
    if check:
        _require_regular(matrix, factors)
    return factors


def shifted(K: Any, M: Any, shift: complex) -> Any:
    """``K - shift M`` by rows; without the work of joining patterns when both are stored alike."""
    K, M = sparse.csr_array(K), sparse.csr_array(M)
    alike = K.nnz == M.nnz and np.array_equal(K.indptr, M.indptr) and np.array_equal(K.indices, M.indices)
    if not alike:
        return K - shift * M
    data = M.data * -shift
    data += K.data
    return sparse.csr_array((data, K.indices, K.indptr), shape=K.shape)


def _choose(solver: str | None) -> str:
    available = available_solvers()
    if solver is None or solver == "auto":
        return available[0]
    if solver not in _SOLVERS:
        raise InputError(f"solver '{solver}' is not known; choose one of {', '.join(_SOLVERS)} or leave it out")
    if solver not in available:
        raise InputError(
            f"solver '{solver}' is not installed: pip install {_PACKAGES[solver]}, or choose {' or '.join(available)}"
        )
    return solver


def _require_no_empty_row(A: Any) -> None:
    empty = np.flatnonzero(np.diff(A.indptr) == 0)
    if len(empty):
        null = np.zeros(A.shape[0])
        null[empty] = 1.0
        raise SingularMatrixError(f"the matrix is singular: {len(empty)} rows are empty, the first is {empty[0]}", null)


def _require_regular(A: Any, factors: Factorisation) -> None:
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
    if left < SINGULAR:
        raise SingularMatrixError(
            f"the matrix is singular to working accuracy: it annihilates a motion to {left:.0e}", np.asarray(x / scale)
        )


def _free_motion(A: Any, function: Callable[[Any], Factorisation]) -> NDArray[Any] | None:
    """What a singular matrix annihilates: inverse iteration with a trace of stiffness added; None if that fails too."""
    added = sparse.diags_array(1e-10 * _row_maximum(A), format="csc")
    try:
        factors = function(sparse.csc_array(A + added))
    except SingularMatrixError:
        return None
    x = np.random.default_rng(0).standard_normal(A.shape[0])
    for _ in range(3):
        x = factors.solve(x)
        x = x / np.abs(x).max()
    return x


def _row_maximum(A: Any) -> NDArray[np.float64]:
    largest = np.maximum.reduceat(np.abs(A.data), A.indptr[:-1])
    return np.where(largest > 0.0, largest, 1.0)


@cache
def _home() -> int:
    """The process that has rslab's threads: in one forked from it they are gone, and waiting for them never ends."""
    return os.getpid()


def _rslab(A: Any) -> Factorisation:
    import rslab

    own: dict[str, Any] = {} if _home() == os.getpid() else {"threads": 1}
    try:
        factors = rslab.ldlt(A, **own)
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    inertia = None if np.iscomplexobj(A.data) else Inertia(**dict(zip(_SIGNS, factors.inertia, strict=True)))
    bytes_held = int(factors.factor_nnz) * (A.dtype.itemsize + 4)
    return _Solved("rslab", factors.solve_many, bytes_held, inertia, A.dtype)


_SIGNS = ("positive", "negative", "zero")


def _pardiso(A: Any) -> Factorisation:
    from slipstick.solve.pardiso import Pardiso

    factors = Pardiso(A)
    inertia = None if factors.inertia is None else Inertia(**dict(zip(_SIGNS, factors.inertia, strict=True)))
    return _Solved("pardiso", factors.solve, factors.memory, inertia, A.dtype)


def _superlu(A: Any) -> Factorisation:
    from scipy.sparse.linalg import splu

    try:
        factors = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    return _Solved("superlu", factors.solve, int(factors.nnz) * (A.dtype.itemsize + 4), None, A.dtype)


_SOLVERS: dict[str, tuple[str, Callable[[Any], Factorisation]]] = {
    "rslab": ("rslab", _rslab),
    "pardiso": ("pypardiso", _pardiso),
    "superlu": ("scipy", _superlu),
}
_PACKAGES = {"rslab": "rslab", "pardiso": "pypardiso", "superlu": "scipy"}
