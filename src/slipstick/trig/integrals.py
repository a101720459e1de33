"""Exact integrals of harmonics over intervals (THEORY.md (4.2)).

Every entry of ``W = (1/pi) int H_+ H_-^T`` is a sum of ``C_k = int cos k tau`` and ``S_k = int sin k tau``,
``k = 0 .. 2 m_n``. These primitives are accumulated over all intervals of one state; the matrix is built once.
"""

from __future__ import annotations

from math import pi

import numpy as np

from slipstick.trig.basis import Grid, grid, powers
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array


@inlined
def add_boundary(weight: float, c: Array, s: Array, C: Array, S: Array, top: int) -> None:
    """Add one interval end to ``k C_k`` and ``k S_k``, k = 1 .. top (stored from 0).

    ``weight`` is that of the interval ending here less that of the one beginning here; ``c, s`` hold
    ``cos k t, sin k t``.
    """
    for k in range(top):
        C[k] += weight * s[k]
        S[k] -= weight * c[k]


@compiled
def fill_matrix(length: float, C: Array, S: Array, grid: Grid, out: Array) -> None:
    """``W`` (L, L) from the accumulated length and primitives ``C_k, S_k`` (stored from k = 1)."""
    orders = grid.orders
    half = 0.5 / pi
    out[0, 0] = half * length
    for i in range(grid.n):
        a = int(orders[i])
        ci, si = half * C[a - 1], half * S[a - 1]
        ri = 2 * i + 1
        out[0, ri], out[0, ri + 1] = ci, si
        out[ri, 0], out[ri + 1, 0] = 2.0 * ci, 2.0 * si
        for j in range(i):
            b = int(orders[j])
            cs, ss = half * C[a + b - 1], half * S[a + b - 1]
            cd, sd = half * C[a - b - 1], half * S[a - b - 1]
            rj = 2 * j + 1
            out[ri, rj], out[rj, ri] = cd + cs, cd + cs
            out[ri + 1, rj + 1], out[rj + 1, ri + 1] = cd - cs, cd - cs
            out[ri, rj + 1], out[rj + 1, ri] = ss - sd, ss - sd
            out[ri + 1, rj], out[rj, ri + 1] = ss + sd, ss + sd
        cs, ss = half * C[2 * a - 1], half * S[2 * a - 1]
        out[ri, ri], out[ri + 1, ri + 1] = half * length + cs, half * length - cs
        out[ri, ri + 1], out[ri + 1, ri] = ss, ss


@inlined
def fill_vectors(length: float, start: Array, end: Array, grid: Grid, h: Array, hv: Array) -> None:
    """``h = (1/pi) int H_+`` and ``h_v = (1/pi) int (tau - a) H_+`` over ``[a, a + length]``, both (L,).

    ``start`` and ``end`` (2, top) hold ``cos k t`` and ``sin k t`` (from k = 1) there.
    """
    orders = grid.orders
    ca, sa, cb, sb = start[0], start[1], end[0], end[1]
    h[0] = 0.5 * length / pi
    hv[0] = 0.25 * length * length / pi
    for j in range(grid.n):
        m = orders[j]
        k = int(m) - 1
        p = 1.0 / (pi * m)
        h[2 * j + 1] = p * (sb[k] - sa[k])
        h[2 * j + 2] = p * (ca[k] - cb[k])
        hv[2 * j + 1] = p * (length * sb[k] + (cb[k] - ca[k]) / m)
        hv[2 * j + 2] = p * ((sb[k] - sa[k]) / m - length * cb[k])


@compiled(allocates=True)
def _interval(a: float, b: float, grid: Grid) -> tuple[Array, Array, Array]:
    n, top = grid.n, grid.top
    start, end = np.empty((2, top + 4)), np.empty((2, top + 4))
    C, S = np.zeros(top), np.zeros(top)
    powers(a, top, start[0], start[1])
    powers(b, top, end[0], end[1])
    add_boundary(-1.0, start[0], start[1], C, S, top)
    add_boundary(1.0, end[0], end[1], C, S, top)
    for k in range(top):
        C[k] /= k + 1.0
        S[k] /= k + 1.0
    W, h, hv = np.empty((2 * n + 1, 2 * n + 1)), np.empty(2 * n + 1), np.empty(2 * n + 1)
    fill_matrix(b - a, C, S, grid, W)
    fill_vectors(b - a, start, end, grid, h, hv)
    return W, h, hv


def interval_integrals(harmonics: Harmonics, a: float, b: float) -> tuple[Array, Array, Array]:
    """``W = (1/pi) int H_+ H_-^T``, ``h = (1/pi) int H_+``, ``h_v = (1/pi) int (tau - a) H_+`` over ``[a, b]``.

    Shapes (L, L), (L,), (L,) [THEORY.md (4.2)].

    >>> W, h, hv = interval_integrals(Harmonics([0, 1]), 0.0, 2 * np.pi)
    >>> bool(np.allclose(W, np.eye(3))), bool(np.allclose(h, [1, 0, 0]))
    (True, True)
    """
    W, h, hv = _interval(float(a), float(b), grid(harmonics))
    return W, h, hv
