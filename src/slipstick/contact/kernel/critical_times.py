"""Critical times of a contact: its trial functions turn, its gap opens or closes (THEORY.md section 3)."""

from __future__ import annotations

from math import pi

import numpy as np

from slipstick.contact.kernel.tuples import BOTH, LOWER, NONE, NORMAL, UPPER, ElementMotion, Search, Segments, Workspace
from slipstick.trig.basis import Grid, Polynomial
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.roots import FULL, Cells, Roots, isolate, rounding_floor
from slipstick.typing import Array, BoolArray, IntArray


@compiled
def tabulate(e: ElementMotion, grid: Grid, varying: bool, g: Array) -> None:
    """Fill ``g`` (9, cells) at cell middles: ``y, y', y''``, then ``p, p', p''`` of ``phi_+'`` and of ``phi_-'``."""
    orders, cos, sin = grid.orders, grid.cos, grid.sin
    xcos, xsin, ycos, ysin = e.X.cos, e.X.sin, e.Y.cos, e.Y.sin
    cells = cos.shape[1]
    for k in range(7):
        for i in range(cells):
            g[k, i] = 0.0
    for i in range(cells):
        g[0, i] = e.Y.mean
        g[4, i] = e.v
    # two orders a pass: the arrays are read and written half as often
    for j in range(0, xcos.size, 2):
        m1, n1 = orders[j], orders[j + 1]
        m2, n2 = m1 * m1, n1 * n1
        m3, n3 = m1 * m2, n1 * n2
        xc, xs, zc, zs = xcos[j], xsin[j], xcos[j + 1], xsin[j + 1]
        for i in range(cells):
            c, s, d, f = cos[j, i], sin[j, i], cos[j + 1, i], sin[j + 1, i]
            a, b = xc * c + xs * s, xs * c - xc * s
            p, q = zc * d + zs * f, zs * d - zc * f
            g[4, i] += m1 * b + n1 * q
            g[5, i] -= m2 * a + n2 * p
            g[6, i] -= m3 * b + n3 * q
        if varying:
            yc, ys, zc, zs = ycos[j], ysin[j], ycos[j + 1], ysin[j + 1]
            for i in range(cells):
                c, s, d, f = cos[j, i], sin[j, i], cos[j + 1, i], sin[j + 1, i]
                a, b = yc * c + ys * s, ys * c - yc * s
                p, q = zc * d + zs * f, zs * d - zc * f
                g[0, i] += a + p
                g[1, i] += m1 * b + n1 * q
                g[2, i] -= m2 * a + n2 * p
                g[3, i] -= m3 * b + n3 * q
    for i in range(cells):
        a, b = e.kt * g[4, i], e.limit * g[1, i]
        a1, b1 = e.kt * g[5, i], e.limit * g[2, i]
        a2, b2 = e.kt * g[6, i], e.limit * g[3, i]
        g[3, i], g[4, i], g[5, i] = a - b, a1 - b1, a2 - b2
        g[6, i], g[7, i], g[8, i] = a + b, a1 + b1, a2 + b2


@compiled
def separated_cells(Y: Polynomial, orders: Array, g: Array, skip: BoolArray) -> None:
    """Mark the cells in which ``y - g < 0`` for certain."""
    h = pi / skip.size
    curvature = 0.0
    for j in range(orders.size):
        curvature += orders[j] * orders[j] * np.sqrt(Y.cos[j] * Y.cos[j] + Y.sin[j] * Y.sin[j])
    for i in range(skip.size):
        skip[i] = g[0, i] + abs(g[1, i]) * h + 0.5 * curvature * h * h < 0.0


@inlined
def peak(y: Array) -> float:
    """The largest of some values, not below zero."""
    top = 0.0
    for i in range(y.size):
        top = max(top, y[i])
    return top


@compiled
def merge(search: Search, same: bool, segments: Segments) -> int:
    """Merge three ascending lists of critical times into one; returns their number."""
    lists, rising, counts = search.lists, search.rising, search.counts
    time, kind, up = segments.time, segments.kind, segments.up
    i, j, k, total = 0, 0, 0, 0
    while i < counts[0] or j < counts[1] or k < counts[2]:
        a = lists[0, i] if i < counts[0] else 1e9
        b = lists[1, j] if j < counts[1] else 1e9
        d = lists[2, k] if k < counts[2] else 1e9
        if a <= b and a <= d:
            time[total], kind[total], up[total] = a, NORMAL, rising[0, i]
            i += 1
        elif b <= d:
            time[total], kind[total], up[total] = b, BOTH if same else UPPER, rising[1, j]
            j += 1
        else:
            time[total], kind[total], up[total] = d, LOWER, rising[2, k]
            k += 1
        total += 1
    return total


