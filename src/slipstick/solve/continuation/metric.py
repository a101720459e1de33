"""The scaled arclength in which branches are measured, for one state or for k states in lockstep.

Formulas of this file, of segments and of the step control hold for states ``(..., N + 1)``. One state is ``(N + 1,)``
and its scalars are floats; k states are ``(k, N + 1)`` and their scalars ``(k,)``. Only the primitives at the end of
this file distinguish the two: with arrays of one state a single curve takes 7 % longer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, inf, isfinite, sqrt
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike, NDArray

from slipstick.errors import InputError
from slipstick.typing import Array

_MIN_MAGNITUDE = 1e-12
"""Magnitude of a solution, over the largest so far, below which corrections are measured by this fraction: rounding."""
_VARYING, _MIN_VARYING = 100.0, 1e-8
"""Magnitude that corrections of what varies are measured by: at most this times its own size, for a large constant part
has another accuracy; but no less than a fraction of that of the solution, whose rounding cannot be corrected."""
_MIN_ROW = 1e-6
"""Size of a row of unknowns, over the largest row, below which it is judged by this fraction of the largest."""
_TINY = float(np.finfo(float).tiny)
"""Added to divisors that may be zero."""

Scalars: TypeAlias = Any
"""A float of one state, or (k,) of k states."""
Marks: TypeAlias = Any
"""A bool of one state, or (k,) of k states."""


@dataclass(frozen=True, kw_only=True)
class ArclengthScaling:
    """How the arclength of a branch in (x, parameter) is measured.

    ``ds^2 = sum (weight dx_i / size_i)^2 + (dparameter / parameter)^2`` with ``size_i = x_i`` times, when ``adaptive``,
    the present magnitude ``norm(solution / x)``, renewed from step to step: near a lightly damped resonance the
    solution grows a thousandfold, and a step is then a fraction of what the solution is, not of what it once was.

    Parameters
    ----------
    x
        Typical size of the unknowns, scalar or (N,), positive. None: 1, or, when not adaptive, the magnitude of the
        starting point. When adaptive only the ratios matter (and the value itself while the solution is zero).
    parameter
        Change of the parameter that counts as 1. None: the range followed, ``|stop - start|``.
    adaptive
        Whether the size follows the solution.
    floor
        Smallest magnitude used when adaptive, as a fraction of the largest met so far: a solution may pass zero.
    weight
        A change of the solution by its own size counts as much as this fraction of the parameter scale.
    rows
        Into how many rows of equal length ``x`` is parted, each of which is judged by its own size between points.
    judged
        Which unknowns of a row say how large it is there, (N / rows,) of bool; None: all. A large constant part must
        not hide the error of what varies, and corrections of what varies are measured by its own size.

    Raises
    ------
    InputError
        If a value is not positive and finite.
    """

    x: ArrayLike | None = None
    parameter: float | None = None
    adaptive: bool = True
    floor: float = 1e-3
    weight: float = 0.1
    rows: int = 1
    judged: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        faults = []
        for name in ("x", "parameter", "floor", "weight"):
            value = getattr(self, name)
            if value is not None and not (np.all(np.isfinite(value)) and np.all(np.asarray(value) > 0)):
                faults.append(f"arclength scaling, {name}: found {value}; expected positive finite numbers")
        if faults:
            raise InputError(faults)


class Measure(NamedTuple):
    """Magnitudes that the weights of a metric are made from: floats, or (k,) of k states.

    Attributes
    ----------
    typical
        Typical size of the unknowns, where the scaling gives none.
    size, present
        Magnitude by which arclength is measured, and that for Newton corrections; both over the typical size.
    largest
        Largest magnitude met so far.
    varying
        Magnitude for Newton corrections of the judged unknowns; that of the others is ``present``.
    """

    typical: Scalars
    size: Scalars
    present: Scalars
    largest: Scalars
    varying: Scalars


class Metric:
    """The scaling at work on states ``z = (x, parameter)``, (N + 1,) or (k, N + 1).

    Parameters
    ----------
    scaling
        The scaling; one for all k states.
    x
        First solutions, (N,) or (k, N).
    parameter_range
        Length of the range of the parameter.
    typical
        Typical size of the unknowns where the scaling gives none, a float or (k,).

    Attributes
    ----------
    weights, inverse
        Factors of the shape of z: of arclength, and of Newton corrections relative to the solution.
    measure
        The magnitudes from which both are computed.
    """

    def __init__(self, scaling: ArclengthScaling, x: Array, parameter_range: float, typical: Scalars = 1.0) -> None:
        self._scaling, self._shape = scaling, (*x.shape[:-1], x.shape[-1] + 1)
        self._parameter = 1.0 / (scaling.parameter if scaling.parameter is not None else parameter_range)
        self._shares = np.ones((x.shape[-1] // scaling.rows, 2))
        """Weights of the squares of a row in its whole size, and in the size of its judged coefficients."""
        self._judged: NDArray[np.bool_] | None = None
        if scaling.judged is not None:
            self._shares[:, 1] = scaling.judged
            self._judged = np.tile(scaling.judged, scaling.rows)
        if scaling.x is None and not scaling.adaptive:
            typical = one_if_zero(norms(x))
        one = typical / typical
        self._unit = 1.0 / (column(typical) if scaling.x is None else np.asarray(scaling.x, dtype=float))
        self.measure = Measure(typical, one, one, 0.0 * one, one)
        self.measure = self.renewed(x).measure
        self._weigh()

    def _weigh(self) -> None:
        """Compute the factors from the magnitudes."""
        weights, inverse = np.empty(self._shape), np.empty(self._shape)
        weights[..., :-1] = self._unit * column(self._scaling.weight / self.measure.size)
        present, varying = column(self.measure.present), column(self.measure.varying)
        inverse[..., :-1] = self._unit / (present if self._judged is None else np.where(self._judged, varying, present))
        weights[..., -1] = inverse[..., -1] = self._parameter
        self.weights, self.inverse = weights, inverse

    def renewed(self, x: Array) -> Metric:
        """The metric that follows the magnitude of solutions ``x``, (N,) or (k, N)."""
        if not self._scaling.adaptive:
            return self
        typical, largest = self.measure.typical, self.measure.largest
        scaled = x * self._unit
        magnitude = norms(scaled)
        largest = larger(largest, magnitude)
        size = one_if_zero(larger(self._scaling.floor * largest, magnitude))
        present = one_if_zero(larger(_MIN_MAGNITUDE * largest, magnitude))
        varying = present
        if self._judged is not None:
            own = _VARYING * norms(scaled[..., self._judged])
            varying = larger(_MIN_VARYING * present, smaller(present, own))
        return self.measuring(Measure(typical, size, present, largest, varying))

    def measuring(self, measure: Measure) -> Metric:
        """The metric with other magnitudes."""
        other = Metric.__new__(Metric)
        other._scaling, other._parameter, other._shares = self._scaling, self._parameter, self._shares
        other._judged, other._unit, other._shape, other.measure = self._judged, self._unit, self._shape, measure
        if measure.typical is not self.measure.typical:  # of a different set of states
            other._shape = (*np.shape(measure.typical), self._shape[-1])
            if self._scaling.x is None:
                other._unit = 1.0 / column(measure.typical)
        other._weigh()
        return other

    def at(self, which: Any) -> Metric:
        """The metrics of some of k states."""
        return self.measuring(Measure(*(part[which] for part in self.measure)))

    @classmethod
    def joined(cls, parts: Sequence[Metric]) -> Metric:
        """The metrics of several lots of states, one after the other."""
        measures = zip(*(part.measure for part in parts), strict=True)
        return parts[0].measuring(Measure(*map(np.concatenate, measures)))

    def put(self, which: Any, those: Metric) -> None:
        """Replace, in place, the magnitudes of some of k states."""
        for part, new in zip(self.measure[1:], those.measure[1:], strict=True):
            part[which] = new
        self.weights[which], self.inverse[which] = those.weights, those.inverse

    def length(self, z: Array) -> Scalars:
        """Scaled lengths of vectors."""
        return norms(z * self.weights)

    def cosine(self, a: Array, b: Array) -> Scalars:
        """Cosines of the scaled angles between vectors."""
        a, b = a * self.weights, b * self.weights
        return dots(a, b) / (norms(a) * norms(b) + _TINY)

    def sizes(self, *states: Array) -> Array:
        """Sizes (..., rows) of the judged coefficients of each row, the largest of the states."""
        x = np.array(states)[..., :-1] * self._unit
        squares = (x * x).reshape(*x.shape[:-1], self._scaling.rows, -1) @ self._shares
        largest = squares.max(axis=0) if len(states) > 1 else squares[0]
        return own_sizes(largest[..., 1], largest[..., 0])

    def judged(self, changes: Array, sizes: Array) -> Array:
        """Changes (..., N + 1) over the ``sizes`` (..., rows) of their rows, the largest of each."""
        x = changes[..., :-1] * self._unit
        rows = x.reshape(*x.shape[:-1], sizes.shape[-1], -1)
        relative = np.sqrt(np.vecdot(rows, rows)) / sizes
        largest = relative.max(axis=-1) if sizes.shape[-1] > 1 else relative[..., 0]
        return np.asarray(np.maximum(largest, np.abs(changes[..., -1]) * self._parameter))


def own_sizes(square: Array, whole: Array) -> Array:
    """Sizes (..., rows) by which rows are judged, from squares of their judged coefficients and of the whole rows.

    Rows much smaller than the largest are judged by a fraction of that.
    """
    least = _MIN_ROW * np.sqrt(whole.max(axis=-1, initial=0.0, keepdims=True))
    return np.asarray(np.maximum(np.sqrt(square), least) + _TINY)


# Primitives, the only functions that distinguish one state from k


def dots(a: Array, b: Array) -> Scalars:
    """Scalar products of vectors (..., n)."""
    return float(a.dot(b)) if a.ndim == 1 else np.vecdot(a, b)


def norms(z: Array) -> Scalars:
    """Euclidean norms of vectors (..., n); inf where not finite."""
    if z.ndim == 1:
        square = z.dot(z)
        return sqrt(square) if isfinite(square) else inf
    with np.errstate(over="ignore", invalid="ignore"):
        return np.sqrt(np.fmin(np.vecdot(z, z), inf))


def column(factors: Scalars) -> Scalars:
    """Factors, one for each state, in a shape that multiplies vectors (..., n)."""
    return factors[:, None] if isinstance(factors, ndarray) else factors


def larger(a: Scalars, b: Scalars) -> Scalars:
    """The larger of two scalars; the second has one value for each state."""
    if isinstance(b, ndarray):
        return np.maximum(a, b)
    return b if b > a else a


def smaller(a: Scalars, b: Scalars) -> Scalars:
    """The smaller of two scalars; the second has one value for each state."""
    if isinstance(b, ndarray):
        return np.minimum(a, b)
    return b if b < a else a


def chosen(which: Marks, one: Scalars, other: Scalars) -> Scalars:
    """The one where ``which`` is true, else the other."""
    return np.where(which, one, other) if isinstance(which, ndarray) else one if which else other


def one_if_zero(size: Scalars) -> Scalars:
    """Sizes, with 1 in place of 0."""
    return np.where(size == 0.0, 1.0, size) if isinstance(size, ndarray) else size or 1.0


def angle_of(cosine: Scalars) -> Scalars:
    """Angles of cosines that may exceed 1 by rounding."""
    if isinstance(cosine, ndarray):
        return np.arccos(np.clip(cosine, -1.0, 1.0))
    return acos(max(-1.0, min(1.0, cosine)))


def entries(vectors: Array) -> Sequence[Scalars]:
    """Entries of vectors (..., n), one after the other."""
    return vectors.tolist() if vectors.ndim == 1 else tuple(vectors.T)


def stacked(*vectors: Array) -> Array:
    """Vectors (..., n) of each state below each other, (..., m, n)."""
    return np.array(vectors) if vectors[0].ndim == 1 else np.stack(vectors, axis=-2)


def mixed(shares: Sequence[Scalars], nodes: Array) -> Array:
    """Linear combinations (..., n) of nodes (..., m, n) with some shares."""
    if nodes.ndim == 2:
        return np.array(shares) @ nodes
    p, q, r, s = map(column, shares)
    return np.asarray(p * nodes[:, 0] + q * nodes[:, 1] + r * nodes[:, 2] + s * nodes[:, 3])
