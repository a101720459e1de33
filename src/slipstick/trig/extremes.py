"""The largest deviation of a trigonometric polynomial from its mean, with its time: a grid, then Newton's method.

Between two neighbouring times of a grid of step ``h`` the deviation rises above the nearer one by at most
``B2 (h/2)^2 / 2``, ``B2 = sum m^2 (|c_m| + |s_m|)``: grid times further below the largest need no look.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.trig.basis import TWO_PI, Grid, Polynomial, basis, grid, values
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_UPHILL = 60
"""Steps to the top at most."""


@inlined
def summit(t: float, start: float, reach: float, p: Polynomial, grid: Grid, c: Array, s: Array) -> tuple[float, float]:
    """Time and value of the extreme next to ``t``, where the value is ``start``, at most ``reach`` away."""
    first = t
    for _ in range(8):
        basis(t, grid, c, s)
        _v, slope, curvature = values(p, grid.orders, c, s)
        moved = t - slope / curvature if curvature != 0.0 else t
        moved = min(max(moved, first - reach), first + reach)
        done = abs(moved - t) < 1e-8
        t = moved
        if done:
            break
    basis(t, grid, c, s)
    v, _slope, _curvature = values(p, grid.orders, c, s)
    return (t, v) if abs(v) >= abs(start) else (first, start)


@compiled(allocates=True)
def _largest(X: Array, dX: Array, tables: Any, out: Array) -> None:
    """Signed largest deviation of each row of ``X`` (k, L), its time, and its change with ``dX`` (k, L) or (0, L).

    They are written into ``out`` (3, k): a new array is handed to Python only after microseconds. ``tables`` is a plain
    tuple of the fields of ``Grid``, whose type numba knows at once.
    """
    grid = Grid(*tables)
    orders, cos, sin = grid.orders, grid.cos, grid.sin
    rows, cells = X.shape[0], cos.shape[1]
    step = TWO_PI / cells
    value, time, change = out[0], out[1], out[2]
    pc, ps = np.zeros(orders.size), np.zeros(orders.size)
    c, s, v = np.empty(orders.size), np.empty(orders.size), np.empty(cells)
    for r in range(rows):
        margin, top = 0.0, 0.0
        value[r], time[r], change[r] = 0.0, 0.0, 0.0
        v[:] = 0.0
        for j in range(grid.n):
            pc[j], ps[j] = X[r, 2 * j + 1], X[r, 2 * j + 2]
            margin += orders[j] * orders[j] * (abs(pc[j]) + abs(ps[j]))
            for i in range(cells):
                v[i] += pc[j] * cos[j, i] + ps[j] * sin[j, i]
        for i in range(cells):
            top = max(top, abs(v[i]))
        least = top - 0.125 * step * step * margin
        for i in range(cells):
            here, before, after = abs(v[i]), abs(v[i - 1]), abs(v[i + 1 if i + 1 < cells else 0])
            if here >= least and here >= before and here >= after:
                t, extreme = summit((i + 0.5) * step, v[i], step, Polynomial(0.0, pc, ps), grid, c, s)
                if abs(extreme) >= abs(value[r]):
                    value[r], time[r] = extreme, t
        if len(dX):
            basis(time[r], grid, c, s)
            for j in range(grid.n):
                change[r] += dX[r, 2 * j + 1] * c[j] + dX[r, 2 * j + 2] * s[j]


@compiled(allocates=True)
def _uphill(X: Array, start: float, tables: Any, out: Array) -> None:
    """Time, deviation and its second derivative (3,) of the extreme of a row ``X`` (L,) that a time lies below.

    By Newton's method, in steps of half a radian of the highest order at most.
    """
    grid = Grid(*tables)
    pc, ps = np.zeros(grid.orders.size), np.zeros(grid.orders.size)
    c, s = np.empty(grid.orders.size), np.empty(grid.orders.size)
    for j in range(grid.n):
        pc[j], ps[j] = X[2 * j + 1], X[2 * j + 2]
    p, reach, t = Polynomial(0.0, pc, ps), 1.0 / grid.top, start
    basis(t, grid, c, s)
    v, slope, curvature = values(p, grid.orders, c, s)
    side = 1.0 if v >= 0.0 else -1.0
    for _ in range(_UPHILL):
        rise, bent = side * slope, side * curvature
        step = -rise / bent if bent < 0.0 else reach * np.sign(rise)
        t += min(max(step, -reach), reach)
        basis(t, grid, c, s)
        v, slope, curvature = values(p, grid.orders, c, s)
        if abs(step) < 1e-14:
            break
    out[0], out[1], out[2] = t, v, curvature


def extreme_above(harmonics: Harmonics, X: Array, time: float) -> tuple[float, float, float]:
    """Time, deviation from the mean and its second derivative of the extreme of ``X`` (L,) that ``time`` lies below.

    Where there is none, of where the way uphill ended.
    """
    row, out = X if X.flags.carray else np.require(X, float, ["C", "W"]), np.empty(3)
    _uphill(row, time, tuple(grid(harmonics)), out)
    t, value, curvature = out.tolist()
    return t, value, curvature


def largest_deviations(harmonics: Harmonics, X: Array) -> tuple[Array, Array]:
    """The largest deviation of each row of ``X`` (k, L) from its mean, signed, and its time, both (k,).

    Times are in rad within ``[0, 2 pi)``; where several deviations are equally large one of them is given.
    """
    value, time, _ = _all_largest(harmonics, X, X[:0])
    return value, np.mod(time, TWO_PI)


def largest_with_changes(harmonics: Harmonics, X: Array, dX: Array) -> tuple[Array, Array]:
    """The same deviations, signed, and their changes (k,) with changes ``dX`` (k, L): at their own times."""
    value, _, change = _all_largest(harmonics, X, dX)
    return value, change


def _all_largest(harmonics: Harmonics, *motions: Array) -> Array:
    """What is written into ``out``, of motions as the one compiled version takes them: writable and contiguous."""
    X, dX = (a if a.flags.carray else np.require(a, float, ["C", "W"]) for a in motions)
    out = np.empty((3, len(X)))
    _largest(X, dX, tuple(grid(harmonics)), out)
    return out
