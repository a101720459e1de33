"""The Bouc-Wen element along a periodic motion: a march over the period in steps with an error tolerance.

``dz/dw = 1 - |z|^n (beta sign(w' z) + gamma)``: the law does not depend on the velocity. Between reversals z is a
function of the path since the last one, ``z = Z(w - w_r, z_r)``. So ``dz = (dz/dw) dw(tau) + E c`` with a constant c
for each path and ``E = dZ/dz_r``: the derivatives by all coefficients follow from two numbers of the march.

Loading has the scale ``(beta + gamma)^(-1/n)``, unloading ``1 / (n (beta - gamma) |z|^(n - 1))``, and where n is no
integer ``|z|^n`` is not smooth at ``z = 0``: three scales, each of which may be by far the smallest. For small motions
``z - w`` is small and decides the mean, so it is integrated separately.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from slipstick.contact.kernel.velocity_friction import (
    _CELLS,
    _START,
    _W1,
    NODES,
    TABLE,
    TWO_PI,
    WEIGHTS,
    Element,
    Workspace,
    add_motion,
    breakpoints,
    motion_at,
)
from slipstick.trig.compiled import compiled, part
from slipstick.typing import Array

_TOLERANCE = 1e-11
"""Error of a step, relative to what it is an error of."""
_ROUNDING = 1e-14
"""Error of a step by rounding, relative to the slope."""
_WILD = 1e3
"""Stiffness lost while loading, over that at the beginning, from which the stages of a step are useless."""
_SATURATED = 1e-14
"""Distance of z from its largest value, relative to that, at which the remaining way is an exponential."""
_ZERO = 1e-15
"""z over its largest value that counts as zero in the march."""

_PERIODIC = 1e-13
"""Error of a periodic z, over the range of the motion, at which Newton's method ends."""
_MOST, _MOST_STEPS = 100, 100_000
"""Periods of Newton's method; steps of a way, and panels of it: beyond them the force is not a number."""

_PANEL = 2.0
"""Largest way of a panel of integration over the shortest scale, and its length in radians of the highest harmonic."""
_NEAR = 0.25
"""Part of that for a panel that begins or ends where ``|z|^n`` is not smooth, whose nodes crowd there."""
_AT_CORNER = 1e-11
"""z over its largest value that counts as zero to the panels: the march is no better."""

_Z, _LOG, _D, _BETA, _GAMMA, _N = range(6)
"""State of the march: z, the logarithm of E, ``z - w`` since it began, and derivatives of z by beta, gamma, n."""
_A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
_E = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
"""Method of J. R. Dormand and P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19, and the error of its steps."""


class March(NamedTuple):
    """Arrays of the march that functions overwrite."""

    K: Array
    """Slopes at the stages of a step, (7, 6)."""
    at: Array
    """State at the end of a step, (6,)."""
    error: Array
    """Errors of a step that are allowed, (6,)."""
    scale: Array
    """Length of the next step, and largest z there can be, (2,)."""


@part
def slopes(y: Array, sigma: float, s: float, p: Array, full: bool, whole: bool, out: Array) -> None:
    """Derivatives of the state by the path in the direction s, with the sign sigma of z.

    ``whole``: for derivatives by parameters over E instead, whose rates are as smooth as that of z.
    """
    n, size = p[2], max(0.0, sigma * y[_Z])
    q = p[0] * sigma + p[1] * s
    power, lower, log = 0.0, 1.0 if n == 1.0 else 0.0, 0.0
    if size > 0.0:
        if n == 1.0:
            power = size
            log = np.log(size) if full else 0.0
        else:
            log = np.log(size)
            power = np.exp(n * log)
            lower = power / size
    by_z = -q * n * sigma * lower
    out[_Z], out[_LOG], out[_D] = s - q * power, by_z, -q * power
    if not full:
        return
    if whole:
        share = power / (1.0 - s * q * power)
        out[_BETA], out[_GAMMA], out[_N] = -sigma * share, -s * share, -q * share * log
    else:
        out[_BETA] = by_z * y[_BETA] - sigma * power
        out[_GAMMA] = by_z * y[_GAMMA] - s * power
        out[_N] = by_z * y[_N] - q * power * log


@part
def side_of(z: float, s: float) -> float:
    """Sign of z, or of its change where z is zero."""
    return 1.0 if z > 0.0 else -1.0 if z < 0.0 else s


