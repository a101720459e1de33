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
    """``H_-`` without the zero harmonic at equidistant times: (2 n, times); the times; the spacing."""

    basis: Array
    times: NDArray[Any]
    step: float


@lru_cache(maxsize=32)
def _grid(orders: tuple[int, ...]) -> _Grid:
    harmonics = Harmonics(orders)
    count = max(32, 8 * harmonics.highest)
    times = np.arange(count, dtype=float) * (2.0 * np.pi / count)
    return _Grid(np.ascontiguousarray(harmonics.H_minus(times)[:, 1:].T), times, 2.0 * np.pi / count)


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


def _candidates(harmonics: Harmonics, flat: Array) -> tuple[NDArray[np.intp], Array]:
    """Grid times next to an extreme that can be the largest: row and time of each, at least one for each row."""
    grid = _grid(harmonics.orders)
    size = np.abs(flat[:, 1:] @ grid.basis)
    # an extreme lies at most half a step from the nearest grid time: what it can be larger by
    m = np.repeat(harmonics.m.astype(float), 2)
    margin = 0.125 * grid.step**2 * (np.abs(flat[:, 1:]) @ (m * m))
    largest = size.max(axis=1)
    near = size >= (largest - margin)[:, None]
    near &= (size >= np.roll(size, 1, axis=1)) & (size >= np.roll(size, -1, axis=1))
    none = ~near.any(axis=1)
    if none.any():
        near[none, size[none].argmax(axis=1)] = True
    rows, columns = np.nonzero(near)
    return rows, grid.times[columns]


def _polished(harmonics: Harmonics, coefficients: Array, times: Array) -> tuple[Array, Array]:
    """Values and times of the extremes next to some times; coefficients (k, 2 n), times (k,)."""
    m, step = harmonics.m.astype(float), _grid(harmonics.orders).step
    c, s = coefficients[:, 0::2], coefficients[:, 1::2]
    t = times.copy()
    for _ in range(8):
        angle = t[:, None] * m
        cos, sin = np.cos(angle), np.sin(angle)
        slope = ((s * cos - c * sin) @ m) if m.size else np.zeros_like(t)
        curvature = -((c * cos + s * sin) @ (m * m))
        change = np.divide(-slope, curvature, out=np.zeros_like(t), where=curvature != 0)
        change = np.clip(change, times - step - t, times + step - t)
        t += change
        if not change.size or np.abs(change).max() < 1e-9:
            break
    angle = t[:, None] * m
    cos, sin = np.cos(angle), np.sin(angle)
    value = (c * cos + s * sin).sum(axis=1)
    start = times[:, None] * m
    before = (c * np.cos(start) + s * np.sin(start)).sum(axis=1)
    worse = np.abs(value) < np.abs(before)
    return np.where(worse, before, value), np.where(worse, times, t)


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
