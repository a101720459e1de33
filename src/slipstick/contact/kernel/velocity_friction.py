"""One element whose friction coefficient depends on the velocity: states with located events, forces, derivatives.

``f' = kt w'`` while ``|f| < B = mu(|w'|) N``, else ``f = +-B``. Between zeros of ``w'`` and ``N``, and velocities at
which ``mu`` has a corner, all is smooth: there changes of state are located to rounding, and integrals taken by
Gauss's rule. ``w`` is the sliding motion with its drift, a dash the derivative by phase.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from slipstick.contact.kernel.tuples import SEPARATION, SLIP_MINUS, SLIP_PLUS, STICK
from slipstick.trig.compiled import compiled
from slipstick.typing import Array

TWO_PI = 2.0 * np.pi
TABLE, EXPONENTIAL, GAUSSIAN, HYPERBOLIC, CUBIC = 0, 1, 2, 3, 4
"""Forms of the friction law."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
_PER_RADIAN = 0.5
"""Panels of integration per radian of the highest harmonic: products of three such waves are exact to rounding."""
_CELLS = 5.0
"""Cells of the search for events per radian of the highest harmonic: each cell separates roots."""
_FEWEST_CELLS = 6
"""Cells of the search between two breakpoints, at least."""

_START = 0.7390851332151607
"""Phase at which a period begins: one at which no corner of a symmetric motion lies."""
_GOLDEN = 0.3819660112501051
"""Smaller part of the golden section."""
_AT_BOUND = 1e-13
"""Rounding of a force that equals the bound, relative to the bound."""
_SHORTEST = 1e-11
"""Least length of a slip, rad: where a stick touches the bound no more than rounding."""
_SAME_ENDS = 1e-11
"""Relative difference of the largest and the smallest force that is rounding: the contact slips."""

_GRID, _MARGIN, _LIMIT = 0, 1, 2
"""Functions whose sign changes at an event, see ``event_value``."""
_W, _W1, _W2, _Y, _Y1 = range(5)
"""Places of a motion at a phase."""
_B, _B1, _MU, _SLOPE, _NORMAL = range(5)
"""Places of a bound at a phase: ``B, B', mu, mu' sign(w'), N``."""
_BEGIN, _END, _SIGN, _CLOSED, _SEGMENT = range(5)
"""Columns of the pieces of a period: start, end, sign of ``w'``, whether closed, segment of the friction law."""
_PHASE, _SIDE, _PIECE, _CORNER = range(4)
"""Columns of the starts of sticks: phase, side of the bound left, its piece, piece at whose start it was (-1: none)."""
_DRIFT, _OMEGA, _KT, _KN, _GAP, _CURVE = range(6)
"""Columns of derivatives after the 2 L of the motion; those of the numbers of the friction law begin at the last."""
_WORK, _STICK_SHARE, _SLIP_SHARE, _LEAST, _LARGEST = range(5)
"""Places of the scalars, see ``evaluate``."""


class Element(NamedTuple):
    """Motion and parameters of one element."""

    X: Array
    """Sliding motion, (L,)."""
    Y: Array
    """Normal motion, (L,)."""
    m: Array
    """Harmonic numbers, (n,)."""
    form: int
    """Of the friction law."""
    curve: Array
    """Numbers of the friction law, (P,)."""
    drift: float
    kn: float
    gap: float
    omega: float
    kt: float


class Workspace(NamedTuple):
    """Arrays that functions overwrite: motion (5,), derivatives of mu by its numbers (P,), bound (5,) at a phase."""

    motion: Array
    by: Array
    bound: Array


