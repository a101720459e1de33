"""Inverses of many matrices; of small ones compiled, as a call of LAPACK for each costs more than the inverse."""

from __future__ import annotations

import numpy as np

from slipstick.trig.compiled import compiled
from slipstick.typing import Array

_SMALL = 64
"""Rows up to which they are made here."""


def inverses(matrices: Array) -> Array:
    """Inverses (k, n, n); nan of singular ones. What is beside a matrix changes no bit of its inverse.

    >>> inverses(np.array([[[2.0, 0.0], [0.0, 4.0]], [[1.0, 1.0], [1.0, 1.0]]])).tolist()
    [[[0.5, 0.0], [0.0, 0.25]], [[nan, nan], [nan, nan]]]
    """
    if matrices.shape[1] <= _SMALL:
        out = np.empty(matrices.shape)
        _invert(np.ascontiguousarray(matrices), out)
        return out
    try:
        return np.asarray(np.linalg.inv(matrices))
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full_like(matrices, np.nan)
        return np.concatenate([inverses(one[None]) for one in matrices])


@compiled(allocates=True, nogil=True)
def _invert(matrices: Array, out: Array) -> None:
    """The method of Gauss and Jordan with partial pivoting, into ``out`` (k, n, n)."""
    n = matrices.shape[1]
    w, order = np.empty((n, n)), np.empty(n, np.int64)
    for e in range(len(matrices)):
        w[:, :] = matrices[e]
        regular = True
        for c in range(n):
            order[c] = c
        for c in range(n):
            pivot, largest = c, abs(w[c, c])
            for r in range(c + 1, n):
                if abs(w[r, c]) > largest:
                    pivot, largest = r, abs(w[r, c])
            if not largest > 0.0:  # nan too
                regular = False
                break
            order[c], order[pivot] = order[pivot], order[c]
            for j in range(n):
                w[c, j], w[pivot, j] = w[pivot, j], w[c, j]
            over = 1.0 / w[c, c]
            w[c, c] = 1.0
            for j in range(n):
                w[c, j] *= over
            for r in range(n):
                if r != c:
                    share = w[r, c]
                    w[r, c] = 0.0
                    for j in range(n):
                        w[r, j] -= share * w[c, j]
        if not regular:
            out[e] = np.nan
        else:
            for c in range(n):
                for r in range(n):
                    out[e, r, order[c]] = w[r, c]
