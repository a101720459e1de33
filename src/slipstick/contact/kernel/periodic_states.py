"""The periodic sequence of stick, slip and separation, exactly (THEORY.md (3.1), (3.2)).

Between two neighbouring critical times the trial functions ``phi_+ = kt w - mu kn y`` and ``phi_- = kt w + mu kn y``
are monotone and contact is fixed, so that over a segment the friction force is a shift clamped between its bounds.
The periodic start value follows from sending one bound once round the period.
"""

from __future__ import annotations

from slipstick.contact.kernel.tuples import (
    NORMAL,
    SEPARATION,
    SLIP_MINUS,
    SLIP_PLUS,
    STICK,
    ElementMotion,
    Intervals,
    Segments,
)
from slipstick.trig.basis import TWO_PI, Grid, Polynomial, Scratch, basis, rise, value, values
from slipstick.trig.compiled import compiled, inlined


@inlined
def send_round(start: float, side: int, count: int, kt: float, segments: Segments) -> tuple[float, float, int, int]:
    """Apply the period map to a start value at a bound: where and at which bound it was clamped last, its value there
    and the gain since, whose sum is the end value.

    Both are apart, for beside a bound that is never reached the gain is lost.
    """
    dw, b, contact = segments.dw, segments.b, segments.contact
    f, gain, where = start, 0.0, 0
    for i in range(count):
        if not contact[i]:
            f, gain, where, side = 0.0, 0.0, i + 1, 0
            continue
        gain += kt * dw[i]
        bound = b[i + 1]
        if gain >= bound - f:
            f, gain, where, side = bound, 0.0, i + 1, 1
        elif gain <= -bound - f:
            f, gain, where, side = -bound, 0.0, i + 1, -1
    return f, gain, where, side


@inlined
def slip_time(
    start: float, right: float, xi: float, f: float, x: float, e: ElementMotion, grid: Grid, scratch: Scratch
) -> float:
    """The stick-to-slip time of a segment, the only root of a monotone function [THEORY.md (3.3)]; safeguarded Newton.

    ``f`` and ``x`` are the force and the periodic motion at the start.
    """
    c, s = scratch.c, scratch.s
    left = start
    t = 0.5 * (left + right)
    for _ in range(100):
        basis(t, grid, c, s)
        w, w1, w2 = values(Polynomial(e.v * (t - start) - x, e.X.cos, e.X.sin), grid.orders, c, s)
        y, y1, y2 = values(e.Y, grid.orders, c, s)
        gain = rise(start, t, e.v, e.X, grid, scratch) if e.steep else w
        g = xi * (f + e.kt * gain) - e.limit * y
        slope = xi * e.kt * (w1 + e.v) - e.limit * y1
        if g < 0.0:
            left = t
        else:
            right = t
        inside = False
        if slope > 0.0:
            step = -g / slope
            q = 0.5 * (xi * e.kt * w2 - e.limit * y2) / slope * step
            if abs(q) < 0.5:  # beyond, the third-order step may stand still
                step -= q * step
            inside = left <= t + step <= right
        if not inside:
            step, q = 0.5 * (left + right) - t, 1.0
        t += step
        size = abs(step)
        if (size < 1e-5 and size * q * q < 1e-17) or size < 2e-15 or right - left < 2e-15:
            break
    return t


