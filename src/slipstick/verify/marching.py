"""Brute-force marching of the contact law, many elements at once: the slow truth behind one row of the table.

Shares no code with the element. Each element is marched from a limit of its friction force, so that one period suffices
(THEORY.md (3.1)); the error is of second order in the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipstick.typing import Array


class MarchedElements(NamedTuple):
    """Inputs of n elements: motions (n, L), the rest (n,)."""

    X: Array
    Y: Array
    v: Array
    kt: Array
    mu: Array
    kn: Array
    gap: Array


def random_elements(rng: np.random.Generator, n: int, orders: int) -> MarchedElements:
    """Elements with harmonics 0 .. orders; about half open now and then, one in five without rubbing velocity."""
    L = 2 * orders + 1
    X, Y = rng.normal(size=(2, n, L)) / np.repeat(np.arange(1.0, orders + 2), 2)[1:]
    v = rng.choice([-1.0, 1.0], n) * 10 ** rng.uniform(-3, 1, n)
    v[rng.random(n) < 0.2] = 0.0
    swing = np.abs(Y[:, 1:]).sum(axis=1)
    return MarchedElements(
        X=X, Y=Y, v=v, kt=10 ** rng.uniform(-1, 1, n), mu=rng.uniform(0.1, 1.0, n),
        kn=10 ** rng.uniform(-0.5, 0.5, n), gap=Y[:, 0] + swing * rng.uniform(-1.2, 0.5, n),
    )  # fmt: skip


def marched_forces(e: MarchedElements, samples: int) -> tuple[Array, Array]:
    """Coefficients of the tangential and the normal force, (n, L) each."""
    tau = 2 * np.pi * np.arange(samples) / samples
    angle = tau[:, None] * np.arange(1, e.X.shape[1] // 2 + 1)
    H = np.ones((samples, e.X.shape[1]))
    H[:, 1::2], H[:, 2::2] = np.cos(angle), np.sin(angle)
    w, y = H @ e.X.T, H @ e.Y.T - e.gap
    bound = e.mu * e.kn * np.maximum(y, 0.0)
    y_before = np.roll(y, 1, axis=0)
    # where contact begins inside a step, only the part of the step in contact moves the spring
    part = np.where((y > 0) & (y_before < 0), y / np.where(y == y_before, 1.0, y - y_before), 1.0)
    moves = part * e.kt * (w - np.roll(w, 1, axis=0) + e.v * 2 * np.pi / samples)

    def once(f: Array) -> tuple[Array, Array]:
        path = np.empty_like(w)
        for i in range(samples):
            path[i] = f
            j = (i + 1) % samples
            f = np.clip(f + moves[j], -bound[j], bound[j])
        return f, path

    high, low = once(bound[0])[0], once(-bound[0])[0]
    _, path = once(np.where(e.v > 0, high, np.where(e.v < 0, low, (high + low) / 2)))
    P = 2 * H / samples
    P[:, 0] /= 2
    return path.T @ P, (e.kn * np.maximum(y, 0.0)).T @ P
