"""All roots of a trigonometric polynomial in one period, with certainty (THEORY.md section 3).

A cell of half-width ``h`` with middle values ``p, p', p''`` and ``B3 = sum m^3 |c_m| >= max |p'''|``

- holds no root if ``|p| > |p'| h + |p''| h^2/2 + B3 h^3/6``;
- is monotone, hence holds at most one, if ``|p'| > |p''| h + B3 h^2/2``;
- is halved otherwise.

Only crossings are reported: a touching double root changes no sign.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.harmonics import Harmonics

Array = NDArray[np.float64]

TWO_PI = 2.0 * pi
_PIECES = 256
_COS, _SIN = np.cos(np.arange(_PIECES) * (TWO_PI / _PIECES)), np.sin(np.arange(_PIECES) * (TWO_PI / _PIECES))
# 2 pi / 256 in two parts, the first short enough for exact products
_STEP_HIGH = float(np.float32(TWO_PI / _PIECES))
_STEP_LOW = TWO_PI / _PIECES - _STEP_HIGH + 2.4492935982947064e-16 / _PIECES
CELLS_PER_ORDER = 10
STACK = 128


@dataclass(frozen=True)
class Grid:
    """Tables of one harmonic set: cell middles of the root search and padded orders."""

    orders: Array
    """Nonzero orders as floats, padded by zeros to a multiple of four, (n4,)."""
    cos: Array
    """``cos(m_j t_i)`` at the cell middles, (n4, cells)."""
    sin: Array
    consecutive: bool
    """Whether the orders are 1, 2, ..., n, so that powers of ``exp(i t)`` serve."""

    @property
    def cells(self) -> int:
        """Number of cells in the period."""
        return int(self.cos.shape[1])


@lru_cache(maxsize=64)
def grid(harmonics: Harmonics) -> Grid:
    """Tables for a harmonic set, computed once."""
    n = harmonics.n
    padded = -(-max(n, 1) // 4) * 4
    orders = np.zeros(padded)
    orders[:n] = harmonics.m
    cells = CELLS_PER_ORDER * max(harmonics.highest, 1)
    middle = (np.arange(cells) + 0.5) * (TWO_PI / cells)
    angle = orders[:, None] * middle
    return Grid(orders, np.cos(angle), np.sin(angle), harmonics.orders == tuple(range(n + 1)))


@compiled(forceinline=True, fastmath=False)
def circle(t: float) -> tuple[float, float]:
    """``cos t, sin t`` to rounding for ``|t| < 100``: a table and a short series, several times quicker than calls."""
    i = int(np.floor(t * (_PIECES / TWO_PI) + 0.5))
    d = (t - i * _STEP_HIGH) - i * _STEP_LOW
    c, s = _COS[i & 255], _SIN[i & 255]
    q = d * d
    sd = d * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0)))
    cd = q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0)))
    return c - (c * cd + s * sd), s - (s * cd - c * sd)


@inlined
def powers(t: float, n: int, c: Any, s: Any) -> None:
    """``c[k-1] = cos k t``, ``s[k-1] = sin k t`` for k = 1 .. n; the arrays have room for n rounded up to four."""
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
def basis(t: float, orders: Any, consecutive: bool, c: Any, s: Any) -> None:
    """``cos m_j t`` and ``sin m_j t`` of every kept order."""
    if consecutive:
        powers(t, orders.size, c, s)
    else:
        for j in range(orders.size):
            c[j] = np.cos(orders[j] * t)
            s[j] = np.sin(orders[j] * t)


@inlined
def value(p0: float, pc: Any, ps: Any, c: Any, s: Any) -> float:
    """``p`` at the time whose basis is ``c, s``."""
    total = 0.0
    for j in range(pc.size):
        total += pc[j] * c[j] + ps[j] * s[j]
    return p0 + total


@inlined
def values(p0: float, pc: Any, ps: Any, m: Any, c: Any, s: Any) -> tuple[float, float, float]:
    """``p, p', p''`` at the time whose basis is ``c, s``."""
    v0, v1, v2 = 0.0, 0.0, 0.0
    for j in range(pc.size):
        a = pc[j] * c[j] + ps[j] * s[j]
        b = ps[j] * c[j] - pc[j] * s[j]
        v0 += a
        v1 += m[j] * b
        v2 += m[j] * m[j] * a
    return p0 + v0, v1, -v2


