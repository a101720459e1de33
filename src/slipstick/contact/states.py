"""The periodic sequence of stick, slip and separation, exactly (THEORY.md section 3).

Between two neighbouring critical times the trial functions ``phi_+ = kt w - mu kn y`` and ``phi_- = kt w + mu kn y``
are monotone and contact is fixed, so that over a segment the friction force is a shift clamped between its bounds.
The periodic start value follows from sending one bound once round the period.
"""

from __future__ import annotations

from typing import Any

from slipstick.trig.basis import TWO_PI, basis, rise, value, values
from slipstick.trig.compiled import compiled, inlined

SEPARATION, STICK, SLIP_PLUS, SLIP_MINUS = 0, 1, 2, 3
"""State codes of an interval."""

NONE, NORMAL, UPPER, LOWER, BOTH = -1, 0, 1, 2, 3
"""Kinds of critical times: a root of ``y - g``, of ``phi_+'``, of ``phi_-'``, of both alike (constant load);
``NONE`` stands for a start where nothing happens."""

NAMES = ("separation", "stick", "slip+", "slip-")


@compiled
def merge(lists: Any, rising: Any, counts: Any, same: bool, time: Any, kind: Any, up: Any) -> int:
    """Merge three ascending lists of critical times into one; returns their number."""
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
def segment_signs(count: int, kind: Any, up: Any, first: Any, contact: Any, plus: Any, minus: Any) -> None:
    """Contact and the signs of ``phi_+'``, ``phi_-'`` in the segment after each critical time.

    A sign comes from the last crossing of its function; without any crossing it is ``first``.
    """
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
                contact[i], plus[i], minus[i] = c, p, q


@inlined
def send_round(f: float, side: int, count: int, kt: float, dw: Any, b: Any, contact: Any) -> tuple[float, int, int]:
    """Send a start value at a bound once round the period: the end value, where and at which bound it clamped last."""
    where = 0
    for i in range(count):
        if not contact[i]:
            f, where, side = 0.0, i + 1, 0
            continue
        f += kt * dw[i]
        bound = b[i + 1]
        if f >= bound:
            f, where, side = bound, i + 1, 1
        elif f <= -bound:
            f, where, side = -bound, i + 1, -1
    return f, where, side


@inlined
def slip_time(
    start: float, right: float, xi: float, f: float, x: float, kt: float, v: float, mukn: float, XU: Any, Y: Any,
    m: Any, consecutive: bool, steep: bool, c: Any, s: Any, half: Any, middle: Any,
) -> float:  # fmt: skip
    """The stick-to-slip time of a segment, the only root of a monotone function [Eq. 12], by safeguarded Newton.

    ``f`` and ``x`` are the force and the periodic motion at the start; ``XU`` and ``Y`` are triples (constant, cosines,
    sines), the constant of ``Y`` less the gap.
    """
    left = start
    t = 0.5 * (left + right)
    for _ in range(100):
        basis(t, m, consecutive, c, s)
        w, w1, w2 = values(v * (t - start) - x, XU[1], XU[2], m, c, s)
        y, y1, y2 = values(Y[0], Y[1], Y[2], m, c, s)
        gain = rise(start, t, v, XU, m, consecutive, half, middle) if steep else w
        g = xi * (f + kt * gain) - mukn * y
        slope = xi * kt * (w1 + v) - mukn * y1
        if g < 0.0:
            left = t
        else:
            right = t
        inside = False
        if slope > 0.0:
            step = -g / slope
            q = 0.5 * (xi * kt * w2 - mukn * y2) / slope * step
            if abs(q) < 0.5:  # beyond, the third-order step may stand still
                step -= q * step
            inside = left <= t + step <= right
        if not inside:
            step, q = 0.5 * (left + right) - t, 1.0
        t += step
        e = abs(step)
        if (e < 1e-5 and e * q * q < 1e-17) or e < 2e-15 or right - left < 2e-15:
            break
    return t


@inlined
def push(total: int, a: float, b: float, state: int, origin: int, f: float, at: Any, code: Any) -> int:
    """Append an interval, unless it has no length, joining it to an equal neighbour.

    ``at`` rows are (start, end, force at start).
    """
    if b <= a:
        return total
    if total > 0 and code[total - 1, 0] == state:
        at[total - 1, 1] = b
        return total
    at[total, 0], at[total, 1], at[total, 2] = a, b, f
    code[total, 0], code[total, 1] = state, origin
    return total + 1


