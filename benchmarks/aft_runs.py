"""The best form of a sampled friction element that we know: the derivative of a run of samples in one state is a
difference of prefix sums.

The motion is sampled, the force marched from sample to sample, and its samples fall into runs: stuck, slipping, open.
Over a run ``sum H_i H_i^T`` is made of ``sum cos k t_i`` and ``sum sin k t_i``, ``k = 0 .. 2 m_n``, each the
difference of two rows of a table. So nothing is carried from sample to sample but the force itself, one matrix a state
is filled at the end, and the second period is marched only until it meets the first. Numba, one thread, float64.
"""

import numba
import numpy as np

OPEN, STICK, UP, DOWN = 0, 1, 2, 3
CHUNK = 1 << 16
"""Samples held at a time, all elements together: they stay in the cache."""


class Tables:
    """Of one harmonic set and number of samples; ``H`` (L, N), prefix sums scaled by ``2 pi / N``."""

    def __init__(self, orders, samples):
        self.orders = np.array(orders[1:], dtype=np.int64)
        top = 2 * int(self.orders[-1])
        t = 2 * np.pi * np.arange(samples) / samples
        self.H = np.ones((2 * len(orders) - 1, samples))
        self.H[1::2], self.H[2::2] = np.cos(self.orders[:, None] * t), np.sin(self.orders[:, None] * t)
        scale = 2 * np.pi / samples
        self.sums = np.zeros((samples + 1, 2 * top))
        angle = t[:, None] * np.arange(1, top + 1)
        np.cumsum(np.cos(angle) * scale, axis=0, out=self.sums[1:, :top])
        np.cumsum(np.sin(angle) * scale, axis=0, out=self.sums[1:, top:])
        self.moments = np.zeros((samples + 1, self.H.shape[0]))
        np.cumsum(self.H.T * (t * scale)[:, None], axis=0, out=self.moments[1:])
        self.H_rows = np.ascontiguousarray(self.H.T)


@numba.njit(cache=True, fastmath=True)
def _march(w, y, v, kt, limit, state):
    """State of every sample of the periodic motion; returns where the force was last known, and the state there."""
    n = w.size
    since, origin = 0, OPEN
    dv = v * 2 * np.pi / n
    f = 0.0
    if y[0] > 0.0:
        f = limit * y[0] if v >= 0.0 else -limit * y[0]
        origin = UP if v >= 0.0 else DOWN
    state[0] = origin
    for i in range(1, n):
        f += kt * (w[i] - w[i - 1] + dv)
        b = limit * y[i]
        now = STICK
        if b <= 0.0:
            f, now = 0.0, OPEN
        elif f >= b:
            f, now = b, UP
        elif f <= -b:
            f, now = -b, DOWN
        state[i] = now
        if now != STICK:
            since, origin = i, now
    for i in range(n):
        f += kt * (w[i] - w[i - 1] + dv)  # w[-1] is the last one
        b = limit * y[i]
        now = STICK
        if b <= 0.0:
            f, now = 0.0, OPEN
        elif f >= b:
            f, now = b, UP
        elif f <= -b:
            f, now = -b, DOWN
        if now != STICK and now == state[i]:
            break  # at a known force, as in the first period: all that follows is the same
        state[i] = now
        if now != STICK:
            since, origin = i, now
    return since, origin


@numba.njit(cache=True, fastmath=True)
def _add(a, b, weight, sums, into):
    """Add a run of samples a .. b - 1."""
    for k in range(into.size):
        into[k] += weight * (sums[b, k] - sums[a, k])


@numba.njit(cache=True, fastmath=True)
def _fill(length, C, S, orders, out):
    """``(1/pi) sum H_+ H_-^T`` from its sums."""
    half = 0.5 / np.pi
    out[0, 0] = half * length
    for i in range(orders.size):
        a, r = orders[i], 2 * i + 1
        out[0, r], out[0, r + 1] = half * C[a - 1], half * S[a - 1]
        out[r, 0], out[r + 1, 0] = 2.0 * out[0, r], 2.0 * out[0, r + 1]
        for j in range(i):
            b, c = orders[j], 2 * j + 1
            cs, ss, cd, sd = half * C[a + b - 1], half * S[a + b - 1], half * C[a - b - 1], half * S[a - b - 1]
            out[r, c], out[c, r] = cd + cs, cd + cs
            out[r + 1, c + 1], out[c + 1, r + 1] = cd - cs, cd - cs
            out[r, c + 1], out[c + 1, r] = ss - sd, ss - sd
            out[r + 1, c], out[c, r + 1] = ss + sd, ss + sd
        cs, ss = half * C[2 * a - 1], half * S[2 * a - 1]
        out[r, r], out[r + 1, r + 1] = half * length + cs, half * length - cs
        out[r, r + 1], out[r + 1, r] = ss, ss


