"""A period marched piece by piece until it is periodic: stick in closed form, slip by collocation."""

from __future__ import annotations

from math import pi

import numpy as np

from slipstick.contact.kernel.planar.motion import (
    FULL,
    LAST_SLIP,
    LOST,
    SLIP,
    STAGES,
    STICK,
    Pieces,
    Planar,
    Workspace,
    evaluate_motion,
)
from slipstick.contact.kernel.planar.slip import (
    INSTANT,
    NODES,
    TOP,
    WEIGHTS,
    begin_slip,
    collocate,
    end_of_slip,
    longest_panel,
    panel,
    slip_rate,
    slip_rate_at_end,
)
from slipstick.trig.basis import Grid
from slipstick.trig.compiled import compiled, part
from slipstick.typing import Array

_SHORTEST = 0.1
"""Length (rad) of the last slip before a separation, over the root of the tolerance: its force vanishes."""
_OF_LAST = 1e-5
"""Error of the force over the last term of a panel's angle to the power 1.5: the maximum of 4000 measured states."""
_NEXT = 0.1
"""Least size of the last term over the last but one: it may pass through zero."""
_BEYOND = 1.1
"""Length of the panel that the next period tries, over the part up to an event."""

_PERIODS = 200
"""Periods that are marched, at most."""
_CLOSED = 1e-9
"""Distance from the periodic state, over the limit, whose square is rounding: one Newton step removes it."""


@compiled
def stick_end(p: Planar, t: float, end: float, f1: float, f2: float, grid: Grid, work: Workspace) -> tuple[float, bool]:
    """End of a stick that begins with a force, at the circle or at ``end``; and whether the circle is reached."""
    o = work.state
    evaluate_motion(p, t, grid, work, o)
    a1, a2 = f1 - p.kt * o[0], f2 - p.kt * o[1]
    step = pi / (8.0 * (grid.top + 2))
    low, rising = t, False
    at = t
    while at < end - INSTANT:
        at = min(at + step, end)
        evaluate_motion(p, at, grid, work, o)
        r1, r2, b = a1 + p.kt * o[0], a2 + p.kt * o[1], p.b * max(o[4], 0.0)
        beyond = r1 * r1 + r2 * r2 - b * b
        grows = p.kt * (r1 * o[2] + r2 * o[3]) - p.b * b * o[5] > 0.0
        if beyond <= 0.0 and rising and not grows:  # a maximum in between may exceed the circle
            left, right = low, at
            for _ in range(60):
                middle = 0.5 * (left + right)
                evaluate_motion(p, middle, grid, work, o)
                r1, r2, b = a1 + p.kt * o[0], a2 + p.kt * o[1], p.b * max(o[4], 0.0)
                if r1 * r1 + r2 * r2 > b * b:
                    beyond, at = 1.0, middle
                    break
                if p.kt * (r1 * o[2] + r2 * o[3]) - p.b * b * o[5] > 0.0:
                    left = middle
                else:
                    right = middle
                if right - left < 1e-9:
                    break
        if beyond > 0.0:
            left, right = low, at
            x = 0.5 * (left + right)
            for _ in range(200):
                evaluate_motion(p, x, grid, work, o)
                r1, r2, b = a1 + p.kt * o[0], a2 + p.kt * o[1], p.b * max(o[4], 0.0)
                value = r1 * r1 + r2 * r2 - b * b
                rate = 2.0 * (p.kt * (r1 * o[2] + r2 * o[3]) - p.b * b * o[5])
                if value > 0.0:
                    right = x
                else:
                    left = x
                move = -value / rate if rate > 0.0 else 1e9
                if abs(move) < 1e-16 * (1.0 + x) or right - left < 2e-16 * (1.0 + x):
                    break
                x = x + move if left < x + move < right else 0.5 * (left + right)
            return min(max(x, left), right), True
        low, rising = at, grows
    return end, False


