"""Mean force of a contact that never slips: of all means within the circle, the one farthest from its edge."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from slipstick.contact.kernel.planar.motion import COLUMNS, GAP, KN, KT, MU, Planar, Workspace, evaluate_motion
from slipstick.trig.basis import TWO_PI, Grid
from slipstick.trig.compiled import compiled, inlined, part
from slipstick.typing import Array, IntArray

_NOTHING, _LEVEL = 1e-14, 1e-10
"""Rounding of a margin over its size, and of its second derivative over the size of its terms."""
_EXCHANGES = 16
"""Rounds of exchange of the active times, at most."""


@compiled
def margin(forces: Array, limits: Array, c1: float, c2: float) -> tuple[float, int]:
    """The largest of ``|c + force| - limit`` over sampled times, and where."""
    largest, where = -1e300, 0
    for i in range(limits.size):
        f1, f2 = c1 + forces[0, i], c2 + forces[1, i]
        value = np.sqrt(f1 * f1 + f2 * f2) - limits[i]
        if value > largest:
            largest, where = value, i
    return largest, where


@compiled
def equal_margins(times: IntArray, n: int, forces: Array, limits: Array) -> tuple[float, float, float]:
    """Least equal margins at one, two or three times: the margin, and the means; 1e300: there are none."""
    nowhere = (1e300, 0.0, 0.0)
    i = times[0]
    q1, q2, b = -forces[0, i], -forces[1, i], limits[i]
    if n == 1:
        return -b, q1, q2
    e1, e2, beta = -forces[0, times[1]] - q1, -forces[1, times[1]] - q2, limits[times[1]] - b
    square = e1 * e1 + e2 * e2
    if n == 2:
        distance = np.sqrt(square)
        radius = 0.5 * (distance - beta)
        if distance == 0.0 or not 0.0 <= radius <= distance:
            return nowhere
        return radius - b, q1 + radius * e1 / distance, q2 + radius * e2 / distance
    g1, g2, gamma = -forces[0, times[2]] - q1, -forces[1, times[2]] - q2, limits[times[2]] - b
    det = e1 * g2 - e2 * g1
    other = g1 * g1 + g2 * g2
    if not abs(det) > 1e-12 * np.sqrt(square * other):
        return nowhere
    # |x| = r, |x - e| = r + beta, |x - g| = r + gamma: x = u - r w
    h, k = 0.5 * (square - beta * beta), 0.5 * (other - gamma * gamma)
    u1, u2 = (h * g2 - k * e2) / det, (k * e1 - h * g1) / det
    w1, w2 = (beta * g2 - gamma * e2) / det, (gamma * e1 - beta * g1) / det
    a, half, c = w1 * w1 + w2 * w2 - 1.0, u1 * w1 + u2 * w2, u1 * u1 + u2 * u2
    root = half * half - a * c
    if root < 0.0:
        return nowhere
    root = np.sqrt(root)
    stable = half + root if half >= 0.0 else half - root
    radius = 1e300
    for r in (c / stable if stable != 0.0 else 1e300, stable / a if a != 0.0 else 1e300):
        if r >= 0.0 and r + beta >= 0.0 and r + gamma >= 0.0:
            radius = min(radius, r)
    if radius >= 1e300:
        return nowhere
    return radius - b, q1 + u1 - radius * w1, q2 + u2 - radius * w2


@compiled
def least_margin(forces: Array, limits: Array, work: IntArray) -> tuple[float, float, float, int]:
    """The mean whose largest margin over the sampled times is least: margin, means, number of active times.

    The smallest circle around weighted points (E. Welzl, 1991), of which two or three are active. They are found by
    exchange: the time with the largest margin joins the active ones. ``work`` (13,) receives their numbers.
    """
    kept, active, trial, better = work[:3], work[3:7], work[7:10], work[10:13]
    _, active[0] = margin(forces, limits, 0.0, 0.0)
    n, best, c1, c2 = 1, -limits[active[0]], -forces[0, active[0]], -forces[1, active[0]]
    kept[0] = active[0]
    for _ in range(100):
        worst, at = margin(forces, limits, c1, c2)
        if worst <= best + 1e-13 * (abs(worst) + limits[at] + abs(c1) + abs(c2)):
            break
        for i in range(n):
            active[i] = kept[i]
        active[n] = at
        size, found, d1, d2, many = n + 1, 1e300, 0.0, 0.0, 0
        for subset in range(1, 1 << size):
            m = 0
            for i in range(size):
                if subset >> i & 1:
                    if m < 3:
                        trial[m] = active[i]
                    m += 1
            if m > 3:
                continue
            s, x1, x2 = equal_margins(trial, m, forces, limits)
            if s >= found:
                continue
            inside = True
            for i in range(size):
                f1, f2, b = x1 + forces[0, active[i]], x2 + forces[1, active[i]], limits[active[i]]
                if np.sqrt(f1 * f1 + f2 * f2) - b > s + 1e-11 * (abs(s) + b + abs(x1) + abs(x2)):
                    inside = False
            if inside:
                found, d1, d2, many = s, x1, x2, m
                for i in range(m):
                    better[i] = trial[i]
        if many == 0 or not found > best:
            break
        n, best, c1, c2 = many, found, d1, d2
        for i in range(n):
            kept[i] = better[i]
    return best, c1, c2, n


@compiled
def margin_at(p: Planar, t: float, c1: float, c2: float, grid: Grid, work: Workspace, out: Array) -> None:
    """Excess of a stuck force of mean ``c`` over its limit, less ``b Y_0``, with derivatives by time.

    ``out``: length of the force, its direction ``n`` and the rate at which that turns; the margin, its first and second
    derivatives, and the size of the terms of the latter. The motion stays in ``work.state``.
    """
    o = work.state
    evaluate_motion(p, t, grid, work, o)
    e1, e2, ey = 0.0, 0.0, 0.0
    for j in range(grid.n):
        i, m, c, s = 2 * j + 1, grid.orders[j], work.c[j], work.s[j]
        e1 -= m * m * (p.X1[i] * c + p.X1[i + 1] * s)
        e2 -= m * m * (p.X2[i] * c + p.X2[i + 1] * s)
        ey -= m * m * (p.Y[i] * c + p.Y[i + 1] * s)
    f1, f2 = c1 + p.kt * o[0], c2 + p.kt * o[1]
    f = np.sqrt(f1 * f1 + f2 * f2)
    over = 1.0 / f if f > 0.0 else 0.0
    n1, n2 = f1 * over, f2 * over
    turn = p.kt * (n1 * o[3] - n2 * o[2]) * over
    along, across, load = p.kt * (n1 * e1 + n2 * e2), f * turn * turn, p.b * ey
    out[0], out[1], out[2], out[3] = f, n1, n2, turn
    out[4], out[5] = f - p.b * (o[4] - p.Y[0]), p.kt * (n1 * o[2] + n2 * o[3]) - p.b * o[5]
    out[6], out[7] = along + across - load, abs(along) + across + abs(load)


@compiled
def maximise_margin(
    p: Planar, t: float, c1: float, c2: float, longest: float, small: float, grid: Grid, work: Workspace, out: Array
) -> float:
    """Time near ``t`` of a largest margin, by Newton steps that never decrease it; ``out`` as of ``margin_at``."""
    margin_at(p, t, c1, c2, grid, work, out)
    there = 0
    for _ in range(60):
        rate, bend, before = out[5], out[6], out[4]
        move = -rate / bend if bend < 0.0 else np.copysign(longest, rate)
        move = min(max(move, -longest), longest)
        if abs(rate * move) <= small:  # only the time itself still improves
            there += 1
            if there > 3 or bend > -_LEVEL * out[7]:
                break
        margin_at(p, t + move, c1, c2, grid, work, out)
        if there == 0 and out[4] < before - small:
            longest = 0.25 * abs(move)
            margin_at(p, t, c1, c2, grid, work, out)
        else:
            t += move
    return t


@inlined
def time_shift(mark: Array) -> float:
    """Shift of the time of the largest margin by its rate; 0 where the margin is constant (a circle)."""
    return -1.0 / mark[6] if mark[6] < -_LEVEL * mark[7] else 0.0


@compiled
def conditions(marks: Array, k: int, M: Array) -> None:
    """Derivatives of the conditions by the mean, (2, 2): equal margins, and for two times opposite forces."""
    for i in range(2):
        M[0, i] = marks[0, 1 + i] - marks[1, 1 + i]
        M[1, i] = marks[0, 1 + i] - marks[2, 1 + i]
    if k == 2:
        M[1, 0], M[1, 1] = 0.0, 0.0
        for i in range(2):
            sign = 1.0 if i == 0 else -1.0
            mark = marks[i]
            curvature = sign * (1.0 / mark[0] + mark[3] * mark[3] * time_shift(mark))
            M[1, 0] -= curvature * mark[2]
            M[1, 1] += curvature * mark[1]


@compiled
def balance(
    p: Planar,
    t: Array,
    k: int,
    c: Array,
    longest: float,
    unit: float,
    grid: Grid,
    work: Workspace,
    marks: Array,
    M: Array,
) -> int:
    """Move two or three times and the mean to where the margins are largest, equal and least, by Newton.

    Returns the number of times, without those that reach the same force; 0 where it does not converge.
    """  # fmt: skip
    n, last = marks, 1e300
    for _ in range(30):
        i = 0
        while i < k:
            t[i] = maximise_margin(p, t[i], c[0], c[1], longest, _NOTHING * unit, grid, work, n[i])
            i += 1
            for j in range(i - 1):
                apart = abs(n[i - 1, 0] - n[j, 0]) / n[j, 0] + abs(n[i - 1, 1] - n[j, 1]) + abs(n[i - 1, 2] - n[j, 2])
                if apart < 1e-9:
                    i, k = i - 1, k - 1
                    t[i] = t[k]
                    break
        least = min(n[0, 0], n[1, 0], n[k - 1, 0])
        if k < 2 or least == 0.0:
            return 0
        conditions(n, k, M)
        r1, r2 = n[1, 4] - n[0, 4], n[2, 4] - n[0, 4]
        if k == 2:
            r2 = n[0, 2] * (n[0, 1] + n[1, 1]) - n[0, 1] * (n[0, 2] + n[1, 2])
        det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        d1, d2 = (M[1, 1] * r1 - M[0, 1] * r2) / det, (M[0, 0] * r2 - M[1, 0] * r1) / det
        size = abs(d1) + abs(d2)
        if not size < 1e3 * unit:
            return 0
        shorter = min(1.0, 0.5 * least / size) if size > 0.0 else 1.0
        c[0] += shorter * d1
        c[1] += shorter * d2
        settled = size <= 1e-13 * least or 0.5 * last <= size < 1e-6 * least
        last = size
        if settled:
            a1, a2 = n[0, 1], n[0, 2]
            if k == 2:
                return 2 if a1 * n[1, 1] + a2 * n[1, 2] < 0.0 else 0
            # no change of the mean lessens all three: zero is within the triangle of the directions
            ab, bc = a1 * n[1, 2] - a2 * n[1, 1], n[1, 1] * n[2, 2] - n[1, 2] * n[2, 1]
            ca = n[2, 1] * a2 - n[2, 2] * a1
            return 3 if min(ab, bc, ca) >= -1e-12 or max(ab, bc, ca) <= 1e-12 else 0
    return 0


@compiled
def add_row(p: Planar, u: Any, v: Any, depth: float, rate: float, grid: Grid, work: Workspace, R: Array) -> None:
    """Add to a row of derivatives ``u.df + v.df' + depth b dy + rate b dy'`` of a stuck force and its load."""
    q, o = 3 * (2 * grid.n + 1), work.state
    L = 2 * grid.n + 1
    R[2 * L] += depth * p.b
    for j in range(grid.n):
        i, m, c, s = 2 * j + 1, grid.orders[j], work.c[j], work.s[j]
        R[i] += p.kt * (u[0] * c - v[0] * m * s)
        R[i + 1] += p.kt * (u[0] * s + v[0] * m * c)
        R[L + i] += p.kt * (u[1] * c - v[1] * m * s)
        R[L + i + 1] += p.kt * (u[1] * s + v[1] * m * c)
        R[2 * L + i] += p.b * (depth * c - rate * m * s)
        R[2 * L + i + 1] += p.b * (depth * s + rate * m * c)
    R[q + KT] += u[0] * o[0] + u[1] * o[1] + v[0] * o[2] + v[1] * o[3]
    load = depth * o[4] + rate * o[5]
    R[q + MU] += p.kn * load
    R[q + KN] += p.mu * load
    R[q + GAP] -= depth * p.b


@compiled
def derive_mean(
    p: Planar, t: Array, k: int, c: Array, grid: Grid, work: Workspace, marks: Array, M: Array, dc: Array
) -> None:
    """Derivatives of the mean with one, two or three active times, into ``dc`` (2, columns)."""
    zero = (0.0, 0.0)
    if k == 1:  # the force at that time is zero
        evaluate_motion(p, t[0], grid, work, work.state)
        add_row(p, (-1.0, 0.0), zero, 0.0, 0.0, grid, work, dc[0])
        add_row(p, (0.0, -1.0), zero, 0.0, 0.0, grid, work, dc[1])
        return
    for i in range(k):
        mark = marks[i]
        margin_at(p, t[i], c[0], c[1], grid, work, mark)
        n = (mark[1], mark[2])
        if i != 2:
            sign = -1.0 if i == 0 else 1.0
            add_row(p, (sign * n[0], sign * n[1]), zero, -sign, 0.0, grid, work, dc[0])
        if k == 3 and i != 1:
            sign = -1.0 if i == 0 else 1.0
            add_row(p, (sign * n[0], sign * n[1]), zero, -sign, 0.0, grid, work, dc[1])
        if k == 2:
            sign = -1.0 if i == 0 else 1.0
            moves = sign * mark[3] * time_shift(mark)
            curvature = sign / mark[0] + moves * mark[3]
            u, v = (-curvature * n[1], curvature * n[0]), (moves * n[0], moves * n[1])
            add_row(p, u, v, 0.0, -moves, grid, work, dc[1])
    conditions(marks, k, M)
    det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
    for j in range(dc.shape[1]):
        r1, r2 = dc[0, j], dc[1, j]
        dc[0, j], dc[1, j] = 0.0, 0.0
        if det != 0.0:
            dc[0, j], dc[1, j] = (M[1, 1] * r1 - M[0, 1] * r2) / det, (M[0, 0] * r2 - M[1, 0] * r1) / det


@compiled
def add_time(
    p: Planar, t: float, n: int, grid: Grid, work: Workspace, times: Array, forces: Array, limits: Array
) -> int:
    """Add a time for ``least_margin``; return their number."""
    o = work.state
    evaluate_motion(p, t, grid, work, o)
    times[n], forces[0, n], forces[1, n], limits[n] = t, p.kt * o[0], p.kt * o[1], p.b * (o[4] - p.Y[0])
    return n + 1


@compiled
def largest_margin(
    p: Planar,
    c: Array,
    least: float,
    unit: float,
    samples: int,
    grid: Grid,
    work: Workspace,
    forces: Array,
    limits: Array,
    mark: Array,
) -> tuple[float, float]:
    """Largest margin of a mean over all times, and its time, by Newton from the sampled maxima."""
    highest, when, longest = least, -1.0, pi / samples
    last, this = -1e300, -1e300
    for i in range(-2, samples):
        f1, f2 = c[0] + forces[0, (i + 1) % samples], c[1] + forces[1, (i + 1) % samples]
        next_one = np.sqrt(f1 * f1 + f2 * f2) - limits[(i + 1) % samples]
        if i >= 0 and this >= max(last, next_one) and 2.0 * this - min(last, next_one) > least:
            t = maximise_margin(p, TWO_PI * i / samples, c[0], c[1], longest, _NOTHING * unit, grid, work, mark)
            if mark[4] > highest:
                highest, when = mark[4], t
        last, this = this, next_one
    return highest, when


@part
def resting_mean(p: Planar, grid: Grid, work: Workspace) -> tuple[float, float, float, Array]:
    """Margin and mean force of a contact that never slips, and the derivatives of the mean (2, 3 L + COLUMNS).

    Of all means that keep the force within the circle it is the one of the largest least distance from it. One, two or
    three times are active. They are found among sampled times and moved to where their margins are largest and equal.
    Where the margin is larger at another time, that one is added to the samples. The problem is convex: no larger
    margin anywhere proves the mean right.
    """
    samples = 16 * (grid.top + 2)
    room_for, columns = samples + 4 * _EXCHANGES, 3 * (2 * grid.n + 1) + COLUMNS
    times, forces, limits = np.empty(room_for), np.empty((2, room_for)), np.empty(room_for)
    dc, c, t, marks, M = np.zeros((2, columns)), np.zeros(2), np.zeros(3), np.zeros((4, 8)), np.zeros((2, 2))
    n, k, left, unit, least, c1, c2, none, proved = 0, 1, 0, 0.0, 0.0, 0.0, 0.0, p.b * p.Y[0], False
    for i in range(samples):
        n = add_time(p, TWO_PI * i / samples, n, grid, work, times, forces, limits)
        unit = max(unit, abs(forces[0, i]) + abs(forces[1, i]), abs(limits[i]))
    if unit == 0.0:
        return -none, 0.0, 0.0, dc
    decide, longest = np.zeros(13, np.int64), pi / samples
    for _ in range(_EXCHANGES):
        least, c1, c2, k = least_margin(forces[:, :n], limits[:n], decide)
        known, proved, c[0], c[1] = n, False, c1, c2
        if least > none:  # it slips
            return least - none, c1, c2, dc
        for i in range(k):
            t[i] = times[decide[i]]
        if k == 1:  # the force is zero there, and grows on both sides
            for side in (-1e-3, 1e-3):
                at = maximise_margin(p, t[0] + side * longest, c1, c2, longest, _NOTHING * unit, grid, work, marks[0])
                if marks[0, 4] > least + 1e-13 * unit:
                    n = add_time(p, at, n, grid, work, times, forces, limits)
            if n > known:
                continue
            break
        left, margin = balance(p, t, k, c, longest, unit, grid, work, marks, M), least
        if left > 0 and marks[0, 4] >= least - 1e-13 * unit:  # no mean has a smaller one
            margin = marks[0, 4]
        else:
            left, c[0], c[1] = 0, c1, c2
        highest, when = largest_margin(p, c, margin, unit, samples, grid, work, forces, limits, marks[3])
        proved = highest <= margin + 1e-13 * unit
        if proved:
            break
        n = add_time(p, when, n, grid, work, times, forces, limits)
        for i in range(k):
            n = add_time(p, t[i], n, grid, work, times, forces, limits)
    if proved and left > 0:
        least, k = marks[0, 4], left
    else:
        c[0], c[1] = c1, c2
        for i in range(k):
            t[i] = times[decide[i]]
    derive_mean(p, t, k, c, grid, work, marks, M, dc)
    return least - none, c[0], c[1], dc
