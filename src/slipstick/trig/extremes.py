"""The largest deviation of a trigonometric polynomial from its mean, with its time: a grid, then Newton's method.

One harmonic has a closed form. Between two neighbouring times of a grid of step ``h`` the deviation rises above the
nearer one by at most ``B2 (h/2)^2 / 2``, ``B2 = sum m^2 (|c_m| + |s_m|)``: grid times further below the largest need no
Newton iteration.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.trig.basis import TWO_PI, Grid, Polynomial, basis, grid, values
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_SUMMIT_STEPS, _SUMMIT_ERROR = 8, 1e-8
"""Largest number of Newton steps from a grid time, and the step (rad) at which they end: the value is then exact."""
_ASCENT_STEPS, _ASCENT_ERROR = 60, 1e-14
"""The same from any time, where steps are limited; the time is then exact."""


@inlined
def summit(t: float, start: float, radius: float, p: Polynomial, grid: Grid, c: Array, s: Array) -> tuple[float, float]:
    """Time and value of the extreme next to ``t``, where the value is ``start``, at most ``radius`` away."""
    first = t
    for _ in range(_SUMMIT_STEPS):
        basis(t, grid, c, s)
        _v, slope, curvature = values(p, grid.orders, c, s)
        moved = t - slope / curvature if curvature != 0.0 else t
        moved = min(max(moved, first - radius), first + radius)
        done = abs(moved - t) < _SUMMIT_ERROR
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
    tuple of the fields of ``Grid``, whose type numba knows at once. One harmonic alone is in closed form.
    """
    grid = Grid(*tables)
    orders, cos, sin = grid.orders, grid.cos, grid.sin
    rows, cells = X.shape[0], cos.shape[1]
    step = TWO_PI / cells
    value, time, change = out[0], out[1], out[2]
    pc, ps = np.zeros(orders.size), np.zeros(orders.size)
    c, s, v = np.empty(orders.size), np.empty(orders.size), np.empty(cells)
    for r in range(rows):
        margin, top, moving, only = 0.0, 0.0, 0, 0
        value[r], time[r], change[r] = 0.0, 0.0, 0.0
        for j in range(grid.n):
            pc[j], ps[j] = X[r, 2 * j + 1], X[r, 2 * j + 2]
            margin += orders[j] * orders[j] * (abs(pc[j]) + abs(ps[j]))
            if pc[j] != 0.0 or ps[j] != 0.0:
                moving, only = moving + 1, j
        if moving <= 1:
            angle = np.mod(np.arctan2(ps[only], pc[only]), TWO_PI)  # of equal maxima the first, as ``amplitude`` has it
            value[r], time[r] = np.hypot(pc[only], ps[only]), angle / orders[only]
        else:
            v[:] = 0.0
            for j in range(grid.n):
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
def _ascend(X: Array, start: float, tables: Any, out: Array) -> None:
    """Time, deviation and its second derivative (3,) of the extreme of a row ``X`` (L,) uphill of a time.

    By Newton's method, in steps of at most half a radian of the highest order.
    """
    grid = Grid(*tables)
    pc, ps = np.zeros(grid.orders.size), np.zeros(grid.orders.size)
    c, s = np.empty(grid.orders.size), np.empty(grid.orders.size)
    for j in range(grid.n):
        pc[j], ps[j] = X[2 * j + 1], X[2 * j + 2]
    p, longest, t = Polynomial(0.0, pc, ps), 1.0 / grid.top, start
    basis(t, grid, c, s)
    v, slope, curvature = values(p, grid.orders, c, s)
    side = 1.0 if v >= 0.0 else -1.0
    for _ in range(_ASCENT_STEPS):
        up, bend = side * slope, side * curvature
        step = -up / bend if bend < 0.0 else longest * np.sign(up)
        t += min(max(step, -longest), longest)
        basis(t, grid, c, s)
        v, slope, curvature = values(p, grid.orders, c, s)
        if abs(step) < _ASCENT_ERROR:
            break
    out[0], out[1], out[2] = t, v, curvature


def extreme_above(harmonics: Harmonics, X: Array, time: float) -> tuple[float, float, float]:
    """Time, deviation from the mean and its second derivative of the extreme of ``X`` (L,) uphill of ``time``.

    Where there is none, of the last time of the iteration.
    """
    row, out = X if X.flags.carray else np.require(X, float, ["C", "W"]), np.empty(3)
    _ascend(row, time, tuple(grid(harmonics)), out)
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
    """Results of ``_largest`` of motions in the form of its one compiled version: writable and contiguous."""
    X, dX = (a if a.flags.carray else np.require(a, float, ["C", "W"]) for a in motions)
    out = np.empty((3, len(X)))
    _largest(X, dX, tuple(grid(harmonics)), out)
    return out