@numba.njit(cache=True, fastmath=True)
def _stick(a, first, beyond, origin, par, motion, tables, out):
    """Add the constant part of a run of sticking samples ``first .. beyond - 1``, whose force was last known at ``a``.

    ``origin`` is the state there. Samples are counted on beyond the period where the run goes over its end.
    """
    v, kt, mu, kn = par
    w, y = motion
    orders, sums, moments, rows = tables
    Fx, dFx, h, hv = out
    n, L, top = w.size, rows.shape[1], sums.shape[1] // 2
    turn = 2 * np.pi
    h[:] = 0.0
    hv[:] = 0.0
    part = first
    while part < beyond:  # at most twice round
        lap = part // n
        lo, hi = part - lap * n, min(beyond - lap * n, n)
        count = (hi - lo) * turn / n
        shift = turn * lap - turn * a / n  # hv counts from the origin
        h[0] += count
        hv[0] += moments[hi, 0] - moments[lo, 0] + shift * count
        for j in range(orders.size):
            m = orders[j] - 1
            c, s = sums[hi, m] - sums[lo, m], sums[hi, top + m] - sums[lo, top + m]
            h[2 * j + 1] += c
            h[2 * j + 2] += s
            hv[2 * j + 1] += moments[hi, 2 * j + 1] - moments[lo, 2 * j + 1] + shift * c
            hv[2 * j + 2] += moments[hi, 2 * j + 2] - moments[lo, 2 * j + 2] + shift * s
        part = lap * n + hi
    for k in range(L):
        h[k] /= np.pi if k else turn
        hv[k] /= np.pi if k else turn
    at = a % n
    sign = 1.0 if origin == UP else (-1.0 if origin == DOWN else 0.0)
    f = sign * mu * kn * y[at]
    c = f - kt * w[at]
    H = rows[at]
    for i in range(L):
        Fx[i] += c * h[i] + kt * v * hv[i]
        for k in range(L):
            dFx[i, k] -= kt * h[i] * H[k]
            dFx[i, L + k] += sign * mu * kn * h[i] * H[k]
        dFx[i, 2 * L] += kt * hv[i]
        dFx[i, 2 * L + 1] += sign * kn * y[at] * h[i]
        dFx[i, 2 * L + 2] += v * hv[i] - w[at] * h[i]
        dFx[i, 2 * L + 3] += sign * mu * y[at] * h[i]


@numba.njit(cache=True, fastmath=True)
def _runs(state, last, w, y, par, periodic, tables, room, Fx, Fy, dFx, dFy):
    """Force and derivatives of one element from its states."""
    orders, sums = tables[:2]
    primitives, W, h, hv = room
    _v, kt, mu, kn = par
    X, Y = periodic
    n, L, top = w.size, X.size, sums.shape[1] // 2
    step = 2 * np.pi / n
    start = 0  # where a run begins
    while start < n and state[start] == state[start - 1]:
        start += 1
    whole = start == n
    if whole:
        start = 0
    primitives[:] = 0.0
    stick, slip, contact = 0, 0, 0
    i = 0
    while i < n:  # runs that do not go over the end of the period
        now, b = state[i], i + 1
        while b < n and state[b] == now:
            b += 1
        if now != OPEN:
            contact += b - i
            _add(i, b, 1.0, sums, primitives[2])
            if now == STICK:
                stick += b - i
                _add(i, b, 1.0, sums, primitives[0])
            else:
                sign = 1.0 if now == UP else -1.0
                slip += (b - i) * (1 if now == UP else -1)
                _add(i, b, sign, sums, primitives[1])
        i = b
    for r in range(3):
        count = stick if r == 0 else (slip if r == 1 else contact)
        _fill(count * step, primitives[r, :top], primitives[r, top:], orders, W[r])
    for i in range(L):
        q, s, z = 0.0, 0.0, 0.0
        for k in range(L):
            x = X[k] if k else 0.0
            q += W[0, i, k] * x
            s += W[1, i, k] * Y[k]
            z += W[2, i, k] * Y[k]
            dFx[i, k] = kt * W[0, i, k]
            dFx[i, L + k] = mu * kn * W[1, i, k]
            dFy[i, k] = kn * W[2, i, k]
        Fx[i], Fy[i] = kt * q + mu * kn * s, kn * z
        dFx[i, 2 * L], dFx[i, 2 * L + 1], dFx[i, 2 * L + 2], dFx[i, 2 * L + 3] = 0.0, kn * s, q, mu * s
        dFy[i, L] = z
    motion = (w, y)
    if whole:
        if state[0] == STICK:
            _stick(last[0], 0, n, last[1], par, motion, tables, (Fx, dFx, h, hv))
        return
    i = start
    while i < start + n:
        now, b = state[i % n], i + 1
        while b < start + n and state[b % n] == now:
            b += 1
        if now == STICK:
            _stick(i - 1, i, b, state[(i - 1) % n], par, motion, tables, (Fx, dFx, h, hv))
        i = b


@numba.njit(cache=True, fastmath=True)
def _batch(W, Yg, X, Y, v, kt, mu, kn, tables, Fx, Fy, dFx, dFy):
    n, L, top = W.shape[1], X.shape[1], tables[1].shape[1]
    state = np.empty(n, np.int8)
    room = (np.empty((3, top)), np.empty((3, L, L)), np.empty(L), np.empty(L))
    for e in range(W.shape[0]):
        last = _march(W[e], Yg[e], v[e], kt[e], mu[e] * kn[e], state)
        par = (v[e], kt[e], mu[e], kn[e])
        _runs(state, last, W[e], Yg[e], par, (X[e], Y[e]), tables, room, Fx[e], Fy[e], dFx[e], dFy[e])


def evaluate(tables, X, Y, *, v, kt, mu, kn, gap):
    """As ``aft_rival.evaluate``."""
    count, L = X.shape
    out = np.empty((count, L)), np.empty((count, L)), np.empty((count, L, 2 * L + 4)), np.empty((count, L, L + 1))
    X, Y = X.copy(), Y.copy()
    X[:, 0] = 0.0
    Y[:, 0] -= gap
    compiled = (tables.orders, tables.sums, tables.moments, tables.H_rows)
    together = max(1, CHUNK // tables.H.shape[1])
    W, Yg = np.empty((2, together, tables.H.shape[1]))
    for first in range(0, count, together):
        part = slice(first, min(first + together, count))
        given = (X[part], Y[part], v[part], kt[part], mu[part], kn[part])
        w, y = W[: len(X[part])], Yg[: len(X[part])]
        np.matmul(X[part], tables.H, out=w)
        np.matmul(Y[part], tables.H, out=y)
        _batch(w, y, *given, compiled, *(o[part] for o in out))
    return out
