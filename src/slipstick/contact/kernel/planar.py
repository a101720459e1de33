"""Compiled planar friction: one spring kt in series with a Coulomb circle of radius ``b = mu kn (y - gap)``.

While stuck ``f' = kt w'``; while slipping ``f = b (cos theta, sin theta)`` with ``theta' = kt w'.t / b`` and the slip
velocity ``lambda = w'.n - b'/kt >= 0``, ``n`` along the force and ``t`` across it. Stick is integrated in closed form;
slip by collocation (Radau IIA, ``STAGES`` nodes a panel) between located events; the derivatives are those of the
collocation itself. Sources: B. D. Yang and C. H. Menq (1998) for the circle; E. Hairer and G. Wanner, Solving Ordinary
Differential Equations II (1996), section IV.5, for the method.

A period is marched for its values alone, from a force at its start, until it ends as it began; its pieces are kept, and
then read once for all derivatives. Columns of a derivative: ``X1 (L), X2 (L), Y (L), v1, v2, kt, mu, kn, gap``, and the
force at the start of the period ``f1, f2``.
"""

from __future__ import annotations

from math import comb, pi
from typing import Any, NamedTuple

import numpy as np
from scipy.special import roots_jacobi

from slipstick.trig.basis import TWO_PI, Grid, Polynomial, basis, circle, powers
from slipstick.trig.compiled import compiled, inlined, part
from slipstick.trig.integrals import fill_matrix, fill_vectors
from slipstick.trig.roots import _roots
from slipstick.typing import Array, IntArray

STAGES = 6
SEPARATION, STICK, SLIP, LAST_SLIP = 0, 1, 2, 3
"""Kinds of pieces. The last slip before a separation is too short for its angle to matter: it stays as it is."""
NAMES = ("separation", "stick", "slip", "slip")

V1, V2, KT, MU, KN, GAP, F1, F2 = range(8)
"""Columns of the derivatives behind the 3 L of the motion."""
COLUMNS = 8

DONE, FULL, LOST = 0, -1, -2
"""How a period ends: as it should, without room for another piece, or with no periodic state."""

_SHORTEST = 0.1
"""Slip before a separation that is left of it, rad, over the root of the tolerance: its force falls to nothing."""
_INSTANT = 1e-15
"""Shorter times, rad, are none."""
_OF_LAST = 1e-5
"""Error of the force over the last term of a panel's angle to the power 1.5: at most, of 4000 measured states."""
_NEXT = 0.1
"""Part of the last term but one that the last is taken to have at least."""
_BLOCK = 48
"""Nodes whose derivatives are summed by one product of matrices."""
_PERIODS = 200
_NEWTON = 14
_CLOSED = 1e-9
"""Distance from the periodic state, over the limit, that one step of Newton's makes nothing."""
_BEYOND = 1.1
"""Part of an interval up to an event that the next period tries."""
_NOTHING, _LEVEL = 1e-14, 1e-10
"""Gain of a margin that rounding hides, over its size; bend of one over time that is none, over what it sums up."""
_EXCHANGES = 16
"""Rounds in which times that decide over the mean of a contact at rest are exchanged."""


def _radau(stages: int) -> tuple[Array, Array, Array, Array]:
    """Nodes, weights ``A``, those of the last two Legendre coefficients of the polynomial through the nodes, and of all
    coefficients but the constant one of that through the start too (rows: powers 1, 2, ...; columns: values at the
    nodes less the start's)."""
    inner, _ = roots_jacobi(stages - 1, 1.0, 0.0)
    nodes = np.append(0.5 * (inner + 1.0), 1.0)
    vander = np.vander(nodes, stages, increasing=True)
    integrals = np.vander(nodes, stages + 1, increasing=True)[:, 1:] / np.arange(1, stages + 1)
    through_start = np.linalg.inv(vander * nodes[:, None])
    weights = np.ascontiguousarray(np.linalg.solve(vander.T, integrals.T).T)
    last = np.linalg.inv(np.polynomial.legendre.legvander(2.0 * nodes - 1.0, stages - 1))[-2:]
    return nodes, weights, np.ascontiguousarray(last[::-1]) * comb(2 * stages - 2, stages - 1), through_start


_C, _A, _TOP, _POWERS = _radau(STAGES)


class Planar(NamedTuple):
    """One element: motion without its tangential means, and constants."""

    X1: Array
    X2: Array
    Y: Array
    """The zero coefficient is less the gap."""
    v1: float
    v2: float
    kt: float
    mu: float
    kn: float
    b: float
    """``mu kn``: friction limit over penetration."""
    series: Array
    """Of each order the coefficients of the cosine in ``w1', w2', y, y', w1, w2``, then those of the sine (n, 12)."""


class Pieces(NamedTuple):
    """One period, piece by piece."""

    kind: IntArray
    at: Array
    """Start, end, force at the start, angle at the start, how far slip was tried (room, 6)."""
    theta: Array
    """Angle at the nodes of a panel (room, STAGES)."""
    rates: Array
    """``w1', w2', penetration, its rate`` at the nodes (room, STAGES, 4)."""


class Room(NamedTuple):
    """Room for one element after the other."""

    c: Array
    s: Array
    jacobian: Array
    residual: Array
    node_cos: Array
    """``cos m_j t`` at the nodes of a panel (STAGES, padded orders), and sines."""
    node_sin: Array
    nodes: Array
    """Rates at the nodes of the panel that is tried (STAGES, 4)."""
    theta: Array
    cos: Array
    """Of the angles at the nodes, as ``sin``, the rate ``g`` of the angle and its derivative ``slope`` by it."""
    sin: Array
    g: Array
    slope: Array
    speed: Array
    """Velocity of slip at the nodes, then coefficients of its polynomial, of that of the angle (3, STAGES)."""
    state: Array
    """Motion at a time: ``w1, w2, w1', w2', penetration, its rate``."""
    rows: Array
    """Of ``differentiate``: both forces and their derivatives at nodes (_BLOCK, 2 (1 + columns))."""
    weighted: Array
    """And their weights (_BLOCK, L)."""


@compiled
def look(p: Planar, t: float, grid: Grid, room: Room, out: Array) -> None:
    """``w1, w2, w1', w2', y - gap, y'`` at a time, whose basis stays in the room."""
    a, c, s = p.series, room.c, room.s
    basis(t, grid, c, s)
    w1, w2, d1, d2, y, dy = p.v1 * t, p.v2 * t, p.v1, p.v2, p.Y[0], 0.0
    for j in range(grid.n):
        cj, sj = c[j], s[j]
        d1 += a[j, 0] * cj + a[j, 6] * sj
        d2 += a[j, 1] * cj + a[j, 7] * sj
        y += a[j, 2] * cj + a[j, 8] * sj
        dy += a[j, 3] * cj + a[j, 9] * sj
        w1 += a[j, 4] * cj + a[j, 10] * sj
        w2 += a[j, 5] * cj + a[j, 11] * sj
    out[0], out[1], out[2], out[3], out[4], out[5] = w1, w2, d1, d2, y, dy


