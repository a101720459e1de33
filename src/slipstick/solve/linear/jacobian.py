"""Jacobians as Newton and the continuation see them: the base class, and those made of another one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from slipstick.typing import Array, BoolArray

OF_CORRECTIONS = 1e-6
"""Relative error of a solution that the next Newton correction corrects again."""


class Jacobian(ABC):
    """A square matrix J (N, N) in any form; it does not change."""

    __slots__ = ()

    @property
    @abstractmethod
    def size(self) -> int:
        """N."""

    @property
    @abstractmethod
    def singular(self) -> bool:
        """Whether J is exactly singular: ``solve`` and ``sign`` then have no meaning."""

    @abstractmethod
    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x`` or ``J.T @ x`` for x (N,) or (N, k)."""

    @abstractmethod
    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right`` or ``J.T @ x = right`` for right (N,) or (N, k)."""

    @abstractmethod
    def sign(self) -> int:
        """Sign of the determinant, 1 or -1."""

    @abstractmethod
    def bound(self, x: Array) -> Array:
        """``|J| @ |x|`` (N,), or more: the sizes of the terms whose sum each entry of ``J @ x`` is."""

    @abstractmethod
    def bordered(self, column: Array, row: Array) -> Jacobian:
        """J with a further ``column`` (N,) and then a further ``row`` (N + 1,), the corner being the row's last."""

    def solve_correction(self, right: Array, to: float = OF_CORRECTIONS) -> Array:
        """``solve`` to a relative error, where that costs less: for a solution that is corrected again."""
        return self.solve(right)

    def take_over(self, other: Jacobian) -> None:
        """Reuse the preconditioner, or the like, of a neighbouring Jacobian: solutions are as exact as without."""
        del other

    def release(self) -> None:
        """Free the memory of what is made again where it is needed again, such as factors."""
        return


class UndefinedJacobian(Jacobian):
    """A singular Jacobian of any size, whose results are nan.

    >>> UndefinedJacobian(2).bordered(np.ones(2), np.ones(3)).solve(np.ones(3))
    array([nan, nan, nan])
    """

    __slots__ = ("_size",)

    singular = True

    def __init__(self, size: int) -> None:
        self._size = size

    @property
    def size(self) -> int:
        """N."""
        return self._size

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """Nan."""
        return np.full(np.shape(x), np.nan)

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Nan."""
        return np.full(np.shape(right), np.nan)

    def sign(self) -> int:
        """Without meaning, as of every singular matrix."""
        return 1

    def bound(self, x: Array) -> Array:
        """Nan."""
        return np.full(np.shape(x), np.nan)

    def bordered(self, column: Array, row: Array) -> UndefinedJacobian:
        """An undefined Jacobian."""
        return UndefinedJacobian(self.size + 1)


class Bordered(Jacobian):
    """Products of a Jacobian ``_inner`` with a further column (N,) and row (N + 1,)."""

    __slots__ = ()

    _inner: Jacobian
    _column: Array
    _row: Array

    @property
    def size(self) -> int:
        """N + 1."""
        return self._row.size

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        last, first = x[-1:], x[:-1]
        if transposed:
            product = np.multiply.outer(self._row, x[-1])
            product[:-1] += self._inner.multiply(first, transposed=True)
            product[-1] += self._column @ first
            return product
        out = np.empty(x.shape)
        out[:-1], out[-1] = self._inner.multiply(first), self._row @ x
        out[:-1] += self._column * last if x.ndim == 1 else self._column[:, None] * last
        return out

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more."""
        size = np.abs(x)
        return np.append(self._inner.bound(x[:-1]) + np.abs(self._column) * size[-1], np.abs(self._row) @ size)


