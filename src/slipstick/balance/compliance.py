"""Receptances of one frequency for all harmonics, in the forms that the balance sums: all entries, or modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.layout import paired
from slipstick.structure.receptance import Factors, Receptance
from slipstick.typing import Array, ComplexArray


class Compliance:
    """``conj(A)`` and its derivative by omega, (n_columns, n_rows, n + 1): harmonic 0 is static and real.

    With ``along`` the derivative is that along a direction in the parameters of the structure, at fixed omega.
    """

    __slots__ = ("_both", "slope", "value")

    def __init__(
        self, receptance: Receptance, orders: Array, omega: float, along: Mapping[str, float] | None = None
    ) -> None:
        self._both = receptance.conjugates(orders, omega)
        self.value: ComplexArray = self._both[0]
        self.slope: ComplexArray = self._both[1]
        if along and orders.size:
            rate = derivative_along(receptance, along, orders, omega)
            np.conjugate(rate.transpose(2, 1, 0), out=self.slope[:, :, 1:])
        if along:
            still = [rate * receptance.static_by_parameter(name) for name, rate in along.items()]
            self.slope[:, :, 0] = np.add.reduce(still, axis=0).T

    def answer(self, G: ComplexArray) -> Array:
        """``conj(A) G`` as coefficients (n_rows * L,) of the first columns' numbers ``G`` (any, n + 1)."""
        return _times(self.value, G)

    def rate(self, G: ComplexArray) -> Array:
        """The same of the derivative."""
        return _times(self.slope, G)

    def residual_with_slope(
        self, x: Array, on_ports: Array, P: Array, springs: Array, support: Array
    ) -> tuple[Array, Array]:
        """``X + A (F - P)`` (N,) and its derivative at fixed motion.

        ``on_ports`` (2, n_ports, L) are the forces ``F`` and their derivatives, ``x`` (n_ports, L); for the others see
        ``driving``.
        """
        out = np.empty(on_ports.shape)
        sums().residual_with_slope(self._both, x, on_ports, P, springs, support, out)
        residual, slope = out.reshape(2, -1)
        return residual, slope

    def transposed(self, Z: ComplexArray) -> ComplexArray:
        """``A^T Z`` (n_columns, n + 1) of numbers on the rows: the transpose of ``answer`` in real coefficients."""
        return np.asarray(np.add.reduce(self.value.conj() * Z[None], axis=1))

    def diagonal(self) -> ComplexArray:
        """``conj(A)`` of the ports over themselves, (n_rows, n + 1)."""
        ports = np.arange(self.value.shape[1])
        return np.asarray(self.value[ports, ports])

    def bound(self, forces: Array) -> Array:
        """``|A| forces`` (n_rows, n + 1) of the first columns' sizes (any,)."""
        size = np.abs(self.value[: forces.size])
        return np.asarray((forces @ size.reshape(forces.size, -1)).reshape(size.shape[1:]))

    def anchor(self, springs: Array) -> None:
        """From ``A`` to ``B = A (1 + i k A)^-1`` for ``k`` (n_rows,), the receptance with springs ``i k`` at the rows.

        Undamped structures have infinite ``A`` at their resonances; ``B`` is bounded and smooth there.
        """
        rows = springs.size
        V, dV = (both.transpose(2, 1, 0)[1:] for both in (self.value, self.slope))
        turned = np.linalg.inv(np.eye(rows) - 1j * V[:, :, :rows] * springs)
        B = turned @ V
        dB = turned @ (dV + 1j * (dV[:, :, :rows] * springs) @ B)
        self.value[:, :, 1:], self.slope[:, :, 1:] = B.transpose(2, 1, 0), dB.transpose(2, 1, 0)


@cache
def sums() -> ModuleType:
    """The compiled sums, loaded at the first use: reading and checking a case needs none."""
    from slipstick.balance.kernel import sums as compiled

    return compiled


def _times(value: ComplexArray, G: ComplexArray) -> Array:
    out = np.empty((value.shape[1], 2 * value.shape[2] - 1))
    sums().compliance_times(value, G, out)
    return out.reshape(-1)