@compiled
def look_rates(p: Planar, t: float, grid: Grid, room: Room, out: Array) -> None:
    """``w1', w2', y - gap, y'`` at a time, whose basis stays in the room."""
    a, c, s = p.series, room.c, room.s
    basis(t, grid, c, s)
    d1, d2, y, dy = p.v1, p.v2, p.Y[0], 0.0
    for j in range(grid.n):
        cj, sj = c[j], s[j]
        d1 += a[j, 0] * cj + a[j, 6] * sj
        d2 += a[j, 1] * cj + a[j, 7] * sj
        y += a[j, 2] * cj + a[j, 8] * sj
        dy += a[j, 3] * cj + a[j, 9] * sj
    out[0], out[1], out[2], out[3] = d1, d2, y, dy


@compiled
def look_at_nodes(p: Planar, t: float, h: float, grid: Grid, room: Room) -> None:
    """The same at the nodes of a panel, in ``room.nodes``."""
    a, c, s, nodes = p.series, room.node_cos, room.node_sin, room.nodes
    for i in range(STAGES):
        basis(t + _C[i] * h, grid, c[i], s[i])
        nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3] = p.v1, p.v2, p.Y[0], 0.0
    for j in range(grid.n):
        for i in range(STAGES):
            cj, sj = c[i, j], s[i, j]
            for k in range(4):
                nodes[i, k] += a[j, k] * cj + a[j, 6 + k] * sj


@compiled
def solve(J: Array, r: Array) -> None:
    """``r = J^-1 r`` of a panel by elimination; both are overwritten."""
    for k in range(STAGES):
        J[k, k] = 1.0 / J[k, k]
        for i in range(k + 1, STAGES):
            q = J[i, k] * J[k, k]
            for j in range(k + 1, STAGES):
                J[i, j] -= q * J[k, j]
            r[i] -= q * r[k]
    for k in range(STAGES - 1, -1, -1):
        total = r[k]
        for j in range(k + 1, STAGES):
            total -= J[k, j] * r[j]
        r[k] = total * J[k, k]


@compiled
def eliminate(J: Array, B: Array, r: Array) -> float:
    """``B = J^-1 B`` and ``r = J^-1 r``; all are overwritten. Returns the size of the determinant of ``J``."""
    n, m, det = r.size, B.shape[1], 1.0
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(J[i, k]) > abs(J[p, k]):
                p = i
        if p != k:
            for j in range(n):
                J[k, j], J[p, j] = J[p, j], J[k, j]
            for j in range(m):
                B[k, j], B[p, j] = B[p, j], B[k, j]
            r[k], r[p] = r[p], r[k]
        det *= J[k, k]
        inverse = 1.0 / J[k, k]
        for i in range(n):
            if i == k:
                continue
            factor = J[i, k] * inverse
            for j in range(k, n):
                J[i, j] -= factor * J[k, j]
            for j in range(m):
                B[i, j] -= factor * B[k, j]
            r[i] -= factor * r[k]
    for k in range(n):
        inverse = 1.0 / J[k, k]
        for j in range(m):
            B[k, j] *= inverse
        r[k] *= inverse
    return abs(det)


@inlined
def turning(p: Planar, room: Room) -> None:
    """``theta'`` at the nodes, and its derivative by theta."""
    for i in range(STAGES):
        d1, d2 = room.nodes[i, 0], room.nodes[i, 1]
        over = p.kt / (p.b * room.nodes[i, 2])
        c, s = circle(room.theta[i])
        room.cos[i], room.sin[i] = c, s
        room.g[i] = over * (d2 * c - d1 * s)
        room.slope[i] = -over * (d1 * c + d2 * s)


@compiled
def collocate(p: Planar, start: float, h: float, small: float, room: Room) -> bool:
    """Angles at the nodes of a panel of length ``h`` whose rates are known; the first guess stands in ``room.theta``.

    Newton's steps end below ``small``: the next would be its square. False: they do not converge.
    """
    theta, J, r = room.theta, room.jacobian, room.residual
    for _ in range(_NEWTON):
        turning(p, room)
        for i in range(STAGES):
            total = theta[i] - start
            for j in range(STAGES):
                total -= h * _A[i, j] * room.g[j]
                J[i, j] = -h * _A[i, j] * room.slope[j]
            J[i, i] += 1.0
            r[i] = total
        solve(J, r)
        size = 0.0
        for i in range(STAGES):
            theta[i] -= r[i]
            size += abs(r[i])
        if size < small:
            turning(p, room)
            return True
        if not size < 12.0:
            return False
    return False


@inlined
def slip_rate(p: Planar, d1: float, d2: float, dy: float, theta: float) -> float:
    """``lambda``, the velocity of slip."""
    return d1 * np.cos(theta) + d2 * np.sin(theta) - p.b * dy / p.kt


@inlined
def slip_rate_at_end(p: Planar, room: Room) -> float:
    """``lambda`` at the last node of a panel."""
    z = STAGES - 1
    along = room.nodes[z, 0] * room.cos[z] + room.nodes[z, 1] * room.sin[z]
    return along - p.b * room.nodes[z, 3] / p.kt


@compiled
def panel(p: Planar, t: float, start: float, h: float, small: float, grid: Grid, room: Room) -> bool:
    """Collocation from a time and angle on, over ``h``; the first guess stands in ``room.theta``."""
    look_at_nodes(p, t, h, grid, room)
    if collocate(p, start, h, small, room):
        return True
    for i in range(STAGES):
        room.theta[i] = start
    return collocate(p, start, h, small, room)


@compiled
def stick_end(p: Planar, t: float, end: float, f1: float, f2: float, grid: Grid, room: Room) -> tuple[float, bool]:
    """When a stick that begins with a force reaches the circle, else ``end``; and whether it does."""
    o = room.state
    look(p, t, grid, room, o)
    a1, a2 = f1 - p.kt * o[0], f2 - p.kt * o[1]
    step = pi / (8.0 * (grid.top + 2))
    low, rising = t, False
    at = t
    while at < end - _INSTANT:
        at = min(at + step, end)
        look(p, at, grid, room, o)
        r1, r2, b = a1 + p.kt * o[0], a2 + p.kt * o[1], p.b * max(o[4], 0.0)
        beyond = r1 * r1 + r2 * r2 - b * b
        grows = p.kt * (r1 * o[2] + r2 * o[3]) - p.b * b * o[5] > 0.0
        if beyond <= 0.0 and rising and not grows:  # it may have been beyond in between
            left, right = low, at
            for _ in range(60):
                middle = 0.5 * (left + right)
                look(p, middle, grid, room, o)
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
                look(p, x, grid, room, o)
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
def begin_slip(p: Planar, t: float, grid: Grid, room: Room) -> tuple[bool, float, float]:
    """Where a contact closes: whether it slips at once, the angle, and its rate."""
    o = room.state
    look(p, t, grid, room, o)
    speed = np.sqrt(o[2] * o[2] + o[3] * o[3])
    if not p.kt * speed > p.b * o[5]:
        return False, 0.0, 0.0
    theta = np.arctan2(o[3], o[2])
    return True, theta, onset_rate(p, speed, theta, o[5], grid, room)


