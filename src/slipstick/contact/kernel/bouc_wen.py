"""The Bouc-Wen element along a periodic motion: one pass over the period, exact but for a fourth-order step in motion.

``dz/dw = 1 - |z|^n (beta sign(w' z) + gamma)``: the law does not know how fast it is moved. Between reversals z is a
function of the way made since, ``z = Z(w - w_r, z_r)``, so ``dz = (dz/dw) dw(tau) + E c`` with a constant c for each
way and ``E = dZ/dz_r``: the derivatives by all coefficients take two numbers of the march.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.contact.kernel.velocity_friction import (
    _CELLS,
    _START,
    _W,
    _W1,
    NODES,
    TABLE,
    TWO_PI,
    WEIGHTS,
    add_motion,
    breakpoints,
    motion_at,
)
from slipstick.trig.compiled import compiled, part
from slipstick.typing import Array

_STEP = 0.02
"""Way of a step of the march, over the way in which z saturates."""
_PANEL = 2.0
"""Largest way of a panel of integration, likewise, and its length in radians of the highest harmonic."""
_SATURATED, _PERIODIC, _NONE = 1e-14, 1e-14, 1e-12
_MOST = 60


@part
def slopes(y: Array, sigma: float, s: float, p: Array, out: Array) -> None:
    """Derivatives of ``z, E, dz/dbeta, dz/dgamma, dz/dn`` by the way made in the direction s, z on the side sigma."""
    beta, gamma, n = p[0], p[1], p[2]
    size = max(0.0, sigma * y[0])
    power = size**n if size > 0.0 else 0.0
    q = beta * sigma + gamma * s
    by_z = -q * n * sigma * (1.0 if n == 1.0 else power / size if size > 0.0 else 0.0)
    out[0] = s - q * power
    out[1] = by_z * y[1]
    out[2] = by_z * y[2] - sigma * power
    out[3] = by_z * y[3] - s * power
    out[4] = by_z * y[4] - (q * power * np.log(size) if size > 0.0 else 0.0)


@part
def side_of(z: float, s: float) -> float:
    """The side that z is on, or goes to."""
    return 1.0 if z > 0.0 else -1.0 if z < 0.0 else s


@part
def step(y: Array, way: float, s: float, p: Array, k: Any, out: Array) -> None:
    """One step of the classical Runge-Kutta method."""
    a, b, c, d, at = k
    sigma = side_of(y[0], s)
    slopes(y, sigma, s, p, a)
    at[:] = y + 0.5 * way * a
    slopes(at, sigma, s, p, b)
    at[:] = y + 0.5 * way * b
    slopes(at, sigma, s, p, c)
    at[:] = y + way * c
    slopes(at, sigma, s, p, d)
    out[:] = y + way / 6.0 * (a + 2.0 * b + 2.0 * c + d)


@part
def advance(y: Array, way: float, s: float, p: Array, k: Any, new: Array) -> None:
    """Carry ``y`` along a way without reversal; steps end where z changes its sign, at the corner of the law."""
    largest = (p[0] + p[1]) ** (-1.0 / p[2])
    rate = max(1.0, p[2]) / largest
    left = way
    while left > 0.0:
        if abs(s * largest - y[0]) <= _SATURATED * largest:
            y[0], y[1] = s * largest, 0.0
            y[2] = -s * largest / (p[2] * (p[0] + p[1]))
            y[3] = y[2]
            y[4] = -y[0] * np.log(largest) / p[2]
            return
        now = min(left, _STEP / rate)
        step(y, now, s, p, k, new)
        if y[0] * new[0] < 0.0:
            first, last, before, after = 0.0, now, y[0], new[0]
            for _ in range(20):
                now = last - after * (last - first) / (after - before)
                step(y, now, s, p, k, new)
                if abs(new[0]) <= 1e-16 * largest or now in (first, last):
                    break
                if new[0] * before > 0.0:
                    first, before = now, new[0]
                else:
                    last, after = now, new[0]
            new[0] = 0.0
        y[:] = new
        left -= now
        if now < 1e-15 * way:
            return


@part
def ways(X: Array, m: Array, v: float, k: Any, times: Array) -> Array:
    """Phases at which the ways of a period begin and end: its reversals; without any, where it is cut."""
    kinds, still = np.empty(times.size, np.int64), np.zeros(X.size)
    e = (X, still, m, TABLE, np.zeros(2), v, 1.0, 1.0, 1.0, 1.0)
    highest = max(1.0, m[-1]) if m.size else 1.0
    count = breakpoints(np.zeros(1), e, int(np.ceil(TWO_PI * _CELLS * highest)), k, times, kinds)
    out = np.empty(max(count, 1) + 1)
    out[0] = times[0] if count else _START
    out[:count] = times[:count]
    out[-1] = out[0] + TWO_PI
    return out


@part
def tangent(z: float, s: float, p: Array) -> float:
    """``dz`` by the way made in the direction s."""
    sigma = side_of(z, s)
    return s - (p[0] * sigma + p[1] * s) * abs(z) ** p[2]


@part
def kept_of(z: float, begun: float, integrated: float, s: float, p: Array) -> float:
    """``dz/dz_r``: the tangent over the one after the reversal, which is at least 1 there."""
    first = tangent(begun, s, p)
    return tangent(z, s, p) / first if s * first > 0.5 else integrated


@part
def moved(a: float, b: float, X: Array, m: Array, v: float, at: Array) -> float:
    """The way between two phases."""
    motion_at(a, X, X, m, v, at)
    w = at[_W]
    motion_at(b, X, X, m, v, at)
    return at[_W] - w


@part
def periodic(
    X: Array, m: Array, v: float, p: Array, edges: Array, now: Array, k: Any, new: Array
) -> tuple[float, float]:
    """z at the cut, and how much of a change of it is left after a period; Newton's method on the map of a period."""
    z, y, kept = 0.0, np.zeros(5), 1.0
    largest = (p[0] + p[1]) ** (-1.0 / p[2])
    for _ in range(_MOST):
        y[:] = 0.0
        y[0], kept = z, 1.0
        for i in range(edges.size - 1):
            way = moved(edges[i], edges[i + 1], X, m, v, now)
            y[1], s, begun = 1.0, 1.0 if way > 0.0 else -1.0, y[0]
            advance(y, abs(way), s, p, k, new)
            kept *= kept_of(y[0], begun, y[1], s, p)
        change = y[0] - z
        if 1.0 - kept < _NONE:
            return 0.0, 1.0
        z = min(largest, max(-largest, z + change / (1.0 - kept)))
        if abs(change) <= _PERIODIC * largest:
            break
    return z, kept


