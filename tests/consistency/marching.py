"""Brute-force time marching of friction elements: the truth that the exact element is held against.

Nothing of ``slipstick.contact`` or ``slipstick.trig`` is used here. The friction force is carried from sample to sample
by ``f <- clamp(f + kt dw, -mu fy, mu fy)``; where contact begins inside a step only the part of the step in contact
counts. Transition times are wrong by up to one step, the force by its square: the error is of second order.

The start is a limit of the friction force: a march begun at the upper limit (v > 0) or the lower one (v < 0) has
reached the periodic state after one period, and for v = 0 both marches are made and their mean is the convention.
"""

import numba
import numpy as np


@numba.njit(cache=True)
def _period(w, y, dv, kt, kn, mu, f, path):
    """One period of the clamped march from ``f`` at sample 0; ``path`` receives the force at every sample."""
    n = w.size
    for i in range(n):
        path[i] = f
        j = i + 1 if i + 1 < n else 0
        if y[j] <= 0.0:
            f = 0.0
            continue
        increment = kt * (w[j] - w[i] + dv)
        if y[i] < 0.0:
            increment *= y[j] / (y[j] - y[i])
        b = mu * kn * y[j]
        f = min(max(f + increment, -b), b)
    return f


@numba.njit(cache=True)
def _periodic_paths(w, y, v, kt, kn, mu, path, ends):
    n = w.shape[1]
    for e in range(w.shape[0]):
        dv = v[e] * 2.0 * np.pi / n
        b = mu[e] * kn[e] * max(y[e, 0], 0.0)
        hi = _period(w[e], y[e], dv, kt[e], kn[e], mu[e], b, path[e])
        lo = _period(w[e], y[e], dv, kt[e], kn[e], mu[e], -b, path[e])
        start = hi if v[e] > 0 else (lo if v[e] < 0 else 0.5 * (lo + hi))
        ends[e, 0], ends[e, 1] = lo, hi
        _period(w[e], y[e], dv, kt[e], kn[e], mu[e], start, path[e])


def basis(orders, samples):
    """``{1, cos m tau, sin m tau, ...}`` on a uniform grid of one period, (samples, L)."""
    tau = 2 * np.pi * np.arange(samples) / samples
    columns = [np.ones(samples)]
    for m in orders[1:]:
        columns += [np.cos(m * tau), np.sin(m * tau)]
    return np.column_stack(columns)


def march(orders, X, Y, *, v, kt, mu, kn, gap, samples=4096):
    """Coefficients ``Fx``, ``Fy`` (n, L), start interval [lo, hi] (n, 2) and the path of f_x (n, samples).

    ``X`` is the whole periodic tangential motion (x + u), (n, L).
    """
    X, Y = np.atleast_2d(X), np.atleast_2d(Y)
    v, kt, mu, kn, gap = (np.broadcast_to(np.asarray(a, float), X.shape[:1]).copy() for a in (v, kt, mu, kn, gap))
    H = basis(orders, samples)
    w, y = X @ H.T, Y @ H.T - gap[:, None]
    path, ends = np.empty_like(w), np.empty((len(X), 2))
    _periodic_paths(w, y, v, kt, kn, mu, path, ends)
    H_plus = H * (2.0 / samples)
    H_plus[:, 0] /= 2
    return path @ H_plus, (kn[:, None] * np.maximum(y, 0.0)) @ H_plus, ends, path


def force_scale(orders, X, Y, *, v, kt, mu, kn, gap):
    """A size of the forces of each element that errors are relative to: the largest normal force, the largest
    friction force the motion could build up, whichever limits the friction."""
    H = basis(orders, 256)
    normal = kn * np.maximum(Y @ H.T - np.asarray(gap)[:, None], 0.0).max(axis=1)
    return np.maximum(normal, 1e-3 * kn * np.abs(Y).sum(axis=1)) * np.maximum(mu, 0.1)


def random_states(rng, n, orders, *, still=0.2):
    """Random elements: amplitudes, stiffnesses, velocities over decades, about half with separation.

    ``still`` is the fraction with v = 0; elsewhere |v| is 1e-4 to 100 tangential amplitudes, both signs. One in ten has
    a constant normal load.
    """
    L = 2 * len(orders) - 1
    decay = np.ones(L)
    m = np.repeat(np.asarray(orders[1:], float), 2)
    power = rng.uniform(0.0, 2.0, (n, 1))
    decay = np.concatenate([np.ones((n, 1)), m[None, :] ** -power], axis=1)
    X = rng.normal(size=(n, L)) * decay
    Y = rng.normal(size=(n, L)) * decay * 10 ** rng.uniform(-1, 1, (n, 1))
    U = np.where(rng.random((n, 1)) < 0.5, rng.normal(size=(n, L)) * decay, 0.0)
    Y[rng.random(n) < 0.1, 1:] = 0.0
    swing = np.abs(Y[:, 1:]).sum(axis=1) + 0.1
    gap = Y[:, 0] + swing * rng.uniform(-1.2, 0.6, n)
    size = np.abs(X + U)[:, 1:].sum(axis=1) if L > 1 else np.ones(n)
    v = size * 10 ** rng.uniform(-4, 2, n) * rng.choice([-1.0, 1.0], n)
    v[rng.random(n) < still] = 0.0
    kt, kn = 10 ** rng.uniform(-1, 1.5, n), 10 ** rng.uniform(-1, 1, n)
    mu = rng.uniform(0.05, 1.0, n)
    return {"X": X + U, "Y": Y, "v": v, "kt": kt, "mu": mu, "kn": kn, "gap": gap}
