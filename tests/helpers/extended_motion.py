"""Extended periodic motion by harmonic balance with forces sampled in time: all dofs, plain Newton, no continuation."""

from __future__ import annotations

import numpy as np


def jenkins(kt, limit):
    """Springs (m,) that slide at their limit forces (m,), marched over two periods, of motion (m, N)."""
    kt, limit = np.atleast_1d(kt)[:, None], np.atleast_1d(limit)[:, None]

    def force(x, v):
        out, anchor = np.empty_like(x), x[:, :1] * 0.0
        for _ in range(2):
            for i in range(x.shape[1]):
                f = np.clip(kt * (x[:, i : i + 1] - anchor), -limit, limit)
                anchor = x[:, i : i + 1] - f / kt
                out[:, i] = f[:, 0]
        return out

    return force


def beam(length, height, thickness, E, rho, nodes):
    """Mass and stiffness of a cantilever of Euler-Bernoulli elements: deflection, slope of each node but the first."""
    EI, mass, le = E * thickness * height**3 / 12.0, rho * thickness * height, length / (nodes - 1)
    k = np.array([[12, 6 * le, -12, 6 * le], [6 * le, 4 * le**2, -6 * le, 2 * le**2],
                  [-12, -6 * le, 12, -6 * le], [6 * le, 2 * le**2, -6 * le, 4 * le**2]])  # fmt: skip
    m = np.array([[156, 22 * le, 54, -13 * le], [22 * le, 4 * le**2, 13 * le, -3 * le**2],
                  [54, 13 * le, 156, -22 * le], [-13 * le, -3 * le**2, -22 * le, 4 * le**2]])  # fmt: skip
    M, K = np.zeros((2, 2 * nodes, 2 * nodes))
    for e in range(nodes - 1):
        at = slice(2 * e, 2 * e + 4)
        K[at, at] += EI / le**3 * k
        M[at, at] += mass * le / 420.0 * m
    return M[2:, 2:], K[2:, 2:]


def extended_motion(M, C, K, rows, force, q, omega, xi, dof, *, samples=4096, static=None):
    """Frequency and damping of ``M x'' + (C - xi M) x' + K x + rows^T f(rows x, rows x') = static``, periodic.

    From a guess ``q`` (2 H + 1, n) in the order 1, c1, s1, ..., whose harmonic 1 at ``dof`` has the amplitude kept.
    """
    n, size = len(M), len(q)
    H, rows = size // 2, np.atleast_2d(rows)
    turn = np.exp(-1j * np.angle(q[1, dof] - 1j * q[2, dof]) * np.arange(1, H + 1))[:, None]
    z = (q[1::2] - 1j * q[2::2]) * turn
    q = np.vstack([q[:1], np.stack([z.real, -z.imag], axis=1).reshape(-1, n)])
    tau = 2.0 * np.pi * np.arange(samples) / samples
    m = np.arange(1, H + 1)
    T = np.ones((size, samples))
    T[1::2], T[2::2] = np.cos(np.outer(m, tau)), np.sin(np.outer(m, tau))
    D = np.zeros((size, samples))
    D[1::2], D[2::2] = -m[:, None] * np.sin(np.outer(m, tau)), m[:, None] * np.cos(np.outer(m, tau))
    project = T.T * np.where(np.arange(size) == 0, 1.0, 2.0) / samples
    amplitude, load = q[1, dof], np.zeros((size, n))
    load[0] = 0.0 if static is None else static

    def sampled(X, w):
        return force(X.T @ T, w * (X.T @ D)) @ project  # (ports, 2 H + 1)

    y = np.concatenate([q.reshape(-1), [omega, xi]])
    size_of = np.append(np.full(q.size, np.abs(q).max()), [omega, omega])
    for _ in range(30):
        q, (w, xi) = y[:-2].reshape(size, n), y[-2:]
        J = np.zeros((y.size, y.size))
        block = J[:-2, :-2].reshape(size, n, size, n)
        block[0, :, 0] = K
        for j in m:
            c, s = 2 * j - 1, 2 * j
            stiff, drag = K - (j * w) ** 2 * M, j * w * (C - xi * M)
            block[c, :, c] = block[s, :, s] = stiff
            block[c, :, s], block[s, :, c] = drag, -drag
        R = np.append(J[:-2, :-2] @ y[:-2] - load.reshape(-1), [q[1, dof] - amplitude, q[2, dof]])
        X = q @ rows.T
        f = sampled(X, w)
        R[:-2] += (f.T @ rows).reshape(-1)
        for p in range(len(rows)):
            for k in range(size):
                moved = X.copy()
                step = 1e-6 * max(np.abs(X[1:]).max(), 1e-12)
                moved[k, p] += step
                df = (sampled(moved, w) - f) / step
                block[:, :, k] += np.einsum("jk,jn,p->knp", df, rows, rows[p])
        dw = 1e-6 * w
        by_w = ((sampled(X, w + dw) - f) / dw).T @ rows
        for j in m:
            c, s = 2 * j - 1, 2 * j
            by_w[c] += -2.0 * j**2 * w * M @ q[c] + j * (C - xi * M) @ q[s]
            by_w[s] += -2.0 * j**2 * w * M @ q[s] - j * (C - xi * M) @ q[c]
            J[n * c : n * c + n, -1] = -j * w * M @ q[s]
            J[n * s : n * s + n, -1] = j * w * M @ q[c]
        J[:-2, -2] = by_w.reshape(-1)
        J[-2, n + dof] = J[-1, 2 * n + dof] = 1.0
        dy = np.linalg.solve(J, -R)
        y = y + dy
        if np.abs(dy / size_of).max() < 1e-9:
            return float(y[-2]), float(y[-1] / (2.0 * y[-2])), y[:-2].reshape(size, n)
    raise AssertionError(f"no convergence, {np.abs(dy / size_of).max():.1e}")
