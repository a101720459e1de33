"""Matrix-free Jacobians with several further unknowns and equations, solved as one."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slipstick.solve.linear.iterative import IterativeJacobian
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.typing import Array


class BlockBordered(IterativeJacobian):
    """``S^-1 J S`` (N, N), ``S`` diagonal, with further ``columns`` (N, k) and then further ``rows`` (k, N + k).

    One iteration solves for all unknowns, with the preconditioner of J bordered as well. Elimination of the border
    would solve for each of its columns first, exactly, at every state.

    Parameters
    ----------
    sizes
        Diagonal of ``S`` (N,) > 0. In these units all equations should be of like size.
    """

    def __init__(self, inner: IterativeJacobian, sizes: Array, columns: Array, rows: Array) -> None:
        self._inner, self._sizes_of, self._columns, self._rows = inner, sizes, columns, rows
        self.has_nearby = inner.has_nearby

    @property
    def size(self) -> int:
        """N + k."""
        return self._rows.shape[1]

    @property
    def _n(self) -> int:
        return len(self._columns)

    def take_over(self, other: Jacobian) -> None:
        """Take over from another one."""
        super().take_over(other)
        if isinstance(other, BlockBordered):
            self._inner.take_over(other._inner)

    def took(self, products: int, tolerance: float) -> bool:
        """See ``IterativeJacobian.took``; the border is eliminated again with a new P."""
        anew = self._inner.took(products, tolerance)
        if anew:
            for name in ("_eliminated", "_pulled"):
                self.__dict__.pop(name, None)
        return anew

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        first, last, s = x[: self._n], x[self._n :], self._sizes_of[(..., *(None,) * (x.ndim - 1))]
        if transposed:
            out = np.asarray(self._rows.T @ last)
            out[: self._n] += s * self._inner.multiply(first / s, transposed=True)
            out[self._n :] += self._columns.T @ first
            return out
        return np.concatenate([self._inner.multiply(s * first) / s + self._columns @ last, self._rows @ x])

    def nearby(self, x: Array) -> Array:
        """With the border as it is."""
        first, s = x[: self._n], self._sizes_of
        return np.concatenate([self._inner.nearby(s * first) / s + self._columns @ x[self._n :], self._rows @ x])

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more."""
        size, s = np.abs(x), self._sizes_of
        above = self._inner.bound(s * x[: self._n]) / s + np.abs(self._columns) @ size[self._n :]
        return np.concatenate([above, np.abs(self._rows) @ size])

    @cached_property
    def _eliminated(self) -> tuple[Array, Array]:
        """``P^-1`` times the columns, and the Schur complement of the corner, (k, k)."""
        s = self._sizes_of
        moved = np.column_stack([self._inner.precondition(s * column) / s for column in self._columns.T])
        return moved, self._rows[:, self._n :] - self._rows[:, : self._n] @ moved

    def precondition(self, x: Array, *, transposed: bool = False) -> Array:
        """``P^-1 @ x`` by block elimination of the border."""
        (moved, corner), s = self._eliminated, self._sizes_of
        first, last = x[: self._n], x[self._n :]
        if transposed:
            y = np.linalg.solve(corner.T, last - moved.T @ first)
            rest = first - self._rows[:, : self._n].T @ y
            return np.concatenate([s * self._inner.precondition(rest / s, transposed=True), y])
        here = self._inner.precondition(s * first) / s
        y = np.linalg.solve(corner, last - self._rows[:, : self._n] @ here)
        return np.concatenate([here - moved @ y, y])

    @property
    def departing(self) -> NDArray[np.intp] | None:
        """Those of the inner one: the border is the same in P."""
        return self._inner.departing

    def departure(self, x: Array) -> Array:
        """That of the inner one, in its units."""
        return self._inner.departure(self._sizes_of[self.departing] * x)

    def spread(self, d: Array, *, alone: bool = False) -> Array:
        """With the further unknowns, so that the further equations hold."""
        (moved, corner), s = self._eliminated, self._sizes_of
        y, inner = -np.linalg.solve(corner, self._pulled @ d), self._inner.spread(d, alone=alone)
        if alone:
            return np.asarray(inner / s[self.departing] - moved[self.departing] @ y)
        return np.concatenate([inner / s - moved @ y, y])

    def spread_transposed(self, x: Array) -> Array:
        """The transpose."""
        (moved, corner), n = self._eliminated, self._n
        y = np.linalg.solve(corner.T, x[n:] - moved.T @ x[:n])
        return np.asarray(self._inner.spread_transposed(x[:n] / self._sizes_of) - self._pulled.T @ y)

    @cached_property
    def _pulled(self) -> Array:
        """The further equations by what departs, (k, m)."""
        rows = self._rows[:, : self._n] / self._sizes_of
        return np.array([self._inner.spread_transposed(row) for row in rows])

    @property
    def preconditioner_sign(self) -> int:
        """Sign of the determinant of P: that of the inner one times that of the corner left over."""
        sign = self._inner.preconditioner_sign
        if not sign or not np.all(np.isfinite(self._eliminated[1])):
            return 0
        return sign * int(np.linalg.slogdet(self._eliminated[1])[0])

    def bordered(self, column: Array, row: Array) -> BlockBordered:  # type: ignore[override]
        """With a further column (N + k,) and row (N + k + 1,), solved with the others."""
        n = self._n
        rows = np.vstack([np.column_stack([self._rows, column[n:]]), row])
        return BlockBordered(self._inner, self._sizes_of, np.column_stack([self._columns, column[:n]]), rows)

    def __repr__(self) -> str:
        return f"BlockBordered({self.size})"
