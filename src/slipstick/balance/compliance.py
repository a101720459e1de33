"""Receptances of one frequency for all harmonics, in the form that the balance sums."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from slipstick.structure.receptance import Receptance
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

    def answer_with_rate(self, G: ComplexArray, slope: ComplexArray | None = None) -> tuple[Array, Array]:
        """``answer``, and its derivative where ``G`` has one, on the first columns."""
        n_rows, n = self.value.shape[1:]
        out = np.empty((2, n_rows, 2 * n - 1))
        sums().compliance_sums(self._both, G, G[:0] if slope is None else slope, out)
        answer, rate = out.reshape(2, -1)
        return answer, rate

    def transposed(self, Z: ComplexArray) -> ComplexArray:
        """``A^T Z`` (n_columns, n + 1) of numbers on the rows: the transpose of ``answer`` in real coefficients."""
        return np.asarray(np.add.reduce(self.value.conj() * Z[None], axis=1))

    def diagonal(self) -> ComplexArray:
        """``conj(A)`` of the ports over themselves, (n_rows, n + 1)."""
        ports = np.arange(self.value.shape[1])
        return np.asarray(self.value[ports, ports])

    def reach(self, forces: Array) -> Array:
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
    """The compiled sums, loaded when they are first asked for: reading and checking a case needs none."""
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
