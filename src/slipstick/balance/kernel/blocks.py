"""Compiled products with the blocks of elements and with a few modes, for the Jacobian of many contacts.

Numbers at ports are (n_ports + 1, L): ``rows`` (n, p) are those of the ports of each element, -1 where there is none.
The last row, which stands for ports that are not there, must be zero where it is read; what is written to it has no
meaning.
"""

from __future__ import annotations

import numpy as np

from slipstick.trig.compiled import compiled
from slipstick.typing import Array, ComplexArray, IntArray


@compiled(allocates=True, nogil=True)
def blocks_times(blocks: Array, rows: IntArray, X: Array, out: Array, transposed: bool) -> None:
    """Write products of ``blocks`` (n, p L, p L), or of their transposes, to the rows of ``out`` of each element."""
    p, L = rows.shape[1], X.shape[1]
    own, moved = np.empty(p * L), np.empty(p * L)
    for e in range(len(rows)):
        for i in range(p):
            own[i * L : (i + 1) * L] = X[rows[e, i]]
        if transposed:
            moved[:] = 0.0
            for j in range(p * L):
                for k in range(p * L):
                    moved[k] += blocks[e, j, k] * own[j]
        else:
            for k in range(p * L):
                total = 0.0
                for j in range(p * L):
                    total += blocks[e, k, j] * own[j]
                moved[k] = total
        for i in range(p):
            out[rows[e, i]] = moved[i * L : (i + 1) * L]


@compiled(allocates=True, nogil=True)
def add_own(compliance: ComplexArray, rows: IntArray, F: Array, out: Array) -> None:
    """Add the motion by forces ``F`` of the same element, its compliance being (n, p, p, n + 1)."""
    p, n = rows.shape[1], compliance.shape[3] - 1
    for e in range(len(rows)):
        for i in range(p):
            for j in range(p):
                by, moved = F[rows[e, j]], out[rows[e, i]]
                moved[0] += compliance[e, i, j, 0].real * by[0]
                for m in range(1, n + 1):
                    z = compliance[e, i, j, m] * complex(by[2 * m - 1], by[2 * m])
                    moved[2 * m - 1] += z.real
                    moved[2 * m] += z.imag


@compiled(allocates=True, nogil=True)
def onto_modes(shapes: Array, first: IntArray, X: Array, out: Array) -> None:
    """Write the sums over the ports of ``shapes`` times ``X``, (q,).

    ``shapes`` (n_ports, any) are those of the modes of order 0, then of 1, ...; order m begins at ``first[m]``. ``out``
    has a number for each mode of order 0, then the cosines and the sines of those of order 1, ...
    """
    out[:] = 0.0
    for r in range(len(shapes)):
        for k in range(first[1]):
            out[k] += shapes[r, k] * X[r, 0]
        for m in range(1, first.size - 1):
            begin, width = first[m], first[m + 1] - first[m]
            at = 2 * begin - first[1]
            cosine, sine = X[r, 2 * m - 1], X[r, 2 * m]
            for k in range(width):
                out[at + k] += shapes[r, begin + k] * cosine
            for k in range(width):
                out[at + width + k] += shapes[r, begin + k] * sine


@compiled(allocates=True, nogil=True)
def subtract_along_modes(shapes: Array, first: IntArray, a: Array, X: Array) -> None:
    """Take the motion of modes with the coefficients ``a`` (q,) from ``X``; all in the order of ``onto_modes``."""
    for r in range(len(shapes)):
        total = 0.0
        for k in range(first[1]):
            total += shapes[r, k] * a[k]
        X[r, 0] -= total
        for m in range(1, first.size - 1):
            begin, width = first[m], first[m + 1] - first[m]
            at = 2 * begin - first[1]
            cosine, sine = 0.0, 0.0
            for k in range(width):
                cosine += shapes[r, begin + k] * a[at + k]
            for k in range(width):
                sine += shapes[r, begin + k] * a[at + width + k]
            X[r, 2 * m - 1] -= cosine
            X[r, 2 * m] -= sine
