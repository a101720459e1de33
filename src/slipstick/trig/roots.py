"""All roots of a trigonometric polynomial in one period, with certainty (THEORY.md (3.5), (3.6)).

A cell of half-width ``h`` with middle values ``p, p', p''`` and ``B3 = sum m^3 |c_m| >= max |p'''|``

- holds no root if ``|p| > |p'| h + |p''| h^2/2 + B3 h^3/6``;
- is monotone, hence holds at most one, if ``|p'| > |p''| h + B3 h^2/2``;
- is halved otherwise.

Only crossings are reported: a touching double root changes no sign.

A root is reported between two neighbouring *certain* signs that differ; the times of certain signs ascend, so the roots
ascend. A sign is certain where ``|p|`` computed exceeds a floor that is proved to be above its error. Then ``p`` itself
alternates at these times, which it can do ``2 m_n`` times at most: no root is a duplicate or spurious.

**The floor.** ``u = 2^-53``, ``n`` orders, ``S = |p0| + sum |c_m|``, ``B1 = sum m |c_m|``; for a difference of two
polynomials ``|c_m|`` is the sum of their amplitudes, before any cancellation. All bounds to first order in u.

- Tables (``turns``): one angle below pi/4, wrong by 1.9 u, and the functions by one unit each: 3.5 u in the complex
  plane, whatever the order, since the multiple of the turn is an integer.
- ``circle``: table, series and its reduced angle, last subtraction: 3.5 u + 0.3 u + 1.4 u = 5.2 u.
- ``powers``: errors add in a product, which adds 2.3 u by its rounding; ``z_k = z_(k-4) z_4`` is made of k factors
  ``z_1`` and k - 1 products: 7.5 k u. Orders that are not consecutive: ``m t`` is off by 2 pi m u, then ``circle``.
  So a basis is wrong by ``7.5 m u`` or ``(6.3 m + 5.2) u``, and ``p`` by ``(7.5 B1 + 5.2 S) u``.
- Coefficients and sums, in any order: ``(n + 6) u S`` on the cell middles, ``(n + 3) u S`` elsewhere.
- A decided cell: ``p`` is off by (n + 10) u S, ``p' h`` and ``p'' h^2/2`` by 0.32 and 0.05 of it (``m h <= pi/10``),
  the comparison by 6 u S; the cell's ends in floating point are within 16 u of the true ones, worth ``16 u B1``. In all
  ``((1.4 n + 20) S + 16 B1) u``. Halved pieces need less: ``((1.2 n + 12) S + 14 B1) u``.
- Two roots never fall on one number: next to a certain time, one unit (8 u) away, the computed sign is the same if the
  floor exceeds twice the error of a value and 8 u B1, that is ``((2 n + 17) S + 23 B1) u``.

``floor = u ((2 n + 20) S + 24 B1)`` is above all of these.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import SlipstickError
from slipstick.trig.basis import TWO_PI, Grid, Polynomial, Scratch, basis, grid, third, value, values
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray

STACK = 128
"""Halved pieces of a cell that are stored: halving ends at the width of rounding, after some 50 times."""
FULL = -1
"""Number of roots returned when the buffer is full, or a cell has ``MOST_PIECES``: neither can happen."""
MOST_PIECES = 200_000
"""Largest number of pieces of one cell: some hundreds, unless values are not numbers."""
TOO_MANY = (
    "found more roots than the harmonics {orders} allow, or no end of them, which cannot be; this is a fault of "
    "slipstick: please report it with the coefficients"
)
_UNIT = 2.0**-53
"""Unit roundoff u."""
_POLISH_STEPS = 100
"""Largest number of steps of ``polish``: bisection alone needs about 50."""
_ROOT_ERROR, _NARROWEST = 1e-16, 1e-15
"""Estimated error, and width of a bracket, at which a root is exact to rounding."""
_SERIES_RANGE = 0.25
"""Largest second and third term of the reverted series, over the first, for which it is used."""
_ROUGH_THIRD = 0.1
"""Relative error of a third derivative by differences between cells."""

Slopes = tuple[float, float, float, float]
"""``p, p', p'', p'''`` at a time."""


class Cells(NamedTuple):
    """A polynomial at the cell middles, and the work of a search."""

    p: Array
    """``p`` (cells,)."""
    slope: Array
    """``p'``."""
    curve: Array
    """``p''``."""
    skip: BoolArray
    """Cells whose roots do not matter."""
    margin: Array
    """Buffer (cells,)."""
    stack: Array
    """Buffer for halved pieces (STACK, 2)."""