@part
def crossing(
    y: Array, t: float, h: float, s: float, X: Array, m: Array, v: float, p: Array, now: Array, k: Any, new: Array
) -> float:
    """How far of a panel z keeps its side."""
    trial = y.copy()
    advance(trial, abs(moved(t, t + h, X, m, v, now)), s, p, k, new)
    if trial[0] * y[0] >= 0.0:
        return h
    first, last, before, after = 0.0, h, y[0], trial[0]
    for i in range(80):
        at = last - after * (last - first) / (after - before)
        if i % 3 == 2 or not first < at < last:
            at = 0.5 * (first + last)
        trial[:] = y
        advance(trial, abs(moved(t, t + at, X, m, v, now)), s, p, k, new)
        if trial[0] * y[0] > 0.0:
            first, before = at, trial[0]
        else:
            last, after = at, trial[0]
        if last - first < 1e-14 or trial[0] == 0.0:
            break
    return last


@part
def evaluate(X: Array, m: Array, v: float, p: Array, f: Array, by: Array, rule: Any) -> float:
    """Coefficients of z, their derivatives (L, L + 4) by X, the drift, beta, gamma, n; the work over 2 pi of ``z``."""
    nodes, weights = rule
    L = 2 * m.size + 1
    G = L + 4
    now, times = np.empty(5), np.empty(64 * (int(max(1.0, m[-1]) if m.size else 1) + 1))
    k, scratch = (now, np.empty(2), np.empty(5)), (np.empty(5), np.empty(5), np.empty(5), np.empty(5), np.empty(5))
    new, y, work = np.empty(5), np.zeros(5), 0.0
    edges = ways(X, m, v, k, times)
    z, kept = periodic(X, m, v, p, edges, now, scratch, new)
    held, left = kept >= 1.0, np.zeros(L)
    c, wave = np.zeros(G), np.empty(L)
    f[:], by[:] = 0.0, 0.0
    so_far, slope = 1.0, 0.0
    largest = (p[0] + p[1]) ** (-1.0 / p[2])
    rate = max(1.0, p[2]) / largest
    longest = _PANEL / (max(1.0, m[-1]) if m.size else 1.0)
    y[0] = z
    for i in range(edges.size - 1):
        a, b = edges[i], edges[i + 1]
        s = 1.0 if moved(a, b, X, m, v, now) > 0.0 else -1.0
        y[1:] = 0.0
        y[1] = 1.0
        begun = y[0]
        # c = dz - (dz/dw) dw where the way begins: the tangent jumps there
        wave[:] = 0.0
        add_motion(slope - s * tangent(y[0], s, p), a, m, wave)
        c[:L] += wave
        c[L] += (slope - s * tangent(y[0], s, p)) * a
        t = a
        while t < b:
            h = min(longest, b - t)
            while abs(s * largest - y[0]) > _SATURATED * largest and h > 1e-12:
                if abs(moved(t, t + h, X, m, v, now)) * rate <= _PANEL:
                    break
                h *= 0.5
            h = b - t if b - t - h < 1e-13 else h
            if y[0] * s < 0.0:  # a panel ends at the corner of the law
                h = crossing(y, t, h, s, X, m, v, p, now, scratch, new)
            last = t
            for r in range(nodes.size + 1):
                tau = t + h if r == nodes.size else t + 0.5 * h * (1.0 + nodes[r])
                advance(y, abs(moved(last, tau, X, m, v, now)), s, p, scratch, new)
                last = tau
                if r == nodes.size:
                    break
                motion_at(tau, X, X, m, v, now)
                g, kept_here = s * tangent(y[0], s, p), kept_of(y[0], begun, y[1], s, p)
                share = 0.5 * h * weights[r] / np.pi
                wave[:] = 0.0
                add_motion(1.0, tau, m, wave)
                work += 0.5 * share * y[0] * now[_W1]
                for j in range(L):
                    part = share * wave[j] * (0.5 if j == 0 else 1.0)
                    f[j] += part * y[0]
                    left[j] += part * kept_here * so_far
                    for col in range(L):
                        by[j, col] += part * (g * wave[col] + kept_here * c[col])
                    by[j, L] += part * (g * tau + kept_here * c[L])
                    for q in range(3):
                        by[j, L + 1 + q] += part * (y[2 + q] + kept_here * c[L + 1 + q])
            t += h
        slope, kept_here = s * tangent(y[0], s, p), kept_of(y[0], begun, y[1], s, p)
        c *= kept_here
        c[L + 1 :] += y[2:]
        so_far *= kept_here
    # a change of z at the cut comes back with its own
    dz = np.zeros(G)
    if held:  # without a reversal any mean repeats: none
        add_motion(1.0, edges[0], m, dz[:L])
        dz[0] = 0.0
    else:
        wave[:] = 0.0
        add_motion(slope, edges[0], m, wave)
        dz[:] = c
        dz[:L] += wave
        dz[L] += slope * edges[-1]
        dz /= 1.0 - kept
    for j in range(L):
        for col in range(G):
            by[j, col] += left[j] * dz[col]
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
        now, times = np.empty(5), np.empty(64 * (int(max(1.0, m[-1]) if m.size else 1) + 1))
        k, scratch = (now, np.empty(2), np.empty(5)), (np.empty(5), np.empty(5), np.empty(5), np.empty(5), np.empty(5))
        new, y = np.empty(5), np.zeros(5)
        edges = ways(X[i], m, v[i], k, times)
        y[0], _ = periodic(X[i], m, v[i], p[i], edges, now, scratch, new)
        t, at = edges[0], np.searchsorted(tau, edges[0])
        done = 0
        for e in range(1, edges.size):
            while t < edges[e] or done < tau.size:
                j = (at + done) % tau.size
                phase = tau[j] if at + done < tau.size else tau[j] + TWO_PI
                take = done < tau.size and (phase <= edges[e] or e == edges.size - 1)
                end = phase if take else edges[e]
                way = moved(t, end, X[i], m, v[i], now)
                advance(y, abs(way), 1.0 if way > 0.0 else -1.0, p[i], scratch, new)
                t = end
                if not take:
                    break
                out[i, j] = y[0]
                done += 1


START, RULE = _START, (NODES, WEIGHTS)