def derivative_along(receptance: Receptance, along: Mapping[str, float], orders: Array, omega: float) -> ComplexArray:
    """Derivative of a receptance along a direction in the parameters of its structure, (k, n_rows, n_columns)."""
    parts = [rate * receptance.by_parameter(name, orders, omega) for name, rate in along.items()]
    return np.asarray(np.add.reduce(parts, axis=0), dtype=complex)


def lossless(value: ComplexArray, share: float) -> NDArray[np.bool_]:
    """Where receptances of directions over themselves have no more than ``share`` of themselves out of phase."""
    return np.asarray(np.abs(value.imag) <= share * np.abs(value))


def coefficients(z: ComplexArray) -> Array:
    """Complex numbers (rows, n + 1) as real coefficients (rows * L,)."""
    parts = np.ascontiguousarray(z).view(float)
    out = np.empty((len(parts), parts.shape[1] - 1))
    out[:, 0], out[:, 1:] = parts[:, 0], parts[:, 2:]
    return out.ravel()


def driving(x: Array, F: Array, P: Array, springs: Array, support: Array) -> ComplexArray:
    """Forces ``F - P`` less those of springs, on all columns as complex numbers (n_columns, n + 1).

    ``x`` and ``F`` (n_ports, L), ``P`` (n_loads, L). Springs ``i k`` and those that ``support`` harmonic 0 have
    stiffnesses (n_ports,), or are empty.
    """
    ports, G = len(F), paired(F, P)
    if support.size:
        G[:ports, 0] -= support * x[:, 0]
    if springs.size:
        G[:ports, 1:] += 1j * springs[:, None] * np.ascontiguousarray(x[:, 1:]).view(complex)
    return G


