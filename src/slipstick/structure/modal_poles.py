"""Poles of measured receptances: least-squares complex frequency method, and which of them are stable.

All receptances have one denominator, ``A(w) = B(z) / a(z)`` with ``z = exp(i T (w - w_a))``: polynomials in ``z`` are
well conditioned at any order. The numerators are eliminated, the denominator follows by linear least squares
(P. Guillaume, P. Verboven, S. Vanlanduit, Proc. ISMA 23, 1998; B. Cauberghe, thesis, Vrije Universiteit Brussel, 2004).
Physical poles stay where they are while the order grows; poles of noise move, and most of them are unstable.
"""

from __future__ import annotations

import numpy as np

from slipstick.typing import Array, ComplexArray

Poles = tuple[Array, Array]
"""Natural frequencies and damping ratios, (n_modes,) each."""

_ORDERS = (60, 150)
"""Highest order of the denominator, usual and at most."""
_COLUMNS = 16
"""Functions that denominators are sought of: the strongest combinations where more were measured."""
_BEYOND = 0.1
"""Poles are sought up to this share of the range above its end."""
_SAME, _SAME_DAMPING = 0.01, 0.2
"""Relative differences of a stable pole from one order to the next, as Ewins has them in his chapter 4."""
_STABLE = 0.3
"""Share of the orders in which a stable pole is found."""
_DAMPED = 0.3
"""Damping ratio up to which a resonance is taken for one."""


def stable_poles(omega: Array, values: ComplexArray, weight: Array, *, many: int = 0) -> Poles:
    """Poles of receptances (n, n_pairs) that many orders agree on, ascending; ``many`` modes are expected, at least."""
    found, orders = _by_order(omega, values, weight, many)
    if not found:
        return np.zeros(0), np.zeros(0)
    w, z, order = (np.array(part) for part in zip(*found, strict=True))
    good = (z > 1e-6) & (z < _DAMPED)
    w, z, order = w[good], z[good], order[good]
    steady = np.zeros(w.size, dtype=bool)
    for k in range(w.size):
        before = order == order[k] - 1
        near = np.abs(w[before] / w[k] - 1.0) < np.minimum(_SAME, np.maximum(z[k], 1e-4))
        steady[k] = bool(np.any(near & (np.abs(z[before] / z[k] - 1.0) < _SAME_DAMPING)))
    w, z, order = w[steady], z[steady], order[steady]
    poles = []
    while w.size:
        near = [np.abs(w / w[k] - 1.0) < np.minimum(_SAME, 0.5 * z[k]) for k in range(w.size)]
        count = [np.unique(order[group]).size for group in near]
        best = int(np.argmax(count))
        if count[best] < max(_STABLE * orders, 3):
            break
        group = near[best]
        poles.append((float(np.median(w[group])), float(np.median(z[group]))))
        w, z, order = w[~group], z[~group], order[~group]
    poles.sort()
    return np.array([p[0] for p in poles]), np.array([p[1] for p in poles])


def _by_order(
    omega: Array, values: ComplexArray, weight: Array, many: int
) -> tuple[list[tuple[float, float, int]], int]:
    """Frequency, damping ratio and number of the order of all poles in the range, and how many orders there are."""
    low, high = float(omega[0]), float(omega[-1])
    start = 0.0 if low < 0.3 * high else low - 0.03 * (high - low)
    T = np.pi / (high + _BEYOND * (high - low) - start)
    n = int(min(max(_ORDERS[0], 6 * many), _ORDERS[1], omega.size // 4))
    Z = np.exp(1j * T * (omega - start))[:, None] ** np.arange(n + 1)
    if values.shape[1] > _COLUMNS:
        common = np.sqrt(np.mean(weight**2, axis=1))[:, None]
        U, s, _ = np.linalg.svd(values * common, full_matrices=False)
        values, weight = U[:, :_COLUMNS] * s[:_COLUMNS] / common, np.broadcast_to(common, (omega.size, _COLUMNS))
    normal = np.zeros((n + 1, n + 1))
    for function, g in zip(values.T, weight.T, strict=True):
        X = Z * g[:, None]
        Q, _ = np.linalg.qr(np.vstack([X.real, X.imag]))
        Y = X * function[:, None]
        Y2 = np.vstack([Y.real, Y.imag])
        Y2 -= Q @ (Q.T @ Y2)
        normal += Y2.T @ Y2
    found, orders = [], range(4, n + 1, 2)
    for number, order in enumerate(orders):
        part = normal[: order + 1, : order + 1]
        a = np.append(np.linalg.lstsq(part[:-1, :-1], -part[:-1, -1], rcond=None)[0], 1.0)
        roots = np.roots(a[::-1])
        roots = roots[(roots.imag > 0.0) & (np.abs(roots) > 1e-6)]
        s = np.log(roots) / T + 1j * start
        w = np.abs(s)
        inside = (w > low) & (w < high + _BEYOND * (high - low))
        found += [(float(x), float(-p.real / x), number) for x, p in zip(w[inside], s[inside], strict=True)]
    return found, len(orders)
