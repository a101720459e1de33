"""All thermal equilibria in a range of temperatures, for contacts whose friction falls steeply as they heat up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from slipstick.state.thermal.equilibrium import (
    SHORTEST_CELL,
    PowerFunction,
    TemperatureCells,
    bracketed,
    checked,
    dissipated,
    equilibrium,
    is_stable,
    onto,
)
from slipstick.typing import Array, BoolArray

Scalar = Callable[[float], tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class ElementEquilibria:
    """Every equilibrium of one element, ascending: temperatures (k,) and which ones are stable (k,)."""

    temperature: Array
    stable: BoolArray

    @property
    def several(self) -> bool:
        """Whether the result depends on the history."""
        return self.temperature.size > 1


def element_equilibria(
    evaluate: PowerFunction,
    background: ArrayLike,
    resistance: ArrayLike,
    *,
    limits: tuple[ArrayLike, ArrayLike],
    knots: ArrayLike | None = None,
    divisions: int = 96,
) -> list[ElementEquilibria]:
    """All equilibria of each element that does not heat the others, within the limits.

    The range is divided at ``knots`` (the rows of the tables) and into ``divisions``. A cell is halved until the values
    and slopes at its ends leave no room for a further root. Arguments as in ``equilibrium``.

    Examples
    --------
    >>> def power(T):  # rises steeply at 100
    ...     grown = 1.0 / (1.0 + np.exp((100.0 - T) / 5.0))
    ...     return 2.0 + 20.0 * grown, 4.0 * grown * (1.0 - grown)
    >>> [found] = element_equilibria(power, [20.0], 8.0, limits=(20.0, 300.0))
    >>> found.temperature.round(1), found.stable
    (array([ 36. ,  97.7, 196. ]), array([ True, False,  True]))
    """
    evaluate = dissipated(evaluate)
    T0, R, (low, high) = checked(background, resistance, limits)
    if R.ndim == 2:
        R = R.diagonal()
    cuts = np.linspace(0.0, 1.0, divisions + 1)
    inner = np.empty(0) if knots is None else np.asarray(knots, dtype=float)
    grid = low + (high - low) * cuts[:, None]
    grid = np.sort(
        np.concatenate([grid, np.clip(np.broadcast_to(inner[:, None], (inner.size, T0.size)), low, high)]), 0
    )
    sampled = [_balance(evaluate, T0, R, level) for level in grid]
    roots = []
    for i in range(T0.size):
        balance = _one(evaluate, T0, R, grid[0], i)
        samples = [(float(grid[k, i]), float(G[i]), float(dG[i])) for k, (G, dG) in enumerate(sampled)]
        for end in (0, -1):
            samples[end] = _rounded_to_root(samples[end], T0[i])
        roots.append(_roots(balance, samples))
    return roots


@dataclass(frozen=True, kw_only=True)
class SurfaceEquilibria:
    """Equilibria found for elements that heat each other: temperatures (k, n), which ones are stable (k,)."""

    temperature: Array
    stable: BoolArray

    @property
    def several(self) -> bool:
        """Whether the result depends on the history."""
        return len(self.temperature) > 1


def surface_equilibria(
    evaluate: PowerFunction,
    background: ArrayLike,
    resistance: ArrayLike,
    *,
    limits: tuple[ArrayLike, ArrayLike],
    starts: int = 40,
) -> SurfaceEquilibria:
    """Equilibria of a coupled surface from many starts, within the limits; ascending in the mean.

    Starts are uniform and scattered temperatures. From each equilibrium found, each single element then starts at its
    other equilibria in the heat of the others, until nothing new appears. Some may be missed; where elements do not
    heat each other ``element_equilibria`` finds all.
    """
    evaluate = dissipated(evaluate)
    T0, R, (lowest, highest) = checked(background, resistance, limits)
    R = np.diag(R) if R.ndim == 1 else R
    low, high = _starting_range(evaluate, T0, R, lowest, highest)
    scattered = np.random.default_rng(0).uniform(0.0, 1.0, (starts, T0.size))
    levels = np.concatenate([np.linspace(0.0, 1.0, 13)[:, None] * np.ones(T0.size), scattered])
    pending = list(low + (high - low) * levels)
    size = max(float(np.abs(T0).max()), float((high - low).max()))
    equilibria: list[Array] = []
    while pending and len(equilibria) < _MOST_FOUND:
        start = pending.pop()
        reached = equilibrium(evaluate, T0, R, limits=(lowest, highest), start=start)
        candidates = [reached.temperature] if reached.converged else []
        candidates += _plain_newton(evaluate, T0, R, start, lowest, highest)
        for T in (onto(T, T0, (lowest, highest)) for T in candidates):
            new = all(np.abs(T - old).max() > _SAME * size for old in equilibria)
            if new and np.array_equal(np.clip(T, lowest, highest), T):
                equilibria.append(T)
                pending += _one_changed(evaluate, T0, R, T, low, high)
    equilibria.sort(key=lambda T: float(T.mean()))
    stable = [is_stable(R, evaluate(T)[1]) for T in equilibria]
    return SurfaceEquilibria(temperature=np.array(equilibria).reshape(-1, T0.size), stable=np.array(stable, dtype=bool))


_MOST_FOUND = 200
"""Equilibria of a surface, at most."""
_SAME = 1e-7
"""Distance of equal equilibria, over the largest temperature or range."""


def _starting_range(evaluate: PowerFunction, T0: Array, R: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Range of the starts; of elements without a table up to twice the rise by the powers at the background."""
    rise = 2.0 * np.abs(R @ evaluate(T0)[0]) + 1.0
    return np.where(np.isfinite(low), low, T0), np.where(np.isfinite(high), high, T0 + rise)


