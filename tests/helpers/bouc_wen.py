"""The Bouc-Wen element by an integrator of scipy: from reversal to reversal, begun anew where z is zero."""

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

_SATURATED = 1.0 - 1e-12
"""Part of the largest z that counts as all of it."""


def reversals(X, m, v):
    """Phases at which the velocity is zero, by the roots of its polynomial."""
    highest = int(m[-1])
    c = np.zeros(2 * highest + 1, complex)
    c[highest] = v
    for j, k in enumerate(m.astype(int)):
        wave = 0.5 * k * (X[2 * j + 2] + 1j * X[2 * j + 1])
        c[highest + k] += wave
        c[highest - k] += np.conj(wave)
    roots = np.roots(c[::-1])
    return np.sort(np.angle(roots[np.abs(np.abs(roots) - 1.0) < 1e-6]) % (2.0 * np.pi))


def coefficients(X, m, v, beta, gamma, n):
    """Coefficients of z over a period (L,), and the work over 2 pi of it."""
    L = 2 * m.size + 1

    def motion(t):
        return X[0] + v * t + X[1::2] @ np.cos(m * t) + X[2::2] @ np.sin(m * t)

    def speed(t):
        return v + (m * X[2::2]) @ np.cos(m * t) - (m * X[1::2]) @ np.sin(m * t)

    def integral(t):
        out = np.empty(L + 1)
        out[0], out[1:-1:2], out[2:-1:2], out[-1] = t, 2.0 * np.sin(m * t) / m, -2.0 * np.cos(m * t) / m, motion(t)
        return out

    first = reversals(X, m, v)
    first = first if first.size else np.array([0.7])
    edges = np.append(first, first[0] + 2.0 * np.pi)
    largest, reach = (beta + gamma) ** (-1.0 / n), np.ptp([motion(t) for t in edges])
    most = largest if v else min(largest, reach)

    def over_a_period(z, integrals):
        y = np.zeros(1 + (L + 1) * integrals)
        y[0] = z
        for a, b in pairwise(edges):
            s, t = np.sign(motion(b) - motion(a)), a
            while t < b - 1e-14:
                side = np.sign(y[0]) or s

                def rates(t, y, s=s, side=side):
                    out, dw = np.empty_like(y), speed(t)
                    out[0] = dw * (1.0 - s * (beta * side + gamma * s) * min(max(side * y[0], 0.0), 2.0 * largest) ** n)
                    if integrals:
                        out[1], out[2:-1:2], out[3:-1:2] = y[0], 2.0 * y[0] * np.cos(m * t), 2.0 * y[0] * np.sin(m * t)
                        out[-1] = y[0] * dw
                    return out

                def zero(t, y):
                    return y[0]

                def saturated(t, y, s=s):
                    return s * y[0] - _SATURATED * largest

                zero.terminal, zero.direction = True, -side
                saturated.terminal, saturated.direction = True, 1.0
                if s * y[0] >= _SATURATED * largest:  # what is left of the way is stiff, and known
                    y[0] = s * largest
                    if integrals:
                        y[1:] += s * largest * (integral(b) - integral(t))
                    break
                found = solve_ivp(
                    rates,
                    (t, b),
                    y,
                    method="DOP853",
                    rtol=1e-12,
                    atol=1e-14 * most,
                    events=saturated if side == s else zero,
                )
                t, y = found.t[-1], found.y[:, -1]
                if found.status == 1:
                    y[0] = s * largest if side == s else 0.0
        return y

    bound = 1.0000001 * most
    z = brentq(lambda z: over_a_period(z, False)[0] - z, -bound, bound, xtol=1e-14 * most, rtol=1e-14)
    y = over_a_period(z, True)[1:] / (2.0 * np.pi)
    return y[:L], y[L]
