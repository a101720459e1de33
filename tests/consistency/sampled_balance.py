"""Harmonic balance by sampling, written anew for the tests: nothing here asks the package for a residual or a force.

Steady motion is held against the solution that this residual has next to it, found by Newton's method with a Jacobian
of differences. Forces are given over the sampled period, ``force(x, v) -> f`` with arrays (..., n_dofs, samples).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Array = np.ndarray
Force = Callable[[Array, Array], Array]


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """``M x'' + C x' + K x + f(x, x') = p`` with p (n, L), times omega^2 where ``unbalance``; orders (0, m_1, ...)."""

    M: Array
    C: Array
    K: Array
    force: Force
    load: Array
    orders: Sequence[int]
    unbalance: bool = False
    samples: int = 4096

    def __post_init__(self) -> None:
        m = np.asarray(self.orders[1:])
        angle = np.multiply.outer(m, np.arange(self.samples) * (2.0 * np.pi / self.samples))
        pairs = np.stack([np.cos(angle), np.sin(angle)], axis=1).reshape(-1, self.samples)
        slopes = np.stack([-m[:, None] * np.sin(angle), m[:, None] * np.cos(angle)], axis=1).reshape(-1, self.samples)
        object.__setattr__(self, "basis", np.vstack([np.ones(self.samples), pairs]))
        object.__setattr__(self, "slope", np.vstack([np.zeros(self.samples), slopes]))

    def residual(self, X: Array, omega: float) -> Array:
        """Of coefficients (..., n, L), order (0, c1, s1, ...)."""
        f = self.force(X @ self.basis, omega * (X @ self.slope)) @ self.basis.T * (2.0 / self.samples)
        f[..., 0] *= 0.5
        w = omega * np.repeat(self.orders, 2)[1:]
        turned = np.zeros_like(X)  # coefficients of x' over w
        turned[..., 1::2], turned[..., 2::2] = X[..., 2::2], -X[..., 1::2]
        load = self.load * (omega**2 if self.unbalance else 1.0)
        return self.K @ X + w * (self.C @ turned) - w**2 * (self.M @ X) + f - load

    def solved(self, X: Array, omega: float, iterations: int = 3) -> Array:
        """The solution next to X (n, L)."""
        size = np.abs(X).max()
        step = 1e-6 * size
        moved = step * np.eye(X.size).reshape(X.size, *X.shape)
        for _ in range(iterations):
            R = self.residual(np.concatenate([X[None], X + moved, X - moved]), omega).reshape(-1, X.size)
            jacobian = (R[1 : X.size + 1] - R[X.size + 1 :]).T / (2.0 * step)
            correction = np.linalg.solve(jacobian, R[0]).reshape(X.shape)
            X = X - correction
            if np.abs(correction).max() < 1e-11 * size:
                break
        return X


def jenkins(x: Array, kt: float, limit: Array | float) -> Array:
    """Friction force of a spring and a slider over a sampled period of motion (..., samples), after two periods."""
    limit = np.broadcast_to(limit, x.shape)
    steps = kt * np.diff(x, axis=-1, prepend=x[..., -1:])
    out, f = np.empty(x.shape), np.clip(kt * x[..., 0], -limit[..., 0], limit[..., 0])
    for period in range(2):
        for i in range(1 - period, x.shape[-1]):
            f = np.minimum(np.maximum(f + steps[..., i], -limit[..., i]), limit[..., i])
            out[..., i] = f
    return out


def worst(sampled: Sampled, dataset, points: Sequence[int]) -> float:
    """Largest distance of stored motion from the solution next to it, each dof relative to its own range."""
    X, omega = dataset.displacement.values, dataset.omega.values
    scale = np.abs(X).max(axis=(0, 2))[:, None]
    return max(float((np.abs(X[p] - sampled.solved(X[p], omega[p])) / scale).max()) for p in points)
