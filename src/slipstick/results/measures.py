"""Amplitude and phase of a periodic motion given by its harmonic coefficients."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array


class Amplitude(NamedTuple):
    """Amplitude, the time at which it is reached (rad), and the sign of the deviation there; all of one shape."""

    value: Array
    time: Array
    sign: Array


@lru_cache(maxsize=32)
def _times(orders: tuple[int, ...]) -> Array:
    """``H_-`` without the mean at equidistant times, (2 n, times)."""
    harmonics = Harmonics(orders)
    count = max(32, 8 * harmonics.highest)
    return np.ascontiguousarray(harmonics.H_minus(np.arange(count) * (2.0 * np.pi / count))[:, 1:].T)


def amplitude(harmonics: Harmonics, X: ArrayLike) -> Amplitude:
    """``max over the period of |x - mean|``, exact to rounding.

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
    value, time = np.empty(len(flat)), np.empty(len(flat))
    for rows, of_form in _forms(flat):
        value[rows], time[rows] = of_form(harmonics, flat[rows])
    shape = X.shape[:-1]
    sign = np.where(value < 0, -1.0, 1.0)
    return Amplitude(np.abs(value).reshape(shape), time.reshape(shape), sign.reshape(shape))


def largest_deviation(harmonics: Harmonics, X: Array) -> Array:
    """``amplitude`` to about a percent, from a grid of times: X (..., L) to (...)."""
    if harmonics.n == 0:
        return np.zeros(X.shape[:-1])
    return np.asarray(np.abs(X[..., 1:] @ _times(harmonics.orders)).max(axis=-1))


_Form = Callable[[Harmonics, Array], tuple[Array, Array]]


def _forms(X: Array) -> Iterator[tuple[slice | NDArray[np.intp], _Form]]:
    """Rows of one form (k, L), and what gives their largest deviations and times: one harmonic is in closed form.

    The form is chosen row by row, so that a result does not depend on the other rows.
    """
    single = (X[:, 1:] != 0.0).sum(axis=1) <= 2
    if not single.any():
        yield slice(None), _of_several
        return
    rows = np.flatnonzero(single)
    single[rows] = np.count_nonzero(np.hypot(X[rows, 1::2], X[rows, 2::2]), axis=1) <= 1
    if single.all() or not single.any():
        yield slice(None), _of_one_harmonic if single.all() else _of_several
    else:
        yield np.flatnonzero(single), _of_one_harmonic
        yield np.flatnonzero(~single), _of_several


def _of_one_harmonic(harmonics: Harmonics, X: Array) -> tuple[Array, Array]:
    """Largest deviation and its time of rows (k, L) that move with one harmonic each."""
    sizes = np.hypot(X[:, 1::2], X[:, 2::2])
    rows, largest = np.arange(len(X)), sizes.argmax(axis=1)
    angle = np.arctan2(X[rows, 2 * largest + 2], X[rows, 2 * largest + 1])
    return sizes[rows, largest], np.mod(angle, 2.0 * np.pi) / harmonics.m[largest]


def _of_several(harmonics: Harmonics, X: Array) -> tuple[Array, Array]:
    """Largest deviation and its time of rows (k, L); compiled, and linear responses do without."""
    from slipstick.trig.extremes import largest_deviations

    return largest_deviations(harmonics, X)


def amplitude_with_slope(harmonics: Harmonics, X: Array, dX: Array) -> tuple[Array, Array]:
    """Amplitudes (...) of motions ``X`` (..., L), and their changes with changes ``dX`` (..., L) of the motions.

    An amplitude changes as the motion does at the time of its extreme (envelope theorem).
    """
    if harmonics.n == 0:
        return np.zeros(X.shape[:-1]), np.zeros(X.shape[:-1])
    from slipstick.trig.extremes import largest_with_changes

    shape = X.shape[:-1]
    value, change = largest_with_changes(harmonics, X.reshape(-1, harmonics.size), dX.reshape(-1, harmonics.size))
    return np.abs(value).reshape(shape), np.copysign(change, value * change).reshape(shape)


def phase_of(X: Array, harmonic: int, parts: ArrayLike, least: float) -> Array:
    """Phase of a harmonic along a branch, degrees: of ``amplitude * cos(m tau + phase)``, as loads are given.

    Parameters
    ----------
    X
        Coefficients (n, L) of one dof.
    harmonic
        Place of the harmonic in the set, from 1.
    parts
        Part of the branch that each point belongs to, (n,): the phase goes on without jumps within each.
    least
        An amplitude of the harmonic up to this one is rounding and has no phase (nan).
    """
    z = X[:, 2 * harmonic - 1] - 1j * X[:, 2 * harmonic]
    known, parts = np.abs(z) > least, np.asarray(parts)
    angle = np.where(known, np.angle(z), np.nan)
    for part in np.unique(parts):
        inside = known & (parts == part)
        angle[inside] = np.unwrap(angle[inside])
    return np.degrees(angle)
