"""Which harmonics are kept, and how their coefficients are laid out: (0, c1, s1, c2, s2, ...)."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.errors import InputError

Array = NDArray[np.float64]


class Harmonics:
    """An increasing set of harmonic orders starting at 0 (THEORY.md section 1).

    A quantity is ``x(tau) = H_minus(tau) @ X`` with ``L = 2 n + 1`` coefficients ``X`` in the order
    ``(0, c1, s1, c2, s2, ...)``: constant, cosine and sine of each order.

    Parameters
    ----------
    orders
        Integers ``0 = m_0 < m_1 < ... < m_n``; gaps are allowed.

    Raises
    ------
    InputError
        If the orders are empty, not integers, not increasing, or do not start at 0.

    Examples
    --------
    >>> h = Harmonics([0, 1, 3])
    >>> h.size, h.labels
    (5, ('0', 'c1', 's1', 'c3', 's3'))
    >>> h.H_minus(0.0)
    array([1., 1., 0., 1., 0.])
    """

    def __init__(self, orders: Iterable[int]) -> None:
        given = list(orders)
        if any(isinstance(m, bool) or int(m) != m for m in given):
            raise InputError(f"harmonics: found {given}; expected whole numbers such as 0..10 or [0, 1, 3]")
        self.orders: tuple[int, ...] = tuple(int(m) for m in given)
        increasing = all(a < b for a, b in zip(self.orders, self.orders[1:], strict=False))
        if not self.orders or self.orders[0] != 0 or not increasing:
            raise InputError(f"harmonics: found {list(self.orders)}; expected increasing whole numbers starting at 0")

    @property
    def n(self) -> int:
        """Number of nonzero orders."""
        return len(self.orders) - 1

    @property
    def size(self) -> int:
        """Number of coefficients ``L = 2 n + 1``."""
        return 2 * self.n + 1

    @property
    def highest(self) -> int:
        """The largest order."""
        return self.orders[-1]

    @cached_property
    def m(self) -> NDArray[np.int64]:
        """The nonzero orders as an array (n,)."""
        return np.array(self.orders[1:], dtype=np.int64)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Names of the coefficients: '0', 'c1', 's1', ..."""
        return ("0", *(f"{part}{m}" for m in self.orders[1:] for part in "cs"))

    def index(self, order: int, part: str = "c") -> int:
        """Position of the cosine ("c") or sine ("s") coefficient of an order; order 0 is position 0."""
        if order not in self.orders:
            raise InputError(f"harmonic {order} is not kept; the harmonics are {list(self.orders)}")
        if order == 0:
            return 0
        return 2 * self.orders.index(order) - (part == "c")

    def H_minus(self, tau: ArrayLike) -> Array:
        """``{1, cos m_1 tau, sin m_1 tau, ...}``, shape (..., L) [Eq. 6]."""
        tau = np.asarray(tau, dtype=float)
        out = np.ones((*tau.shape, self.size))
        angle = tau[..., None] * self.m
        out[..., 1::2] = np.cos(angle)
        out[..., 2::2] = np.sin(angle)
        return out

    def H_plus(self, tau: ArrayLike) -> Array:
        """As ``H_minus`` with first entry 1/2 [Eq. 19]."""
        out = self.H_minus(tau)
        out[..., 0] = 0.5
        return out

    def derivative(self, X: ArrayLike) -> Array:
        """Coefficients of ``dx/dtau``: the operator ``L`` of Eq. (40) applied to (..., L)."""
        X = np.asarray(X, dtype=float)
        out = np.zeros_like(X)
        out[..., 1::2] = self.m * X[..., 2::2]
        out[..., 2::2] = -self.m * X[..., 1::2]
        return out

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Harmonics) and self.orders == other.orders

    def __hash__(self) -> int:
        return hash(self.orders)

    def __repr__(self) -> str:
        return f"Harmonics({list(self.orders)})"
