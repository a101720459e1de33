"""Which harmonics are kept, and how their coefficients are laid out: (0, c1, s1, c2, s2, ...)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property, lru_cache
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.faults import numbers, shown, whole, wrong
from slipstick.quantities import harmonic_orders
from slipstick.typing import Array, Orders, Reals

HIGHEST = 10_000
"""Orders above it are no harmonics of a vibration but a slip of the pen, and tables of them fill the memory."""

_PARTS = {"c": "c", "cos": "c", "s": "s", "sin": "s"}


class Harmonics:
    """An increasing set of harmonic orders starting at 0 (THEORY.md section 1).

    A quantity is ``x(tau) = H_minus(tau) @ X`` with ``L = 2 n + 1`` coefficients ``X`` in the order
    ``(0, c1, s1, c2, s2, ...)``: constant, cosine and sine of each order.

    Parameters
    ----------
    orders
        Integers ``0 = m_0 < m_1 < ... < m_n``; gaps are allowed. One integer ``n`` stands for all of ``0..n``; a text
        such as ``"0..10"`` or ``"0, 1, 3..7"`` is read as in a case file.

    Raises
    ------
    InputError
        If the orders are empty, not integers, not increasing, above 10 000, or do not start at 0.

    Examples
    --------
    >>> h = Harmonics([0, 1, 3])
    >>> h.size, h.labels
    (5, ('0', 'c1', 's1', 'c3', 's3'))
    >>> h.H_minus(0.0)
    array([1., 1., 0., 1., 0.])
    """

    def __init__(self, orders: Iterable[int] | int | str) -> None:
        self.orders: tuple[int, ...] = _orders(orders)
        increasing = all(a < b for a, b in zip(self.orders, self.orders[1:], strict=False))
        if not self.orders or self.orders[0] != 0 or not increasing:
            raise wrong("harmonics", list(self.orders), "increasing whole numbers starting at 0")

    @classmethod
    def of(cls, orders: Orders) -> Harmonics:
        """The harmonics given, or those with the orders given."""
        return orders if isinstance(orders, Harmonics) else cls(orders)

    @cached_property
    def n(self) -> int:
        """Number of nonzero orders."""
        return len(self.orders) - 1

    @cached_property
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
        """Position of the cosine ("c" or "cos") or sine ("s" or "sin") coefficient of an order.

        Order 0 has one coefficient, position 0, which counts as its cosine. Raises InputError for another part, the
        sine of order 0, and an order that is not kept.
        """
        known = _PARTS.get(part) if isinstance(part, str) else None
        if known is None:
            raise InputError(f'harmonics: found part {shown(part)}; expected "c" or "cos", "s" or "sin"')
        order = whole("harmonics, order", order)
        if order not in self.orders:
            raise InputError(f"harmonic {shown(order)} is not kept; the harmonics are {shown(list(self.orders))}")
        if order == 0:
            if known == "s":
                raise InputError("harmonic 0 has no sine; it is one constant, harmonics.index(0)")
            return 0
        return 2 * self.orders.index(order) - (known == "c")

    def columns(self, orders: Iterable[int]) -> NDArray[np.intp]:
        """Positions of the coefficients of some orders, each cosine before its sine; InputError as ``index``.

        >>> Harmonics([0, 1, 3]).columns([0, 3])
        array([0, 3, 4])
        """
        return _columns(self, tuple(orders))

    def H_minus(self, tau: Reals) -> Array:
        """``{1, cos m_1 tau, sin m_1 tau, ...}``, shape (..., L) [THEORY.md (1.3)]."""
        tau = _floats("tau", tau)
        out = np.ones((*tau.shape, self.size))
        angle = tau[..., None] * self.m
        out[..., 1::2] = np.cos(angle)
        out[..., 2::2] = np.sin(angle)
        return out

    def H_plus(self, tau: Reals) -> Array:
        """As ``H_minus`` with first entry 1/2 [THEORY.md (4.1)]."""
        out = self.H_minus(tau)
        out[..., 0] = 0.5
        return out

    def derivative(self, X: Reals) -> Array:
        """Coefficients of ``dx/dtau``: the operator ``L`` of THEORY.md (1.4) applied to (..., L)."""
        X = _floats("X", X)
        if X.shape[-1:] != (self.size,):
            raise InputError(f"X: found shape {X.shape}; expected (..., {self.size}), coefficients of {self}")
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


@lru_cache(maxsize=256)
def _columns(harmonics: Harmonics, orders: tuple[int, ...]) -> NDArray[np.intp]:
    columns = np.array([harmonics.index(m, part) for m in orders for part in ("cs" if m else "c")], dtype=np.intp)
    columns.flags.writeable = False  # it is given to every caller
    return columns


def _orders(orders: Any) -> tuple[int, ...]:
    expected = 'a count such as 10 for 0..10, whole numbers such as range(11) or [0, 1, 3], or "0..10"'
    if isinstance(orders, str):
        try:
            return tuple(harmonic_orders(orders))
        except InputError as error:
            raise InputError([replace(f, found=shown(orders)).inside("harmonics") for f in error.faults]) from None
    if isinstance(orders, bytes | bool) or (getattr(orders, "dtype", None) is not None and orders.dtype.kind == "b"):
        raise wrong("harmonics", orders, expected)
    if not isinstance(orders, Iterable) or getattr(orders, "ndim", 1) == 0:
        orders = range(whole("harmonics", orders, 0, HIGHEST) + 1)
    listed = list(islice(orders, HIGHEST + 2))
    try:
        return tuple(whole("harmonics", m, -HIGHEST, HIGHEST) for m in listed)
    except InputError:
        raise wrong("harmonics", listed, f"{expected}, at most {HIGHEST}") from None


def _floats(name: str, value: Any) -> Array:
    """As an array of floats; those that are one already cost nothing, and may hold nan on the way."""
    return value if isinstance(value, np.ndarray) and value.dtype == np.float64 else numbers(name, value)
