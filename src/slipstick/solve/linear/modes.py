"""Modes of sparse symmetric ``K phi = lambda M phi``: what is found, how it is asked for, and how good it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from slipstick.errors import SlipstickError
from slipstick.typing import Array, Sparse

WRONG = 1e-4
"""A backward error above this is no mode."""


class EigenError(SlipstickError, RuntimeError):
    """Modes that did not converge or could not be proven complete."""


@dataclass(frozen=True, kw_only=True)
class StageProgress:
    """One sign of life of a long computation: ``done`` of ``total`` in the stage named."""

    stage: str
    done: int
    total: int


StageListener = Callable[[StageProgress], None]


@dataclass(frozen=True, kw_only=True)
class EigenOptions:
    """``tolerance`` bounds ``|(K - s M)^-1 M phi - theta phi|_M / theta``; eigenvalue errors are its square."""

    block: int = 16
    tolerance: float = 1e-8
    subspace: int | None = None
    """Largest basis before a restart; by default three times the modes wanted and 16 blocks."""
    restarts: int = 20


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Mass-normalised modes in ascending order, of which none is missing when ``complete`` is True.

    ``eigenvalues`` (n_modes,) are squared angular frequencies; ``shapes`` is (n, n_modes), the largest entry of each
    positive; ``residuals`` (n_modes,) are componentwise backward errors of ``K phi = lambda M phi``; ``complete`` is
    proven by a count, or, where its factors would be large or are not to be had, by a search that overlooks a mode with
    a probability of 1e-12; None where nobody looked.
    """

    eigenvalues: Array
    shapes: Array
    residuals: Array
    complete: bool | None
    solver: str

    @property
    def omega(self) -> Array:
        """Angular frequencies (n_modes,); a rigid body's rounding below zero counts as zero."""
        return np.sqrt(np.maximum(self.eigenvalues, 0.0))


def backward_errors(K: Sparse, M: Sparse, eigenvalues: Array, shapes: Array) -> Array:
    """``max |K phi - lambda M phi| / max (|K| |phi| + |lambda| |M| |phi|)`` of each column, (n_modes,)."""
    errors = np.empty(len(eigenvalues))
    # patterns are shared, only values copied
    size_K, size_M = (
        sparse.csr_array((abs(A.data), A.indices, A.indptr), shape=A.shape) for A in (K.tocsr(), M.tocsr())
    )
    for first in range(0, len(eigenvalues), 16):
        part = slice(first, first + 16)
        values, phi = eigenvalues[part], np.ascontiguousarray(shapes[:, part])
        residual = np.abs(K @ phi - (M @ phi) * values).max(axis=0)
        size = (size_K @ np.abs(phi) + (size_M @ np.abs(phi)) * np.abs(values)).max(axis=0)
        errors[part] = residual / size
    return errors