@compiled(allocates=True)
def motion_at(tau: float, e: Element, out: Array) -> None:
    """``w, w', w'', y, y'`` at a phase."""
    X, Y, m = e.X, e.Y, e.m
    w, w1, w2, y, y1 = X[0] + e.drift * tau, e.drift, 0.0, Y[0], 0.0
    for k in range(m.size):
        c, s, o = np.cos(m[k] * tau), np.sin(m[k] * tau), m[k]
        a, b = X[2 * k + 1], X[2 * k + 2]
        w += a * c + b * s
        w1 += o * (b * c - a * s)
        w2 -= o * o * (a * c + b * s)
        a, b = Y[2 * k + 1], Y[2 * k + 2]
        y += a * c + b * s
        y1 += o * (b * c - a * s)
    out[_W], out[_W1], out[_W2], out[_Y], out[_Y1] = w, w1, w2, y, y1


@compiled(allocates=True)
def coefficient(form: int, p: Array, segment: int, speed: float, by: Array) -> tuple[float, float]:
    """mu and its slope at a speed of a segment of the law; ``by`` receives its derivatives by the numbers ``p``."""
    by[:] = 0.0
    if form == TABLE:
        n = p.size // 2
        if segment >= n - 1:
            by[2 * n - 1] = 1.0
            return p[2 * n - 1], 0.0
        a, b = p[segment], p[segment + 1]
        share = (speed - a) / (b - a)
        slope = (p[n + segment + 1] - p[n + segment]) / (b - a)
        by[n + segment], by[n + segment + 1] = 1.0 - share, share
        by[segment], by[segment + 1] = -slope * (1.0 - share), -slope * share
        return p[n + segment] + slope * (speed - a), slope
    static, kinetic, scale, viscous = p[0], p[1], p[2], p[3]
    x = speed / scale
    if form == EXPONENTIAL:
        e = np.exp(-x)
        d = -e
    elif form == GAUSSIAN:
        e = np.exp(-x * x)
        d = -2.0 * x * e
    elif form == HYPERBOLIC:
        e = 1.0 / (1.0 + x)
        d = -e * e
    else:
        e = 1.0 - 1.5 * x + 0.5 * x * x * x
        d = 1.5 * (x * x - 1.0)
    fall = static - kinetic
    by[0], by[1], by[2], by[3] = e, 1.0 - e, -fall * d * x / scale, speed
    return kinetic + fall * e + viscous * speed, fall * d / scale + viscous


@compiled(allocates=True)
def bound(at: Array, e: Element, piece: Array, by: Array, out: Array) -> None:
    """``B, B', mu, mu' sign(w'), N`` at a motion, as the piece of the period has them."""
    kn, gap, omega = e.kn, e.gap, e.omega
    if piece[_CLOSED] == 0.0:
        out[:] = 0.0
        by[:] = 0.0
        return
    mu, slope = coefficient(e.form, e.curve, int(piece[_SEGMENT]), piece[_SIGN] * omega * at[_W1], by)
    slope *= piece[_SIGN]
    normal = kn * (at[_Y] - gap)
    out[_B] = mu * normal
    out[_B1] = slope * omega * at[_W2] * normal + mu * kn * at[_Y1]
    out[_MU], out[_SLOPE], out[_NORMAL] = mu, slope, normal


@compiled(allocates=True)
def event_value(code: int, tau: float, side: float, held: float, e: Element, piece: Array, work: Workspace) -> float:
    """Function whose sign changes at an event: a level of the motion, the margin of slip, or of stick at a side.

    ``held`` is ``f - kt w`` of a stick.
    """
    at, by, out = work.motion, work.by, work.bound
    motion_at(tau, e, at)
    if code == _GRID:
        return e.omega * at[_W1] - side if held == 0.0 else at[_Y] - e.gap
    bound(at, e, piece, by, out)
    if code == _MARGIN:
        return e.kt * at[_W1] * side - out[_B1]
    return out[_B] - side * (held + e.kt * at[_W])


