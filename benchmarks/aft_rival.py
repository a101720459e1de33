"""The usual way: a compiled, sampled alternating frequency-time evaluation of the same element.

The motion is sampled by matrix products with tabulated harmonics; the friction force is marched for two periods, the
first started from the limit the rubbing velocity drives it to. Two versions, both numba, one thread, float64:

``propagate``
    as such codes are written: the derivatives of the force by X, Y and the parameters are propagated from sample to
    sample and projected on the harmonics as they come.
``tuned``
    as far as sampling can be driven: within a stick the derivatives are rebuilt from the sample at which the stick
    began, so nothing is propagated in the first period, and everything is projected by one BLAS product a matrix.

``aft_runs.py`` goes further still. All three give the same numbers.
"""

import numba
import numpy as np

SAMPLES = 1024


def tables(orders, samples=SAMPLES):
    """Sampled ``H_-`` (samples, L) and the projection on coefficients (L, samples)."""
    tau = 2 * np.pi * np.arange(samples) / samples
    H = np.ones((samples, 2 * len(orders) - 1))
    H[:, 1::2] = np.cos(tau[:, None] * np.array(orders[1:]))
    H[:, 2::2] = np.sin(tau[:, None] * np.array(orders[1:]))
    P = 2 * H.T / samples
    P[0] /= 2
    return np.ascontiguousarray(H), np.ascontiguousarray(P)


@numba.njit(cache=True, fastmath=True)
def _march(w, y, v, kt, mu, kn, force, state, memory):
    """Two periods of the friction force; in the second, force, state (0 open, 1 stick, 2, 3 slip) and at which sample
    the spring of a stick was last at a known force (a limit, or zero) with that limit's sign."""
    n = w.size
    dv = v * 2 * np.pi / n
    f, sign, since, elapsed = 0.0, 0, 0, 0
    if y[0] > 0.0:
        sign = 1 if v >= 0.0 else -1
        f = sign * mu * kn * y[0]
    for lap in range(2):
        for i in range(n):
            if lap == 1 or i > 0:
                before = i - 1 if i > 0 else n - 1
                elapsed += 1
                if y[i] <= 0.0:
                    f, sign, since, elapsed, now = 0.0, 0, i, 0, 0
                else:
                    f += kt * (w[i] - w[before] + dv)
                    b = mu * kn * y[i]
                    now = 1
                    if f >= b:
                        f, sign, since, elapsed, now = b, 1, i, 0, 2
                    elif f <= -b:
                        f, sign, since, elapsed, now = -b, -1, i, 0, 3
                if lap == 1:
                    force[i], state[i] = f, now
                    memory[i, 0], memory[i, 1], memory[i, 2] = since, sign, elapsed


@numba.njit(cache=True, fastmath=True)
def _derivatives(w, y, v, kt, mu, kn, state, memory, H, rows, normal):
    """Rows of derivatives of f_x by X, Y and (v, mu, kt, kn), and of f_y by Y and kn, at every sample."""
    n, L = H.shape
    dv = 2 * np.pi / n
    for i in range(n):
        a, sign, elapsed = memory[i, 0], memory[i, 1], memory[i, 2]
        if state[i] == 0:
            rows[i, :] = 0.0
            normal[i, :] = 0.0
            continue
        limit = sign * mu * kn
        if state[i] == 1:
            for k in range(L):
                rows[i, k] = kt * (H[i, k] - H[a, k])
                rows[i, L + k] = limit * H[a, k]
            rows[i, 2 * L] = kt * dv * elapsed
            rows[i, 2 * L + 2] = w[i] - w[a] + v * dv * elapsed
        else:
            for k in range(L):
                rows[i, k] = 0.0
                rows[i, L + k] = limit * H[i, k]
            rows[i, 2 * L] = 0.0
            rows[i, 2 * L + 2] = 0.0
        rows[i, 2 * L + 1] = sign * kn * y[a]
        rows[i, 2 * L + 3] = sign * mu * y[a]
        for k in range(L):
            normal[i, k] = kn * H[i, k]
        normal[i, L] = y[i]