@compiled
def march(
    f: float, side: int, count: int, kt: float, v: float, mukn: float, time: Any, w: Any, dw: Any, b: Any,
    contact: Any, plus: Any, minus: Any, XU: Any, Y: Any, m: Any, consecutive: bool, steep: bool, c: Any, s: Any,
    half: Any, middle: Any, at: Any, code: Any,
) -> int:  # fmt: skip
    """March once round the period from the periodic start value, recording the intervals; returns their number.

    ``side`` says at which bound the march starts: +1, -1, 0 for both (zero load), 2 for neither.
    """
    total = 0
    previous = SEPARATION if side == 0 else (SLIP_PLUS if side == 1 else SLIP_MINUS)
    for i in range(count):
        left, right = time[i], time[i + 1]
        if b[i] == 0.0:
            side = 0
        if not contact[i]:
            total = push(total, left, right, SEPARATION, 0, 0.0, at, code)
            f, side, previous = 0.0, 0, SEPARATION
            continue
        bound = b[i + 1]
        if side != -1 and side != 2 and (plus[i] > 0.0 or (mukn == 0.0 and plus[i] == 0.0)):
            total = push(total, left, right, SLIP_PLUS, 0, f, at, code)
            f, side, previous = bound, 1, SLIP_PLUS
            continue
        if side != 1 and side != 2 and minus[i] < 0.0:
            total = push(total, left, right, SLIP_MINUS, 0, f, at, code)
            f, side, previous = -bound, -1, SLIP_MINUS
            continue
        new = f + kt * dw[i]
        xi = 1.0 if new > bound else (-1.0 if new < -bound else 0.0)
        if xi == 0.0:
            total = push(total, left, right, STICK, previous, f, at, code)
            side = 1 if new == bound else (-1 if new == -bound else 2)
            f, previous = new, STICK
            continue
        x = w[i] - v * (left - time[0])
        t = slip_time(
            left, right, xi, f, x, kt, v, mukn, XU, Y, m, consecutive, steep, c, s, half, middle
        )  # fmt: skip
        total = push(total, left, t, STICK, previous, f, at, code)
        previous = SLIP_PLUS if xi > 0.0 else SLIP_MINUS
        total = push(total, t, right, previous, 0, xi * bound, at, code)
        f, side = xi * bound, 1 if xi > 0.0 else -1
    if total > 1 and code[0, 0] == code[total - 1, 0]:
        at[total - 1, 1] = at[0, 1] + TWO_PI
        for i in range(total - 1):
            at[i, 0], at[i, 1], at[i, 2] = at[i + 1, 0], at[i + 1, 1], at[i + 1, 2]
            code[i, 0], code[i, 1] = code[i + 1, 0], code[i + 1, 1]
        total -= 1
    return total


@compiled
def motion(
    count: int, v: float, mukn: float, time: Any, kind: Any, XU: Any, Y: Any, m: Any, consecutive: bool, steep: bool,
    c: Any, s: Any, half: Any, middle: Any, w: Any, dw: Any, b: Any,
) -> None:  # fmt: skip
    """Total tangential motion and friction limit at every critical time and, one period on, at the first again, and
    the motion gained over each segment.

    The linear part of the motion is counted from the first critical time.
    """
    for i in range(count):
        basis(time[i], m, consecutive, c, s)
        w[i] = value(v * (time[i] - time[0]), XU[1], XU[2], c, s)
        b[i] = 0.0 if kind[i] == NORMAL else mukn * max(value(Y[0], Y[1], Y[2], c, s), 0.0)
    time[count] = time[0] + TWO_PI
    w[count] = w[0] + v * TWO_PI
    b[count] = b[0]
    for i in range(count):
        if steep:
            dw[i] = rise(time[i], time[i + 1], v, XU, m, consecutive, half, middle)
        else:
            dw[i] = w[i + 1] - w[i]


@compiled
def periodic_start(
    count: int, kt: float, v: float, dw: Any, b: Any, contact: Any
) -> tuple[float, int, float, int, int, float, int, int]:
    """The periodic start value by the period map (THEORY.md section 3, table).

    Returns the start value and its side, then ``(lo, where, side)`` and ``(hi, where, side)``.
    """
    lo, lo_at, lo_side = send_round(-b[0], -1 if b[0] > 0.0 else 0, count, kt, dw, b, contact)
    hi, hi_at, hi_side = send_round(b[0], 1 if b[0] > 0.0 else 0, count, kt, dw, b, contact)
    if v > 0.0:
        return hi, hi_side if hi_at == count else 2, lo, lo_at, lo_side, hi, hi_at, hi_side
    if v < 0.0 or lo == hi:
        return lo, lo_side if lo_at == count else 2, lo, lo_at, lo_side, hi, hi_at, hi_side
    return 0.5 * (lo + hi), 2, lo, lo_at, lo_side, hi, hi_at, hi_side
