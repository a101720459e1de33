"""Critical times of a contact element: where its trial functions turn and its gap opens or closes (THEORY.md 3)."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from slipstick.contact.states import NONE, merge, segment_signs
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.roots import FULL, isolate, rounding_floor


@compiled
def tabulate(
    XU: Any, Y: Any, v: float, kt: float, mukn: float, orders: Any, cos: Any, sin: Any, varying: bool, g: Any
) -> None:  # fmt: skip
    """Fill ``g`` (9, cells) at cell middles: ``y, y', y''``, then ``p, p', p''`` of ``phi_+'`` and of ``phi_-'``."""
    cells = cos.shape[1]
    for k in range(7):
        for i in range(cells):
            g[k, i] = 0.0
    for i in range(cells):
        g[0, i] = Y[0]
        g[4, i] = v
    # two orders a pass: the arrays are read and written half as often
    for j in range(0, XU[1].size, 2):
        m1, n1 = orders[j], orders[j + 1]
        m2, n2 = m1 * m1, n1 * n1
        m3, n3 = m1 * m2, n1 * n2
        xc, xs, zc, zs = XU[1][j], XU[2][j], XU[1][j + 1], XU[2][j + 1]
        for i in range(cells):
            c, s, e, f = cos[j, i], sin[j, i], cos[j + 1, i], sin[j + 1, i]
            a, b = xc * c + xs * s, xs * c - xc * s
            p, q = zc * e + zs * f, zs * e - zc * f
            g[4, i] += m1 * b + n1 * q
            g[5, i] -= m2 * a + n2 * p
            g[6, i] -= m3 * b + n3 * q
        if varying:
            yc, ys, zc, zs = Y[1][j], Y[2][j], Y[1][j + 1], Y[2][j + 1]
            for i in range(cells):
                c, s, e, f = cos[j, i], sin[j, i], cos[j + 1, i], sin[j + 1, i]
                a, b = yc * c + ys * s, ys * c - yc * s
                p, q = zc * e + zs * f, zs * e - zc * f
                g[0, i] += a + p
                g[1, i] += m1 * b + n1 * q
                g[2, i] -= m2 * a + n2 * p
                g[3, i] -= m3 * b + n3 * q
    for i in range(cells):
        a, b = kt * g[4, i], mukn * g[1, i]
        a1, b1 = kt * g[5, i], mukn * g[2, i]
        a2, b2 = kt * g[6, i], mukn * g[3, i]
        g[3, i], g[4, i], g[5, i] = a - b, a1 - b1, a2 - b2
        g[6, i], g[7, i], g[8, i] = a + b, a1 + b1, a2 + b2


@compiled
def separated_cells(Y: Any, orders: Any, g: Any, skip: Any) -> None:
    """Mark the cells in which ``y - g < 0`` for certain."""
    h = pi / skip.size
    curvature = 0.0
    for j in range(orders.size):
        curvature += orders[j] * orders[j] * np.sqrt(Y[1][j] * Y[1][j] + Y[2][j] * Y[2][j])
    for i in range(skip.size):
        skip[i] = g[0, i] + abs(g[1, i]) * h + 0.5 * curvature * h * h < 0.0


@inlined
def peak(y: Any) -> float:
    """The largest of some values, not below zero."""
    top = 0.0
    for i in range(y.size):
        top = max(top, y[i])
    return top


@compiled
def fill_polynomials(
    XU: Any, Y: Any, v: float, kt: float, mukn: float, orders: Any, p: Any
) -> tuple[float, float, float]:  # fmt: skip
    """Cosines and sines of ``y - g``, of ``phi_+'`` and of ``phi_-'`` in the rows of ``p`` (6, n4).

    Returns the rounding floors of the first and of the other two, and the largest rate ``kt w'`` the motion can have.
    """
    size, slope, wx, sx, sy = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(orders.size):
        m, x = orders[j], np.sqrt(XU[1][j] * XU[1][j] + XU[2][j] * XU[2][j])
        y = np.sqrt(Y[1][j] * Y[1][j] + Y[2][j] * Y[2][j])
        size += y
        slope += m * y
        wx += m * x
        sx += m * m * x
        sy += m * m * y
        p[0, j], p[1, j] = Y[1][j], Y[2][j]
        a, b = kt * orders[j] * XU[2][j], mukn * orders[j] * Y[2][j]
        p[2, j], p[4, j] = a - b, a + b
        a, b = -kt * orders[j] * XU[1][j], -mukn * orders[j] * Y[1][j]
        p[3, j], p[5, j] = a - b, a + b
    rate = kt * (wx + abs(v))
    floor = rounding_floor(size + abs(Y[0]), slope, orders.size)
    return floor, rounding_floor(rate + mukn * slope, kt * sx + mukn * sy, orders.size), rate


@inlined
def critical_times(XU: Any, Y: Any, v: float, kt: float, mukn: float, tables: Any, k: Any) -> int:
    """Critical times of one element, merged, with contact and signs of the segments after them; returns their number.

    Without any, one segment begins at time 0. ``FULL`` where there would be more than there can be.
    """
    orders, cos, sin, consecutive = tables
    varying = False
    for j in range(orders.size):
        if Y[1][j] != 0.0 or Y[2][j] != 0.0:
            varying = True
    tabulate(XU, Y, v, kt, mukn, orders, cos, sin, varying, k.g)
    floor_y, floor, k.scale[0] = fill_polynomials(XU, Y, v, kt, mukn, orders, k.p)
    k.scale[1] = mukn * peak(k.g[0])
    k.skip[:] = False
    counts, signs = k.counts, k.signs
    counts[:], signs[:] = 0, 0
    signs[0] = 1 if Y[0] > 0.0 else -1
    for r in range(3):
        if r == 0 and not varying:
            continue
        if r == 1 and varying:
            separated_cells(Y, orders, k.g, k.skip)
        if r == 1 and counts[0] == 0 and signs[0] < 0:
            break
        if r == 2 and not varying:
            signs[2] = signs[1]
            break
        counts[r], signs[r] = isolate(
            Y[0] if r == 0 else kt * v, k.p[2 * r], k.p[2 * r + 1], floor_y if r == 0 else floor, k.g[3 * r],
            k.g[3 * r + 1], k.g[3 * r + 2], k.skip, k.margin, orders, consecutive, k.c, k.s, k.stack, k.lists[r],
            k.rising[r],
        )  # fmt: skip
        if counts[r] == FULL:
            return FULL
    count = merge(k.lists, k.rising, counts, not varying, k.time, k.kind, k.up)
    if count == 0:
        k.time[0], k.kind[0], count = 0.0, NONE, 1
    segment_signs(count, k.kind, k.up, signs, k.contact, k.plus, k.minus)
    return count


@compiled
def triple(X: Any, constant: float, parts: Any) -> tuple[float, Any, Any]:
    """A given constant with the cosines and sines of coefficients (L,), padded by zeros."""
    for j in range(parts.shape[1]):
        parts[0, j], parts[1, j] = 0.0, 0.0
    for j in range((X.size - 1) // 2):
        parts[0, j], parts[1, j] = X[2 * j + 1], X[2 * j + 2]
    return constant, parts[0], parts[1]