class FactoredCompliance:
    """``conj(A)`` and its derivative as a ``Compliance`` has them, applied by their factors.

    Attributes
    ----------
    factors
        Of the receptance; order 0 is the static one.
    n_rows
        Ports, which are the first columns too.
    """

    __slots__ = ("factors", "n_rows")

    def __init__(self, factors: Factors) -> None:
        self.factors, self.n_rows = factors, len(factors.left)

    def answer(self, G: ComplexArray) -> Array:
        """``conj(A) G`` as coefficients (n_rows * L,) of the first columns' numbers ``G`` (any, n + 1)."""
        f = self.factors
        delayed = G if f.columns is None else G * f.columns[: len(G)]
        return self._sum(delayed, f.weight, f.part_weight)

    def answers(self, G: Sequence[ComplexArray]) -> Array:
        """The same of several together, (n_rows * L, k)."""
        f, k = self.factors, len(G)
        if k == 1:
            return self.answer(G[0])[:, None]
        joined = np.concatenate(G if f.columns is None else [one * f.columns[: len(one)] for one in G], axis=1)
        return self._sum(joined, np.tile(f.weight, (k, 1)), np.tile(f.part_weight, k), k)

    def rate(self, G: ComplexArray) -> Array:
        """The same of the derivative."""
        f = self.factors
        if f.columns is None or f.columns_slope is None:
            return self._sum(G, f.slope, f.part_slope) + self._coupled(G)
        delayed = G * f.columns[: len(G)]
        explicit = self._sum(delayed, f.slope, f.part_slope) + self._coupled(delayed)
        return explicit + self._sum(G * f.columns_slope[: len(G)], f.weight, f.part_weight)

    def residual_with_slope(
        self, x: Array, on_ports: Array, P: Array, springs: Array, support: Array
    ) -> tuple[Array, Array]:
        """``X + A (F - P)`` (N,) and its derivative at fixed motion, see ``Compliance``."""
        G, none = driving(x, on_ports[0], P, springs, support), np.empty(0)
        residual, slope = x.reshape(-1) + self.answer(G), self.rate(G)
        if on_ports[1].any():
            slope += self.answer(driving(x, on_ports[1], P[:0], none, none))
        return residual, slope

    def _coupled(self, G: ComplexArray) -> Array | float:
        """Contribution of the coupling of the modes to the derivative."""
        f = self.factors
        if f.coupling is None or f.coupling_weight is None:
            return 0.0
        weight, pairs = f.weight.conj().T, np.ascontiguousarray(G).view(float)
        modal = (f.right[: len(G)].T @ pairs).view(complex) * weight * f.coupling_weight.conj()
        motion, sizes = f.coupling
        coupled = (motion @ (sizes[:, None] * (motion.T @ modal.view(float)))).view(complex) * weight
        return coefficients((f.left @ coupled.view(float)).view(complex))

    def by_modes(self, G: ComplexArray) -> ComplexArray:
        """``conj(A) G`` (n_rows, n + 1) without the residuals."""
        f = self.factors
        return self._modes(G if f.columns is None else G * f.columns[: len(G)], f.weight)

    def _modes(self, G: ComplexArray, weight: ComplexArray) -> ComplexArray:
        pairs = np.ascontiguousarray(G).view(float)  # real matrices times real numbers: half the work
        modal = (self.factors.right[: len(G)].T @ pairs).view(complex) * weight.conj().T
        return np.asarray((self.factors.left @ modal.view(float)).view(complex))

    def _sum(self, G: ComplexArray, weight: ComplexArray, part_weight: ComplexArray, k: int = 0) -> Array:
        """Coefficients (n_rows * L,), or (n_rows * L, k) of k together."""
        out = self._modes(G, weight)
        if part_weight.any():
            out += self.factors.parts.times(G, part_weight.conj())
        if not k:
            return coefficients(out)
        return np.column_stack([coefficients(one) for one in np.split(out, k, axis=1)])

    def transposed(self, Z: ComplexArray) -> ComplexArray:
        """``A^T Z`` (n_columns, n + 1) of numbers on the rows: the transpose of ``answer`` in real coefficients."""
        f = self.factors
        pairs = np.ascontiguousarray(Z).view(float)
        out: ComplexArray = (f.right @ ((f.left.T @ pairs).view(complex) * f.weight.T).view(float)).view(complex)
        out += f.parts.times_transposed(Z, f.part_weight)
        return out if f.columns is None else out * f.columns

    def diagonal(self) -> ComplexArray:
        """``conj(A)`` of the ports over themselves, (n_rows, n + 1)."""
        none = np.zeros(self.factors.weight.shape, dtype=bool)
        return self.local(np.arange(self.n_rows)[:, None], none)[:, 0, 0]

    def bound(self, forces: Array) -> Array:
        """``|A| forces`` (n_rows, n + 1) of the first columns' sizes (any,), or more."""
        return self.bound_by_order(np.repeat(forces[:, None], len(self.factors.weight), axis=1))

    def bound_by_order(self, forces: Array) -> Array:
        """``|A| forces`` of sizes (any, n + 1) that differ from order to order."""
        f, count = self.factors, len(forces)
        out = np.abs(f.left) @ (np.abs(f.weight).T * (np.abs(f.right[:count]).T @ forces))
        return np.asarray(out + f.parts.reach(forces, np.abs(f.part_weight)))

    def local(self, rows: NDArray[np.intp], excluded: NDArray[np.bool_]) -> ComplexArray:
        """``conj(A)`` between the ports of each element alone, (n, p, p, n + 1).

        Without the modes that ``excluded`` (n + 1, n_modes) marks. ``rows`` (n, p) are port numbers, -1 for a
        port that an element does not have: zero.
        """
        f, here = self.factors, rows >= 0
        left, right = f.left[rows] * here[:, :, None], f.right[rows] * here[:, :, None]
        weight = np.where(excluded, 0.0, f.weight).conj()
        both = left[:, :, None, :] * right[:, None, :, :]
        n, p = rows.shape
        value = (both.reshape(n * p * p, -1) @ weight.T).reshape(n, p, p, -1)
        return np.asarray(value + self.local_residual(rows), dtype=complex)

    def local_residual(self, rows: NDArray[np.intp]) -> ComplexArray:
        """The same of the residuals alone."""
        f, here = self.factors, rows >= 0
        value = np.zeros((*rows.shape, rows.shape[1], len(f.weight)), dtype=complex)
        present = here[:, :, None] & here[:, None, :]
        for entries, share in zip(f.parts.entries(rows[:, :, None], rows[:, None, :]), f.part_weight, strict=True):
            value += (entries * present)[..., None] * share.conj()
        return value
