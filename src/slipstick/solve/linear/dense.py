"""Dense Jacobians, factorised by LAPACK when first solved with."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dgesv, dgetrf, dgetrs

from slipstick.solve.linear.jacobian import OF_CORRECTIONS, Bordered, Jacobian
from slipstick.typing import Array, BoolArray

REFINED_FROM = 250
"""Unknowns from which refining a solution by the factors of a neighbour costs less than new factors (measured)."""
_FILLED_FROM, _MOST_FILLED = 100, 0.75
"""Unknowns from which, and part of the columns up to which, factors of the filled ones alone cost less (measured)."""
_CONTRACTION = 0.2
"""Largest ratio of two refinements, one after the other, with which a solution is refined further."""
_MOST_REFINEMENTS = 10
_MOST_COLUMNS = 4
"""Columns of a right-hand side that are refined: for more, factors cost less."""
_ROUNDING = 1e-14
"""Refinement, over the solution, that is rounding."""
_SIGN_ERROR = 1e-6
"""Relative error of the solutions that show the sign of a determinant."""
_SEED = 1
"""Of their right-hand sides: results repeat."""


def solution(matrix: Array, right: Array) -> Array | None:
    """Solution of a small system for right (n,) or (n, k); None where it is exactly singular.

    For 16 unknowns in half the time of ``numpy.linalg.solve``.

    >>> solution(np.array([[2.0, 0.0], [0.0, 4.0]]), np.array([2.0, 2.0])), solution(np.zeros((1, 1)), np.ones(1))
    (array([1. , 0.5]), None)
    """
    x: Array
    _, _, x, zero = dgesv(matrix, right)
    return None if zero else x


class Factors:
    """LU factors of a matrix in Fortran order, in whose memory they stay.

    ``singular``: there is an exact zero on the diagonal.
    """

    __slots__ = ("_lu", "_pivots", "singular")

    def __init__(self, entries: Array) -> None:
        self._lu, self._pivots, zero = dgetrf(entries, overwrite_a=1)
        self.singular = zero > 0

    def solve(self, right: Array, transposed: bool = False) -> Array:
        """Solution for right (N,) or (N, k), or with the transpose."""
        x: Array = dgetrs(self._lu, self._pivots, right, trans=int(transposed))[0]
        return x

    def sign(self) -> int:
        """Sign of the determinant."""
        swapped, negative = self._pivots != np.arange(self._pivots.size), self._lu.diagonal() < 0
        return -1 if np.count_nonzero(swapped ^ negative) % 2 else 1


class FilledFactors(Factors):
    """Factors of a matrix (N, N) of which only the columns marked ``filled`` (N,) are not those of the identity.

    The other columns have entries in the last rows too, which are ``borders``, and which are filled. All other rows
    hold one of the other unknowns alone, so that only the block of the filled ones is factorised.
    """

    __slots__ = ("_above", "_borders", "_filled", "_others")

    def __init__(self, entries: Array, filled: BoolArray, borders: int) -> None:
        self._filled, self._others = np.flatnonzero(filled), np.flatnonzero(~filled)
        columns = entries.T[self._filled]
        self._above = columns[:, self._others]
        self._borders = entries[len(entries) - borders :, self._others]
        block = columns[:, self._filled]
        block[:, len(block) - borders :] -= self._above @ self._borders.T
        super().__init__(block.T)

    def solve(self, right: Array, transposed: bool = False) -> Array:
        """Solution for right (N,) or (N, k), or with the transpose."""
        right = np.asarray(right, dtype=float)
        x, inner, others = np.empty(right.shape), right[self._filled], right[self._others]
        first = len(inner) - len(self._borders)
        if transposed:
            inner -= self._above @ others
        else:
            inner[first:] -= self._borders @ others
        inner = super().solve(inner, transposed)
        x[self._filled] = inner
        x[self._others] = others - (self._borders.T @ inner[first:] if transposed else self._above.T @ inner)
        return x


class _Factorised(Jacobian):
    """LU factors, made on first use; a kind says its size and how it is written where they are made.

    ``borders`` is the number of rows and columns it was bordered with.
    """

    __slots__ = ("_lu", "_near", "_sign", "borders")

    borders: int
    _lu: Factors | None
    _near: Factors | None
    """Factors of a neighbouring Jacobian, by which solutions are refined."""
    _sign: int | None

    @abstractmethod
    def write(self, out: Array) -> BoolArray | None:
        """Write all entries into the first rows and columns of ``out``, which is zero and in Fortran order.

        Returns marks of the columns of ``out`` that are filled, if the others are those of the identity but for the
        borders.
        """

    def _factors(self) -> Factors:
        if self._lu is None:
            entries = np.zeros((self.size, self.size), order="F")
            filled = self.write(entries)
            if filled is None or self.size < _FILLED_FROM or np.count_nonzero(filled) > _MOST_FILLED * self.size:
                self._lu = Factors(entries)
            else:
                filled[self.size - max(1, self.borders) :] = True  # LAPACK takes no empty matrix
                self._lu = FilledFactors(entries, filled, self.borders)
        return self._lu

    @property
    def singular(self) -> bool:
        """Whether it is exactly singular; not where solutions are refined, which a singular one does not allow."""
        return self._near is None and (self._lu or self._factors()).singular

    def take_over(self, other: Jacobian) -> None:
        """Refine solutions by the factors of a neighbouring Jacobian, as long as few refinements do."""
        if self._lu is None and isinstance(other, _Factorised) and self.size == other.size >= REFINED_FROM:
            self._near = other._lu or other._near

    def release(self) -> None:
        """Free the factors."""
        self._lu = None

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or with its transpose."""
        if self._near is not None and not transposed and (refined := self._refined(right, 0.0)) is not None:
            return refined
        return (self._lu or self._factors()).solve(right, transposed)

    def solve_correction(self, right: Array, to: float = OF_CORRECTIONS) -> Array:
        """``solve``, to a relative error where solutions are refined."""
        if self._near is not None and (refined := self._refined(right, min(to, OF_CORRECTIONS))) is not None:
            return refined
        return self.solve(right)

    def _refined(self, right: Array, to: float) -> Array | None:
        """Solution by refinement to a relative error; None, and never again, where it would take many refinements."""
        assert self._near is not None
        x = self._near.solve(right)
        size = before = _sizes(x)
        for _ in range(_MOST_REFINEMENTS if right.ndim == 1 or right.shape[1] <= _MOST_COLUMNS else 0):
            change = self._near.solve(right - self.multiply(x))
            now = _sizes(change)
            x += change
            done = (now * now <= to * size * before) | (now <= _ROUNDING * size)  # the next one is smaller by the ratio
            if done.all():
                return x
            if not (done | (now <= _CONTRACTION * before)).all():
                break
            before = now
        self._near = None
        return None

    def sign(self) -> int:
        """Sign of the determinant.

        Solutions for a random right-hand side, which has a part along every eigenvector, are refined quickly only where
        no eigenvalue has changed its sign since the factors were made.
        """
        if self._sign is None and self._near is not None:
            known = self._near
            if self._refined(_every_direction(self.size), _SIGN_ERROR) is not None:
                self._sign = known.sign()
        if self._sign is None:
            self._sign = (self._lu or self._factors()).sign()
        return self._sign

    def bordered(self, column: Array, row: Array) -> BorderedDense:
        """With a further column (N,) and row (N + 1,)."""
        return BorderedDense(self, column, row)