class Roots(NamedTuple):
    """Buffers for ascending roots, and whether the sign changes from minus to plus there."""

    times: Array
    rising: BoolArray


class Search(NamedTuple):
    """A polynomial whose roots are computed, with bounds of its derivatives and the floor of its rounding."""

    p: Polynomial
    grid: Grid
    third: float
    """``B3 = sum m^3 |c_m|``"""
    fourth: float
    """``B4 = sum m^4 |c_m|``"""
    floor: float
    c: Array
    """Buffers for a basis."""
    s: Array


@inlined
def derivatives_at(f: Search, t: float) -> Slopes:
    """``p, p', p'', p'''`` at a time."""
    basis(t, f.grid, f.c, f.s)
    v0, v1, v2 = values(f.p, f.grid.orders, f.c, f.s)
    return v0, v1, v2, third(f.p, f.grid.orders, f.c, f.s)


@inlined
def rounding_floor(size: float, slope: float, n: int) -> float:
    """Floor that the computed ``|p|`` must exceed for a certain sign: ``size`` is S, ``slope`` is B1 (see above)."""
    return _UNIT * ((2.0 * n + 20.0) * size + 24.0 * slope)


@inlined
def bounds(p: Polynomial, m: Array) -> tuple[float, float]:
    """``B3 = sum m^3 |c_m|`` and ``B4 = sum m^4 |c_m|``."""
    pc, ps = p.cos, p.sin
    bound, next_bound = 0.0, 0.0
    for j in range(pc.size):
        cube = m[j] * m[j] * m[j] * np.sqrt(pc[j] * pc[j] + ps[j] * ps[j])
        bound += cube
        next_bound += m[j] * cube
    return bound, next_bound


@inlined
def polish(left: float, right: float, rising: bool, t: float, start: Slopes, f: Search) -> float:
    """The only root in ``[left, right]``: fourth-order steps (series reversion of the cubic Taylor polynomial), Newton
    steps where these are long, halving where a step would leave the bracket.

    ``start`` holds ``p, p', p'', p'''`` at the first guess ``t`` (the last may be rough).
    """
    v0, v1, v2, v3 = start
    rough = _ROUGH_THIRD
    for _ in range(_POLISH_STEPS):
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
            if abs(q) < _SERIES_RANGE and abs(w) < _SERIES_RANGE:
                d = u * (1.0 - q + 2.0 * q * q - w)
                error = (
                    abs(u * q) * (q * q + abs(w)) * 5.0 + u * u * u * u * f.fourth * abs(r) / 24.0 + rough * abs(u * w)
                )
            inside = left <= t + d <= right
        if not inside:
            d, error = 0.5 * (left + right) - t, 1.0
        t = min(max(t + d, left), right)
        if error < _ROOT_ERROR or right - left < _NARROWEST:
            return t
        v0, v1, v2, v3 = derivatives_at(f, t)
        rough = 0.0
    return t


@compiled
def between(left: float, right: float, sign: int, f: Search) -> float:
    """A crossing between two times with certain signs, ``sign`` at the right one."""
    t = 0.5 * (left + right)
    return polish(left, right, sign > 0, t, derivatives_at(f, t), f)