@inlined
def third(pc: Any, ps: Any, m: Any, c: Any, s: Any) -> float:
    """``p'''`` at the time whose basis is ``c, s``."""
    total = 0.0
    for j in range(pc.size):
        total += m[j] * m[j] * m[j] * (pc[j] * s[j] - ps[j] * c[j])
    return total


@inlined
def bounds(pc: Any, ps: Any, m: Any) -> tuple[float, float, float]:
    """``B3 = sum m^3 |c_m|``, ``B4 = sum m^4 |c_m|`` and ``sum |c_m|``."""
    bound, next_bound, size = 0.0, 0.0, 0.0
    for j in range(pc.size):
        amplitude = np.sqrt(pc[j] * pc[j] + ps[j] * ps[j])
        cube = m[j] * m[j] * m[j] * amplitude
        size += amplitude
        bound += cube
        next_bound += m[j] * cube
    return bound, next_bound, size


@inlined
def polish(
    left: float, right: float, rising: bool, t: float, start: Any, p0: float, pc: Any, ps: Any, m: Any,
    consecutive: bool, bound: float, c: Any, s: Any,
) -> float:  # fmt: skip
    """The only root in ``[left, right]``: fourth-order steps (series reversion of the cubic Taylor polynomial), Newton
    steps where these are long, halving where a step would leave the bracket.

    ``start`` holds ``p, p', p'', p'''`` at the first guess ``t`` (the last may be rough), ``bound`` is ``B4``.
    """
    v0, v1, v2, v3 = start
    rough = 0.1
    for _ in range(100):
        if v0 == 0.0:
            return t
        if (v0 < 0.0) == rising:
            left = t
        else:
            right = t
        inside, error = False, 1.0
        if v1 != 0.0:
            r = 1.0 / v1
            u = -v0 * r
            q = 0.5 * v2 * r * u
            w = v3 * r * u * u / 6.0
            d = u
            if abs(q) < 0.25 and abs(w) < 0.25:
                d = u * (1.0 - q + 2.0 * q * q - w)
                error = abs(u * q) * (q * q + abs(w)) * 5.0 + u * u * u * u * bound * abs(r) / 24.0 + rough * abs(u * w)
            inside = left <= t + d <= right
        if not inside:
            d, error = 0.5 * (left + right) - t, 1.0
        t += d
        if error < 1e-16 or right - left < 1e-15:
            return t
        basis(t, m, consecutive, c, s)
        v0, v1, v2 = values(p0, pc, ps, m, c, s)
        v3 = third(pc, ps, m, c, s)
        rough = 0.0
    return t


@compiled
def between(left: float, right: float, sign: int, p0: float, pc: Any, ps: Any, m: Any, consecutive: bool,
    bound: float, c: Any, s: Any) -> float:  # fmt: skip
    """A crossing between two times with certain signs, ``sign`` at the right one."""
    t = 0.5 * (left + right)
    basis(t, m, consecutive, c, s)
    v0, v1, v2 = values(p0, pc, ps, m, c, s)
    start = (v0, v1, v2, third(pc, ps, m, c, s))
    return polish(left, right, sign > 0, t, start, p0, pc, ps, m, consecutive, bound, c, s)


@inlined
def edge_sign(t: float, taylor: float, doubt: float, floor: float, p0: float, pc: Any, ps: Any, m: Any,
    consecutive: bool, c: Any, s: Any) -> int:  # fmt: skip
    """Sign of ``p`` at a cell edge, 0 where it is zero to rounding; ``taylor`` is right within ``doubt``."""
    if abs(taylor) <= doubt + floor:
        basis(t, m, consecutive, c, s)
        taylor = value(p0, pc, ps, c, s)
        if abs(taylor) <= floor:
            return 0
    return 1 if taylor > 0.0 else -1


