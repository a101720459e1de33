"""Planar friction marched in time, many contacts at once: the truth beside the element, with none of its code.

Slip is integrated on the angle by an explicit Runge-Kutta pair of order 8 (J. R. Dormand and P. J. Prince, as in
SciPy) with fixed small steps; a step in which a contact changes its state is cut at the change. The coefficients of the
forces are integrated along. Contact begins and ends where the normal motion crosses the gap, by bisection.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as dop

from slipstick.typing import Array

_A, _B, _C = dop.A[:12, :12], dop.B, dop.C[:12]


class TooStiffError(Exception):
    """An explicit method needs too many steps, as where friction hardly limits a fast motion."""


@dataclass
class Marched:
    """Motion (n, 3, L) of n contacts and their parameters (n, 6): ``v1 v2 kt mu kn gap``."""

    orders: Array
    X: Array
    par: Array
    most: float = np.inf
    """Steps of a period after which it is given up."""

    def motion(self, t: Array, of: Array) -> tuple[Array, ...]:
        """``w1, w2, w1', w2', penetration, its rate`` of contacts ``of`` at a time each."""
        m = self.orders
        c, s = np.cos(t[:, None] * m), np.sin(t[:, None] * m)
        X, v = self.X[of], self.par[of]
        a, b = X[:, :, 1::2], X[:, :, 2::2]
        q = (a * c[:, None] + b * s[:, None]).sum(2)
        dq = (m * (b * c[:, None] - a * s[:, None])).sum(2)
        return (
            q[:, 0] + v[:, 0] * t, q[:, 1] + v[:, 1] * t, dq[:, 0] + v[:, 0], dq[:, 1] + v[:, 1],
            q[:, 2] + X[:, 2, 0] - v[:, 5], dq[:, 2],
        )  # fmt: skip

    def basis(self, t: Array) -> Array:
        """``H_+ / pi`` rows at a time each, (n, L)."""
        out = np.full((t.size, 1 + 2 * self.orders.size), 0.5)
        out[:, 1::2], out[:, 2::2] = np.cos(t[:, None] * self.orders), np.sin(t[:, None] * self.orders)
        return out / np.pi

    def rate(self, t: Array, theta: Array, of: Array) -> tuple[Array, Array, Array]:
        """``theta'``, friction limit and slip velocity."""
        _, _, d1, d2, y, dy = self.motion(t, of)
        kt, mu, kn = self.par[of, 2:5].T
        b, c, s = mu * kn * np.maximum(y, 1e-300), np.cos(theta), np.sin(theta)
        return kt * (d2 * c - d1 * s) / b, b, d1 * c + d2 * s - mu * kn * dy / kt

    def slip(self, t: Array, theta: Array, h: Array, of: Array) -> tuple[Array, Array]:
        """Angle after a step, and the coefficients (n, 2, L) that the force adds in it."""
        K, total = [], np.zeros((t.size, 2, 1 + 2 * self.orders.size))
        for i in range(12):
            at = theta + h * sum((_A[i, j] * K[j] for j in range(i)), np.zeros_like(t))
            slope, b, _ = self.rate(t + _C[i] * h, at, of)
            K.append(slope)
            if _B[i]:
                force = np.stack([b * np.cos(at), b * np.sin(at)], axis=1)
                total += (_B[i] * h)[:, None, None] * force[:, :, None] * self.basis(t + _C[i] * h)[:, None]
        return theta + h * sum(_B[i] * K[i] for i in range(12)), total

    def stick(self, t: Array, f: Array, h: Array, of: Array) -> tuple[Array, Array]:
        """The same of a stick that begins with forces (n, 2)."""
        nodes, weights = np.polynomial.legendre.leggauss(8)
        kt, start = self.par[of, 2], np.stack(self.motion(t, of)[:2], axis=1)
        total = np.zeros((t.size, 2, 1 + 2 * self.orders.size))
        for x, w in zip(0.5 * (nodes + 1.0), 0.5 * weights, strict=True):
            force = f + kt[:, None] * (np.stack(self.motion(t + x * h, of)[:2], axis=1) - start)
            total += (w * h)[:, None, None] * force[:, :, None] * self.basis(t + x * h)[:, None]
        return f + kt[:, None] * (np.stack(self.motion(t + h, of)[:2], axis=1) - start), total

    def period(self, f: Array, start: Array, steps: int) -> tuple[Array, Array]:
        """One period from forces (n, 2) at times (n,) on: forces at its end, coefficients (n, 2, L)."""
        n = len(start)
        everyone = np.arange(n)
        t, end, h0 = start.copy(), start + 2.0 * np.pi, 2.0 * np.pi / steps
        F = np.zeros((n, 2, 1 + 2 * self.orders.size))
        kt, mu, kn = self.par[:, 2:5].T
        f, slipping, theta = f.copy(), np.zeros(n, bool), np.arctan2(f[:, 1], f[:, 0])
        y, dy = self.motion(t, everyone)[4:]
        touching = y > 1e-9 * (np.abs(y) + np.abs(self.X[:, 2]).sum(1))
        since, fresh = np.where(touching, -np.inf, t), ~touching
        touching |= dy > 0
        _, limit, out = self.rate(t, theta, everyone)
        slipping = touching & ~fresh & (np.hypot(*f.T) >= limit * (1 - 1e-11)) & (out > 0)
        for count in itertools.count():
            alive = end - t > 1e-13
            if not alive.any():
                break
            if count >= self.most:
                raise TooStiffError(f"{count} steps and {float((end - t).max()):.3g} rad to go")
            born = np.flatnonzero(fresh & touching & alive)  # stick or slip at once
            if born.size:
                _, _, d1, d2, _, dy = self.motion(t[born], born)
                slipping[born] = kt[born] * np.hypot(d1, d2) > (mu * kn)[born] * dy
                theta[born], f[born] = np.arctan2(d2, d1), 0.0
                fresh[born] = False
            h = np.minimum(h0, end - t)
            h = np.minimum(h, np.maximum(0.15 * (t - since), 1e-7))
            _, _, d1, d2, y, _ = self.motion(
                t, everyone
            )  # an explicit method: no longer than the angle takes to follow
            stable = mu * kn * np.maximum(y, 0.0) / np.maximum(kt * np.hypot(d1, d2), 1e-300)
            h = np.where(slipping, np.minimum(h, np.maximum(stable, 1e-7)), h)
            # contact ends or begins within the step
            y1 = self.motion(t + h, everyone)[4]
            crossing = np.flatnonzero(alive & ((y1 > 0) != touching))
            last = np.zeros(n, bool)
            if crossing.size:
                low, high = np.zeros(crossing.size), h[crossing]
                for _ in range(52):
                    x = 0.5 * (low + high)
                    inside = (self.motion(t[crossing] + x, crossing)[4] > 0) == touching[crossing]
                    low, high = np.where(inside, x, low), np.where(inside, high, x)
                ends = touching[crossing] & (low > 1e-7)
                h[crossing] = np.where(ends, 0.5 * low, high)
                last[crossing] = ~ends
            new_f, new_theta, add, stops = f.copy(), theta.copy(), np.zeros_like(F), np.zeros(n, bool)
            of = np.flatnonzero(alive & touching & ~slipping)
            if of.size:
                new_f[of], add[of], h[of], stops[of] = self._stick_step(t, f, h, of)
            of = np.flatnonzero(alive & touching & slipping)
            if of.size:
                new_theta[of], add[of], h[of], stops[of] = self._slip_step(t, theta, h, of)
                _, b, _ = self.rate((t + h)[of], new_theta[of], of)
                new_f[of] = b[:, None] * np.stack([np.cos(new_theta[of]), np.sin(new_theta[of])], axis=1)
            t = np.where(alive, t + h, t)
            F[alive] += add[alive]
            f, theta = new_f, new_theta
            begins = stops & ~slipping
            theta[begins] = np.arctan2(f[begins, 1], f[begins, 0])
            slipping ^= stops
            opened, closed = alive & last & ~stops & touching, alive & last & ~touching
            f[opened], slipping[opened] = 0.0, False
            touching[opened], touching[closed] = False, True
            fresh[closed], since[closed] = True, t[closed]
        return f, F

    def _stick_step(self, t: Array, f: Array, h: Array, of: Array) -> tuple[Array, Array, Array, Array]:
        mu, kn = self.par[of, 3], self.par[of, 4]

        def beyond(x: Array) -> Array:
            force, _ = self.stick_force(t[of], f[of], x, of)
            return np.hypot(*force.T) - mu * kn * np.maximum(self.motion(t[of] + x, of)[4], 0.0)

        x, stops = h[of].copy(), beyond(h[of]) > 0
        if stops.any():
            low, high = np.zeros(of.size), x.copy()
            for _ in range(50):
                middle = 0.5 * (low + high)
                out = beyond(middle) > 0
                low, high = np.where(out, low, middle), np.where(out, middle, high)
            x = np.where(stops, high, x)
        force, add = self.stick(t[of], f[of], x, of)
        return force, add, x, stops

    def stick_force(self, t: Array, f: Array, h: Array, of: Array) -> tuple[Array, None]:
        start, end = self.motion(t, of)[:2], self.motion(t + h, of)[:2]
        return f + self.par[of, 2][:, None] * np.stack([e - s for e, s in zip(end, start, strict=True)], axis=1), None

    def _slip_step(self, t: Array, theta: Array, h: Array, of: Array) -> tuple[Array, Array, Array, Array]:
        x = h[of].copy()
        angle, add = self.slip(t[of], theta[of], x, of)
        stops = self.rate(t[of] + x, angle, of)[2] < 0
        k = np.flatnonzero(stops)
        if k.size:
            who = of[k]
            low, high = np.zeros(k.size), x[k].copy()
            for _ in range(48):
                middle = 0.5 * (low + high)
                at, _ = self.slip(t[who], theta[who], middle, who)
                still = self.rate(t[who] + middle, at, who)[2] >= 0
                low, high = np.where(still, middle, low), np.where(still, high, middle)
            x[k] = high
            angle[k], add[k] = self.slip(t[who], theta[who], high, who)
        return angle, add, x, stops