@compiled
def onset_rate(p: Planar, speed: float, theta: float, dy: float, grid: Grid, room: Room) -> float:
    """``theta'`` where a contact closes slipping; the basis of that time stands in the room.

    The direction of motion turns at some rate; the angle follows with ``kappa / (1 + kappa)`` of it.
    """
    a1, a2 = 0.0, 0.0
    for j in range(grid.n):
        i, k = 2 * j + 1, grid.orders[j]
        a1 -= k * k * (p.X1[i] * room.c[j] + p.X1[i + 1] * room.s[j])
        a2 -= k * k * (p.X2[i] * room.c[j] + p.X2[i + 1] * room.s[j])
    kappa = p.kt * speed / (p.b * dy) if dy > 0.0 else 1e300
    turn = (a2 * np.cos(theta) - a1 * np.sin(theta)) / speed
    return turn / (1.0 + 1.0 / kappa)


@inlined
def polynomial(x: float, first: float, coefficients: Array) -> tuple[float, float]:
    """Value and derivative of a panel's polynomial at part ``x`` of it."""
    value, rate = 0.0, 0.0
    for k in range(STAGES - 1, -1, -1):
        rate = rate * x + value
        value = value * x + coefficients[k]
    return first + x * value, value + x * rate


@compiled
def falls(p: Planar, first: float, room: Room) -> float:
    """Part of the panel just computed after which the velocity of slip, ``first`` at its start, is negative; or 2.

    It is sought on the polynomial through the nodes, which stays in ``room.speed``.
    """
    speed, coefficients = room.speed[0], room.speed[1]
    for i in range(STAGES):
        along = room.nodes[i, 0] * room.cos[i] + room.nodes[i, 1] * room.sin[i]
        speed[i] = along - p.b * room.nodes[i, 3] / p.kt
    rate = 0.0
    for k in range(STAGES):
        coefficients[k] = 0.0
        for i in range(STAGES):
            coefficients[k] += _POWERS[k, i] * (speed[i] - first)
        rate += (k + 1.0) * coefficients[k]
    low, high, at, value = 0.0, 2.0, 0.0, first
    for i in range(-1, STAGES):  # -1 is the start
        if i >= 0 and speed[i] < 0.0:
            low, high = at, _C[i]
            break
        if i < 0:
            dips = coefficients[0] < 0.0 and speed[0] >= first
        elif i == STAGES - 1:
            dips = speed[i] < value and rate > 0.0
        else:
            dips = speed[i] < value and speed[i] < speed[i + 1]
        if dips:  # the lowest point, by bisection
            left, right = at, _C[min(i + 1, STAGES - 1)]
            for _ in range(40):
                middle = 0.5 * (left + right)
                _, rises = polynomial(middle, first, coefficients)
                if rises > 0.0:
                    right = middle
                else:
                    left = middle
            least, _ = polynomial(left, first, coefficients)
            if least < 0.0:
                low, high = at, left
                break
        if i >= 0:
            at, value = _C[i], speed[i]
    if high > 1.0:
        return 2.0
    x = 0.5 * (low + high)
    for _ in range(60):
        value, rate = polynomial(x, first, coefficients)
        if value >= 0.0:
            low = x
        else:
            high = x
        new = x - value / rate if rate < 0.0 else -1.0
        if not low < new < high:
            new = 0.5 * (low + high)
        moved = abs(new - x)
        x = new
        if moved < 1e-14:
            break
    return x


@compiled
def end_of_slip(
    p: Planar, t: float, start: float, h: float, first: float, small: float, grid: Grid, room: Room
) -> tuple[float, bool]:
    """Where in the panel just computed slip ends, as its length: there its last node is, collocated anew; and whether.

    ``first`` is the slip velocity at its start. Force and its rate are steady there: an error of the time enters the
    force by its square.
    """
    x = falls(p, first, room)
    if x > 1.0:
        return h, False
    if first <= 0.0 and x * h < _INSTANT:
        return 0.0, True
    coefficients = room.speed[2]
    for k in range(STAGES):
        coefficients[k] = 0.0
        for i in range(STAGES):
            coefficients[k] += _POWERS[k, i] * (room.theta[i] - start)
    for i in range(STAGES):
        room.theta[i], _ = polynomial(_C[i] * x, start, coefficients)
    last = 1.0
    for _ in range(8):
        if not panel(p, t, start, x * h, small, grid, room):
            break
        _, rate = polynomial(x, first, room.speed[1])
        move = -slip_rate_at_end(p, room) / rate if rate < 0.0 else 0.0
        if abs(move) < 1e-10 or abs(move) > 0.5 * last or not 0.0 < x + move < 1.0:
            break
        last = abs(move)
        x += move
    return x * h, True


@inlined
def longest_panel(tolerance: float, grid: Grid) -> float:
    """Longest panel whose nodes sum a force of that tolerance, rad."""
    return pi / (0.5 * grid.top + 1.0) * min(0.5, max(0.25, 0.55 * (1e8 * tolerance) ** (1.0 / (2 * STAGES - 1))))


