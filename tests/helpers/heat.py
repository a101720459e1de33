"""Powers of temperature with equilibria that are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Array = np.ndarray


LOAD, VELOCITY, T0, R = 20.0, 5.0, 25.0, 8.0


def permanent_slip(mu: Callable[[Array], Array], dmu: Callable[[Array], Array], heat: Array) -> Callable:
    return lambda T: (heat * mu(T), heat * dmu(T))


def steep(rng: np.random.Generator, n: int) -> tuple[Callable, Array]:
    """Power that rises steeply somewhere, as where a hot contact starts to slip; n elements."""
    at, width = rng.uniform(60, 300, n), rng.uniform(2, 40, n)
    base, gain = rng.uniform(0.5, 8, n), rng.uniform(2, 40, n)
    fall = rng.uniform(0, 0.004, n)

    def power(T: Array) -> tuple[Array, Array]:
        grown = 1 / (1 + np.exp(-(T - at) / width))
        decay = np.exp(-fall * (T - 20))
        value = (base + gain * grown) * decay
        return value, gain * grown * (1 - grown) / width * decay - fall * value

    return power, np.full(n, 20.0)


def brute_roots(power: Callable, background: Array, r: float, limits: tuple[float, float]) -> list[Array]:
    """Sign changes on a fine grid, all elements at once."""
    grid = np.linspace(*limits, 40001)
    G = np.array([t - background - r * power(np.full_like(background, t))[0] for t in grid])
    return [grid[np.flatnonzero(np.diff(np.sign(G[:, i])) != 0)] for i in range(background.size)]


def surface(rng: np.random.Generator, n: int, coupling: float) -> Array:
    """A symmetric positive influence matrix with positive entries, as conduction gives."""
    at = rng.uniform(0, 1, (n, 2))
    distance = np.linalg.norm(at[:, None] - at[None], axis=-1)
    return 8.0 * (np.eye(n) + coupling * np.exp(-3 * distance) * (1 - np.eye(n)))
