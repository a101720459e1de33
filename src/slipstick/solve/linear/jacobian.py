"""Base class of Jacobians: Newton and the continuation ask them, and never see their entries."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from slipstick.typing import Array

OF_CORRECTIONS = 1e-6
"""Relative error of a solution that is corrected again."""


class Jacobian(ABC):
    """A square matrix J (N, N) in whatever form serves it; it is not changed once made."""

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
        """Keep what helps to solve with ``other``, a Jacobian of a state nearby: solutions stay as exact."""
        del other


class UndefinedJacobian(Jacobian):
    """Singular, of any size, all of its answers nan.

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
        """As undefined as before."""
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
        above = self._inner.multiply(first) + np.multiply.outer(self._column, x[-1])
        return np.concatenate([above, np.reshape(self._row @ x, last.shape)])

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more."""
        size = np.abs(x)
        return np.append(self._inner.bound(x[:-1]) + np.abs(self._column) * size[-1], np.abs(self._row) @ size)
