"""Dense Jacobians, factorised by LAPACK when first solved with."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from slipstick.solve.linear.jacobian import Bordered, Jacobian
from slipstick.typing import Array


class _Factorised(Jacobian):
    """LU factors, made on first use in the memory they stay in; a kind says its size and how it is written there."""

    __slots__ = ("_lu",)

    _lu: tuple[Array, NDArray[np.int32], int] | None

    @abstractmethod
    def write(self, out: Array) -> None:
        """Write all entries into the first rows and columns of ``out``, which is zero and in Fortran order."""

    def _factors(self) -> tuple[Array, NDArray[np.int32], int]:
        """LU factors, pivots, and LAPACK's word on singularity (positive: an exact zero on the diagonal)."""
        if self._lu is None:
            entries = np.zeros((self.size, self.size), order="F")
            self.write(entries)
            self._lu = dgetrf(entries, overwrite_a=1)
        return self._lu

    @property
    def singular(self) -> bool:
        """Whether it is exactly singular."""
        return (self._lu or self._factors())[2] > 0

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or with its transpose."""
        lu, pivots, _ = self._lu or self._factors()
        x: Array = dgetrs(lu, pivots, right, trans=int(transposed))[0]
        return x

    def sign(self) -> int:
        """Sign of the determinant."""
        lu, pivots, _ = self._lu or self._factors()
        swapped, negative = pivots != np.arange(pivots.size), lu.diagonal() < 0
        return -1 if np.count_nonzero(swapped ^ negative) % 2 else 1

    def bordered(self, column: Array, row: Array) -> BorderedDense:
        """With a further column (N,) and row (N + 1,)."""
        return BorderedDense(self, column, row)


_NOT_WRITTEN = np.empty((0, 0))


class DenseJacobian(_Factorised):
    """A Jacobian given by its ``matrix`` (N, N), which is kept and not written on.

    Or by a function that does what ``write`` does, and ``size``, N: many a Jacobian is never asked for.

    >>> J = DenseJacobian([[2.0, 1.0], [0.0, -4.0]])
    >>> J.solve(np.array([3.0, -4.0])), J.solve(np.array([2.0, -3.0]), transposed=True), J.sign()
    (array([1., 1.]), array([1., 1.]), -1)
    """

    __slots__ = ("_matrix", "_size", "_writer")

    def __init__(self, matrix: ArrayLike | Callable[[Array], None], size: int = 0) -> None:
        self._lu = None
        self._writer: Callable[[Array], None] | None = None
        self._matrix: Array = _NOT_WRITTEN
        if callable(matrix):
            self._writer, self._size = matrix, size
        else:
            self._matrix = np.asarray(matrix, dtype=float)
            self._size = len(self._matrix)

    @property
    def matrix(self) -> Array:
        """All entries (N, N)."""
        if self._writer is not None:
            self._matrix = np.zeros((self._size, self._size), order="F")
            self._writer(self._matrix)
            self._writer = None
        return self._matrix

    @property
    def size(self) -> int:
        """N."""
        return self._size

    def write(self, out: Array) -> None:
        """Write all entries into the first rows and columns of ``out``."""
        if self._writer is None:
            out[: self._size, : self._size] = self._matrix
        else:
            self._writer(out)

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        return np.asarray((self.matrix.T if transposed else self.matrix) @ x)

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``."""
        return np.asarray(np.abs(self.matrix) @ np.abs(x))

    def __repr__(self) -> str:
        return f"DenseJacobian({self.size})"


class BorderedDense(Bordered, _Factorised):
    """A dense Jacobian with a further column (N,) and row (N + 1,): assembled where it is factorised, not before."""

    __slots__ = ("_column", "_inner", "_row")

    _inner: _Factorised

    def __init__(self, inner: _Factorised, column: Array, row: Array) -> None:
        self._lu = None
        self._inner, self._column, self._row = inner, column, row

    def write(self, out: Array) -> None:
        """Write all entries into the first rows and columns of ``out``."""
        self._inner.write(out)
        last = self._row.size - 1
        out[:last, last] = self._column
        out[last, : last + 1] = self._row

    def __repr__(self) -> str:
        return f"BorderedDense({self.size})"
