"""The Jacobian of a state at which there is none."""

from __future__ import annotations

import numpy as np

from slipstick.typing import Array


class UndefinedJacobian:
    """Singular, of any size, all of its answers nan.

    >>> UndefinedJacobian(2).bordered(np.ones(2), np.ones(3)).solve(np.ones(3))
    array([nan, nan, nan])
    """

    __slots__ = ("size",)

    singular = True

    def __init__(self, size: int) -> None:
        self.size = size

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
