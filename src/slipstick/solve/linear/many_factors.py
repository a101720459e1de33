"""LU factors of many matrices; compiled for small ones, because a call of LAPACK costs as much as their factors.

The factors of a matrix (n, n) are stored as (n + 1, n): L, without its diagonal of ones, and U as in LAPACK, then the
number of the row that each row was swapped with. The other matrices of a call change no bit of its factors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf

from slipstick.trig.compiled import compiled
from slipstick.typing import Array

_COMPILED_UP_TO = 50
"""Rows up to which compiled code is faster than LAPACK: 22 rows 1.4 and 3.5 us, 43 rows 9 and 10, 64 rows 27 and 21."""


def factorise(matrices: Array) -> None:
    """Turn matrices (k, n, n), given as (k, n + 1, n) with a row of any numbers, into factors; nan of singular ones.

    >>> factors = np.array([[[2.0, 1.0], [4.0, 0.0], [0.0, 0.0]]])
    >>> factorise(factors)
    >>> solutions(factors, np.array([0]), np.array([[3.0, 4.0]])).tolist(), signs(factors).tolist()
    ([[1.0, 1.0]], [-1.0])
    """
    n = matrices.shape[2]
    if n <= _COMPILED_UP_TO:
        _factorise(matrices)
        return
    for matrix in matrices:
        matrix[:n], matrix[n], singular = dgetrf(matrix[:n])
        if singular:
            matrix[:] = np.nan


def solutions(factors: Array, which: NDArray[np.intp], right: Array) -> Array:
    """Solutions (m, n) with the factors of the matrices named, of right-hand sides (m, q) that are zero beyond q."""
    out = np.zeros((len(right), factors.shape[2]))
    out[:, : right.shape[1]] = right
    _solve(factors, which, out)
    return out


def signs(factors: Array) -> Array:
    """Signs (k,) of the determinants."""
    n = factors.shape[2]
    diagonal, swapped = factors[:, np.arange(n), np.arange(n)], factors[:, n] != np.arange(n)
    return np.asarray(np.prod(np.sign(diagonal), axis=1) * (1.0 - 2.0 * (swapped.sum(axis=1) % 2)))


@compiled(allocates=True, nogil=True)
def _factorise(matrices: Array) -> None:
    """The method of Gauss with partial pivoting."""
    n = matrices.shape[2]
    for e in range(len(matrices)):
        w = matrices[e]
        for c in range(n):
            pivot, largest = c, abs(w[c, c])
            for r in range(c + 1, n):
                if abs(w[r, c]) > largest:
                    pivot, largest = r, abs(w[r, c])
            if not largest > 0.0:  # nan too
                w[:, :] = np.nan
                break
            w[n, c] = pivot
            if pivot != c:
                for j in range(n):
                    w[c, j], w[pivot, j] = w[pivot, j], w[c, j]
            over = 1.0 / w[c, c]
            for r in range(c + 1, n):
                share = w[r, c] * over
                w[r, c] = share
                for j in range(c + 1, n):
                    w[r, j] -= share * w[c, j]


@compiled(allocates=True, nogil=True)
def _solve(factors: Array, which: NDArray[np.intp], x: Array) -> None:
    """Right-hand sides ``x`` (m, n) become solutions."""
    n = factors.shape[2]
    for e in range(len(x)):
        w, y = factors[which[e]], x[e]
        if not w[n, 0] >= 0.0:
            y[:] = np.nan
            continue
        for c in range(n):
            other = int(w[n, c])
            y[c], y[other] = y[other], y[c]
        for r in range(n):
            total = y[r]
            for j in range(r):
                total -= w[r, j] * y[j]
            y[r] = total
        for r in range(n - 1, -1, -1):
            total = y[r]
            for j in range(r + 1, n):
                total -= w[r, j] * y[j]
            y[r] = total / w[r, r]
