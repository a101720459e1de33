"""Residuals of a reduction that are applied by solutions: when they cost less, and what they are near themselves."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.structure.reduction.data import ReducedData
from slipstick.structure.reduction.near_field import near_fields, neighbours
from slipstick.structure.residuals import NearField
from slipstick.typing import Array, Sparse

_PRODUCTS = 1000
"""Products with a receptance that a curve takes, for the choice between both kinds."""

_COLUMNS = 11
"""Of each: the harmonics 0 to 5."""

ALWAYS_WRITTEN = 500
"""Directions up to which residuals are written out."""

MOST_WRITTEN_BYTES = 4e9
"""Memory that residuals written out may take."""


def cheaper_solved(n_keep: int, factors: int) -> bool:
    """Whether solutions cost less than matrices, over reduction and one curve, by operations.

    ``factors`` are the bytes of the factorised stiffness.
    """
    if n_keep <= ALWAYS_WRITTEN:
        return False
    if 16.0 * n_keep**2 > MOST_WRITTEN_BYTES:
        return True
    solution = 4.0 * factors / 12.0
    matrices = 2.0 * n_keep * solution + _PRODUCTS * _COLUMNS * 4.0 * n_keep**2
    return (2.0 * _COLUMNS * _PRODUCTS + 500.0) * solution < matrices


def near_residuals(
    iteration: BlockLanczos, M: Sparse, directions: Any, data: ReducedData
) -> tuple[NearField, NearField]:
    """Both residuals of ``data`` between directions (n, n_keep), near themselves; a few solutions for each."""
    n, omega, sample = directions.shape[1], data.omega, data.sample
    assert sample is not None
    kept, s = data.amplitudes[:n], len(sample)

    def residual(x: Array) -> Array:
        U = iteration.solve(np.asfortranarray(directions @ x))
        modal, out = kept.T @ x, np.empty((2, *x.shape))
        out[0] = directions.T @ U - kept @ (modal / omega[:, None] ** 2)
        out[1] = directions.T @ iteration.solve(np.asfortranarray(M @ U)) - kept @ (modal / omega[:, None] ** 4)
        return out

    exact = np.array([data.left_over(data.static, 2), data.left_over(data.second, 4)])
    return near_fields(residual, neighbours(iteration.K, directions), sample, exact[:, :n, :s])