@compiled(allocates=True)
def root(code: int, a: float, b: float, side: float, held: float, e: Element, piece: Array, work: Workspace) -> float:
    """Zero between two phases of different sign (Illinois method, safeguarded by bisection)."""
    fa, fb = event_value(code, a, side, held, e, piece, work), event_value(code, b, side, held, e, piece, work)
    if fa == 0.0:
        return a
    last = 0
    for i in range(200):
        if abs(b - a) <= 4e-16 * (1.0 + abs(b)):
            break
        c = b - fb * (b - a) / (fb - fa)
        if i % 4 == 3 or not (min(a, b) < c < max(a, b)):
            c = 0.5 * (a + b)
        fc = event_value(code, c, side, held, e, piece, work)
        if fc == 0.0:
            return c
        if (fc > 0.0) == (fb > 0.0):
            b, fb = c, fc
            if last == 1:
                fa *= 0.5
            last = 1
        else:
            a, fa = c, fc
            if last == 2:
                fb *= 0.5
            last = 2
    return 0.5 * (a + b)


@compiled(allocates=True)
def extreme(
    code: int, a: float, b: float, sign: float, side: float, held: float, e: Element, piece: Array, work: Workspace
) -> tuple[float, float]:
    """Phase and value where ``sign`` times the function is least between two phases (golden section)."""
    c, d = a + _GOLDEN * (b - a), b - _GOLDEN * (b - a)
    fc, fd = (
        sign * event_value(code, c, side, held, e, piece, work),
        sign * event_value(code, d, side, held, e, piece, work),
    )
    for _ in range(40):
        if fc < fd:
            b, d, fd = d, c, fc
            c = a + _GOLDEN * (b - a)
            fc = sign * event_value(code, c, side, held, e, piece, work)
        else:
            a, c, fc = c, d, fd
            d = b - _GOLDEN * (b - a)
            fd = sign * event_value(code, d, side, held, e, piece, work)
    return (c, sign * fc) if fc < fd else (d, sign * fd)


@compiled(allocates=True)
def _deepest(before: float, now: float, after: float) -> float:
    """Eight times the depth of a parabola below a lowest sample and its neighbours; 0 where it is not the lowest."""
    return before + after - 2.0 * now if now <= before and now <= after else 0.0


@compiled(allocates=True)
def first_below(
    code: int, a: float, b: float, side: float, held: float, e: Element, piece: Array, cells: float, work: Workspace
) -> float:
    """First phase after ``a`` at which the function falls below zero, or ``b``."""
    n = max(_FEWEST_CELLS, int(np.ceil((b - a) * cells)))
    step = (b - a) / n
    before, now = np.inf, event_value(code, a, side, held, e, piece, work)
    for i in range(n):
        left, right = a + i * step, a + (i + 1) * step if i < n - 1 else b
        after = event_value(code, right, side, held, e, piece, work)
        if after < 0.0:
            peak, height = left, now
            if i == 0:  # zero to rounding where it begins at the bound
                c, most = extreme(code, left, right, -1.0, side, held, e, piece, work)
                if most > now:
                    peak, height = c, most
            return root(code, peak, right, side, held, e, piece, work) if height > 0.0 else left
        if i > 0 and 0.0 < now < _deepest(before, now, after):
            low, least = extreme(code, left - step, right, 1.0, side, held, e, piece, work)
            if least < 0.0:
                return root(code, left - step, low, side, held, e, piece, work)
        before, now = now, after
    return b


