"""How large a receptance given by modes and a static residual is: what its error is relative to.

Between two resonances a receptance can pass through zero, where nothing is small beside it. There it counts as a share
of what its modes come to without cancelling each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from slipstick.typing import Array

CANCELLED = 0.1
"""A receptance counts as no less than this share of what its modes come to without cancelling."""

UNREACHED = 1e-4
"""The response to a load counts as no less than this share of what it could at most be: some reach nothing."""

_BETWEEN = 24
_SPREAD = 96


class ReceptanceSize:
    """Undamped, Frobenius norm between all dofs (first column) and from each load to all dofs (the others).

    Parameters
    ----------
    omega, shapes
        The modes kept, (n_modes,) and (n_dofs, n_modes).
    residual
        Static compliance of the modes left out, (n_dofs, n_dofs).
    participation, load_residual
        Of loads: modal forces (n_loads, n_modes), static response of the modes left out (n_dofs, n_loads).
    """

    def __init__(
        self, omega: Array, shapes: Array, residual: Array, participation: Array, load_residual: Array
    ) -> None:
        self._squared, self._shapes = omega**2, shapes
        self._gram = shapes.T @ shapes
        self._crossed = np.einsum("ir,ij,jr->r", shapes, residual, shapes, optimize=True)
        self._residual = float(np.linalg.norm(residual))
        self._loads = list(zip(participation, load_residual.T, strict=True))

    def at(self, frequency: ArrayLike) -> Array:
        """Sizes (..., 1 + n_loads) at frequencies (rad/s)."""
        gap = self._squared - np.asarray(frequency, dtype=float)[..., None] ** 2
        c = 1.0 / np.where(gap == 0.0, 1e-12 * self._squared, gap)
        size, most = self._between_dofs(c), self._between_dofs(np.abs(c))
        columns = [np.maximum(size, CANCELLED * most)]
        for participation, residual in self._loads:
            weights = c * participation
            alone = np.linalg.norm(weights @ self._shapes.T + residual, axis=-1)
            apart = _norm(np.abs(weights), np.abs(self._gram)) + float(np.linalg.norm(residual))
            possible = np.sqrt(most * np.sum(np.abs(weights * participation), axis=-1))
            columns.append(np.maximum.reduce([alone, CANCELLED * apart, UNREACHED * possible]))
        return np.stack(columns, axis=-1)

    def _between_dofs(self, c: Array) -> Array:
        """``|sum c_r a_r a_r^T + R0|`` by the Gram matrix of the modes."""
        whole = np.sum((c @ self._gram**2) * c, axis=-1) + 2.0 * c @ self._crossed + self._residual**2
        return np.asarray(np.sqrt(np.maximum(whole, 0.0)))


def _norm(weights: Array, gram: Array) -> Array:
    return np.asarray(np.sqrt(np.maximum(np.sum((weights @ gram) * weights, axis=-1), 0.0)))


def band(omega: Array, lowest: float, highest: float) -> Array:
    """Frequencies that show what a receptance does over a band: spread evenly, and more between its resonances."""
    even = np.linspace(lowest, highest, _SPREAD)
    inner = np.sort(omega[(omega > lowest) & (omega < highest)])
    ends = np.concatenate([[lowest], inner, [highest]])
    parts = (np.arange(_BETWEEN) + 0.5) / _BETWEEN
    between = ends[:-1, None] + np.diff(ends)[:, None] * parts
    return np.unique(np.concatenate([even, between.ravel()]))