@part
def share_lost(z: float, s: float, p: Array) -> float:
    """``1 - |dz/dw|`` in the direction s."""
    return (p[0] * s * side_of(z, s) + p[1]) * abs(z) ** p[2]


@part
def allowed(reach: float, small: bool, p: Array, out: Array) -> None:
    """Error tolerances of a step for each number of the state; ``reach`` is the largest possible z."""
    n, most = p[2], p[0] + abs(p[1])
    power = reach**n
    lost = min(1.0, most * power)
    out[_Z] = _TOLERANCE * reach * (lost if small else 1.0) + 1e-300
    out[_LOG] = _TOLERANCE
    out[_BETA] = _TOLERANCE * reach * power / n + 1e-300
    out[_GAMMA] = out[_BETA]
    out[_N] = _TOLERANCE * reach * lost * (1.0 / n + abs(np.log(reach))) + 1e-300
    out[_D] = out[_Z]


@part
def march_step(y: Array, now: float, sigma: float, s: float, p: Array, march: March, full: bool, whole: bool) -> float:
    """One step from ``y``, whose slopes are the first row of K, to ``at``; its error over what is allowed."""
    K, at, error = march.K, march.at, march.error
    for r in range(1, 7):
        for i in range(6 if full else 3):
            total = 0.0
            for c in range(r):
                total += _A[r, c] * K[c, i]
            at[i] = y[i] + now * total
        slopes(at, sigma, s, p, full, whole, K[r])
        if sigma == s and not -s * K[r, _D] < _WILD:  # its power, or that of the next stage, may overflow
            return np.inf
    if not -s * K[6, _D] < (1.0 if whole else 2.0):  # far beyond the limit of z
        return np.inf
    worst = 0.0
    for i in range(_LOG if not whole else _D, 6 if full else 3):
        total = 0.0
        for c in range(7):
            total += _E[c] * K[c, i]
        share = abs(now * total) / (error[i] + _ROUNDING * abs(now * K[0, i]))
        if not share <= 1e300:
            return np.inf
        worst = max(worst, share)
    return worst


@part
def advance(y: Array, way: float, s: float, p: Array, march: March, full: bool, stop: bool) -> float:
    """Integrate ``y`` along a path without reversal, with ``stop`` up to where z becomes zero; the rest of the path."""
    K, at, scale = march.K, march.at, march.scale
    n, largest = p[2], (p[0] + p[1]) ** (-1.0 / p[2])
    left, fresh, made = way, True, 0
    while left > 0.0:
        made += 1
        if abs(s * largest - y[_Z]) <= _SATURATED * largest:
            y[_D] += s * largest - y[_Z] - s * left
            y[_LOG] -= n / largest * left
            y[_Z], kept_here = s * largest, np.exp(-n / largest * left)
            by_beta, by_n = -y[_Z] / (n * (p[0] + p[1])), -y[_Z] * np.log(largest) / n
            y[_BETA] = by_beta + kept_here * (y[_BETA] - by_beta)
            y[_GAMMA] = by_beta + kept_here * (y[_GAMMA] - by_beta)
            y[_N] = by_n + kept_here * (y[_N] - by_n)
            return 0.0
        sigma, size, now = side_of(y[_Z], s), abs(y[_Z]), min(left, scale[0])
        lost = share_lost(y[_Z], s, p) if fresh else -s * K[0, _D]
        whole = lost <= 0.5
        if sigma != s:
            if size <= _ZERO * scale[1]:
                y[_Z], fresh = 0.0, True
                left -= min(left, size)
                if stop:
                    return left
                continue
            now = min(now, to_zero(size, lost))
        elif not whole:  # longer steps would oscillate about the limit of z
            now = min(now, largest / n)
        if full and whole:
            for i in range(_BETA, 6):
                y[i] /= 1.0 - lost
        if fresh:
            slopes(y, sigma, s, p, full, whole, K[0])
        longest = now
        worst = march_step(y, now, sigma, s, p, march, full, whole)
        while worst > 1.0 and now > 1e-12 * longest:
            now *= max(0.1, 0.9 * worst**-0.2)
            worst = march_step(y, now, sigma, s, p, march, full, whole)
        proposed = now * min(5.0, 0.9 * max(worst, 1e-9) ** -0.2)
        if now < longest or proposed > scale[0]:
            scale[0] = proposed
        z = at[_Z]
        if made > _MOST_STEPS or not abs(z) <= 1e300:
            y[:] = np.nan
            return 0.0
        after = -s * K[6, _D]
        y[_D] = at[_D]
        y[_LOG] = y[_LOG] + np.log1p(-after) - np.log1p(-lost) if whole else at[_LOG]
        y[_Z] = z
        if full:
            for i in range(_BETA, 6):
                y[i] = at[i] * (1.0 - after) if whole else at[i]
        left -= now
        if stop and z * s >= 0.0:
            return left
        # the slopes at the end of the step are those at the beginning of the next one
        fresh = side_of(z, s) != sigma or (after <= 0.5) != whole
        if not fresh:
            K[0, :] = K[6, :]
    return left