def marched(
    orders: Array, X: Array, par: Array, *, steps: int = 400, periods: int = 40, most: float = np.inf
) -> tuple[Array, Array]:
    """Coefficients (n, 2, L) of the steady friction forces, and by how much the last period was not closed.

    Contacts that separate start where they close and need one period. TooStiffError for a period of more than ``most``
    steps.
    """
    system, n = Marched(np.asarray(orders, dtype=float), X, par, most), len(X)
    start = np.zeros(n)
    grid = np.linspace(0.0, 2.0 * np.pi, 4001)
    for e in range(n):
        y = system.motion(grid, np.full(grid.size, e))[4]
        up = np.flatnonzero((y[:-1] <= 0) & (y[1:] > 0))
        if up.size:
            low, high = grid[up[0]], grid[up[0] + 1]
            for _ in range(60):
                middle = 0.5 * (low + high)
                inside = system.motion(np.array([middle]), np.array([e]))[4][0] > 0
                low, high = (low, middle) if inside else (middle, high)
            start[e] = high
    limit = par[:, 3] * par[:, 4] * np.maximum(system.motion(start, np.arange(n))[4], 0.0)
    speed = np.hypot(par[:, 0], par[:, 1])
    f = np.divide(limit, speed, out=np.zeros(n), where=speed > 0)[:, None] * par[:, :2]
    left, F, gap = np.arange(n), np.zeros((n, 2, X.shape[2])), np.zeros(n)
    for _ in range(periods):
        part = Marched(system.orders, X[left], par[left], most)
        end, F[left] = part.period(f[left], start[left], steps)
        gap[left] = np.abs(end - f[left]).max(axis=1)
        f[left] = end
        left = left[gap[left] > 1e-13 * np.maximum(limit[left], 1e-300)]
        if not left.size:
            break
    return F, gap
