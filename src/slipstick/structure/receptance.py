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

    def at(self, frequency: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance and its derivative by frequency, both (n_frequencies, n_rows, n_columns); frequency in rad/s."""
        w = np.asarray(frequency, dtype=float).reshape(-1, 1)
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
        return value, slope

    def _sum(self, factors: ComplexArray) -> ComplexArray:
        """``factors @ products``; real products are multiplied with real and imaginary parts apart (half the work)."""
        if self.static.size * factors.shape[1] > _LARGE:
            rows = [(self._left * factor) @ self._right.T for factor in factors]
            return np.stack([row.ravel() for row in rows])
        if self._products.dtype == complex:
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

    def at(self, frequency: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance and its derivative by frequency, both (n_frequencies, n_rows, n_columns); frequency in rad/s."""
        w = np.asarray(frequency, dtype=float).reshape(-1, 1)
        both = np.empty((2, w.size, self._poles.size), dtype=complex)
        np.divide(1.0, 1j * w - self._poles, out=both[0])
        np.multiply(both[0], -1j * both[0], out=both[1])
        summed: ComplexArray = both.reshape(2 * w.size, -1) @ self._products
        value, slope = summed.reshape(2, w.size, *self.static.shape)
        return value, slope


class SolvedReceptance:
    """``A(w) = rows^T Z(w)^-1 columns`` with one solution of ``Z(w)`` for each frequency.

    The derivative needs no further factorisation: ``dA/dw = -(Z^-1 rows)^T (dZ/dw) (Z^-1 columns)``, Z being symmetric.

    Parameters
    ----------
    solve
        ``solve(w, right)`` returns ``Z(w)^-1 right`` and ``dZ/dw Z(w)^-1 right`` for right-hand sides (n_dofs, k).
    rows, columns
        Directions (n_dofs, n_rows) and (n_dofs, n_columns).
    static
        Exact static compliance (n_rows, n_columns).
    """

    def __init__(
        self,
        *,
        solve: Callable[[float, Array], tuple[ComplexArray, ComplexArray]],
        rows: Array,
        columns: Array,
        static: Array,
    ) -> None:
        self.static = static
        self._solve, self._rows, self._columns = solve, rows, columns
        self._both = np.hstack((columns, rows))

    def at(self, frequency: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance and its derivative by frequency, both (n_frequencies, n_rows, n_columns); frequency in rad/s."""
        w = np.asarray(frequency, dtype=float).reshape(-1)
        value = np.empty((w.size, *self.static.shape), dtype=complex)
        slope = np.empty_like(value)
        k = self._columns.shape[1]
        for i, each in enumerate(w):
            solution, stiffness_slope = self._solve(float(each), self._both)
            value[i] = self._rows.T @ solution[:, :k]
            slope[i] = -solution[:, k:].T @ stiffness_slope[:, :k]
        return value, slope
