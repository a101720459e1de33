"""How the length of a branch is measured."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.errors import InputError
from slipstick.solve.norm import norm
from slipstick.typing import Array

_VANISHED = 1e-12
"""Fraction of the largest magnitude met below which corrections are no longer measured by the solution itself."""
STILL = 1e-6
"""Fraction of the largest part of a solution below which another is as good as nothing."""
_TINY = float(np.finfo(float).tiny)


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
        not hide the error of what varies.

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


class Metric:
    """The scaling at work on states ``z = (x, parameter)`` (N + 1,).

    ``weights`` (N + 1,) measure arclength, ``inverse`` (N + 1,) measures Newton corrections relative to the solution.
    """

    def __init__(self, scaling: ArclengthScaling, x: Array, parameter_range: float) -> None:
        self._scaling, self._shape = scaling, x.shape
        self._unit = np.broadcast_to(1.0 / np.asarray(1.0 if scaling.x is None else scaling.x, dtype=float), x.shape)
        self._parameter = 1.0 / (scaling.parameter if scaling.parameter is not None else parameter_range)
        rows = x.size // scaling.rows
        self._shares = np.ones((rows, 2))
        """Of the squares of a row in its whole size, and in that of what is judged."""
        if scaling.judged is not None:
            self._shares[:, 1] = scaling.judged
        self.weights = self.inverse = np.empty(0)
        self.measure = (1.0 if scaling.adaptive else norm(x) or 1.0, 1.0, 1.0, 0.0)
        if scaling.adaptive:
            self.renew(x)

    @property
    def measure(self) -> tuple[float, float, float, float]:
        """What the weights are made from: typical size where none is given, sizes for arclength and for corrections,
        largest magnitude met. Set, it brings the metric back to where it was."""
        return self._measure

    @measure.setter
    def measure(self, parts: tuple[float, float, float, float]) -> None:
        self._measure = typical, size, present, _ = parts
        if self._scaling.x is None:
            self._unit = np.broadcast_to(1.0 / np.asarray(typical), self._shape)
        inverse, weights = np.empty(self._unit.size + 1), np.empty(self._unit.size + 1)
        np.divide(self._unit, present, out=inverse[:-1])
        np.multiply(self._unit, self._scaling.weight / size, out=weights[:-1])
        inverse[-1] = weights[-1] = self._parameter
        self.inverse, self.weights = inverse, weights

    def renew(self, x: Array) -> None:
        """Follow the magnitude of the solution ``x`` (N,)."""
        if not self._scaling.adaptive:
            return
        typical, _, _, largest = self._measure
        magnitude = norm(x * self._unit)
        largest = max(largest, magnitude)
        size = max(magnitude, self._scaling.floor * largest) or 1.0
        self.measure = (typical, size, max(magnitude, _VANISHED * largest) or 1.0, largest)

    def sizes(self, *states: Array) -> Array:
        """Size (rows,) of each row of what is judged, the largest of the states (N + 1,)."""
        x = np.array(states)[:, :-1] * self._unit
        squares = (x * x).reshape(len(states), self._scaling.rows, -1) @ self._shares
        whole, judged = squares.max(axis=0).T if len(states) > 1 else squares[0].T
        return own_sizes(judged, whole)

    def judged(self, changes: Array, sizes: Array) -> Array:
        """Changes (n, N + 1) over the ``sizes`` of their rows, the largest of each: (n,)."""
        rows = (changes[:, :-1] * self._unit).reshape(len(changes), sizes.size, -1)
        relative = np.sqrt(np.vecdot(rows, rows)) / sizes
        largest = relative.max(axis=1) if sizes.size > 1 else relative[:, 0]
        return np.asarray(np.maximum(largest, np.abs(changes[:, -1]) * self._parameter))

    def length(self, vector: Array) -> float:
        """Scaled length of a vector (N + 1,)."""
        return norm(vector * self.weights)

    def lengths(self, vectors: Array) -> Array:
        """Scaled lengths (n,) of vectors (n, N + 1)."""
        scaled = vectors * self.weights
        return np.asarray(np.sqrt(np.vecdot(scaled, scaled)))

    def cosine(self, a: Array, b: Array) -> float:
        """Cosine of the scaled angle between two vectors."""
        a, b = a * self.weights, b * self.weights
        return float(a.dot(b)) / (norm(a) * norm(b) or np.inf)


def own_sizes(square: Array, whole: Array) -> Array:
    """Sizes (rows,) by which rows are judged: squares of what is judged of them, and of the rows as a whole.

    What is as good as nothing beside the largest is judged by that.
    """
    least = STILL * sqrt(whole.max(initial=0.0))
    return np.asarray(np.maximum(np.sqrt(square), least) + _TINY)