class Eliminated(Jacobian):
    """J (N, N) with further ``columns`` (N, k) and then further ``rows`` (k, N + k), solved by block elimination.

    J itself must not be singular. ``solved`` is ``J^-1 columns`` where it is known.

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
        """Schur complement of the corner, (k, k)."""
        return np.asarray(self._rows[:, self._n :] - self._rows[:, : self._n] @ self._solved)

    @property
    def singular(self) -> bool:
        """Whether the inner Jacobian, or the Schur complement of the corner, is exactly singular."""
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


class Scaled(Jacobian):
    """``S^-1 J S`` for ``S`` diagonal with ``sizes`` (N,) > 0: unknowns and equations in units of their own.

    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> J = Scaled(DenseJacobian(np.array([[2.0, 1.0], [0.0, 4.0]])), np.array([1.0, 10.0]))
    >>> J.multiply(np.array([0.0, 1.0])), J.solve(np.array([10.0, 4.0])), J.sign()
    (array([10.,  4.]), array([0., 1.]), 1)
    """

    def __init__(self, inner: Jacobian, sizes: Array) -> None:
        self._inner, self._sizes = inner, sizes

    @property
    def size(self) -> int:
        """N."""
        return self._inner.size

    @property
    def singular(self) -> bool:
        """Whether J is exactly singular."""
        return self._inner.singular

    def _sizes_for(self, x: Array) -> Array:
        return self._sizes if x.ndim == 1 else self._sizes[:, None]

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """Product with x (N,) or (N, k), or of the transpose."""
        s = self._sizes_for(x)
        if transposed:
            return np.asarray(s * self._inner.multiply(x / s, transposed=True))
        return np.asarray(self._inner.multiply(s * x) / s)

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution for right (N,) or (N, k), or with the transpose."""
        s = self._sizes_for(right)
        if transposed:
            return np.asarray(s * self._inner.solve(right / s, transposed=True))
        return np.asarray(self._inner.solve(s * right) / s)

    def sign(self) -> int:
        """Sign of the determinant."""
        return self._inner.sign()

    def bound(self, x: Array) -> Array:
        """``|S^-1 J S| |x|``, or more."""
        return np.asarray(self._inner.bound(self._sizes * x) / self._sizes)

    def bordered(self, column: Array, row: Array) -> Jacobian:
        """With a further column (N,) and row (N + 1,)."""
        return Eliminated(self, column[:, None], row[None])


class EmbeddedJacobian(Jacobian):
    """A Jacobian of which ``inner`` is the block of the unknowns that ``active`` (N,) marks; the others have ones.

    ``others`` are the entries of the last row, an active one, in the columns of the other unknowns; zero without it.

    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> J = EmbeddedJacobian(DenseJacobian(np.array([[2.0]])), np.array([True, False]))
    >>> J.bordered(np.zeros(2), np.array([0.0, 1.0, 1.0])).solve(np.array([4.0, 1.0, 3.0]))
    array([2., 1., 2.])
    """

    __slots__ = ("_active", "_inner", "_others")

    def __init__(self, inner: Jacobian, active: BoolArray, others: Array | None = None) -> None:
        self._inner, self._active = inner, active
        self._others = np.zeros(active.size - inner.size) if others is None else others

    @property
    def size(self) -> int:
        """N."""
        return self._active.size

    @property
    def singular(self) -> bool:
        """Whether the inner one is."""
        return self._inner.singular

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        out, others = np.array(x, dtype=float), ~self._active
        out[self._active] = self._inner.multiply(x[self._active], transposed=transposed)
        if transposed:
            out[others] += np.multiply.outer(self._others, x[-1])
        else:
            out[-1] += self._others @ x[others]
        return out

    def take_over(self, other: Jacobian) -> None:
        """Reuse the inner Jacobian of another one with the same active unknowns."""
        if isinstance(other, EmbeddedJacobian) and np.array_equal(other._active, self._active):
            self._inner.take_over(other._inner)

    def release(self) -> None:
        """Free the memory of the inner one."""
        self._inner.release()

    def solve_correction(self, right: Array, to: float = OF_CORRECTIONS) -> Array:
        """Solution to fewer digits, where that costs the inner one less."""
        out = np.array(right, dtype=float)
        out[-1] -= self._others @ right[~self._active]
        out[self._active] = self._inner.solve_correction(out[self._active], to)
        return out

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or of the transpose."""
        out, others = np.array(right, dtype=float), ~self._active
        if not transposed:
            out[-1] -= self._others @ right[others]
        out[self._active] = self._inner.solve(out[self._active], transposed=transposed)
        if transposed:
            out[others] -= np.multiply.outer(self._others, out[-1])
        return out

    def sign(self) -> int:
        """That of the inner one."""
        return self._inner.sign()

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``."""
        out, others = np.abs(x), ~self._active
        out[self._active] = self._inner.bound(x[self._active])
        out[-1] += np.abs(self._others) @ np.abs(x[others])
        return out

    def bordered(self, column: Array, row: Array) -> EmbeddedJacobian:
        """With a further column, zero at the others, and a further row."""
        active = np.append(self._active, True)
        return EmbeddedJacobian(self._inner.bordered(column[self._active], row[active]), active, row[~active])
