"""A Jacobian of some of the unknowns, where the others are held at zero."""

from __future__ import annotations

import numpy as np

from slipstick.solve.linear.jacobian import Jacobian
from slipstick.typing import Array, BoolArray


class EmbeddedJacobian:
    """``inner`` on the unknowns that ``active`` (N,) marks, a one on the diagonal of each other.

    ``beside`` is what the last row, an active one, has in the columns of the others; zero without it.

    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> J = EmbeddedJacobian(DenseJacobian(np.array([[2.0]])), np.array([True, False]))
    >>> J.bordered(np.zeros(2), np.array([0.0, 1.0, 1.0])).solve(np.array([4.0, 1.0, 3.0]))
    array([2., 1., 2.])
    """

    __slots__ = ("_active", "_beside", "_inner")

    def __init__(self, inner: Jacobian, active: BoolArray, beside: Array | None = None) -> None:
        self._inner, self._active = inner, active
        self._beside = np.zeros(active.size - inner.size) if beside is None else beside

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
            out[others] += np.multiply.outer(self._beside, x[-1])
        else:
            out[-1] += self._beside @ x[others]
        return out

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or of the transpose."""
        out, others = np.array(right, dtype=float), ~self._active
        if not transposed:
            out[-1] -= self._beside @ right[others]
        out[self._active] = self._inner.solve(out[self._active], transposed=transposed)
        if transposed:
            out[others] -= np.multiply.outer(self._beside, out[-1])
        return out

    def sign(self) -> int:
        """That of the inner one."""
        return self._inner.sign()

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``."""
        out, others = np.abs(x), ~self._active
        out[self._active] = self._inner.bound(x[self._active])
        out[-1] += np.abs(self._beside) @ np.abs(x[others])
        return out

    def bordered(self, column: Array, row: Array) -> EmbeddedJacobian:
        """With a further column, zero at the others, and a further row."""
        active = np.append(self._active, True)
        return EmbeddedJacobian(self._inner.bordered(column[self._active], row[active]), active, row[~active])
