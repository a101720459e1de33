"""Norms of vectors."""

from __future__ import annotations

from math import inf, isfinite, sqrt

import numpy as np

from slipstick.typing import Array


def norm(vector: Array) -> float:
    """Euclidean norm, fast for short vectors; inf if not finite."""
    square = vector.dot(vector)
    return sqrt(square) if isfinite(square) else inf


def relative(residual: Array, terms: Array) -> float:
    """Norm of a residual (N,), each entry over the size of its own ``terms`` (N,), where it has any."""
    return norm(residual / np.where(terms > 0, terms, 1.0))