@inlined
def search_cell(
    left: float, right: float, middle: Any, before: Any, p0: float, pc: Any, ps: Any, m: Any, consecutive: bool,
    limits: Any, floor: float, c: Any, s: Any, stack: Any, roots: Any, rising: Any, count: int,
) -> tuple[int, int, float, int, float]:  # fmt: skip
    """Append the crossings in one cell, halving it until each piece is decided.

    ``middle`` holds ``p, p', p''`` and, roughly, the third derivative at the cell's middle; ``limits`` is (B3, B4);
    ``before`` is the last certain sign and its time. A crossing lies between two neighbouring certain signs that
    differ, so values at rounding level make no roots.
    Returns the new count, the last certain sign and its time, and the first certain sign met here and its time.
    """
    sign, since = before
    first, first_time = 0, 0.0
    top = 0
    known = True
    v0, v1, v2, v3 = middle
    bound, next_bound = limits
    while True:
        t = 0.5 * (left + right)
        h = 0.5 * (right - left)
        if not known:
            basis(t, m, consecutive, c, s)
            v0, v1, v2 = values(p0, pc, ps, m, c, s)
            v3 = third(pc, ps, m, c, s)
        known = False
        a1, a2 = abs(v1) * h, 0.5 * abs(v2) * h * h
        rest = bound * h * h * h / 6.0
        none = abs(v0) > a1 + a2 + rest + floor
        monotone = a1 > 2.0 * a2 + 3.0 * rest + floor
        flat = abs(v0) + a1 + a2 <= floor and rest <= 1e3 * floor
        if not (none or monotone or flat or h < 1e-15):
            stack[top, 0], stack[top, 1] = t, right
            top += 1
            right = t
            continue
        for end in range(2):
            d = h if end else -h
            new = edge_sign(t + d, v0 + d * (v1 + 0.5 * d * v2), rest, floor, p0, pc, ps, m, consecutive, c, s)
            if new != 0:
                if sign != 0 and new != sign and count < roots.size:
                    if end:
                        roots[count] = polish(
                            left, right, new > 0, t, (v0, v1, v2, v3), p0, pc, ps, m, consecutive, next_bound, c, s
                        )
                    else:
                        roots[count] = between(since, left, new, p0, pc, ps, m, consecutive, next_bound, c, s)
                    rising[count] = new > 0
                    count += 1
                if first == 0:
                    first, first_time = new, t + d
                sign, since = new, t + d
        if top == 0:
            return count, sign, since, first, first_time
        top -= 1
        left, right = stack[top, 0], stack[top, 1]


@compiled
def close_period(
    count: int, sign: int, since: float, first: int, first_time: float, p0: float, pc: Any, ps: Any, m: Any,
    consecutive: bool, bound: float, c: Any, s: Any, roots: Any, rising: Any,
) -> int:  # fmt: skip
    """Add the crossing between the last certain sign of the period and the first one of the next, if they differ."""
    if sign == first or count >= roots.size:
        return count
    t = between(since, first_time + TWO_PI, first, p0, pc, ps, m, consecutive, bound, c, s)
    at = count
    if t >= TWO_PI:
        t -= TWO_PI
        for i in range(count, 0, -1):
            roots[i], rising[i] = roots[i - 1], rising[i - 1]
        at = 0
    roots[at], rising[at] = t, first > 0
    return count + 1


