"""Whether a matrix is symmetric, dense or sparse: one rule wherever matrices come in."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from slipstick.typing import Matrix, Sparse

ASYMMETRY = 1e-8
"""Largest difference between a row and its column, relative to the row's absolute sum, that passes as symmetric."""


class MirroredPair(NamedTuple):
    """An entry (row, column) and its mirror image (column, row) that differ."""

    row: int
    column: int
    entry: float
    mirrored: float


def asymmetry(A: Matrix, tolerance: float = ASYMMETRY) -> MirroredPair | None:
    """In the first row that differs from its column, what differs most; None for a symmetric matrix.

    Two products with a random vector, no transposed copy: rows and columns that differ give different sums.

    >>> from scipy import sparse
    >>> asymmetry(sparse.csr_array([[2.0, 1.0], [0.0, 2.0]]))
    MirroredPair(row=0, column=1, entry=1.0, mirrored=0.0)
    """
    x = np.random.default_rng(1).uniform(0.5, 1.5, A.shape[0])
    difference = np.abs(A @ x - A.T @ x)
    wrong = np.flatnonzero(difference > tolerance * np.maximum(abs(A) @ x, np.finfo(float).tiny))
    if not len(wrong):
        return None
    i = int(wrong[0])
    row, column = (np.ravel(each.toarray() if hasattr(each, "toarray") else each) for each in _cross(A, i))
    j = int(np.argmax(np.abs(row - column)))
    return MirroredPair(i, j, float(row[j]), float(column[j]))


def _cross(A: Sparse, i: int) -> tuple[Any, Any]:
    """Row and column ``i``."""
    return (A.tocsr()[[i]], A.tocsc()[:, [i]]) if hasattr(A, "tocsr") else (A[i], A[:, i])
