"""Receptances of one frequency between thousands of ports: modes and residuals, never written out entry by entry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slipstick.structure.receptance import Factors
from slipstick.typing import Array, ComplexArray


def coefficients(z: ComplexArray) -> Array:
    """Complex numbers (rows, n + 1) as coefficients (rows * L,)."""
    return np.delete(np.ascontiguousarray(z).view(float), 1, axis=1).ravel()


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

    def answer_with_rate(self, G: ComplexArray, slope: ComplexArray | None = None) -> tuple[Array, Array]:
        """``answer``, and its derivative where ``G`` has one, on the first columns."""
        rate = self.rate(G)
        if slope is not None:
            rate += self.answer(slope)
        return self.answer(G), rate

    def _coupled(self, G: ComplexArray) -> Array | float:
        """What the modes' coupling adds to the derivative."""
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
        apart = np.zeros(self.factors.weight.shape, dtype=bool)
        return self.local(np.arange(self.n_rows)[:, None], apart)[:, 0, 0]

    def reach(self, forces: Array) -> Array:
        """``|A| forces`` (n_rows, n + 1) of the first columns' sizes (any,), or more."""
        return self.reach_by_order(np.repeat(forces[:, None], len(self.factors.weight), axis=1))

    def reach_by_order(self, forces: Array) -> Array:
        """``|A| forces`` of sizes (any, n + 1) that differ from order to order."""
        f, count = self.factors, len(forces)
        out = np.abs(f.left) @ (np.abs(f.weight).T * (np.abs(f.right[:count]).T @ forces))
        return np.asarray(out + f.parts.reach(forces, np.abs(f.part_weight)))

    def local(self, rows: NDArray[np.intp], apart: NDArray[np.bool_]) -> ComplexArray:
        """``conj(A)`` between the ports of each element alone, (n, p, p, n + 1).

        Without the modes ``apart`` (n + 1, n_modes), true where left out. ``rows`` (n, p) are port numbers, -1 for a
        port that an element does not have: zero.
        """
        f, here = self.factors, rows >= 0
        left, right = f.left[rows] * here[:, :, None], f.right[rows] * here[:, :, None]
        weight = np.where(apart, 0.0, f.weight).conj()
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
