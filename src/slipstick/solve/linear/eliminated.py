"""A Jacobian with borders, solved by eliminating them: the factors of the inner one serve, whatever the borders."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from slipstick.solve.linear.jacobian import Jacobian
from slipstick.typing import Array


class Eliminated:
    """J (N, N) with further ``columns`` (N, k) and then further ``rows`` (k, N + k).

    J itself must not be singular. ``solved`` is ``J^-1 columns`` where that is known.

    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> J = Eliminated(DenseJacobian([[2.0]]), np.array([[1.0]]), np.array([[3.0, 0.0]]))
    >>> J.solve(np.array([3.0, 3.0])), J.solve(np.array([5.0, 1.0]), transposed=True), J.sign()
    (array([1., 1.]), array([1., 1.]), -1)
    """

    def __init__(self, inner: Jacobian, columns: Array, rows: Array, solved: Array | None = None) -> None:
        self._inner, self._columns, self._rows = inner, columns, rows
        if solved is not None:
            self._solved = solved

    @property
    def size(self) -> int:
        """N + k."""
        return self._rows.shape[1]

    @property
    def _n(self) -> int:
        return self._columns.shape[0]

    @cached_property
    def _solved(self) -> Array:
        return self._inner.solve(self._columns)

    @cached_property
    def _corner(self) -> Array:
        """What is left of the corner, (k, k)."""
        return np.asarray(self._rows[:, self._n :] - self._rows[:, : self._n] @ self._solved)

    @property
    def singular(self) -> bool:
        """Whether the inner one, or what is left of the corner, is exactly singular."""
        if self._inner.singular or not np.all(np.isfinite(self._corner)):
            return True
        return bool(np.linalg.det(self._corner) == 0.0)

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        first, last = x[: self._n], x[self._n :]
        if transposed:
            whole = self._rows.T @ last
            whole[: self._n] += self._inner.multiply(first, transposed=True)
            whole[self._n :] += self._columns.T @ first
            return np.asarray(whole)
        return np.concatenate([self._inner.multiply(first) + self._columns @ last, self._rows @ x])

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or with its transpose."""
        first, last = right[: self._n], right[self._n :]
        if transposed:
            u = np.linalg.solve(self._corner.T, last - self._solved.T @ first)
            return np.concatenate([self._inner.solve(first - self._rows[:, : self._n].T @ u, transposed=True), u])
        y = self._inner.solve(first)
        u = np.linalg.solve(self._corner, last - self._rows[:, : self._n] @ y)
        return np.concatenate([y - self._solved @ u, u])

    def sign(self) -> int:
        """Sign of the determinant."""
        return self._inner.sign() * (-1 if np.linalg.det(self._corner) < 0 else 1)

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more."""
        size = np.abs(x)
        above = self._inner.bound(x[: self._n]) + np.abs(self._columns) @ size[self._n :]
        return np.concatenate([above, np.abs(self._rows) @ size])

    def bordered(self, column: Array, row: Array) -> Eliminated:
        """With a further column (N + k,) and row (N + k + 1,); the inner factors are kept."""
        n = self._n
        columns = np.column_stack([self._columns, column[:n]])
        rows = np.vstack([np.column_stack([self._rows, column[n:]]), row])
        solved = np.column_stack([self._solved, self._inner.solve(column[:n])])
        return Eliminated(self._inner, columns, rows, solved)

    def __repr__(self) -> str:
        return f"Eliminated({self.size})"