@compiled(allocates=True)
def breakpoints(levels: Array, e: Element, cells: int, work: Workspace, times: Array, kinds: Array) -> int:
    """Phases of a period at which ``w'`` passes a level or the contact opens or closes, sorted; their number.

    ``kinds``: the number of the level, or ``levels.size`` where the contact opens or closes.
    """
    piece, count = np.zeros(5), 0
    rates, gaps = np.empty(cells + 1), np.empty(cells + 1)
    for i in range(cells + 1):
        tau = _START + TWO_PI * i / cells
        rates[i] = event_value(_GRID, tau, 0.0, 0.0, e, piece, work)
        gaps[i] = work.motion[_Y] - e.gap
    low, high = rates.min(), rates.max()
    reach = high - low
    step = TWO_PI / cells
    for j in range(levels.size + 1):
        normal = j == levels.size
        level, held = (0.0, 1.0) if normal else (levels[j], 0.0)
        if not normal and (level > high + reach or level < low - reach):
            continue
        for i in range(cells):
            now = gaps[i] if normal else rates[i] - level
            after = gaps[i + 1] if normal else rates[i + 1] - level
            if (now > 0.0) != (after > 0.0):
                if count < times.size:
                    times[count] = root(_GRID, _START + i * step, _START + (i + 1) * step, level, held, e, piece, work)
                    kinds[count] = j
                    count += 1
                continue
            before = gaps[i - 1 if i else cells - 1] if normal else rates[i - 1 if i else cells - 1] - level
            sign = 1.0 if now > 0.0 else -1.0
            if (before > 0.0) == (now > 0.0) and abs(now) < _deepest(abs(before), abs(now), abs(after)):
                a, b = _START + (i - 1) * step, _START + (i + 1) * step
                dip, least = extreme(_GRID, a, b, sign, level, held, e, piece, work)
                if sign * least < 0.0:
                    for r in range(2):
                        if count < times.size:
                            t = root(_GRID, a if r == 0 else dip, dip if r == 0 else b, level, held, e, piece, work)
                            times[count] = t + TWO_PI if t < _START else t
                            kinds[count] = j
                            count += 1
    order = np.argsort(times[:count])
    times[:count] = times[:count][order]
    kinds[:count] = kinds[:count][order]
    return count


@compiled(allocates=True)
def pieces_of(count: int, times: Array, levels: Array, e: Element, work: Workspace, pieces: Array) -> None:
    """Start, end, sign of ``w'``, whether closed, and segment of the law of each piece of the period."""
    n = e.curve.size // 2
    for i in range(count + 1):
        a = times[i - 1] if i else _START
        b = times[i] if i < count else _START + TWO_PI
        motion_at(0.5 * (a + b), e, work.motion)
        rate = work.motion[_W1]
        segment = 0
        if e.form == TABLE:
            while segment < n - 1 and e.curve[segment + 1] <= abs(rate * e.omega):
                segment += 1
        pieces[i, _BEGIN], pieces[i, _END] = a, b
        pieces[i, _SIGN] = 1.0 if rate > 0.0 else -1.0 if rate < 0.0 else 0.0
        pieces[i, _CLOSED] = 1.0 if work.motion[_Y] > e.gap and e.kn > 0.0 else 0.0
        pieces[i, _SEGMENT] = segment


