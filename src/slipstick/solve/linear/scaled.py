"""A Jacobian whose unknowns and equations are measured in units of their own."""

from __future__ import annotations

import numpy as np

from slipstick.solve.linear.eliminated import Eliminated
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.typing import Array


class Scaled:
    """``S^-1 J S`` for ``S`` diagonal with ``sizes`` (N,) > 0.

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

    def _own(self, x: Array) -> Array:
        return self._sizes if x.ndim == 1 else self._sizes[:, None]

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """Product with x (N,) or (N, k), or of the transpose."""
        s = self._own(x)
        if transposed:
            return np.asarray(s * self._inner.multiply(x / s, transposed=True))
        return np.asarray(self._inner.multiply(s * x) / s)

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution for right (N,) or (N, k), or with the transpose."""
        s = self._own(right)
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
