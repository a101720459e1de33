"""The norm that all numerics measure with."""

from __future__ import annotations

from math import inf, isfinite, sqrt

from slipstick.typing import Array


def norm(vector: Array) -> float:
    """Euclidean norm, quick for short vectors; inf if not finite."""
    square = float(vector.dot(vector))
    return sqrt(square) if isfinite(square) else inf