@compiled
def march(
    p: Planar,
    f1: float,
    f2: float,
    arcs: Array,
    tolerance: float,
    grid: Grid,
    room: Room,
    old: Pieces,
    known: int,
    out: Pieces,
    P: Array,
) -> tuple[int, float, float]:
    """One period of contact arcs ``(start, end, whether the contact has been closed before)`` from a force on.

    Fills ``out``, and ``P`` (2, 2) with the derivative of the force at the end by that at the start. ``old`` holds the
    ``known`` pieces of the period before: its panels are kept. Returns the number of pieces, or ``FULL``, and the force
    at the end.
    """  # fmt: skip
    longest, small, shortest = longest_panel(tolerance, grid), np.sqrt(1e-5 * tolerance), _SHORTEST * np.sqrt(tolerance)
    count, k = 0, 0
    P[0, 0], P[0, 1], P[1, 0], P[1, 1] = 1.0, 0.0, 0.0, 1.0
    kind, at, o, z = out.kind, out.at, room.state, STAGES - 1
    for a in range(arcs.shape[0]):
        t, end, whole = arcs[a, 0], arcs[a, 1], arcs[a, 2] > 0.5
        slope, curve, first, turn0, turn1 = 0.0, 0.0, 0.0, 0.0, 0.0
        look(p, t, grid, room, o)
        if whole:
            theta, b = np.arctan2(f2, f1), p.b * o[4]
            size = np.sqrt(f1 * f1 + f2 * f2)
            first = slip_rate(p, o[2], o[3], o[5], theta)
            slip = size >= b * (1.0 - 1e-12) and first > 0.0
            if slip:
                turn0, turn1 = -np.sin(theta) / b, np.cos(theta) / b
        else:
            f1, f2 = 0.0, 0.0
            slip, theta, slope = begin_slip(p, t, grid, room)
            first = slip_rate(p, o[2], o[3], o[5], theta)
            P[0, 0], P[0, 1], P[1, 0], P[1, 1] = 0.0, 0.0, 0.0, 0.0
        h, still = longest, 0
        while t < end - _INSTANT * (1.0 + end):
            if count >= kind.size:
                return FULL, f1, f2
            at[count, 0], at[count, 2], at[count, 3], at[count, 4] = t, f1, f2, theta
            if not slip:
                until, slip = stick_end(p, t, end, f1, f2, grid, room)
                look(p, t, grid, room, o)
                w1, w2 = o[0], o[1]
                look(p, until, grid, room, o)
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
                look_rates(p, t + 0.5 * left, grid, room, out.rates[count, 0])
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
                    room.theta[i] = old.theta[k, i] + shift
            error, settled = 0.0, False
            if same:
                for i in range(STAGES):
                    for j in range(4):
                        room.nodes[i, j] = old.rates[k, i, j]
                settled = collocate(p, theta, h, small, room)
            for _ in range(60):
                if not settled:
                    if not again:
                        for i in range(STAGES):
                            x = _C[i] * h
                            room.theta[i] = theta + x * (slope + 0.5 * curve * x)
                    settled = panel(p, t, theta, h, small, grid, room)
                if settled:
                    top, next_to = 0.0, 0.0
                    for j in range(STAGES):
                        top += _TOP[0, j] * room.g[j]
                        next_to += _TOP[1, j] * room.g[j]
                    last = max(abs(top), _NEXT * abs(next_to)) * h  # the last alone may pass through zero
                    error = _OF_LAST * last * np.sqrt(last)
                    if error < (1.5 * tolerance if again else tolerance) and abs(room.theta[z] - theta) < 1.5:
                        break
                h *= 0.5
                again, settled = False, False
            length, ends = end_of_slip(p, t, theta, h, first, small, grid, room)
            slip = not ends
            if length > 0.0:
                total = 0.0
                for i in range(STAGES):
                    out.theta[count, i] = room.theta[i]
                    total += _A[z, i] * room.slope[i]
                    for j in range(4):
                        out.rates[count, i, j] = room.nodes[i, j]
                # what the angle at the end owes to that at the start
                owed = np.exp(length * total)
                turn0, turn1 = turn0 * owed, turn1 * owed
                kind[count], at[count, 1] = SLIP, t + length
                at[count, 5] = t + min(h, _BEYOND * length) if ends else t + length
                count += 1
                t, theta, slope = t + length, room.theta[z], room.g[z]
                curve = (room.g[z] - room.g[z - 1]) / ((1.0 - _C[z - 1]) * length)
                first = slip_rate_at_end(p, room)
                b = p.b * room.nodes[z, 2]
                c, s = room.cos[z], room.sin[z]
                f1, f2 = b * c, b * s
                P[0, 0], P[0, 1], P[1, 0], P[1, 1] = -b * s * turn0, -b * s * turn1, b * c * turn0, b * c * turn1
            still = still + 1 if length < 1e-13 else 0
            if still > 8:
                break
            grown = 2.0 if error <= 0.0 else min(2.0, max(0.8, 0.8 * (tolerance / error) ** (1.0 / STAGES)))
            h = longest if ends else min(longest, grown * h)
    return count, f1, f2


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
    """Where the margins at one, two or three times are equal and least: the margin, and the means; inf: nowhere."""
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
def least_margin(forces: Array, limits: Array, room: IntArray) -> tuple[float, float, float, int]:
    """The mean whose largest margin over the sampled times is least: margin, means, how many times decide.

    The smallest circle round points with a weight each (E. Welzl, 1991): two or three of them decide. They are found
    by exchange: the time that is most beyond joins those that decide. ``room`` (13,) receives their numbers.
    """
    kept, active, trial, better = room[:3], room[3:7], room[7:10], room[10:13]
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
def margin_at(p: Planar, t: float, c1: float, c2: float, grid: Grid, room: Room, out: Array) -> None:
    """By how much a stuck force of mean ``c`` exceeds its limit, less ``b Y_0``, with what derivatives are made of.

    ``out``: length of the force, its direction ``n`` and how fast that turns; the margin, its rate, the rate of that,
    and the size of what this is the sum of. The motion stays in ``room.state``.
    """
    o = room.state
    look(p, t, grid, room, o)
    e1, e2, ey = 0.0, 0.0, 0.0
    for j in range(grid.n):
        i, m, c, s = 2 * j + 1, grid.orders[j], room.c[j], room.s[j]
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
def climb(
    p: Planar, t: float, c1: float, c2: float, longest: float, small: float, grid: Grid, room: Room, out: Array
) -> float:
    """Time near ``t`` where the margin is largest, by Newton's steps that never fall; ``out`` as of ``margin_at``."""
    margin_at(p, t, c1, c2, grid, room, out)
    there = 0
    for _ in range(60):
        rate, bend, before = out[5], out[6], out[4]
        move = -rate / bend if bend < 0.0 else np.copysign(longest, rate)
        move = min(max(move, -longest), longest)
        if abs(rate * move) <= small:  # nothing to gain but the time itself
            there += 1
            if there > 3 or bend > -_LEVEL * out[7]:
                break
        margin_at(p, t + move, c1, c2, grid, room, out)
        if there == 0 and out[4] < before - small:
            longest = 0.25 * abs(move)
            margin_at(p, t, c1, c2, grid, room, out)
        else:
            t += move
    return t


@inlined
def standing(mark: Array) -> float:
    """How far the time of the largest margin moves by its rate; none where margins are alike all round (a circle)."""
    return -1.0 / mark[6] if mark[6] < -_LEVEL * mark[7] else 0.0


@compiled
def conditions(marks: Array, k: int, M: Array) -> None:
    """What the mean does to the conditions (2, 2): equal margins; of two times opposite directions of the force."""
    for i in range(2):
        M[0, i] = marks[0, 1 + i] - marks[1, 1 + i]
        M[1, i] = marks[0, 1 + i] - marks[2, 1 + i]
    if k == 2:
        M[1, 0], M[1, 1] = 0.0, 0.0
        for i in range(2):
            sign = 1.0 if i == 0 else -1.0
            mark = marks[i]
            curvature = sign * (1.0 / mark[0] + mark[3] * mark[3] * standing(mark))
            M[1, 0] -= curvature * mark[2]
            M[1, 1] += curvature * mark[1]


@compiled
def balance(
    p: Planar, t: Array, k: int, c: Array, longest: float, unit: float, grid: Grid, room: Room, marks: Array, M: Array
) -> int:
    """Moves two or three times and the mean to where their margins are largest, equal and least, by Newton.

    How many are left: those that climb to one force are one; none where it does not converge.
    """  # fmt: skip
    n, last = marks, 1e300
    for _ in range(30):
        i = 0
        while i < k:
            t[i] = climb(p, t[i], c[0], c[1], longest, _NOTHING * unit, grid, room, n[i])
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
            # the mean cannot be moved to lessen all three: it is among the directions
            ab, bc = a1 * n[1, 2] - a2 * n[1, 1], n[1, 1] * n[2, 2] - n[1, 2] * n[2, 1]
            ca = n[2, 1] * a2 - n[2, 2] * a1
            return 3 if min(ab, bc, ca) >= -1e-12 or max(ab, bc, ca) <= 1e-12 else 0
    return 0