@compiled(allocates=True)
def march(
    f: float, pieces: Array, e: Element, cells: float, work: Workspace, at: Array, code: Array, anchors: Array
) -> tuple[float, int, int]:
    """One period from the force at its start: the force at its end, numbers of intervals and of sticks that began.

    Rows of ``at``: start, end, ``f - kt w`` of a stick; of ``code``: state, piece, number of the stick (-1: it began
    before the period). Rows of ``anchors`` are the starts of sticks. -1 intervals: the arrays are too short.
    """
    kt, total, begun, current, slipped = e.kt, 0, 0, -1, 0.0
    now, by, out = work.motion, work.by, work.bound
    for i in range(len(pieces)):
        piece, t, end = pieces[i], pieces[i, _BEGIN], pieces[i, _END]
        side = 0.0
        if piece[_CLOSED] == 0.0:
            f = 0.0
        elif end > t:
            motion_at(t, e, now)
            bound(now, e, piece, by, out)
            at_bound = 1.0 if f >= (1.0 - _AT_BOUND) * out[_B] else -1.0 if f <= (_AT_BOUND - 1.0) * out[_B] else 0.0
            if i > 0 and pieces[i - 1, _CLOSED] == 0.0:  # contact has just closed
                at_bound = 1.0 if now[_W1] > 0.0 else -1.0
            if at_bound != 0.0 and kt * now[_W1] * at_bound > out[_B1]:
                side = at_bound
        corner = i
        while t < end:
            if total == len(at) or begun == len(anchors):
                return f, -1, begun
            state, held = SEPARATION, 0.0
            if piece[_CLOSED] == 0.0:
                stop = end
            elif side != 0.0:
                state = SLIP_PLUS if side > 0.0 else SLIP_MINUS
                stop = max(first_below(_MARGIN, t, end, side, 0.0, e, piece, cells, work), min(end, t + _SHORTEST))
                motion_at(stop, e, now)
                bound(now, e, piece, by, out)
                f = side * out[_B]
            else:
                if total > 0 and code[total - 1, 0] != STICK:
                    anchors[begun, _PHASE], anchors[begun, _PIECE] = t, code[total - 1, 1]
                    anchors[begun, _CORNER] = corner
                    anchors[begun, _SIDE] = 0.0 if code[total - 1, 0] == SEPARATION else slipped
                    current, begun = begun, begun + 1
                state = STICK
                motion_at(t, e, now)
                held = f - kt * now[_W]
                upper = first_below(_LIMIT, t, end, 1.0, held, e, piece, cells, work)
                stop = first_below(_LIMIT, t, upper, -1.0, held, e, piece, cells, work)
                motion_at(stop, e, now)
                f = held + kt * now[_W]
            at[total, 0], at[total, 1], at[total, 2] = t, stop, held
            code[total, 0], code[total, 1], code[total, 2] = state, i, current
            total += 1
            if state == STICK:
                side = 0.0 if stop >= end else 1.0 if f > 0.0 else -1.0
            else:
                slipped, side = side, 0.0
            t, corner = stop, -1
    return f, total, begun


@compiled(allocates=True)
def anchor(
    a: Array, shift: float, pieces: Array, kinds: Array, levels: Array, e: Element, work: Workspace, out: Array
) -> None:
    """Derivatives of ``f - kt w`` of a stick, begun ``shift`` periods before, by all arguments (see ``evaluate``)."""
    at, by, b = work.motion, work.by, work.bound
    m, t, side = e.m, a[_PHASE], a[_SIDE]
    L = 2 * m.size + 1
    motion_at(t, e, at)
    out[:] = 0.0
    if side != 0.0:
        bound(at, e, pieces[int(a[_PIECE])], by, b)
        slope_of_bound(side, t, e, work, out)
    else:
        b[:] = 0.0
    kt = e.kt
    add_motion(-kt, t, m, out[:L])
    out[2 * L + _DRIFT] -= kt * (t - shift * TWO_PI)
    out[2 * L + _KT] -= at[_W] - shift * TWO_PI * e.drift
    if a[_CORNER] < 0.0 or int(a[_CORNER]) == 0:
        return
    # it began at a corner of the bound, which moves
    kind, rate = kinds[int(a[_CORNER]) - 1], side * b[_B1] - kt * at[_W1]
    if kind == levels.size:
        add_motion(-rate / at[_Y1], t, m, out[L : 2 * L])
        out[2 * L + _GAP] += rate / at[_Y1]
    else:
        share = -rate / (e.omega * at[_W2])
        add_rate(share * e.omega, t, m, out[:L])
        out[2 * L + _DRIFT] += share * e.omega
        out[2 * L + _OMEGA] += share * at[_W1]
        if e.form == TABLE and levels[kind] != 0.0:
            knot = 0
            while e.curve[knot] != abs(levels[kind]):
                knot += 1
            out[2 * L + _CURVE + knot] -= share * (1.0 if levels[kind] > 0.0 else -1.0)


@compiled(allocates=True)
def add_motion(factor: float, tau: float, m: Array, out: Array) -> None:
    """Add ``factor H_-``."""
    out[0] += factor
    for j in range(m.size):
        out[2 * j + 1] += factor * np.cos(m[j] * tau)
        out[2 * j + 2] += factor * np.sin(m[j] * tau)