@compiled
def isolate(
    p0: float, pc: Any, ps: Any, g0: Any, g1: Any, g2: Any, skip: Any, margin: Any, m: Any, consecutive: bool,
    c: Any, s: Any, stack: Any, roots: Any, rising: Any,
) -> tuple[int, int]:  # fmt: skip
    """All crossings of one polynomial, ascending; returns their number and the first certain sign.

    ``g0, g1, g2`` hold ``p, p', p''`` at the cell middles. Crossings in cells with ``skip`` are not all found, but
    where their number is odd one of them is, so that the directions of the others are right.
    """
    bound, next_bound, size = bounds(pc, ps, m)
    floor = 2e-15 * (size + abs(p0))
    if not size > floor or not next_bound < 1e300:  # also where it is not a number, or overflows
        return 0, 1 if p0 > 0.0 else (-1 if p0 < 0.0 else 0)
    cells = g0.size
    h = 0.5 * TWO_PI / cells
    half, rest = 0.5 * h * h, bound * h * h * h / 6.0 + floor
    count, sign, since, first, first_time = 0, 0, 0.0, 0, 0.0
    decided = -1
    for i in range(cells):
        margin[i] = abs(g0[i]) - abs(g1[i]) * h - abs(g2[i]) * half - rest
    for i in range(cells):
        if skip[i]:
            continue
        if margin[i] > 0.0:
            if decided != i - 1 or i == 0:
                new, t = (1 if g0[i] > 0.0 else -1), 2.0 * h * (i + 0.5)
                if first == 0:
                    first, first_time = new, t
                if sign != 0 and new != sign and count < roots.size:
                    roots[count] = between(since, t, new, p0, pc, ps, m, consecutive, next_bound, c, s)
                    rising[count] = new > 0
                    count += 1
                sign, since = new, t
            decided = i
            continue
        if decided == i - 1 and i > 0:
            sign, since = (1 if g0[i - 1] > 0.0 else -1), 2.0 * h * i
        v3 = (g2[i + 1 if i + 1 < cells else 0] - g2[i - 1]) / (4.0 * h)
        count, sign, since, new, new_time = search_cell(
            2.0 * h * i, 2.0 * h * (i + 1), (g0[i], g1[i], g2[i], v3), (sign, since), p0, pc, ps, m, consecutive,
            (bound, next_bound), floor, c, s, stack, roots, rising, count,
        )  # fmt: skip
        if first == 0:
            first, first_time = new, new_time
    if decided == cells - 1:
        sign, since = (1 if g0[decided] > 0.0 else -1), TWO_PI
    count = close_period(
        count, sign, since, first, first_time, p0, pc, ps, m, consecutive, next_bound, c, s, roots, rising
    )
    return count, first


@compiled(allocates=True)
def _roots(p0: float, pc: Any, ps: Any, m: Any, cos: Any, sin: Any, consecutive: bool) -> tuple[Any, Any]:
    cells, n = cos.shape[1], m.size
    g = np.zeros((3, cells))
    for i in range(cells):
        g[0, i], g[1, i], g[2, i] = values(p0, pc, ps, m, cos[:, i], sin[:, i])
    c, s = np.empty(n), np.empty(n)
    highest = int(m.max())
    found, rising = np.empty(2 * highest + 2), np.empty(2 * highest + 2, np.bool_)
    skip = np.zeros(cells, np.bool_)
    count, _ = isolate(
        p0, pc, ps, g[0], g[1], g[2], skip, np.empty(cells), m, consecutive, c, s, np.empty((STACK, 2)), found, rising
    )
    return found[:count], rising[:count]


def roots(harmonics: Harmonics, coefficients: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """All sign changes of ``p(tau) = H_minus(tau) @ coefficients`` in ``[0, 2 pi)``.

    Parameters
    ----------
    harmonics
        The harmonic set.
    coefficients
        Shape (L,).

    Returns
    -------
    times, rising
        Ascending times (k,) in rad, and whether the sign goes from minus to plus there (k,).

    Examples
    --------
    >>> times, rising = roots(Harmonics([0, 1]), [0.0, 1.0, 0.0])      # cos tau
    >>> (times / np.pi).round(12).tolist(), rising.tolist()
    ([0.5, 1.5], [False, True])
    """
    p = np.ascontiguousarray(coefficients, dtype=float)
    table = grid(harmonics)
    pc, ps = np.zeros(table.orders.size), np.zeros(table.orders.size)
    pc[: harmonics.n], ps[: harmonics.n] = p[1::2], p[2::2]
    times, rising = _roots(p[0], pc, ps, table.orders, table.cos, table.sin, table.consecutive)
    return np.asarray(times), np.asarray(rising)