@compiled
def march(
    p: Planar,
    f1: float,
    f2: float,
    arcs: Array,
    tolerance: float,
    grid: Grid,
    work: Workspace,
    old: Pieces,
    known: int,
    out: Pieces,
    P: Array,
) -> tuple[int, float, float]:
    """One period of contact arcs ``(start, end, whether the contact has been closed before)`` from an initial force.

    Fills ``out``, and ``P`` (2, 2) with the derivative of the force at the end by that at the start. ``old`` holds the
    ``known`` pieces of the period before: its panels are kept. Returns the number of pieces, or ``FULL``, and the force
    at the end.
    """  # fmt: skip
    longest, small, shortest = longest_panel(tolerance, grid), np.sqrt(1e-5 * tolerance), _SHORTEST * np.sqrt(tolerance)
    count, k = 0, 0
    P[0, 0], P[0, 1], P[1, 0], P[1, 1] = 1.0, 0.0, 0.0, 1.0
    kind, at, o, z = out.kind, out.at, work.state, STAGES - 1
    for a in range(arcs.shape[0]):
        t, end, whole = arcs[a, 0], arcs[a, 1], arcs[a, 2] > 0.5
        slope, curve, first, turn0, turn1 = 0.0, 0.0, 0.0, 0.0, 0.0
        evaluate_motion(p, t, grid, work, o)
        if whole:
            theta, b = np.arctan2(f2, f1), p.b * o[4]
            size = np.sqrt(f1 * f1 + f2 * f2)
            first = slip_rate(p, o[2], o[3], o[5], theta)
            slip = size >= b * (1.0 - 1e-12) and first > 0.0
            if slip:
                turn0, turn1 = -np.sin(theta) / b, np.cos(theta) / b
        else:
            f1, f2 = 0.0, 0.0
            slip, theta, slope = begin_slip(p, t, grid, work)
            first = slip_rate(p, o[2], o[3], o[5], theta)
            P[0, 0], P[0, 1], P[1, 0], P[1, 1] = 0.0, 0.0, 0.0, 0.0
        h, still = longest, 0
        while t < end - INSTANT * (1.0 + end):
            if count >= kind.size:
                return FULL, f1, f2
            at[count, 0], at[count, 2], at[count, 3], at[count, 4] = t, f1, f2, theta
            if not slip:
                until, slip = stick_end(p, t, end, f1, f2, grid, work)
                evaluate_motion(p, t, grid, work, o)
                w1, w2 = o[0], o[1]
                evaluate_motion(p, until, grid, work, o)
                f1, f2 = f1 + p.kt * (o[0] - w1), f2 + p.kt * (o[1] - w2)
                kind[count], at[count, 1], at[count, 5] = STICK, until, until
                count += 1
                still = still + 1 if until - t < 1e-13 else 0
                t = until
                if slip:
                    if o[4] <= 0.0 or still > 8:
                        break
                    theta = np.arctan2(f2, f1)
                    c, s, over = np.cos(theta), np.sin(theta), 1.0 / (p.b * o[4])
                    turn0, turn1 = (c * P[1, 0] - s * P[0, 0]) * over, (c * P[1, 1] - s * P[0, 1]) * over
                    h, slope, curve = longest, p.kt * over * (o[3] * c - o[2] * s), 0.0
                    first = slip_rate(p, o[2], o[3], o[5], theta)
                continue
            left = end - t
            if not whole and left <= shortest:
                kind[count], at[count, 1] = LAST_SLIP, end
                evaluate_motion(p, t + 0.5 * left, grid, work, o)
                for j in range(4):
                    out.rates[count, 0, j] = o[2 + j]
                count += 1
                f1, f2, t = 0.0, 0.0, end
                break
            h = min(h, left)
            if not whole:
                h = min(h, max(0.6 * left, 0.5 * shortest))
            while k < known and old.at[k, 5] <= t + 1e-3 * longest:
                k += 1
            again = k < known and old.kind[k] == SLIP and old.at[k, 0] < t + 0.5 * longest
            same = again and old.at[k, 0] == t and old.at[k, 5] == old.at[k, 1]
            if again:
                h = min(old.at[k, 5] - t, left)
                shift = theta - old.at[k, 4]
                for i in range(STAGES):
                    work.theta[i] = old.theta[k, i] + shift
            error, settled = 0.0, False
            if same:
                for i in range(STAGES):
                    for j in range(4):
                        work.nodes[i, j] = old.rates[k, i, j]
                settled = collocate(p, theta, h, small, work)
            for _ in range(60):
                if not settled:
                    if not again:
                        for i in range(STAGES):
                            x = NODES[i] * h
                            work.theta[i] = theta + x * (slope + 0.5 * curve * x)
                    settled = panel(p, t, theta, h, small, grid, work)
                if settled:
                    top, next_to = 0.0, 0.0
                    for j in range(STAGES):
                        top += TOP[0, j] * work.g[j]
                        next_to += TOP[1, j] * work.g[j]
                    last = max(abs(top), _NEXT * abs(next_to)) * h  # the last may pass through zero
                    error = _OF_LAST * last * np.sqrt(last)
                    if error < (1.5 * tolerance if again else tolerance) and abs(work.theta[z] - theta) < 1.5:
                        break
                h *= 0.5
                again, settled = False, False
            length, ends = end_of_slip(p, t, theta, h, first, small, grid, work)
            slip = not ends
            if length > 0.0:
                total = 0.0
                for i in range(STAGES):
                    out.theta[count, i] = work.theta[i]
                    total += WEIGHTS[z, i] * work.slope[i]
                    for j in range(4):
                        out.rates[count, i, j] = work.nodes[i, j]
                # derivative of the angle at the end by that at the start
                decay = np.exp(length * total)
                turn0, turn1 = turn0 * decay, turn1 * decay
                kind[count], at[count, 1] = SLIP, t + length
                at[count, 5] = t + min(h, _BEYOND * length) if ends else t + length
                count += 1
                t, theta, slope = t + length, work.theta[z], work.g[z]
                curve = (work.g[z] - work.g[z - 1]) / ((1.0 - NODES[z - 1]) * length)
                first = slip_rate_at_end(p, work)
                b = p.b * work.nodes[z, 2]
                c, s = work.cos[z], work.sin[z]
                f1, f2 = b * c, b * s
                P[0, 0], P[0, 1], P[1, 0], P[1, 1] = -b * s * turn0, -b * s * turn1, b * c * turn0, b * c * turn1
            still = still + 1 if length < 1e-13 else 0
            if still > 8:
                break
            grown = 2.0 if error <= 0.0 else min(2.0, max(0.8, 0.8 * (tolerance / error) ** (1.0 / STAGES)))
            h = longest if ends else min(longest, grown * h)
    return count, f1, f2