@compiled(allocates=True)
def add_rate(factor: float, tau: float, m: Array, out: Array) -> None:
    """Add ``factor dH_-/dtau``."""
    for j in range(m.size):
        out[2 * j + 1] -= factor * m[j] * np.sin(m[j] * tau)
        out[2 * j + 2] += factor * m[j] * np.cos(m[j] * tau)


@compiled(allocates=True)
def slope_of_bound(side: float, tau: float, e: Element, work: Workspace, out: Array) -> None:
    """Add the derivatives of ``side B`` by all arguments, at the motion and bound in the workspace."""
    m, at, by, b = e.m, work.motion, work.by, work.bound
    L, omega, mu, normal, slope_force = 2 * m.size + 1, e.omega, b[_MU], b[_NORMAL], side * b[_SLOPE] * b[_NORMAL]
    add_rate(slope_force * omega, tau, m, out[:L])
    add_motion(side * mu * e.kn, tau, m, out[L : 2 * L])
    out[2 * L + _DRIFT] += slope_force * omega
    out[2 * L + _OMEGA] += slope_force * at[_W1]
    out[2 * L + _KN] += side * mu * normal / e.kn
    out[2 * L + _GAP] -= side * mu * e.kn
    for j in range(by.size):
        out[2 * L + _CURVE + j] += side * normal * by[j]