@part
def to_zero(size: float, lost: float) -> float:
    """Path on which z unloads to zero, or a little less; exact for n = 1."""
    return size * (np.log1p(-lost) / -lost if lost < -1e-8 else 1.0)


@part
def moving(X: Array, m: Array, v: float) -> tuple[Element, Workspace]:
    """The motion as an element without normal motion, and arrays for its search."""
    e = Element(X, np.zeros(X.size), m, TABLE, np.zeros(2), v, 1.0, 1.0, 1.0, 1.0)
    return e, Workspace(np.empty(5), np.empty(2), np.empty(5))


@part
def ways(e: Element, work: Workspace, times: Array) -> Array:
    """Phases of the reversals in a period, between which paths run; without any, the phase at which it begins."""
    kinds = np.empty(times.size, np.int64)
    highest = max(1.0, e.m[-1]) if e.m.size else 1.0
    count = breakpoints(np.zeros(1), e, int(np.ceil(TWO_PI * _CELLS * highest)), work, times, kinds)
    out = np.empty(max(count, 1) + 1)
    out[0] = times[0] if count else _START
    out[:count] = times[:count]
    out[-1] = out[0] + TWO_PI
    return out


@part
def tangent(z: float, s: float, p: Array) -> float:
    """``dz/dw`` in the direction s."""
    return 1.0 - share_lost(z, s, p)


@part
def moved(a: float, b: float, X: Array, m: Array, v: float) -> float:
    """Path between two phases, with a small relative error."""
    middle, half, way = 0.5 * (a + b), 0.5 * (b - a), v * (b - a)
    for j in range(m.size):
        wave = X[2 * j + 2] * np.cos(m[j] * middle) - X[2 * j + 1] * np.sin(m[j] * middle)
        way += 2.0 * np.sin(m[j] * half) * wave
    return way


@part
def periodic(X: Array, m: Array, v: float, p: Array, edges: Array, march: March, y: Array) -> tuple[float, bool]:
    """z at the start of the period, and whether the motion is small; Newton on the period map, between bounds."""
    largest = (p[0] + p[1]) ** (-1.0 / p[2])
    count = edges.size - 1
    lengths, at, low, high = np.empty(count), 0.0, 0.0, 0.0
    for i in range(count):
        lengths[i] = moved(edges[i], edges[i + 1], X, m, v)
        at += lengths[i]
        low, high = min(low, at), max(high, at)
    small = high - low < largest
    reach = min(largest, high - low)
    most = reach if v == 0.0 else largest
    z = -0.5 * (low + high)
    if v != 0.0 and count == 1:
        z = largest if lengths[0] > 0.0 else -largest
    z, below, above = min(most, max(-most, z)), -most, most
    scale = march.scale
    allowed(reach, small, p, march.error)
    scale[0], scale[1] = reach, reach
    for _ in range(_MOST):
        y[:] = 0.0
        y[_Z] = z
        for i in range(count):
            s = 1.0 if lengths[i] > 0.0 else -1.0
            advance(y, abs(lengths[i]), s, p, march, False, False)
        change, gap = y[_D] + TWO_PI * v if small else y[_Z] - z, -np.expm1(y[_LOG])
        if change == 0.0 or gap <= 0.0:
            break
        if change > 0.0:
            below = z
        else:
            above = z
        better = z + change / gap
        if not below <= better <= above:
            better = 0.5 * (below + above)
        step = abs(better - z)
        z = better
        if step * step * p[2] <= _PERIODIC * reach * reach:  # of which Newton's method leaves this
            break
    return z, small