@lru_cache(maxsize=8)
def _every_direction(size: int) -> Array:
    """A random right-hand side, the same each time."""
    return np.random.default_rng(_SEED).standard_normal(size)


def _sizes(x: Array) -> Array:
    """Norms of the columns."""
    return np.asarray(np.sqrt((x * x).sum(axis=0)))


_NOT_WRITTEN = np.empty((0, 0))


class DenseJacobian(_Factorised):
    """A Jacobian given by its ``matrix`` (N, N), which is kept and not written on.

    Or by a function that does what ``write`` does, and ``size``, N: many a Jacobian is never asked for. ``product``
    computes ``J @ x`` (N,) without the matrix.

    >>> J = DenseJacobian([[2.0, 1.0], [0.0, -4.0]])
    >>> J.solve(np.array([3.0, -4.0])), J.solve(np.array([2.0, -3.0]), transposed=True), J.sign()
    (array([1., 1.]), array([1., 1.]), -1)
    """

    __slots__ = ("_matrix", "_product", "_size", "_writer")

    _writer: Callable[[Array], BoolArray | None] | None
    _product: Callable[[Array], Array] | None

    def __init__(
        self,
        matrix: ArrayLike | Callable[[Array], BoolArray | None],
        size: int = 0,
        product: Callable[[Array], Array] | None = None,
    ) -> None:
        self._lu = self._near = self._sign = None
        self._product, self._writer, self.borders = product, None, 0
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

    def write(self, out: Array) -> BoolArray | None:
        """Write all entries into the first rows and columns of ``out``."""
        if self._writer is not None:
            return self._writer(out)
        out[: self._size, : self._size] = self._matrix
        return None

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        if self._writer is not None and self._product is not None and not transposed:
            if x.ndim == 1:
                return self._product(x)
            if x.shape[1] <= _MOST_COLUMNS:
                return np.stack([self._product(np.ascontiguousarray(column)) for column in x.T], axis=1)
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
        self._lu = self._near = self._sign = None
        self._inner, self._column, self._row, self.borders = inner, column, row, inner.borders + 1

    def write(self, out: Array) -> BoolArray | None:
        """Write all entries into the first rows and columns of ``out``."""
        filled = self._inner.write(out)
        last = self._row.size - 1
        out[:last, last] = self._column
        out[last, : last + 1] = self._row
        return filled

    def __repr__(self) -> str:
        return f"BorderedDense({self.size})"