@inlined
def push(total: int, a: float, b: float, state: int, origin: int, f: float, intervals: Intervals) -> int:
    """Append an interval, unless it has no length, joining it to an equal neighbour."""
    at, code = intervals.at, intervals.code
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
    f: float, side: int, count: int, segments: Segments, e: ElementMotion, grid: Grid, scratch: Scratch, out: Intervals
) -> int:
    """March once round the period from the periodic start value, recording the intervals; returns their number.

    ``side`` says at which bound the march starts: +1, -1, 0 for both (zero load), 2 for neither.
    """
    time, w, dw, b = segments.time, segments.w, segments.dw, segments.b
    contact, plus, minus = segments.contact, segments.plus, segments.minus
    at, code = out.at, out.code
    total = 0
    previous = SEPARATION if side == 0 else (SLIP_PLUS if side == 1 else SLIP_MINUS)
    for i in range(count):
        left, right = time[i], time[i + 1]
        if b[i] == 0.0:
            side = 0
        if not contact[i]:
            total = push(total, left, right, SEPARATION, 0, 0.0, out)
            f, side, previous = 0.0, 0, SEPARATION
            continue
        bound = b[i + 1]
        if side != -1 and side != 2 and (plus[i] > 0.0 or (e.limit == 0.0 and plus[i] == 0.0)):
            total = push(total, left, right, SLIP_PLUS, 0, f, out)
            f, side, previous = bound, 1, SLIP_PLUS
            continue
        if side != 1 and side != 2 and minus[i] < 0.0:
            total = push(total, left, right, SLIP_MINUS, 0, f, out)
            f, side, previous = -bound, -1, SLIP_MINUS
            continue
        new = f + e.kt * dw[i]
        xi = 1.0 if new > bound else (-1.0 if new < -bound else 0.0)
        if xi == 0.0:
            total = push(total, left, right, STICK, previous, f, out)
            side = 1 if new == bound else (-1 if new == -bound else 2)
            f = new
            if right > left:  # critical times coincide: no stick begins there
                previous = STICK
            continue
        x = w[i] - e.v * (left - time[0])
        t = slip_time(left, right, xi, f, x, e, grid, scratch)
        total = push(total, left, t, STICK, previous, f, out)
        previous = SLIP_PLUS if xi > 0.0 else SLIP_MINUS
        total = push(total, t, right, previous, 0, xi * bound, out)
        f, side = xi * bound, 1 if xi > 0.0 else -1
    if total > 1 and code[0, 0] == code[total - 1, 0]:
        at[total - 1, 1] = at[0, 1] + TWO_PI
        for i in range(total - 1):
            at[i, 0], at[i, 1], at[i, 2] = at[i + 1, 0], at[i + 1, 1], at[i + 1, 2]
            code[i, 0], code[i, 1] = code[i + 1, 0], code[i + 1, 1]
        total -= 1
    return total


@compiled
def motion(count: int, segments: Segments, e: ElementMotion, grid: Grid, scratch: Scratch) -> None:
    """Total tangential motion and friction limit at every critical time and, one period on, at the first again, and
    the motion gained over each segment.

    The linear part of the motion is counted from the first critical time.
    """
    time, w, dw, b = segments.time, segments.w, segments.dw, segments.b
    c, s = scratch.c, scratch.s
    for i in range(count):
        basis(time[i], grid, c, s)
        w[i] = value(Polynomial(e.v * (time[i] - time[0]), e.X.cos, e.X.sin), c, s)
        b[i] = 0.0 if segments.kind[i] == NORMAL else e.limit * max(value(e.Y, c, s), 0.0)
    time[count] = time[0] + TWO_PI
    w[count] = w[0] + e.v * TWO_PI
    b[count] = b[0]
    for i in range(count):
        if e.steep:
            dw[i] = rise(time[i], time[i + 1], e.v, e.X, grid, scratch)
        else:
            dw[i] = w[i + 1] - w[i]


@compiled
def periodic_start(
    count: int, kt: float, v: float, segments: Segments
) -> tuple[float, int, float, int, int, float, int, int]:
    """The periodic start value by the period map (THEORY.md section 3, table).

    Returns the start value and its side, then ``(lo, where, side)`` and ``(hi, where, side)``.
    """
    bound = segments.b[0]
    low, rise, lo_at, lo_side = send_round(-bound, -1 if bound > 0.0 else 0, count, kt, segments)
    high, fall, hi_at, hi_side = send_round(bound, 1 if bound > 0.0 else 0, count, kt, segments)
    lo, hi = low + rise, high + fall
    if v > 0.0:
        return hi, hi_side if hi_at == count else 2, lo, lo_at, lo_side, hi, hi_at, hi_side
    if v < 0.0 or lo == hi:
        return lo, lo_side if lo_at == count else 2, lo, lo_at, lo_side, hi, hi_at, hi_side
    return 0.5 * ((low + high) + (rise + fall)), 2, lo, lo_at, lo_side, hi, hi_at, hi_side