@part
def periodic(
    p: Planar,
    arcs: Array,
    f1: float,
    f2: float,
    tolerance: float,
    grid: Grid,
    work: Workspace,
    pieces: Pieces,
    old: Pieces,
    P: Array,
) -> tuple[int, float, float]:
    """Pieces of the periodic state, from a guess of the force: their number, ``FULL`` or ``LOST``; and the force at the
    end less that at the start, which one Newton step removes.

    Marching never increases the distance of two states (the circle is convex), so it converges; Newton's steps are
    faster.
    """  # fmt: skip
    o = work.state
    evaluate_motion(p, arcs[0, 0], grid, work, o)
    limit = p.b * o[4]
    best, stalled, wanted, count = 1e300, 0, tolerance, 0
    for lap in range(_PERIODS):
        for i in range(count):
            old.kind[i] = pieces.kind[i]
            old.at[i] = pieces.at[i]
            old.theta[i] = pieces.theta[i]
            old.rates[i] = pieces.rates[i]
        count, g1, g2 = march(p, f1, f2, arcs, tolerance, grid, work, old, count, pieces, P)
        if count < 0:
            return count, 0.0, 0.0
        r1, r2 = g1 - f1, g2 - f2
        gap = max(abs(r1), abs(r2))
        if gap <= 4e-15 * limit:
            return count, r1, r2
        stalled = stalled + 1 if gap >= 0.5 * best else 0
        best = min(best, gap)
        if stalled > 1 and gap <= 1e-2 * limit:  # panels that change from lap to lap
            if gap <= wanted * limit:
                return count, r1, r2
            tolerance, best, stalled, count = max(0.1 * tolerance, 1e-14), 1e300, 0, 0
        a, b, c, d = 1.0 - P[0, 0], -P[0, 1], -P[1, 0], 1.0 - P[1, 1]
        det = a * d - b * c
        n1, n2 = g1, g2
        if det != 0.0 and lap % 6 < 5:
            s1, s2 = (d * r1 - b * r2) / det, (a * r2 - c * r1) / det
            step = max(abs(s1), abs(s2))
            if step <= min(_CLOSED, 0.1 * wanted) * limit:
                return count, r1, r2
            shorter = min(1.0, 0.5 * limit / step)
            n1, n2 = f1 + shorter * s1, f2 + shorter * s2
        size = np.sqrt(n1 * n1 + n2 * n2)
        if size > limit:
            n1, n2 = n1 * limit / size, n2 * limit / size
        f1, f2 = n1, n2
    return LOST, 0.0, 0.0
