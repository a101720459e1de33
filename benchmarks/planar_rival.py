"""Friction in two directions, exact and sampled: time of an element with all its tangents at equal accuracy.

OMP_NUM_THREADS=1 python benchmarks/planar_rival.py

The rival is alternating frequency/time as the open codes have it, compiled: an elastic step, a return to the circle,
the derivatives of the force carried along; a first period without derivatives finds the periodic state as well as a
period does, and stretches of stick add nothing to the derivatives until they end. It is given the numbers of samples
it needs for some accuracy of the force, half of the states rub, a third separates.
"""

from __future__ import annotations

from functools import partial

import numba
import numpy as np
from clocks import interleaved, one_thread
from planar import COUNT, states

import slipstick as ss
from slipstick.contact.law import Motion

SAMPLES, ORDERS, REPEATS = (64, 256, 1024, 4096, 16384), (3, 10), 5


@numba.njit(fastmath=True)
def sampled(X, Y, y, H, dH, kt, mu, kn, F, J):
    """Forces F (2, L) and derivatives J (2, L, 3 L) by motion in both directions and the normal one, a period each."""
    n, L = H.shape[0] - 1, H.shape[1]
    f1, f2 = 0.0, 0.0
    D = np.zeros((2, 3 * L))
    row1, row2 = np.zeros((n, 3 * L)), np.zeros((n, 3 * L))
    force1, force2 = np.zeros(n), np.zeros(n)
    for period in range(2):
        since, stuck = 0, True
        for i in range(1, n + 1):
            g1, g2 = f1 + kt * (X[i] - X[i - 1]), f2 + kt * (Y[i] - Y[i - 1])
            limit = mu * kn * y[i]
            if limit <= 0.0:
                f1, f2 = 0.0, 0.0
                D[:] = 0.0
                since, stuck = i, True
            else:
                size = np.sqrt(g1 * g1 + g2 * g2)
                if size <= limit:
                    f1, f2, stuck = g1, g2, True
                else:
                    c, s, over = g1 / size, g2 / size, limit / size
                    f1, f2 = limit * c, limit * s
                    if period == 1:
                        for j in range(L):
                            d = kt * (H[i, j] - H[since, j])
                            D[0, j] += d
                            D[1, L + j] += d
                        for j in range(3 * L):
                            a, b = D[0, j], D[1, j]
                            across = over * (c * b - s * a)
                            D[0, j], D[1, j] = -s * across, c * across
                        for j in range(L):
                            D[0, 2 * L + j] += mu * kn * c * H[i, j]
                            D[1, 2 * L + j] += mu * kn * s * H[i, j]
                    since, stuck = i, False
            if period == 1:
                k = i - 1
                force1[k], force2[k] = f1, f2
                row1[k], row2[k] = D[0], D[1]
                if stuck and limit > 0.0:
                    for j in range(L):
                        d = kt * (H[i, j] - H[since, j])
                        row1[k, j] += d
                        row2[k, L + j] += d
    F[0], F[1] = dH @ force1, dH @ force2
    J[0], J[1] = dH @ row1, dH @ row2


def rival(orders: int, n: int, Q: np.ndarray, values: dict[str, np.ndarray], drift: np.ndarray) -> np.ndarray:
    """Forces (COUNT, 2, L) of all elements; their tangents are computed too."""
    tau = 2.0 * np.pi * np.arange(n + 1) / n
    H = np.column_stack([np.ones(n + 1), *(f(m * tau) for m in range(1, orders + 1) for f in (np.cos, np.sin))])
    weights = np.ascontiguousarray(H[1:].T) * 2.0 / n
    weights[0] *= 0.5
    F, J = np.empty((2, H.shape[1])), np.empty((2, H.shape[1], 3 * H.shape[1]))
    out = np.empty((Q.shape[1], 2, H.shape[1]))
    motion = Q @ H.T
    motion[:2] += drift[:2, :, None] * tau
    for e in range(Q.shape[1]):
        kt, mu, kn, gap = (float(values[name][e]) for name in ("kt", "mu", "kn", "gap"))
        sampled(motion[0, e], motion[1, e], motion[2, e] - gap, H, weights, kt, mu, kn, F, J)
        out[e] = F
    return out


def main() -> None:
    """A table: microseconds an element, the error of the force over its size (median, worst of 95 %)."""
    for orders in ORDERS:
        Q, values, drift = states(orders)
        motion = Motion(ss.Harmonics(range(orders + 1)), 1.0, tuple(Q), drift)
        calls = {}
        for tolerance in (1e-4, 1e-6, 1e-8):
            law = ss.PlanarFrictionContact(kt=1.0, mu=1.0, normal_load=1.0, tolerance=tolerance)
            calls[f"exact, {tolerance:g}"] = partial(law.respond, motion, values)
        best = ss.PlanarFrictionContact(kt=1.0, mu=1.0, normal_load=1.0, tolerance=1e-12).respond(motion, values)
        truth = np.stack(best.force[:2], axis=1)
        slips = np.asarray(best.detail.slip_fraction) > 0.0  # else the mean force is one of many
        for n in SAMPLES:
            calls[f"sampled, {n}"] = partial(rival, orders, n, Q, values, drift)
        size = np.abs(truth).max(axis=(1, 2))
        with one_thread():
            taken = np.median(interleaved([*calls.values()], REPEATS), axis=0)
        for (name, call), seconds in zip(calls.items(), taken, strict=True):
            found = call()
            force = found if isinstance(found, np.ndarray) else np.stack(found.force[:2], axis=1)
            error = (np.abs(force - truth).max(axis=(1, 2)) / np.where(size > 0.0, size, 1.0))[slips]
            middle, high = np.quantile(error, [0.5, 0.95])
            print(f"{orders:3d} harmonics  {name:14s} {seconds / COUNT * 1e6:9.1f} us  error {middle:.1e}, {high:.1e}")


if __name__ == "__main__":
    main()
