"""What is measured on a periodic motion given by its coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.trig.harmonics import Harmonics

Array = NDArray[np.float64]


class Amplitude(NamedTuple):
    """Amplitude, the time at which it is reached (rad), and the sign of the deviation there; all of one shape."""

    value: Array
    time: Array
    sign: Array


class _Grid(NamedTuple):
    """What depends on the orders alone: ``H_-`` without the zero harmonic at equidistant times, and powers of ``m``."""

    basis: Array
    """(2 n, times)."""
    times: NDArray[Any]
    step: float
    order: NDArray[Any]
    """``i m`` (n,)."""
    derivatives: NDArray[Any]
    """Factors of value, first and second derivative on ``exp(i m t)``, (n, 3)."""
    margin: Array
    """How much each coefficient can lift an extreme above the nearest grid time, (2 n,)."""


@lru_cache(maxsize=32)
def _grid(orders: tuple[int, ...]) -> _Grid:
    harmonics = Harmonics(orders)
    count = max(32, 8 * harmonics.highest)
    step, m = 2.0 * np.pi / count, harmonics.m.astype(float)
    times = np.arange(count, dtype=float) * step
    basis = np.ascontiguousarray(harmonics.H_minus(times)[:, 1:].T)
    factors = np.stack([np.ones_like(m), 1j * m, -m * m], axis=1)
    return _Grid(basis, times, step, 1j * m, factors, 0.125 * step**2 * np.repeat(m * m, 2))


def amplitude(harmonics: Harmonics, X: ArrayLike) -> Amplitude:
    """``max over the period of |x - zero harmonic|``, exact to rounding.

    Parameters
    ----------
    harmonics
        The harmonic set, L coefficients.
    X
        Coefficients (..., L).

    Returns
    -------
    Amplitude
        Of shape (...): the extremes of a grid that can be the largest are polished by Newton's method on ``x' = 0``.

    Examples
    --------
    >>> float(amplitude(Harmonics([0, 1]), [7.0, 3.0, 4.0]).value)
    5.0
    """
    X = np.asarray(X, dtype=float)
    flat = X.reshape(-1, harmonics.size)
    if harmonics.n == 0:
        zero = np.zeros(X.shape[:-1])
        return Amplitude(zero, zero, zero + 1.0)
    rows, times = _candidates(harmonics, flat)
    value, time = _polished(harmonics, flat[rows, 1:], times)
    best = _largest(rows, np.abs(value), len(flat))
    shape = X.shape[:-1]
    found = value[best]
    return Amplitude(
        np.abs(found).reshape(shape),
        (time[best] % (2.0 * np.pi)).reshape(shape),
        np.where(found < 0, -1.0, 1.0).reshape(shape),
    )


def largest_deviation(harmonics: Harmonics, X: Array) -> Array:
    """``amplitude`` to about a percent, from a grid of times: X (..., L) to (...)."""
    if harmonics.n == 0:
        return np.zeros(X.shape[:-1])
    return np.asarray(np.abs(X[..., 1:] @ _grid(harmonics.orders).basis).max(axis=-1))


def _candidates(harmonics: Harmonics, flat: Array) -> tuple[NDArray[np.intp], Array]:
    """Grid times next to an extreme that can be the largest: row and time of each, at least one for each row."""
    grid = _grid(harmonics.orders)
    dynamic = flat[:, 1:]
    size = np.abs(dynamic @ grid.basis)
    # an extreme lies at most half a step from the nearest grid time
    least = size.max(axis=1) - np.abs(dynamic) @ grid.margin
    rows, columns = np.nonzero(size >= least[:, None])
    here = size[rows, columns]
    top = (here >= size[rows, columns - 1]) & (here >= size[rows, (columns + 1) % grid.times.size])
    return rows[top], grid.times[columns[top]]


def _polished(harmonics: Harmonics, coefficients: Array, times: Array) -> tuple[Array, Array]:
    """Values and times of the extremes next to some times; coefficients (k, 2 n), times (k,)."""
    grid = _grid(harmonics.orders)
    z, t = coefficients[:, 0::2] - 1j * coefficients[:, 1::2], times
    value, slope, curvature = _taylor(z, t, grid)
    first = value
    for _ in range(8):
        change = np.divide(-slope, curvature, out=np.zeros_like(t), where=curvature != 0)
        moved = np.minimum(np.maximum(t + change, times - grid.step), times + grid.step)
        done = float(np.abs(moved - t).max(initial=0.0)) < 1e-8
        t = moved
        value, slope, curvature = _taylor(z, t, grid)
        if done:
            break
    worse = np.abs(value) < np.abs(first)
    if worse.any():
        value, t = np.where(worse, first, value), np.where(worse, times, t)
    return value, t


def _taylor(z: NDArray[Any], t: Array, grid: _Grid) -> tuple[Array, Array, Array]:
    """Value, first and second derivative at times (k,) of ``Re sum z exp(i m t)``, z (k, n)."""
    parts = ((z * np.exp(t[:, None] * grid.order)) @ grid.derivatives).real
    return parts[:, 0], parts[:, 1], parts[:, 2]


def _largest(rows: NDArray[np.intp], size: Array, count: int) -> NDArray[np.intp]:
    """Index of the largest of each row; ``rows`` is ascending and holds every row."""
    if len(rows) == count:
        return np.arange(count)
    order = np.lexsort((size, rows))
    last = np.searchsorted(rows, np.arange(count), side="right") - 1
    return order[last]


def amplitude_slope(harmonics: Harmonics, at: Amplitude, dX: ArrayLike) -> Array:
    """Change of the amplitude with a change ``dX`` (..., L) of the motion: at its own time (envelope theorem)."""
    H = harmonics.H_minus(at.time)
    H[..., 0] = 0.0
    change: Array = at.sign * (H * np.asarray(dX, dtype=float)).sum(axis=-1)
    return change


def friction_force(
    harmonics: Harmonics,
    states: Sequence[tuple[float, float, str]],
    tau: ArrayLike,
    *,
    W: ArrayLike,
    Y: ArrayLike,
    v: float,
    kt: float,
    mu: float,
    kn: float,
    gap: float,
    mean: float,
) -> Array:
    """Friction force of one contact at times ``tau`` (n,), exactly, not as a truncated series.

    Parameters
    ----------
    states
        Intervals (start, end, state) as ``ContactForces.states`` gives them.
    W, Y
        Coefficients (L,) of the tangential motion with the periodic rubbing motion, and of the normal motion.
    v
        Rubbing velocity over omega.
    mean
        Zero harmonic of the force: it settles the level of a contact stuck all period.
    """
    tau, W, Y = np.asarray(tau, dtype=float), np.asarray(W, dtype=float), np.asarray(Y, dtype=float)
    limit = mu * kn * np.maximum(harmonics.H_minus(tau) @ Y - gap, 0.0)
    force = np.zeros_like(tau)
    for k, (start, end, state) in enumerate(states):
        since = (tau - start) % (2.0 * np.pi)
        inside = since <= end - start
        if state in ("slip+", "slip-"):
            force[inside] = limit[inside] if state == "slip+" else -limit[inside]
        elif state == "stick" and len(states) == 1:
            force = mean + kt * (harmonics.H_minus(tau) @ W - W[0])
        elif state == "stick":
            sign = {"slip+": 1.0, "slip-": -1.0}.get(states[k - 1][2], 0.0)
            begin = sign * mu * kn * max(float(harmonics.H_minus(start) @ Y) - gap, 0.0)
            moved = v * since + harmonics.H_minus(tau) @ W - float(harmonics.H_minus(start) @ W)
            force[inside] = (begin + kt * moved)[inside]
    return force