def _one_changed(evaluate: PowerFunction, T0: Array, R: Array, T: Array, low: Array, high: Array) -> list[Array]:
    """Starts with one element at another of its equilibria, heated by the others as they are."""
    diagonal = R.diagonal()
    heated = np.clip(T0 + R @ evaluate(T)[0] - diagonal * evaluate(T)[0], low, high)
    starts = []
    for i, roots in enumerate(element_equilibria(evaluate, heated, diagonal, limits=(low, high), divisions=48)):
        for root in roots.temperature:
            start = T.copy()
            start[i] = root
            starts.append(start)
    return starts


def _plain_newton(evaluate: PowerFunction, T0: Array, R: Array, T: Array, low: Array, high: Array) -> list[Array]:
    """Temperatures at which plain Newton converges, [] where it does not."""
    for _ in range(30):
        power, slope = evaluate(T)
        try:
            step = np.linalg.solve(np.eye(T.size) - R * slope, T0 + R @ power - T)
        except np.linalg.LinAlgError:
            return []
        if np.all(np.abs(step) <= 1e-11 * np.maximum(np.abs(T).max(), np.abs(T - T0).max()) + np.finfo(float).tiny):
            return [T]
        T = np.clip(T + step, low, high)
    return []


def _balance(evaluate: PowerFunction, T0: Array, R: Array, T: Array) -> tuple[Array, Array]:
    """``G = T - T0 - R Edot`` and its derivative, element-wise."""
    power, slope = evaluate(T)
    return T - T0 - R * power, 1.0 - R * slope


def _one(evaluate: PowerFunction, T0: Array, R: Array, others: Array, i: int) -> Scalar:
    def balance(t: float) -> tuple[float, float]:
        T = others.copy()
        T[i] = t
        G, dG = _balance(evaluate, T0, R, T)
        return float(G[i]), float(dG[i])

    return balance


def _rounded_to_root(sample: tuple[float, float, float], T0: float) -> tuple[float, float, float]:
    """An end of a range, with ``G = 0`` where it differs from that by rounding alone."""
    t, G, dG = sample
    return t, 0.0 if abs(G) <= 1e-14 * max(abs(t), abs(t - T0)) else G, dG


def _roots(balance: Scalar, samples: list[tuple[float, float, float]]) -> ElementEquilibria:
    span = samples[-1][0] - samples[0][0]
    roots: list[float] = [samples[0][0]] if samples[0][1] == 0 else []
    cells = list(pairwise(samples))[::-1]
    while cells:
        left, right = cells.pop()
        if (
            right[0] - left[0] > SHORTEST_CELL * span
            and TemperatureCells(*np.array((*left, *right))).may_hold_more_roots()
        ):
            middle = 0.5 * (left[0] + right[0])
            between = (middle, *balance(middle))
            cells += [(between, right), (left, between)]
        elif right[1] == 0:
            roots.append(right[0])
        elif left[1] * right[1] < 0:
            a, Ga, b = (np.array([end]) for end in (left[0], left[1], right[0]))
            root, _ = bracketed(lambda T: _arrays(balance(float(T[0]))), a, Ga, b, lambda T: 2e-16 * np.abs(T))
            roots.append(float(root[0]))
    temperature = np.array(roots)
    return ElementEquilibria(
        temperature=temperature, stable=np.array([balance(t)[1] > 0 for t in temperature], dtype=bool)
    )


def _arrays(values: tuple[float, float]) -> tuple[Array, Array]:
    return np.array(values[:1]), np.array(values[1:])