@compiled
def add_row(p: Planar, u: Any, v: Any, depth: float, rate: float, grid: Grid, room: Room, R: Array) -> None:
    """Adds to a row of derivatives ``u.df + v.df' + depth b dy + rate b dy'`` of a stuck force and its load."""
    q, o = 3 * (2 * grid.n + 1), room.state
    L = 2 * grid.n + 1
    R[2 * L] += depth * p.b
    for j in range(grid.n):
        i, m, c, s = 2 * j + 1, grid.orders[j], room.c[j], room.s[j]
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
    p: Planar, t: Array, k: int, c: Array, grid: Grid, room: Room, marks: Array, M: Array, dc: Array
) -> None:
    """Derivatives of the mean that one, two or three times decide, into ``dc`` (2, columns)."""
    zero = (0.0, 0.0)
    if k == 1:  # the force at that time is none
        look(p, t[0], grid, room, room.state)
        add_row(p, (-1.0, 0.0), zero, 0.0, 0.0, grid, room, dc[0])
        add_row(p, (0.0, -1.0), zero, 0.0, 0.0, grid, room, dc[1])
        return
    for i in range(k):
        mark = marks[i]
        margin_at(p, t[i], c[0], c[1], grid, room, mark)
        n = (mark[1], mark[2])
        if i != 2:
            sign = -1.0 if i == 0 else 1.0
            add_row(p, (sign * n[0], sign * n[1]), zero, -sign, 0.0, grid, room, dc[0])
        if k == 3 and i != 1:
            sign = -1.0 if i == 0 else 1.0
            add_row(p, (sign * n[0], sign * n[1]), zero, -sign, 0.0, grid, room, dc[1])
        if k == 2:
            sign = -1.0 if i == 0 else 1.0
            moves = sign * mark[3] * standing(mark)
            curvature = sign / mark[0] + moves * mark[3]
            u, v = (-curvature * n[1], curvature * n[0]), (moves * n[0], moves * n[1])
            add_row(p, u, v, 0.0, -moves, grid, room, dc[1])
    conditions(marks, k, M)
    det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
    for j in range(dc.shape[1]):
        r1, r2 = dc[0, j], dc[1, j]
        dc[0, j], dc[1, j] = 0.0, 0.0
        if det != 0.0:
            dc[0, j], dc[1, j] = (M[1, 1] * r1 - M[0, 1] * r2) / det, (M[0, 0] * r2 - M[1, 0] * r1) / det


@compiled
def add_time(p: Planar, t: float, n: int, grid: Grid, room: Room, times: Array, forces: Array, limits: Array) -> int:
    """One more time for ``least_margin``; returns how many there are."""
    o = room.state
    look(p, t, grid, room, o)
    times[n], forces[0, n], forces[1, n], limits[n] = t, p.kt * o[0], p.kt * o[1], p.b * (o[4] - p.Y[0])
    return n + 1


@compiled
def beyond(
    p: Planar,
    c: Array,
    least: float,
    unit: float,
    samples: int,
    grid: Grid,
    room: Room,
    forces: Array,
    limits: Array,
    mark: Array,
) -> tuple[float, float]:
    """The largest margin of all times with a mean, and its time: climbed from the sampled ones that may lead there."""
    highest, when, longest = least, -1.0, pi / samples
    last, this = -1e300, -1e300
    for i in range(-2, samples):
        f1, f2 = c[0] + forces[0, (i + 1) % samples], c[1] + forces[1, (i + 1) % samples]
        next_one = np.sqrt(f1 * f1 + f2 * f2) - limits[(i + 1) % samples]
        if i >= 0 and this >= max(last, next_one) and 2.0 * this - min(last, next_one) > least:
            t = climb(p, TWO_PI * i / samples, c[0], c[1], longest, _NOTHING * unit, grid, room, mark)
            if mark[4] > highest:
                highest, when = mark[4], t
        last, this = this, next_one
    return highest, when


@part
def resting_mean(p: Planar, grid: Grid, room: Room) -> tuple[float, float, float, Array]:
    """Margin and mean force of a contact that never slips, and the derivatives of the mean (2, 3 L + COLUMNS).

    Of all means that keep the force within the circle it is the one of the largest least distance from it. One, two or
    three times decide; found among sampled times they are moved to where their margins are largest and equal. Where the
    margin is larger at another time, which proves the mean wrong, that one is added to the samples, and so on: the
    problem is convex, so nothing larger anywhere proves the mean right.
    """
    samples = 16 * (grid.top + 2)
    room_for, columns = samples + 4 * _EXCHANGES, 3 * (2 * grid.n + 1) + COLUMNS
    times, forces, limits = np.empty(room_for), np.empty((2, room_for)), np.empty(room_for)
    dc, c, t, marks, M = np.zeros((2, columns)), np.zeros(2), np.zeros(3), np.zeros((4, 8)), np.zeros((2, 2))
    n, k, left, unit, least, c1, c2, none, proved = 0, 1, 0, 0.0, 0.0, 0.0, 0.0, p.b * p.Y[0], False
    for i in range(samples):
        n = add_time(p, TWO_PI * i / samples, n, grid, room, times, forces, limits)
        unit = max(unit, abs(forces[0, i]) + abs(forces[1, i]), abs(limits[i]))
    if unit == 0.0:
        return -none, 0.0, 0.0, dc
    decide, longest = np.zeros(13, np.int64), pi / samples
    for _ in range(_EXCHANGES):
        least, c1, c2, k = least_margin(forces[:, :n], limits[:n], decide)
        known, proved, c[0], c[1] = n, False, c1, c2
        if least > none:  # it slips for certain
            return least - none, c1, c2, dc
        for i in range(k):
            t[i] = times[decide[i]]
        if k == 1:  # the force is none there, and grows to both sides
            for side in (-1e-3, 1e-3):
                at = climb(p, t[0] + side * longest, c1, c2, longest, _NOTHING * unit, grid, room, marks[0])
                if marks[0, 4] > least + 1e-13 * unit:
                    n = add_time(p, at, n, grid, room, times, forces, limits)
            if n > known:
                continue
            break
        left, margin = balance(p, t, k, c, longest, unit, grid, room, marks, M), least
        if left > 0 and marks[0, 4] >= least - 1e-13 * unit:  # no mean has less
            margin = marks[0, 4]
        else:
            left, c[0], c[1] = 0, c1, c2
        highest, when = beyond(p, c, margin, unit, samples, grid, room, forces, limits, marks[3])
        proved = highest <= margin + 1e-13 * unit
        if proved:
            break
        n = add_time(p, when, n, grid, room, times, forces, limits)
        for i in range(k):
            n = add_time(p, t[i], n, grid, room, times, forces, limits)
    if proved and left > 0:
        least, k = marks[0, 4], left
    else:
        c[0], c[1] = c1, c2
        for i in range(k):
            t[i] = times[decide[i]]
    derive_mean(p, t, k, c, grid, room, marks, M, dc)
    return least - none, c[0], c[1], dc


@compiled
def basis_row(t: float, grid: Grid, room: Room, H: Array, dH: Array) -> None:
    """``H_-`` and ``H_-'`` at a time, (L,) each."""
    basis(t, grid, room.c, room.s)
    H[0], dH[0] = 1.0, 0.0
    for j in range(grid.n):
        r, m, c, s = 2 * j + 1, grid.orders[j], room.c[j], room.s[j]
        H[r], H[r + 1], dH[r], dH[r + 1] = c, s, -m * s, m * c


@inlined
def force_row(p: Planar, depth: float, c: float, s: float, H: Array, angle: Array, row: Array) -> None:
    """Both forces while slipping and their derivatives, from those of the angle: two rows (1 + columns), joined."""
    L, limit = H.size, p.b * depth
    columns = 3 * L + COLUMNS
    for r in range(2):
        start = r * (columns + 1)
        along, across = (c, -limit * s) if r == 0 else (s, limit * c)
        row[start] = limit * along
        for j in range(columns):
            row[start + 1 + j] = across * angle[j]
        first = start + 1 + 2 * L
        for j in range(L):
            row[first + j] += p.b * along * H[j]
        first = start + 1 + 3 * L
        row[first + MU] += limit / p.mu * along
        row[first + KN] += limit / p.kn * along
        row[first + GAP] -= p.b * along