@inlined
def edge_sign(t: float, taylor: float, error: float, f: Search) -> int:
    """Sign of ``p`` at the edge of a piece, 0 where it is not certain; ``taylor`` has an ``error``."""
    if abs(taylor) <= error + f.floor:
        basis(t, f.grid, f.c, f.s)
        taylor = value(f.p, f.c, f.s)
        if abs(taylor) <= f.floor:
            return 0
    return 1 if taylor > 0.0 else -1


@inlined
def search_cell(
    left: float,
    right: float,
    middle: Slopes,
    before: tuple[int, float, float],
    f: Search,
    stack: Array,
    roots: Roots,
    count: int,
) -> tuple[int, int, float, int, float]:
    """Append the crossings in one cell, halving it until each piece is decided.

    ``middle`` holds ``p, p', p''`` and, roughly, the third derivative at the cell's middle. ``before`` is the last
    certain sign, its time, and whether the sign at the left edge is decided: an edge belongs to two pieces and is
    decided once. Pieces within rounding have no roots.
    Returns the new count, or ``FULL``, the last certain sign and its time, and the first met here and its time.
    """
    sign, since, seen = before
    first, first_time = 0, 0.0
    top = 0
    evaluated = True
    v0, v1, v2, v3 = middle
    floor = f.floor
    for _ in range(MOST_PIECES):
        t = 0.5 * (left + right)
        h = 0.5 * (right - left)
        if not evaluated:
            v0, v1, v2, v3 = derivatives_at(f, t)
        evaluated = False
        a1, a2 = abs(v1) * h, 0.5 * abs(v2) * h * h
        rest = f.third * h * h * h / 6.0
        none = abs(v0) > a1 + a2 + rest + floor
        monotone = a1 > 2.0 * a2 + 3.0 * rest + floor
        # above the floor, so that an interval of values equal to it is not halved to the last digit
        flat = abs(v0) + a1 + a2 <= 1.1 * floor and rest <= 1e3 * floor
        if not (none or monotone or flat or h < _NARROWEST):
            stack[top, 0], stack[top, 1] = t, right
            top += 1
            right = t
            continue
        for end in range(1 if seen and not none else 0, 2):
            at, d = (right, h) if end else (left, -h)
            new = 1 if v0 > 0.0 else -1
            if not none:
                new = edge_sign(at, v0 + d * (v1 + 0.5 * d * v2), rest, f)
            if new == 0:
                continue
            if sign != 0 and new != sign:
                if count == roots.times.size:
                    return FULL, sign, since, first, first_time
                if end and monotone:
                    roots.times[count] = polish(left, right, new > 0, t, (v0, v1, v2, v3), f)
                else:
                    roots.times[count] = between(since, at, new, f)
                roots.rising[count] = new > 0
                count += 1
            if first == 0:
                first, first_time = new, at
            sign, since = new, at
        seen = True
        if top == 0:
            return count, sign, since, first, first_time
        top -= 1
        left, right = stack[top, 0], stack[top, 1]
    return FULL, sign, since, first, first_time


@compiled
def close_period(count: int, last: tuple[int, float], first: tuple[int, float], f: Search, roots: Roots) -> int:
    """Add the crossing between the last certain sign of the period and the first one of the next, if they differ.

    ``last`` and ``first`` are a sign and its time.
    """
    if last[0] == first[0]:
        return count
    if count == roots.times.size:
        return FULL
    t = between(last[1], first[1] + TWO_PI, first[0], f)
    at = count
    if t >= TWO_PI:
        t -= TWO_PI
        for i in range(count, 0, -1):
            roots.times[i], roots.rising[i] = roots.times[i - 1], roots.rising[i - 1]
        at = 0
    roots.times[at], roots.rising[at] = t, first[0] > 0
    return count + 1