@part
def phase_of(way: float, t: float, h: float, X: Array, m: Array, v: float) -> float:
    """Phase after t at which a path is completed, at most h."""
    first, last, before, after = 0.0, h, -way, abs(moved(t, t + h, X, m, v)) - way
    for i in range(80):
        at = last - after * (last - first) / (after - before)
        if i % 3 == 2 or not first < at < last:
            at = 0.5 * (first + last)
        now = abs(moved(t, t + at, X, m, v)) - way
        if now < 0.0:
            first, before = at, now
        else:
            last, after = at, now
        if last - first < 1e-14 or now == 0.0:
            break
    return last


@part
def over_shortest(z: float, unloads: bool, way: float, s: float, p: Array) -> float:
    """Length of a path over the shortest scale of z along twice that path."""
    size, n = abs(z), p[2]
    if unloads:
        gained = (p[0] - p[1]) * size**n
        # for large n the rule does not resolve |z|^n, however small it is
        return way * n / size * (max(1.0, gained) if n > 4.0 and gained > 1e-9 else gained)
    largest = (p[0] + p[1]) ** (-1.0 / n)
    if abs(s * largest - z) <= _SATURATED * largest:
        return 0.0
    return way * n / largest * (min(1.0, (size + 2.0 * way) / largest) ** (n - 1.0) if n > 1.0 else 1.0)


@part
def evaluate(X: Array, m: Array, v: float, p: Array, f: Array, by: Array, rule: Any) -> float:
    """Coefficients of z, their derivatives (L, L + 4) by X, the drift, beta, gamma, n; the work over 2 pi of ``z``."""
    nodes, weights = rule
    L = 2 * m.size + 1
    G = L + 4
    times = np.empty(64 * (int(max(1.0, m[-1]) if m.size else 1) + 1))
    march = March(np.empty((7, 6)), np.empty(6), np.empty(6), np.empty(2))
    y, trial, work = np.zeros(6), np.zeros(6), 0.0
    element, space = moving(X, m, v)
    edges = ways(element, space, times)
    z, small = periodic(X, m, v, p, edges, march, trial)
    reach, returned = march.scale[1], np.zeros(L)
    c, wave = np.zeros(G), np.empty(L)
    f[:], by[:] = 0.0, 0.0
    so_far, lost = 0.0, 0.0
    longest = _PANEL / (max(1.0, m[-1]) if m.size else 1.0)
    rough = p[2] != np.floor(p[2])
    y[_Z] = z
    for i in range(edges.size - 1):
        a, b = edges[i], edges[i + 1]
        s = 1.0 if moved(a, b, X, m, v) > 0.0 else -1.0
        y[_LOG], y[_BETA], y[_GAMMA], y[_N] = 0.0, 0.0, 0.0, 0.0
        # c = dz - (dz/dw) dw where the path begins: the tangent jumps there
        jump = share_lost(y[_Z], s, p) - lost
        wave[:] = 0.0
        add_motion(jump, a, m, wave)
        c[:L] += wave
        c[L] += jump * a
        t, made = a, 0
        while t < b:
            made += 1
            if made > _MOST_STEPS or not abs(y[_Z]) <= 1e300:
                f[:], by[:] = np.nan, np.nan
                return np.nan
            h = min(longest, b - t)
            way = abs(moved(t, t + h, X, m, v))
            size, unloads = abs(y[_Z]), y[_Z] * s < 0.0 and abs(y[_Z]) > _AT_CORNER * reach
            to_corner = to_zero(size, share_lost(y[_Z], s, p)) if unloads else 0.0
            crowd = 0
            while h > 1e-12:
                scales = over_shortest(y[_Z], unloads, way, s, p)
                crowd = 0
                if rough and not unloads and size < _NEAR * way:
                    crowd = 1
                elif rough and unloads and to_corner < (1.0 + _NEAR) * way:
                    crowd = 2
                if scales <= _PANEL and (crowd == 0 or (scales <= _NEAR * _PANEL and h <= _NEAR * longest)):
                    break
                h *= 0.5
                way = abs(moved(t, t + h, X, m, v))
            h = b - t if b - t - h < 1e-13 else h
            if unloads and to_corner <= way:  # a panel ends at the corner of the law
                trial[:] = y
                rest = advance(trial, way, s, p, march, False, True)
                if rest > 0.0:
                    h = max(phase_of(way - rest, t, h, X, m, v), 1e-14)
            last = t
            for r in range(nodes.size + 1):
                tau, share = t + h, 0.0
                if r < nodes.size:
                    x = 0.5 * (1.0 + nodes[r])
                    share = 0.5 * h * weights[r] / np.pi
                    if crowd == 1:
                        share *= 3.0 * x * x
                        x = x * x * x
                    elif crowd == 2:
                        share *= 3.0 * (1.0 - x) * (1.0 - x)
                        x = 1.0 - (1.0 - x) * (1.0 - x) * (1.0 - x)
                    tau = t + h * x
                advance(y, abs(moved(last, tau, X, m, v)), s, p, march, True, False)
                last = tau
                if r == nodes.size:
                    break
                motion_at(tau, element, space.motion)
                g, kept_here = tangent(y[_Z], s, p), np.exp(y[_LOG])
                wave[:] = 0.0
                add_motion(1.0, tau, m, wave)
                work += 0.5 * share * (y[_D] if small and v == 0.0 else y[_Z]) * space.motion[_W1]
                for j in range(L):
                    part = share * wave[j] * (0.5 if j == 0 else 1.0)
                    f[j] += part * y[_Z]
                    returned[j] += part * kept_here * np.exp(so_far)
                    for col in range(L):
                        by[j, col] += part * (g * wave[col] + kept_here * c[col])
                    by[j, L] += part * (g * tau + kept_here * c[L])
                    for q in range(3):
                        by[j, L + 1 + q] += part * (y[_BETA + q] + kept_here * c[L + 1 + q])
            t += h
        lost = share_lost(y[_Z], s, p)
        c *= np.exp(y[_LOG])
        c[L + 1 :] += y[_BETA:]
        so_far += y[_LOG]
    # a change of z at the start returns with its own
    wave[:] = 0.0
    add_motion(lost, edges[-1], m, wave)
    c[:L] -= wave
    c[L] += TWO_PI - lost * edges[-1]
    if so_far >= 0.0:  # any mean is periodic: the motion is centred
        c[:] = 0.0
        at_cut, low, high = 0.0, 0.0, 0.0
        first, other = edges[0], edges[0]
        for i in range(edges.size - 1):
            at_cut += moved(edges[i], edges[i + 1], X, m, v)
            if at_cut < low:
                low, first = at_cut, edges[i + 1]
            if at_cut > high:
                high, other = at_cut, edges[i + 1]
        add_motion(-0.5, first, m, c[:L])
        add_motion(-0.5, other, m, c[:L])
    else:
        c /= -np.expm1(so_far)
    for j in range(L):
        for col in range(G):
            by[j, col] += returned[j] * c[col]
    return work