@inlined
def divide(J: Array, B: Array) -> None:
    """``B = J^-1 B`` of a panel, (STAGES, STAGES + 1); both are overwritten."""
    for k in range(STAGES):
        J[k, k] = 1.0 / J[k, k]
        for i in range(k + 1, STAGES):
            q = J[i, k] * J[k, k]
            for j in range(k + 1, STAGES):
                J[i, j] -= q * J[k, j]
            for j in range(STAGES + 1):
                B[i, j] -= q * B[k, j]
    for k in range(STAGES - 1, -1, -1):
        for i in range(k + 1, STAGES):
            for j in range(STAGES + 1):
                B[k, j] -= J[k, i] * B[i, j]
        for j in range(STAGES + 1):
            B[k, j] *= J[k, k]


@part
def differentiate(
    p: Planar, pieces: Pieces, count: int, arcs: Array, grid: Grid, room: Room
) -> tuple[Array, Array, Array]:
    """Friction force (2, L) of a period, its derivatives (2, L, columns), those of the force at its end (2, columns).

    The last two columns are those of the force at the start of the period.
    """
    L, z = 2 * grid.n + 1, STAGES - 1
    columns, q = 3 * L + COLUMNS, 3 * L
    F, dF = np.zeros((2, L)), np.zeros((2, L, columns))
    D = np.zeros((2, columns))
    D[0, q + F1], D[1, q + F2] = 1.0, 1.0
    turn = np.zeros(columns)
    H, dH, bases, o = np.zeros(L), np.zeros(L), np.zeros((STAGES, L)), room.state
    edge = np.zeros((2, 2, grid.top + 4))
    h, hv, W = np.zeros(L), np.zeros(L), np.zeros((L, L))
    C, S, moved = np.zeros(grid.top + 4), np.zeros(grid.top + 4), np.zeros((2, columns))
    stick = 0.0
    # slip: rows of both forces with their derivatives at _BLOCK nodes, summed with their weights by one product
    wide = columns + 1
    rows, weighted = room.rows, room.weighted
    sums, angles = np.zeros((L, 2 * wide)), np.zeros((STAGES, columns))
    rates, J, B = np.zeros((STAGES, columns)), np.zeros((STAGES, STAGES)), np.zeros((STAGES, STAGES + 1))
    filled, was_slip, opened = 0, False, arcs.shape[0] == 0 or arcs[0, 2] < 0.5
    for piece in range(count):
        kind, a, b = pieces.kind[piece], pieces.at[piece, 0], pieces.at[piece, 1]
        f1, f2 = pieces.at[piece, 2], pieces.at[piece, 3]
        fresh = opened and (piece == 0 or pieces.at[piece - 1, 1] < a - 1e-15 or pieces.kind[piece - 1] == LAST_SLIP)
        if fresh:
            D[:] = 0.0
            basis_row(a, grid, room, H, dH)
            look(p, a, grid, room, o)
            if kind == STICK:
                for r in range(2):
                    over = p.kt * o[2 + r] / o[5]
                    for j in range(L):
                        D[r, 2 * L + j] = over * H[j]
                    D[r, q + GAP] = -over
        if kind == STICK:
            powers(a, grid.top, edge[0, 0], edge[0, 1])
            powers(b, grid.top, edge[1, 0], edge[1, 1])
            fill_vectors(b - a, edge[0], edge[1], grid, h, hv)
            for i in range(grid.top):
                C[i] += edge[1, 1, i] - edge[0, 1, i]
                S[i] += edge[0, 0, i] - edge[1, 0, i]
            stick += b - a
            basis_row(a, grid, room, H, dH)
            look(p, a, grid, room, o)
            x1, x2 = o[0] - p.v1 * a, o[1] - p.v2 * a
            for r in range(2):
                for j in range(columns):
                    moved[r, j] = D[r, j]
                for j in range(1, L):
                    moved[r, r * L + j] -= p.kt * H[j]
                moved[r, q + KT] -= x1 if r == 0 else x2
                constant = (f1 - p.kt * x1) if r == 0 else (f2 - p.kt * x2)
                v = p.v1 if r == 0 else p.v2
                for i in range(L):
                    F[r, i] += constant * h[i] + p.kt * v * hv[i]
                    dF[r, i, q + V1 + r] += p.kt * hv[i]
                    dF[r, i, q + KT] += v * hv[i]
                    for j in range(columns):
                        dF[r, i, j] += h[i] * moved[r, j]
            basis_row(b, grid, room, H, dH)
            look(p, b, grid, room, o)
            for r in range(2):
                for j in range(columns):
                    D[r, j] = moved[r, j]
                for j in range(1, L):
                    D[r, r * L + j] += p.kt * H[j]
                v = p.v1 if r == 0 else p.v2
                D[r, q + V1 + r] += p.kt * (b - a)
                D[r, q + KT] += o[r] - v * b + v * (b - a)
            was_slip = False
            continue
        theta = pieces.at[piece, 4]
        if kind == LAST_SLIP:
            basis_row(0.5 * (a + b), grid, room, H, dH)
            angles[0] = 0.0
            force_row(p, pieces.rates[piece, 0, 2], np.cos(theta), np.sin(theta), H, angles[0], rows[filled])
            for j in range(L):
                weighted[filled, j] = (b - a) / pi * H[j]
            filled += 1
            was_slip = False
            D[:] = 0.0
        else:
            if fresh:
                speed = np.sqrt(o[2] * o[2] + o[3] * o[3])
                c, s = np.cos(theta), np.sin(theta)
                rate = onset_rate(p, speed, theta, o[5], grid, room)
                over = rate * p.b / (p.kt * speed)
                turn[:] = 0.0
                for j in range(L):
                    turn[j], turn[L + j], turn[2 * L + j] = -s * dH[j] / speed, c * dH[j] / speed, -over * H[j]
                turn[q + V1], turn[q + V2], turn[q + GAP] = -s / speed, c / speed, over
            elif not was_slip:
                c, s = np.cos(theta), np.sin(theta)
                look(p, a, grid, room, o)
                over = 1.0 / (p.b * o[4])
                for j in range(columns):
                    turn[j] = over * (c * D[1, j] - s * D[0, j])
            length = b - a
            for i in range(STAGES):
                basis_row(a + _C[i] * length, grid, room, bases[i], dH)
                room.theta[i] = pieces.theta[piece, i]
                room.nodes[i] = pieces.rates[piece, i]
                room.cos[i], room.sin[i] = circle(room.theta[i])
                c, s, depth = room.cos[i], room.sin[i], room.nodes[i, 2]
                over = p.kt / (p.b * depth)
                g = over * (room.nodes[i, 1] * c - room.nodes[i, 0] * s)
                slope = -over * (room.nodes[i, 0] * c + room.nodes[i, 1] * s)
                by1, by2, by3 = -over * s, over * c, -g / depth
                for j in range(STAGES):
                    J[j, i] = -length * _A[j, i] * slope
                    B[i, j] = length * _A[i, j]
                B[i, STAGES] = 1.0
                for j in range(L):
                    rates[i, j], rates[i, L + j], rates[i, 2 * L + j] = by1 * dH[j], by2 * dH[j], by3 * bases[i, j]
                rates[i, q + V1], rates[i, q + V2] = by1, by2
                rates[i, q + KT], rates[i, q + MU], rates[i, q + KN] = g / p.kt, -g / p.mu, -g / p.kn
                rates[i, q + GAP] = -by3
            for i in range(STAGES):
                J[i, i] += 1.0
            divide(J, B)
            for i in range(STAGES):  # angles = J^-1 (1 turn + length A rates)
                for j in range(columns):
                    total = B[i, STAGES] * turn[j]
                    for k in range(STAGES):
                        total += B[i, k] * rates[k, j]
                    angles[i, j] = total
                force_row(p, room.nodes[i, 2], room.cos[i], room.sin[i], bases[i], angles[i], rows[filled])
                weight = length * _A[z, i] / pi
                for j in range(L):
                    weighted[filled, j] = weight * bases[i, j]
                filled += 1
            for j in range(columns):
                turn[j], D[0, j], D[1, j] = angles[z, j], rows[filled - 1, 1 + j], rows[filled - 1, wide + 1 + j]
            was_slip = True
        if filled > _BLOCK - STAGES:
            sums += np.dot(weighted[:filled].T, rows[:filled])
            filled = 0
    if filled > 0:
        sums += np.dot(weighted[:filled].T, rows[:filled])
    sums[0] *= 0.5
    for i in range(grid.top):
        C[i] /= i + 1.0
        S[i] /= i + 1.0
    fill_matrix(stick, C, S, grid, W)
    for r in range(2):
        X = p.X1 if r == 0 else p.X2
        for i in range(L):
            moves = 0.0
            for j in range(1, L):
                moves += W[i, j] * X[j]
                dF[r, i, r * L + j] += p.kt * W[i, j]
            F[r, i] += p.kt * moves + sums[i, r * wide]
            dF[r, i, q + KT] += moves
            for j in range(columns):
                dF[r, i, j] += sums[i, r * wide + 1 + j]
    return F, dF, D