@numba.njit(cache=True, fastmath=True)
def _tuned(W, Yg, v, kt, mu, kn, H, P, Fx, Fy, dFx, dFy):
    n, L = H.shape
    force, state, memory = np.empty(n), np.empty(n, np.int64), np.empty((n, 3), np.int64)
    rows, normal, normal_force = np.empty((n, 2 * L + 4)), np.empty((n, L + 1)), np.empty(n)
    for e in range(W.shape[0]):
        _march(W[e], Yg[e], v[e], kt[e], mu[e], kn[e], force, state, memory)
        _derivatives(W[e], Yg[e], v[e], kt[e], mu[e], kn[e], state, memory, H, rows, normal)
        for i in range(n):
            normal_force[i] = kn[e] * max(Yg[e, i], 0.0)
        np.dot(P, force, Fx[e])
        np.dot(P, normal_force, Fy[e])
        np.dot(P, rows, dFx[e])
        np.dot(P, normal, dFy[e])


@numba.njit(cache=True, fastmath=True)
def _propagate(W, Yg, v, kt, mu, kn, H, Fx, Fy, dFx, dFy):
    n, L = H.shape
    d = 2 * np.pi / n
    g, p, q = np.empty(2 * L + 4), np.empty(L), np.empty(L + 1)
    for e in range(W.shape[0]):
        w, y, ktn, limit = W[e], Yg[e], kt[e], mu[e] * kn[e]
        Fx[e], Fy[e], dFx[e], dFy[e] = 0.0, 0.0, 0.0, 0.0
        sign = 0.0 if y[0] <= 0.0 else (1.0 if v[e] >= 0.0 else -1.0)
        f = sign * limit * max(y[0], 0.0)
        _at_limit(sign, y[0], mu[e], kn[e], H[0], g)
        for lap in range(2):
            for i in range(n):
                if lap == 1 or i > 0:
                    before = i - 1 if i > 0 else n - 1
                    move = w[i] - w[before] + v[e] * d
                    f += ktn * move
                    b = limit * max(y[i], 0.0)
                    if f >= b or f <= -b:
                        sign = 0.0 if y[i] <= 0.0 else (1.0 if f >= b else -1.0)
                        f = sign * b
                        _at_limit(sign, y[i], mu[e], kn[e], H[i], g)
                    else:
                        for k in range(L):
                            g[k] += ktn * (H[i, k] - H[before, k])
                        g[2 * L] += ktn * d
                        g[2 * L + 2] += move
                if lap == 1:
                    for k in range(L):
                        p[k] = (1.0 if k == 0 else 2.0) / n * H[i, k]
                    for j in range(L):
                        Fx[e, j] += p[j] * f
                        for k in range(2 * L + 4):
                            dFx[e, j, k] += p[j] * g[k]
                    if y[i] > 0.0:
                        for k in range(L):
                            q[k] = kn[e] * H[i, k]
                        q[L] = y[i]
                        for j in range(L):
                            Fy[e, j] += p[j] * kn[e] * y[i]
                            for k in range(L + 1):
                                dFy[e, j, k] += p[j] * q[k]


@numba.njit(cache=True, fastmath=True)
def _at_limit(sign, y, mu, kn, h, g):
    """Derivatives of a force at its limit (or zero, ``sign`` = 0)."""
    L = h.size
    for k in range(L):
        g[k] = 0.0
        g[L + k] = sign * mu * kn * h[k]
    g[2 * L], g[2 * L + 1], g[2 * L + 2], g[2 * L + 3] = 0.0, sign * kn * y, 0.0, sign * mu * y


def evaluate(orders, X, Y, *, v, kt, mu, kn, gap, table=None, version="tuned"):
    """Forces and derivatives of a batch: ``Fx, Fy`` (n, L), ``dFx`` (n, L, 2 L + 4) by X, Y, v, mu, kt, kn and ``dFy``
    (n, L, L + 1) by Y, kn; derivatives by the gap are minus the first column of those by Y."""
    H, P = table or tables(orders)
    count, L = X.shape
    Fx, Fy = np.empty((count, L)), np.empty((count, L))
    dFx, dFy = np.empty((count, L, 2 * L + 4)), np.empty((count, L, L + 1))
    W, Yg = X @ H.T, Y @ H.T - gap[:, None]
    if version == "tuned":
        _tuned(W, Yg, v, kt, mu, kn, H, P, Fx, Fy, dFx, dFy)
    else:
        _propagate(W, Yg, v, kt, mu, kn, H, Fx, Fy, dFx, dFy)
    return Fx, Fy, dFx, dFy