@compiled(allocates=True)
def evaluate(
    X: Array, Y: Array, m: Array, form: int, p: Array, levels: Array, v: float, omega: float, kt: float, kn: float,
    gap: float, rule: Any, fx: Array, fy: Array, by_x: Array, by_y: Array, scalars: Array, at: Array, code: Array,
) -> int:  # fmt: skip
    """Forces and derivatives of one element; the number of its intervals, -1 where the arrays are too short.

    ``by_x``, ``by_y`` (L, 2 L + 5 + P): derivatives of both forces by X, Y, the drift, omega, kt, kn, gap and the P
    numbers of the friction law. ``scalars``: work over 2 pi, fractions of stick and slip, least and largest mean force.
    """
    nodes, weights = rule
    L, P = 2 * m.size + 1, p.size
    e = Element(X, Y, m, form, p, v, kn, gap, omega, kt)
    now, by, b = np.empty(5), np.empty(P), np.empty(5)
    work = Workspace(now, by, b)
    highest = max(1.0, m[-1]) if m.size else 1.0
    times, kinds = np.empty(len(at)), np.empty(len(at), np.int64)
    cells = _CELLS * highest * (2.0 if form == TABLE else 3.0)
    count = breakpoints(levels, e, int(np.ceil(TWO_PI * _CELLS * highest)), work, times, kinds)
    if count == len(times):
        return -1
    pieces = np.empty((count + 1, 5))
    pieces_of(count, times, levels, e, work, pieces)
    anchors, sides = np.zeros((len(at), 4)), np.zeros((2, 4))
    ends, found = np.zeros(2), 0
    # the period map is a shift by the drift, clipped on both sides: its ends are those of the largest forces
    motion_at(_START, e, now)
    bound(now, e, pieces[0], by, b)
    first = b[_B]
    for r in range(2):
        side = 1.0 - 2.0 * r
        if v * side < 0.0:
            continue
        ends[r], total, begun = march(side * first, pieces, e, cells, work, at, code, anchors)
        if total < 0:
            return -1
        sides[r] = anchors[begun - 1] if begun else np.array([_START, side, 0.0, -1.0])
        found = r
    high, low = ends[0], ends[1]
    stuck = v == 0.0 and high - low > _SAME_ENDS * (abs(high) + abs(low))
    f = 0.5 * (high + low) if v == 0.0 else ends[found]
    if v == 0.0 and not stuck:
        f, found = high, 0
    _, total, begun = march(f, pieces, e, cells, work, at, code, anchors)
    if total < 0:
        return -1
    G = 2 * L + _CURVE + P
    held = np.empty((begun + 1, G))
    for j in range(begun):
        anchor(anchors[j], 0.0, pieces, kinds, levels, e, work, held[j])
    if stuck and begun == 0:
        other = np.empty(G)
        anchor(sides[0], 0.0, pieces, kinds, levels, e, work, held[0])
        anchor(sides[1], 0.0, pieces, kinds, levels, e, work, other)
        held[0] = 0.5 * (held[0] + other)
    elif begun:
        anchor(anchors[begun - 1], 1.0, pieces, kinds, levels, e, work, held[begun])
    else:
        anchor(sides[found], 1.0, pieces, kinds, levels, e, work, held[0])

    fx[:], fy[:], by_x[:], by_y[:], scalars[:] = 0.0, 0.0, 0.0, 0.0, 0.0
    g, wave = np.empty(G), np.empty(L)
    for i in range(total):
        a, z, state, piece = at[i, 0], at[i, 1], code[i, 0], pieces[code[i, 1]]
        if state == SEPARATION:
            continue
        scalars[_STICK_SHARE if state == STICK else _SLIP_SHARE] += (z - a) / TWO_PI
        side = 1.0 if state == SLIP_PLUS else -1.0
        panels = 1 + int((z - a) * highest * _PER_RADIAN)
        half = 0.5 * (z - a) / panels
        for q in range(panels * nodes.size):
            tau = a + half * (2 * (q // nodes.size) + 1 + nodes[q % nodes.size])
            share = half * weights[q % nodes.size] / np.pi
            motion_at(tau, e, now)
            bound(now, e, piece, by, b)
            wave[:] = 0.0
            add_motion(1.0, tau, m, wave)
            if state == STICK:
                g[:] = held[code[i, 2] if code[i, 2] >= 0 else begun]
                for j in range(L):
                    g[j] += kt * wave[j]
                g[2 * L + _DRIFT] += kt * tau
                g[2 * L + _KT] += now[_W]
                force = at[i, 2] + kt * now[_W]
            else:
                g[:] = 0.0
                slope_of_bound(side, tau, e, work, g)
                force = side * b[_B]
            scalars[_WORK] += 0.5 * share * force * now[_W1]
            for j in range(L):
                part = share * wave[j] * (0.5 if j == 0 else 1.0)
                fx[j] += part * force
                fy[j] += part * b[_NORMAL]
                for c in range(G):
                    by_x[j, c] += part * g[c]
                for c in range(L):
                    by_y[j, L + c] += part * kn * wave[c]
                by_y[j, 2 * L + _KN] += part * b[_NORMAL] / kn
                by_y[j, 2 * L + _GAP] -= part * kn
    if stuck:
        by_x[:, 2 * L + _DRIFT] = 0.0  # any drift makes it slip
        scalars[_LEAST], scalars[_LARGEST] = fx[0] - 0.5 * (high - low), fx[0] + 0.5 * (high - low)
    else:
        scalars[_LEAST], scalars[_LARGEST] = fx[0], fx[0]
    return total


@compiled(allocates=True, nogil=True)
def run(
    X: Array, Y: Array, m: Array, form: int, p: Array, levels: Array, constants: Array, rule: Any, fx: Array, fy: Array,
    by_x: Array, by_y: Array, scalars: Array, at: Array, code: Array, totals: Array,
) -> None:  # fmt: skip
    """``evaluate`` of n elements; rows of ``constants``: drift, omega, kt, kn, gap."""
    for i in range(len(X)):
        v, omega, kt, kn, gap = constants[i]
        totals[i] = evaluate(
            X[i], Y[i], m, form, p[i], levels[i], v, omega, kt, kn, gap, rule, fx[i], fy[i], by_x[i], by_y[i],
            scalars[i], at[i], code[i],
        )  # fmt: skip