@part
def contact_arcs(p: Planar, grid: Grid) -> tuple[bool, Array]:
    """Whether the contact is closed all period, and its arcs ``(start, end, closed before)``, (k, 3)."""
    total = 0.0
    for j in range(1, p.Y.size):
        total += abs(p.Y[j])
    whole = np.array([[0.0, TWO_PI, 1.0]])
    if total == 0.0 or abs(p.Y[0]) > total:
        return p.Y[0] > 0.0, whole[: 1 if p.Y[0] > 0.0 else 0]
    padded = grid.orders.size
    c, s = np.zeros(padded), np.zeros(padded)
    for j in range(grid.n):
        c[j], s[j] = p.Y[2 * j + 1], p.Y[2 * j + 2]
    count, times, rising = _roots(Polynomial(p.Y[0], c, s), grid, grid.top + 2)
    if count <= 0:
        value = p.Y[0]
        for j in range(grid.n):
            value += c[j]
        return value > 0.0, whole[: 1 if value > 0.0 else 0]
    arcs, k = np.zeros((count // 2 + 1, 3)), 0
    for i in range(count):
        if rising[i]:
            arcs[k, 0] = times[i]
            arcs[k, 1] = times[i + 1] if i + 1 < count else times[0] + TWO_PI
            k += 1
    return False, arcs[:k]


@part
def new_room(grid: Grid) -> Room:
    """Room of one thread."""
    padded, L = grid.orders.size, 2 * grid.n + 1
    return Room(
        np.zeros(padded), np.zeros(padded), np.zeros((STAGES, STAGES)), np.zeros(STAGES),
        np.zeros((STAGES, padded)), np.zeros((STAGES, padded)), np.zeros((STAGES, 4)),
        np.zeros(STAGES), np.zeros(STAGES), np.zeros(STAGES), np.zeros(STAGES), np.zeros(STAGES), np.zeros((3, STAGES)),
        np.zeros(6), np.zeros((_BLOCK, 2 * (3 * L + COLUMNS + 1))), np.zeros((_BLOCK, L)),
    )  # fmt: skip


@part
def new_pieces(room: int) -> Pieces:
    """Room for the pieces of a period."""
    return Pieces(np.zeros(room, np.int64), np.zeros((room, 6)), np.zeros((room, STAGES)), np.zeros((room, STAGES, 4)))


@part
def periodic(
    p: Planar,
    arcs: Array,
    f1: float,
    f2: float,
    tolerance: float,
    grid: Grid,
    room: Room,
    pieces: Pieces,
    old: Pieces,
    P: Array,
) -> tuple[int, float, float]:
    """Pieces of the period that ends as it begins, from a guess of the force: their number, ``FULL`` or ``LOST``; and
    what the force at its end is more than that at its start, which Newton's next step makes nothing.

    Marching never lets two states part (the circle is convex), so it converges; Newton's steps make it quick.
    """  # fmt: skip
    o = room.state
    look(p, arcs[0, 0], grid, room, o)
    limit = p.b * o[4]
    best, stalled, wanted, count = 1e300, 0, tolerance, 0
    for lap in range(_PERIODS):
        for i in range(count):
            old.kind[i] = pieces.kind[i]
            old.at[i] = pieces.at[i]
            old.theta[i] = pieces.theta[i]
            old.rates[i] = pieces.rates[i]
        count, g1, g2 = march(p, f1, f2, arcs, tolerance, grid, room, old, count, pieces, P)
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


@part
def settle(
    p: Planar,
    whole: bool,
    arcs: Array,
    tolerance: float,
    grid: Grid,
    room: Room,
    pieces: Pieces,
    old: Pieces,
    P: Array,
) -> tuple[int, float, float, Array, Array]:
    """The periodic state in ``pieces``: their number, ``FULL`` or ``LOST``; what remains of ``periodic``.

    A contact that never slips has one piece, of all the period, with the mean force in the place of that at the start;
    that mean is one of many: it is returned with its derivatives (2,), (2, columns); else arrays of no length.
    """  # fmt: skip
    none, nothing = np.zeros(0), np.zeros((0, 0))
    if not whole:
        count, _, _ = march(p, 0.0, 0.0, arcs, tolerance, grid, room, old, 0, pieces, P)
        return count, 0.0, 0.0, none, nothing
    o, f1, f2 = room.state, 0.0, 0.0
    look(p, 0.0, grid, room, o)
    limit, speed = p.b * o[4], np.sqrt(p.v1 * p.v1 + p.v2 * p.v2)
    if speed > 0.0:
        f1, f2 = limit * p.v1 / speed, limit * p.v2 / speed
    else:
        w1, w2 = o[0], o[1]
        least, c1, c2, dc = resting_mean(p, grid, room)
        f1, f2 = c1 + p.kt * w1, c2 + p.kt * w2
        if least <= 0.0:
            pieces.kind[0] = STICK
            pieces.at[0, 0], pieces.at[0, 1], pieces.at[0, 2], pieces.at[0, 3] = 0.0, TWO_PI, f1, f2
            return 1, 0.0, 0.0, np.array([c1, c2]), dc
        size = np.sqrt(f1 * f1 + f2 * f2)
        if size > limit:
            f1, f2 = f1 * limit / size, f2 * limit / size
    count, r1, r2 = periodic(p, arcs, f1, f2, tolerance, grid, room, pieces, old, P)
    return count, r1, r2, none, nothing


@compiled(allocates=True, nogil=True)
def run_planar(
    first: int, last: int, X: Array, par: Array, tables: Any, tolerance: float, capacity: int, outputs: Any
) -> int:
    """Elements from ``first`` to ``last``: motion (n, 3, L), parameters ``v1 v2 kt mu kn gap`` (n, 6).

    Outputs: forces (n, 3, L), derivatives (n, 3, L, 3 L + 6), scalars (n, 4): fractions of stick, slip, separation, and
    whether the mean is one of many. Returns -1, the element whose pieces do not fit, or, negative and less 2, the one
    without a periodic state. Motion that is no number has nan for an answer.
    """
    grid = Grid(*tables)
    forces, derivatives, scalars = outputs
    L, q = 2 * grid.n + 1, 3 * (2 * grid.n + 1)
    kept = q + COLUMNS - 2
    room, pieces, old, P = new_room(grid), new_pieces(capacity), new_pieces(capacity), np.zeros((2, 2))
    for e in range(first, last):
        F, dF = forces[e], derivatives[e]
        if not (np.isfinite(X[e]).all() and np.isfinite(par[e]).all()):
            F[:], dF[:], scalars[e] = np.nan, np.nan, np.nan
            continue
        F[:], dF[:], scalars[e] = 0.0, 0.0, 0.0
        p = element(X[e], par[e], grid)
        whole, arcs = contact_arcs(p, grid)
        length = normal_force(p, arcs, grid, F[2], dF[2])
        scalars[e, 2] = 1.0 - length / TWO_PI
        if arcs.shape[0] == 0 or p.mu == 0.0 or p.kt == 0.0:
            scalars[e, 1] = length / TWO_PI
            continue
        count, r1, r2, mean, dc = settle(p, whole, arcs, tolerance, grid, room, pieces, old, P)
        if count == FULL:
            return e
        if count == LOST:
            return -2 - e
        if mean.size > 0:
            for r in range(2):
                x = p.X1 if r == 0 else p.X2
                F[r, 0] = mean[r]
                for i in range(1, L):
                    F[r, i] = p.kt * x[i]
                    dF[r, i, r * L + i] = p.kt
                    dF[r, i, q + KT] = x[i]
                for j in range(kept):
                    dF[r, 0, j] = dc[r, j]
            scalars[e, 0], scalars[e, 3] = 1.0, 1.0
            continue
        G, dG, D = differentiate(p, pieces, count, arcs, grid, room)
        a, b, c, d = 1.0 - D[0, kept], -D[0, kept + 1], -D[1, kept], 1.0 - D[1, kept + 1]
        det = a * d - b * c
        for j in range(kept):
            s1, s2 = 0.0, 0.0
            if whole and det != 0.0:
                s1, s2 = (d * D[0, j] - b * D[1, j]) / det, (a * D[1, j] - c * D[0, j]) / det
            for r in range(2):
                for i in range(L):
                    dF[r, i, j] = dG[r, i, j] + dG[r, i, kept] * s1 + dG[r, i, kept + 1] * s2
        s1, s2 = 0.0, 0.0
        if whole and det != 0.0:
            s1, s2 = (d * r1 - b * r2) / det, (a * r2 - c * r1) / det
        for r in range(2):
            for i in range(L):
                F[r, i] = G[r, i] + dG[r, i, kept] * s1 + dG[r, i, kept + 1] * s2
        stick = 0.0
        for i in range(count):
            if pieces.kind[i] == STICK:
                stick += pieces.at[i, 1] - pieces.at[i, 0]
        scalars[e, 0] = stick / TWO_PI
        scalars[e, 1] = max(length - stick, 0.0) / TWO_PI
    return -1


@compiled(allocates=True, nogil=True)
def trace(X: Array, par: Array, tables: Any, tolerance: float, capacity: int) -> Any:
    """Pieces of an element's period (motion (3, L), parameters (6,)): their number, kinds, ``at``, angles at the nodes.

    None of a contact that is open, or has no friction; the arcs of contact come last.
    """
    grid = Grid(*tables)
    p = element(X, par, grid)
    whole, arcs = contact_arcs(p, grid)
    pieces, count = new_pieces(capacity), 0
    if arcs.shape[0] > 0 and p.mu > 0.0 and p.kt > 0.0:
        old, P = new_pieces(capacity), np.zeros((2, 2))
        count, _, _, _, _ = settle(p, whole, arcs, tolerance, grid, new_room(grid), pieces, old, P)
    return count, pieces.kind, pieces.at[:, :5], pieces.theta, arcs


@part
def element(X: Array, par: Array, grid: Grid) -> Planar:
    """One element: the tangential means do not matter."""
    X1, X2, Y = X[0].copy(), X[1].copy(), X[2].copy()
    X1[0], X2[0] = 0.0, 0.0
    Y[0] -= par[5]
    series = np.zeros((grid.n, 12))
    for j in range(grid.n):
        i, m, a = 2 * j + 1, grid.orders[j], series[j]
        a[0], a[1], a[2], a[3], a[4], a[5] = m * X1[i + 1], m * X2[i + 1], Y[i], m * Y[i + 1], X1[i], X2[i]
        a[6], a[7], a[8], a[9], a[10], a[11] = -m * X1[i], -m * X2[i], Y[i + 1], -m * Y[i], X1[i + 1], X2[i + 1]
    return Planar(X1, X2, Y, par[0], par[1], par[2], par[3], par[4], par[3] * par[4], series)


@part
def normal_force(p: Planar, arcs: Array, grid: Grid, F: Array, dF: Array) -> float:
    """Normal force (L,) and its derivatives (L, columns); returns the length of contact."""
    L = 2 * grid.n + 1
    q = 3 * L
    W, edge = np.zeros((L, L)), np.zeros((2, 2, grid.top + 4))
    C, S, length = np.zeros(grid.top + 4), np.zeros(grid.top + 4), 0.0
    for k in range(arcs.shape[0]):
        length += arcs[k, 1] - arcs[k, 0]
        if arcs[k, 2] < 0.5:
            for end in range(2):
                powers(arcs[k, end], grid.top, edge[end, 0], edge[end, 1])
            for i in range(grid.top):
                C[i] += (edge[1, 1, i] - edge[0, 1, i]) / (i + 1.0)
                S[i] += (edge[0, 0, i] - edge[1, 0, i]) / (i + 1.0)
    if length == 0.0:
        return 0.0
    fill_matrix(length, C, S, grid, W)
    for i in range(L):
        for j in range(L):
            dF[i, 2 * L + j] = p.kn * W[i, j]
            dF[i, q + KN] += W[i, j] * p.Y[j]
        F[i] = p.kn * dF[i, q + KN]
        dF[i, q + GAP] = -p.kn * W[i, 0]
    return length


def angle_within(first: float, theta: Array, way: Array, kind: int) -> Array:
    """Angles at parts ``way`` (0 to 1) of a piece of slip: the polynomial through its start and its nodes."""
    if kind == LAST_SLIP:
        return np.full(way.shape, first)
    nodes, angles = np.concatenate([[0.0], _C]), np.concatenate([[first], theta])
    powers_of = np.vander(nodes, increasing=True)
    return np.asarray(np.vander(way, nodes.size, increasing=True) @ np.linalg.solve(powers_of, angles), dtype=float)