@compiled
def isolate(p: Polynomial, floor: float, cells: Cells, grid: Grid, scratch: Scratch, roots: Roots) -> tuple[int, int]:
    """All crossings of one polynomial, ascending; returns their number, or ``FULL``, and the first certain sign.

    ``floor`` is ``rounding_floor``. Crossings in cells with ``skip`` are not all found, but where their number is odd
    one of them is, so that the directions of the others are right.
    """
    bound, next_bound = bounds(p, grid.orders)
    if not next_bound > 0.0 or not next_bound < 1e300:  # also where it is not a number, or overflows
        return 0, 1 if p.mean > 0.0 else (-1 if p.mean < 0.0 else 0)
    f = Search(p, grid, bound, next_bound, floor, scratch.c, scratch.s)
    g0, g1, g2, skip, margin = cells.p, cells.slope, cells.curve, cells.skip, cells.margin
    number = g0.size
    h = 0.5 * TWO_PI / number
    half, rest = 0.5 * h * h, bound * h * h * h / 6.0 + floor
    count, sign, since, first, first_time = 0, 0, 0.0, 0, 0.0
    decided, seen = -1, False
    for i in range(number):
        margin[i] = abs(g0[i]) - abs(g1[i]) * h - abs(g2[i]) * half - rest
    for i in range(number):
        if skip[i]:
            seen = False
            continue
        left = 2.0 * h * i
        if margin[i] > 0.0:
            if decided != i - 1 or i == 0:
                new = 1 if g0[i] > 0.0 else -1
                if first == 0:
                    first, first_time = new, left
                if sign != 0 and new != sign:
                    if count == roots.times.size:
                        return FULL, first
                    roots.times[count] = between(since, left, new, f)
                    roots.rising[count] = new > 0
                    count += 1
                sign, since = new, left
            decided = i
            continue
        if decided == i - 1 and i > 0:
            sign, since, seen = (1 if g0[i - 1] > 0.0 else -1), left, True
        v3 = (g2[i + 1 if i + 1 < number else 0] - g2[i - 1]) / (4.0 * h)
        count, sign, since, new, new_time = search_cell(
            left, 2.0 * h * (i + 1), (g0[i], g1[i], g2[i], v3), (sign, since, seen), f, cells.stack, roots, count
        )
        if count == FULL:
            return FULL, first
        if first == 0:
            first, first_time = new, new_time
        seen = True
    if decided == number - 1:
        sign, since = (1 if g0[decided] > 0.0 else -1), TWO_PI
    return close_period(count, (sign, since), (first, first_time), f, roots), first


@compiled(allocates=True)
def _roots(p: Polynomial, grid: Grid, room: int) -> tuple[int, Array, BoolArray]:
    cells, n, m = grid.cos.shape[1], grid.orders.size, grid.orders
    g = np.zeros((3, cells))
    for i in range(cells):
        g[0, i], g[1, i], g[2, i] = values(p, m, grid.cos[:, i], grid.sin[:, i])
    size, slope = abs(p.mean), 0.0
    for j in range(n):
        amplitude = np.sqrt(p.cos[j] * p.cos[j] + p.sin[j] * p.sin[j])
        size += amplitude
        slope += m[j] * amplitude
    work = Cells(g[0], g[1], g[2], np.zeros(cells, np.bool_), np.empty(cells), np.empty((STACK, 2)))
    scratch = Scratch(np.empty(n), np.empty(n), np.empty((2, n)), np.empty((2, n)))
    roots = Roots(np.empty(room), np.empty(room, np.bool_))
    count, _ = isolate(p, rounding_floor(size, slope, n), work, grid, scratch, roots)
    return count, roots.times, roots.rising


def roots(harmonics: Harmonics, coefficients: ArrayLike) -> tuple[Array, BoolArray]:
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

    Raises
    ------
    SlipstickError
        If more roots are found than there can be; the list is never truncated.

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
    count, times, rising = _roots(Polynomial(p[0], pc, ps), table, 2 * harmonics.highest)
    if count == FULL:
        raise SlipstickError(TOO_MANY.format(orders=list(harmonics.orders)))
    return np.asarray(times)[:count], np.asarray(rising)[:count]
