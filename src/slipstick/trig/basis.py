"""Values of trigonometric polynomials at one time: tables, ``cos k t`` and ``sin k t`` of every order, sums.

Bounds of the rounding errors are derived in ``slipstick.trig.roots``.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi
from typing import NamedTuple

import numpy as np

from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, IntArray

TWO_PI = 2.0 * pi
CELLS_PER_ORDER = 10
"""Cells of the root search for each order: ``m h <= pi / 10`` in ``slipstick.trig.roots``."""
_PIECES = 256
"""Entries of the table of ``circle``: the rest is below pi / 256, where series to order six are exact to rounding."""
# 2 pi / 256 in two parts, the first short enough for exact products
_STEP_HIGH = float(np.float32(TWO_PI / _PIECES))
_STEP_LOW = TWO_PI / _PIECES - _STEP_HIGH + 2.4492935982947064e-16 / _PIECES


def turns(part: int | IntArray, whole: int) -> tuple[Array, Array]:
    """Cosine and sine of ``part / whole`` turns, for integers of any size, to rounding: by angles up to pi/4."""
    quarter, rest = np.divmod(4 * np.mod(part, whole), whole)
    beyond = 2 * rest > whole
    angle = np.where(beyond, whole - rest, rest) / whole * (0.5 * pi)
    c, s = np.where(beyond, np.sin(angle), np.cos(angle)), np.where(beyond, np.cos(angle), np.sin(angle))
    return np.choose(quarter, [c, -s, -c, s]), np.choose(quarter, [s, c, -s, -c])


_COS, _SIN = turns(np.arange(_PIECES), _PIECES)


class Grid(NamedTuple):
    """Tables of one harmonic set: cell middles of the root search and padded orders."""

    orders: Array
    """Nonzero orders as floats, padded by zeros to a multiple of four, (n4,)."""
    cos: Array
    """``cos(m_j t_i)`` at the cell middles, (n4, cells)."""
    sin: Array
    consecutive: bool
    """Whether the orders are 1, 2, ..., n, so that powers of ``exp(i t)`` serve."""
    n: int
    """Number of nonzero orders."""
    top: int
    """Twice the highest order: as many roots as there can be."""


class Polynomial(NamedTuple):
    """``mean + sum_j cos_j cos m_j t + sin_j sin m_j t``."""

    mean: float
    cos: Array
    """(n4,)"""
    sin: Array


class Scratch(NamedTuple):
    """Buffers for ``cos m_j t, sin m_j t``: at a time (n4,) each, and for ``rise`` (2, n4) each."""

    c: Array
    s: Array
    half: Array
    middle: Array


@lru_cache(maxsize=64)
def grid(harmonics: Harmonics) -> Grid:
    """Tables for a harmonic set, computed once."""
    n = harmonics.n
    padded = -(-max(n, 1) // 4) * 4
    orders = np.zeros(padded)
    orders[:n] = harmonics.m
    cells = CELLS_PER_ORDER * max(harmonics.highest, 1)
    cos, sin = turns(orders[:, None].astype(np.int64) * (2 * np.arange(cells) + 1), 2 * cells)
    return Grid(orders, cos, sin, harmonics.orders == tuple(range(n + 1)), n, 2 * max(harmonics.highest, 1))


@compiled(forceinline=True, fastmath=False)
def circle(t: float) -> tuple[float, float]:
    """``cos t, sin t`` to rounding for ``|t| < 1e6``: a table and a short series, several times quicker than calls."""
    i = int(np.floor(t * (_PIECES / TWO_PI) + 0.5))
    d = (t - i * _STEP_HIGH) - i * _STEP_LOW
    c, s = _COS[i & 255], _SIN[i & 255]
    q = d * d
    sd = d * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0)))
    cd = q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0)))
    return c - (c * cd + s * sd), s - (s * cd - c * sd)


@inlined
def powers(t: float, n: int, c: Array, s: Array) -> None:
    """``c[k-1] = cos k t``, ``s[k-1] = sin k t`` for k = 1 .. n; the arrays have n entries, rounded up to four."""
    c1, s1 = circle(t)
    c2, s2 = c1 * c1 - s1 * s1, 2.0 * c1 * s1
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * c2 * s2
    c[0], s[0] = c1, s1
    c[1], s[1] = c2, s2
    c[2], s[2] = c1 * c2 - s1 * s2, s1 * c2 + c1 * s2
    c[3], s[3] = c4, s4
    for k in range(4, n, 4):
        for i in range(k, k + 4):
            a, b = c[i - 4], s[i - 4]
            c[i] = a * c4 - b * s4
            s[i] = b * c4 + a * s4


@inlined
def basis(t: float, grid: Grid, c: Array, s: Array) -> None:
    """``cos m_j t`` and ``sin m_j t`` of every kept order."""
    orders = grid.orders
    if grid.consecutive:
        powers(t, orders.size, c, s)
    else:
        for j in range(orders.size):
            c[j], s[j] = circle(orders[j] * t)


@inlined
def value(p: Polynomial, c: Array, s: Array) -> float:
    """``p`` at the time whose basis is ``c, s``."""
    pc, ps = p.cos, p.sin
    total = 0.0
    for j in range(pc.size):
        total += pc[j] * c[j] + ps[j] * s[j]
    return p.mean + total


@inlined
def values(p: Polynomial, m: Array, c: Array, s: Array) -> tuple[float, float, float]:
    """``p, p', p''`` at the time whose basis is ``c, s``."""
    pc, ps = p.cos, p.sin
    v0, v1, v2 = 0.0, 0.0, 0.0
    for j in range(pc.size):
        a = pc[j] * c[j] + ps[j] * s[j]
        b = ps[j] * c[j] - pc[j] * s[j]
        v0 += a
        v1 += m[j] * b
        v2 += m[j] * m[j] * a
    return p.mean + v0, v1, -v2


@inlined
def third(p: Polynomial, m: Array, c: Array, s: Array) -> float:
    """``p'''`` at the time whose basis is ``c, s``."""
    pc, ps = p.cos, p.sin
    total = 0.0
    for j in range(pc.size):
        total += m[j] * m[j] * m[j] * (pc[j] * s[j] - ps[j] * c[j])
    return total


@inlined
def rise(start: float, end: float, v: float, p: Polynomial, grid: Grid, scratch: Scratch) -> float:
    """Change of ``v t + p(t)`` from ``start`` to ``end``, without cancellation however short the interval.

    ``scratch.half`` and ``scratch.middle`` receive the bases of half the interval's length and of its middle.
    """
    half, middle = scratch.half, scratch.middle
    basis(0.5 * (end - start), grid, half[0], half[1])
    basis(0.5 * (start + end), grid, middle[0], middle[1])
    pc, ps = p.cos, p.sin
    total = 0.0
    for j in range(grid.orders.size):
        total += half[1, j] * (ps[j] * middle[0, j] - pc[j] * middle[1, j])
    return v * (end - start) + 2.0 * total