@compiled
def segment_signs(count: int, first: IntArray, segments: Segments) -> None:
    """Contact and the signs of ``phi_+'``, ``phi_-'`` in the segment after each critical time.

    A sign comes from the last crossing of its function; without any crossing it is ``first``.
    """
    kind, up = segments.kind, segments.up
    c, p, q = first[0] > 0, float(first[1]), float(first[2])
    for lap in range(2):
        for i in range(count):
            direction = 1.0 if up[i] else -1.0
            if kind[i] == NORMAL:
                c = up[i]
            if kind[i] == UPPER or kind[i] == BOTH:
                p = direction
            if kind[i] == LOWER or kind[i] == BOTH:
                q = direction
            if lap == 1:
                segments.contact[i], segments.plus[i], segments.minus[i] = c, p, q


@compiled
def fill_polynomials(e: ElementMotion, orders: Array, p: Array) -> tuple[float, float, float]:
    """Cosines and sines of ``y - g``, of ``phi_+'`` and of ``phi_-'`` in the rows of ``p`` (6, n4).

    Returns the rounding floors of the first and of the other two, and the largest rate ``kt w'`` the motion can have.
    """
    X, Y, kt, limit = e.X, e.Y, e.kt, e.limit
    size, slope, wx, sx, sy = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(orders.size):
        m, x = orders[j], np.sqrt(X.cos[j] * X.cos[j] + X.sin[j] * X.sin[j])
        y = np.sqrt(Y.cos[j] * Y.cos[j] + Y.sin[j] * Y.sin[j])
        size += y
        slope += m * y
        wx += m * x
        sx += m * m * x
        sy += m * m * y
        p[0, j], p[1, j] = Y.cos[j], Y.sin[j]
        a, b = kt * orders[j] * X.sin[j], limit * orders[j] * Y.sin[j]
        p[2, j], p[4, j] = a - b, a + b
        a, b = -kt * orders[j] * X.cos[j], -limit * orders[j] * Y.cos[j]
        p[3, j], p[5, j] = a - b, a + b
    rate = kt * (wx + abs(e.v))
    floor = rounding_floor(size + abs(Y.mean), slope, orders.size)
    return floor, rounding_floor(rate + limit * slope, kt * sx + limit * sy, orders.size), rate


@inlined
def critical_times(e: ElementMotion, grid: Grid, k: Workspace) -> tuple[int, float, float]:
    """Critical times of one element, merged, with contact and signs of the segments after them; returns their number,
    the largest rate ``kt w'`` the motion can have and the largest friction limit.

    Without any, one segment begins at time 0. ``FULL`` where there would be more than there can be.
    """
    orders, search, segments = grid.orders, k.search, k.segments
    varying = False
    for j in range(orders.size):
        if e.Y.cos[j] != 0.0 or e.Y.sin[j] != 0.0:
            varying = True
    g, p, skip = search.g, search.p, search.skip
    tabulate(e, grid, varying, g)
    floor_y, floor, rate = fill_polynomials(e, orders, p)
    limit = e.limit * peak(g[0])
    skip[:] = False
    counts, signs = search.counts, search.signs
    counts[:], signs[:] = 0, 0
    signs[0] = 1 if e.Y.mean > 0.0 else -1
    for r in range(3):
        if r == 0 and not varying:
            continue
        if r == 1 and varying:
            separated_cells(e.Y, orders, g, skip)
        if r == 1 and counts[0] == 0 and signs[0] < 0:
            break
        if r == 2 and not varying:
            signs[2] = signs[1]
            break
        f = Polynomial(e.Y.mean if r == 0 else e.kt * e.v, p[2 * r], p[2 * r + 1])
        cells = Cells(g[3 * r], g[3 * r + 1], g[3 * r + 2], skip, search.margin, search.stack)
        counts[r], signs[r] = isolate(
            f, floor_y if r == 0 else floor, cells, grid, k.scratch, Roots(search.lists[r], search.rising[r])
        )
        if counts[r] == FULL:
            return FULL, rate, limit
    count = merge(search, not varying, segments)
    if count == 0:
        segments.time[0], segments.kind[0], count = 0.0, NONE, 1
    segment_signs(count, signs, segments)
    return count, rate, limit


@compiled
def padded(X: Array, mean: float, parts: Array) -> Polynomial:
    """A given mean with the cosines and sines of coefficients (L,), padded by zeros in ``parts`` (2, n4)."""
    for j in range(parts.shape[1]):
        parts[0, j], parts[1, j] = 0.0, 0.0
    for j in range((X.size - 1) // 2):
        parts[0, j], parts[1, j] = X[2 * j + 1], X[2 * j + 2]
    return Polynomial(mean, parts[0], parts[1])
