"""Receptances between a few directions: summed over modes, or solved for directly (THEORY.md section 9)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


_SMALL = 2000
"""Below so many products complex numbers cost less than two real multiplications."""

_LARGE = 2**25
"""Above so many products (256 MB) they are not kept but formed for each frequency."""


def _products(left: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """Products of (n_rows, n) and (n_columns, n) for each of the n: (n, n_rows n_columns)."""
    return np.ascontiguousarray((left[:, None, :] * right[None, :, :]).reshape(-1, left.shape[1]).T)


def undamped(omega: Array, modes: Array, static: Array, second: Array | None = None) -> ModalReceptance:
    """Receptance without damping between dofs: modes (n_dofs, n_modes), exact static compliance, second residual."""
    return ModalReceptance(
        left=modes, right=modes, stiffness=omega**2, damping=np.zeros_like(omega), static=static,
        residual=static - (modes / omega**2) @ modes.T, second=second,
    )  # fmt: skip


class ModalReceptance:
    """``A(w) = sum_r left_r right_r / (stiffness_r + i w damping_r - w^2) + residual + w^2 second``.

    Parameters
    ----------
    left, right
        Modes at the rows (n_rows, n_modes) and participations of the columns (n_columns, n_modes), mass-normalised.
    stiffness
        ``w_r^2 (1 + i eta_r)``, (n_modes,), complex.
    damping
        Modal viscous damping ``2 zeta_r w_r``, (n_modes,).
    static
        Exact static compliance (n_rows, n_columns).
    residual, second
        Compliance of the modes left out (n_rows, n_columns) and the coefficient of its growth with ``w^2``, or None.
    """

    def __init__(
        self,
        *,
        left: Array,
        right: Array,
        stiffness: ArrayLike,
        damping: ArrayLike,
        static: Array,
        residual: Array | ComplexArray | None = None,
        second: Array | ComplexArray | None = None,
    ) -> None:
        self.static = static
        self._shape = static.shape
        self._stiffness = np.asarray(stiffness, dtype=complex)
        self._damping = 1j * np.asarray(damping, dtype=float)
        self._left, self._right = left, right
        self._residual, self._second = residual, second

    @cached_property
    def _products(self) -> NDArray[Any]:
        """``left_r right_r`` (n_modes, n_rows n_columns), made when a frequency is first asked for."""
        products = _products(self._left, self._right)
        return products.astype(complex) if products.size < _SMALL else products

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        places, w, shape = _places(orders, omega, self._shape)
        count, modes = w.size, self._stiffness.size
        both = np.empty((2, count, modes), dtype=complex)
        np.divide(1.0, self._stiffness + w * (self._damping - w), out=both[0])
        np.multiply(both[0] * both[0], 2.0 * w - self._damping, out=both[1])
        summed = self._sum(both.reshape(2 * count, modes)).reshape(2, count, *self._shape)
        value, slope = summed
        if self._residual is not None:
            value += self._residual
        if self._second is not None:
            cube = w[:, :, None]
            value += cube * cube * self._second
            slope += 2.0 * cube * self._second
        return _by_omega(value.reshape(shape), slope.reshape(shape), places)

    def _sum(self, factors: ComplexArray) -> ComplexArray:
        """``factors @ products``; real products are multiplied with real and imaginary parts apart (half the work)."""
        if self.static.size * factors.shape[1] > _LARGE:
            rows = [(self._left * factor) @ self._right.T for factor in factors]
            return np.stack([row.ravel() for row in rows])
        if self._products.dtype.kind == "c":
            small: ComplexArray = factors @ self._products
            return small
        out = np.empty((factors.shape[0], self._products.shape[1]), dtype=complex)
        out.real = factors.real @ self._products
        out.imag = factors.imag @ self._products
        return out


class PoleReceptance:
    """``A(w) = sum_k left_k right_k / (i w - pole_k)`` over the 2 n poles of a viscously damped structure.

    Parameters
    ----------
    left, right
        Complex modes at the rows (n_rows, n_poles) and columns (n_columns, n_poles), normalised so that
        ``mode^T (2 pole M + C) mode = 1``.
    poles
        (n_poles,), complex.
    static
        Exact static compliance (n_rows, n_columns).
    """

    def __init__(self, *, left: ComplexArray, right: ComplexArray, poles: ComplexArray, static: Array) -> None:
        self.static = static
        self._poles, self._left, self._right = poles, left, right

    @cached_property
    def _products(self) -> ComplexArray:
        """``left_k right_k`` (n_poles, n_rows n_columns), made when a frequency is first asked for."""
        return _products(self._left, self._right)

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        places, w, shape = _places(orders, omega, self.static.shape)
        both = np.empty((2, w.size, self._poles.size), dtype=complex)
        np.divide(1.0, 1j * w - self._poles, out=both[0])
        np.multiply(both[0], -1j * both[0], out=both[1])
        summed: ComplexArray = both.reshape(2 * w.size, -1) @ self._products
        value, slope = summed.reshape(2, *shape)
        return _by_omega(value, slope, places)


class SolvedReceptance:
    """``A(w) = rows^T Z(w)^-1 columns`` with one factorisation of ``Z(w)``, which need not be symmetric, a frequency.

    The derivative needs no further one: ``dA/dw = -(Z^-T rows)^T (dZ/dw) (Z^-1 columns)``.

    Parameters
    ----------
    stiffness
        ``stiffness(w)`` returns ``Z(w)`` and ``dZ/dw``, (n_dofs, n_dofs), dense or scipy sparse.
    rows, columns
        Directions (n_dofs, n_rows) and (n_dofs, n_columns).
    static
        Exact static compliance (n_rows, n_columns).
    """

    def __init__(
        self, *, stiffness: Callable[[float], tuple[Any, Any]], rows: Array, columns: Array, static: Array
    ) -> None:
        self.static = static
        self._stiffness, self._rows, self._columns = stiffness, rows, columns

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        places, w, shape = _places(orders, omega, self.static.shape)
        value = np.empty((w.size, *self.static.shape), dtype=complex)
        slope = np.empty_like(value)
        for i, each in enumerate(w[:, 0].tolist()):
            Z, dZ = self._stiffness(each)
            solve = _solver(Z)
            moved = solve(self._columns, False)
            value[i] = self._rows.T @ moved
            slope[i] = -solve(self._rows, True).T @ (dZ @ moved)
        return _by_omega(value.reshape(shape), slope.reshape(shape), places)


def _places(orders: ArrayLike, omega: ArrayLike, shape: tuple[int, ...]) -> tuple[Array, Array, tuple[int, ...]]:
    """Orders (k,), the frequencies ``orders * omega`` as a column, and the shape of what is asked there."""
    m = np.asarray(orders, dtype=float)
    w = np.multiply.outer(omega, m)
    return m, w.reshape(-1, 1), (*w.shape, *shape)


def _by_omega(value: ComplexArray, slope: ComplexArray, orders: Array) -> tuple[ComplexArray, ComplexArray]:
    """The derivative by each order's own frequency, ``slope``, becomes that by omega."""
    slope *= orders[:, None, None]
    return value, slope


def _solver(Z: Any) -> Callable[[Array, bool], ComplexArray]:
    """``solve(right, transposed)`` with one factorisation of a dense or sparse matrix."""
    if hasattr(Z, "tocsc"):
        from scipy.sparse.linalg import splu

        factors = splu(Z.tocsc())
        return lambda right, transposed: factors.solve(right.astype(complex), trans="T" if transposed else "N")
    from scipy.linalg import lu_factor, lu_solve

    lu = lu_factor(Z)
    return lambda right, transposed: lu_solve(lu, right, trans=int(transposed))