@compiled(allocates=True, nogil=True)
def run(X: Array, m: Array, v: Array, p: Array, rule: Any, f: Array, by: Array, work: Array) -> None:
    """``evaluate`` of n elements; rows of p: beta, gamma, n."""
    for i in range(len(X)):
        work[i] = evaluate(X[i], m, v[i], p[i], f[i], by[i], rule)


@compiled(allocates=True, nogil=True)
def path(X: Array, m: Array, v: Array, p: Array, tau: Array, out: Array) -> None:
    """z of n elements at phases that increase from ``_START`` on within a period."""
    for i in range(len(X)):
        times = np.empty(64 * (int(max(1.0, m[-1]) if m.size else 1) + 1))
        march = March(np.empty((7, 6)), np.empty(6), np.empty(6), np.empty(2))
        y = np.zeros(6)
        element, space = moving(X[i], m, v[i])
        edges = ways(element, space, times)
        z, _ = periodic(X[i], m, v[i], p[i], edges, march, y)
        y[:] = 0.0
        y[_Z] = z
        t, at = edges[0], np.searchsorted(tau, edges[0])
        done = 0
        for e in range(1, edges.size):
            while t < edges[e] or done < tau.size:
                j = (at + done) % tau.size
                phase = tau[j] if at + done < tau.size else tau[j] + TWO_PI
                take = done < tau.size and (phase <= edges[e] or e == edges.size - 1)
                end = phase if take else edges[e]
                way = moved(t, end, X[i], m, v[i])
                advance(y, abs(way), 1.0 if way > 0.0 else -1.0, p[i], march, False, False)
                t = end
                if not take:
                    break
                out[i, j] = y[_Z]
                done += 1


START, RULE = _START, (NODES, WEIGHTS)
