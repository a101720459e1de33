"""The slope of an amplitude over the solutions of the balance, and the gradient of that slope.

With ``R(X, w, s) = 0``, an amplitude ``a`` of gradient ``g`` and one factorisation of ``J = R_X``:
``t = -J^-1 R_w``, ``z = J^-T g``, ``G = da/dw = g . t + a_w = a_w - z . R_w``. With z and t held, G is the derivative
of ``a - z . R`` along ``(t, 1)``, so that its gradient is the change along ``(t, 1)`` of the gradient of that: one
central difference of exact first derivatives and no further factorisation. The same holds over s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from slipstick.analysis.sensitivity.linearization import FREQUENCY, Linearization, Move
from slipstick.balance.inputs import Inputs, Path
from slipstick.results.measures import amplitude
from slipstick.results.record import Outputs
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_STEP = 1e-6
"""Of the state, over which exact first derivatives are differenced."""
_SAME = 1e-6
"""Times (rad) that are one."""
_TIED = 1e-8
"""Relative difference of extremes that are equal: points are solved to less."""
_SEEN = 0.7
"""Part of an extreme that the nearest of the times looked at shows, at least: cos(pi / 8) and less."""
_PARTS = np.linspace(0.0, 1.0, 9)[1:]
_HILL, _LEAST_APART = 1.0, 1e-3
"""Way of an extreme over a part of a step above which it is another one, of the period of the highest order over
2 pi; and times (rad) at the end of a step that are those of one extreme."""
FLAT = 1e-6
"""Slope over the sizes of its terms above which a point is no smooth peak."""


@dataclass(frozen=True)
class Extreme:
    """An extreme in time of a motion about its mean."""

    harmonics: Harmonics
    value: float
    """Its size: an amplitude where it is the largest."""
    time: float
    sign: float

    @classmethod
    def largest(cls, harmonics: Harmonics, U: Array) -> Extreme:
        """The largest of a motion ``U`` (L,)."""
        largest = amplitude(harmonics, U)
        return cls(harmonics, float(largest.value), float(largest.time), float(largest.sign))

    @classmethod
    def near(cls, harmonics: Harmonics, U: Array, time: float) -> Extreme:
        """The one that a time lies below, by Newton's method uphill; the largest where there is none."""
        from slipstick.trig.extremes import extreme_above

        t, value, curvature = extreme_above(harmonics, U, time)
        if value * curvature >= 0.0:
            return cls.largest(harmonics, U)
        return cls(harmonics, abs(value), t % (2.0 * np.pi), float(np.sign(value)))

    def goes_on_as(self, other: Extreme, first: Array, second: Array) -> bool:
        """Whether it becomes ``other`` where the motion (L,) goes straight from ``first`` to ``second``."""
        now = self
        for part in _PARTS:
            moved = Extreme.near(self.harmonics, first + part * (second - first), now.time)
            if moved.sign != now.sign or _apart(moved.time, now.time) > _HILL / self.harmonics.highest:
                return False
            now = moved
        return _apart(now.time, other.time) <= _LEAST_APART and now.sign == other.sign

    def ahead(self, U: Array) -> float:
        """The largest other extreme of the motion over this one, less 1; -1 where there is none."""
        rival = self.rival(U)
        return rival.value / self.value - 1.0 if rival is not None and self.value > 0.0 else -1.0

    def rival(self, U: Array) -> Extreme | None:
        """The largest other extreme of the motion."""
        return max(self._others(U), key=lambda other: other.value, default=None)

    def tied(self, U: Array) -> list[Extreme]:
        """The other extremes that are as large as this one: of a motion that is symmetric about its mean."""
        least = (1.0 - _TIED) * self.value
        return [other for other in self._others(U, least) if other.value >= least] if self.value > 0.0 else []

    def _others(self, U: Array, least: float = 0.0) -> Iterator[Extreme]:
        """All others that can be larger than ``least``."""
        times, H = _waves(self.harmonics)
        size = np.abs(H @ U[1:])
        tops = (size >= np.roll(size, 1)) & (size >= np.roll(size, -1)) & (size >= _SEEN * least)
        for k in np.flatnonzero(tops):
            other = Extreme.near(self.harmonics, U, float(times[k]))
            if _apart(other.time, self.time) > _SAME:
                yield other

    @property
    def h(self) -> Array:
        """Its derivative by the motion, (1, L): ``sign H_-(time)`` without the mean."""
        H = self.sign * self.harmonics.H_minus(self.time)[None]
        H[0, 0] = 0.0
        return H


def _apart(time: float, other: float) -> float:
    """Distance (rad) of two times of a period."""
    return abs(float(np.remainder(time - other + np.pi, 2.0 * np.pi)) - np.pi)


@lru_cache(maxsize=16)
def _waves(harmonics: Harmonics) -> tuple[Array, Array]:
    """Times (k,) near to each other over a period, and ``H_-`` without the mean there, (k, 2 n)."""
    count = 8 * max(1, harmonics.highest)
    times = np.asarray(np.arange(2 * count) * (np.pi / count), dtype=float)
    return times, harmonics.H_minus(times)[:, 1:]


class StateSpace:
    """The states ``(X, w, s)`` of a problem with one output: a parameter moves along its path, if there is one."""

    def __init__(self, outputs: Outputs, inputs: Inputs, path: Path | None = None) -> None:
        self.outputs, self.inputs, self.path = outputs, inputs, path
        self._latest: tuple[float, Inputs] | None = None

    def at(self, x: Array, omega: float, value: float, near: Array | None = None) -> Linearization:
        """The balance linearised at a state."""
        return Linearization(self.outputs, x, omega, self.at_value(value), near)

    def at_value(self, value: float) -> Inputs:
        """Inputs at a value of the parameter, the latest of which are remembered."""
        if self.path is None:
            return self.inputs
        if self._latest is None or self._latest[0] != value:
            self._latest = value, self.path.at(value)[0]
        return self._latest[1]

    def along(self, value: float) -> Move:
        """The direction of the parameter."""
        assert self.path is not None
        return Move(inputs=self.path.at(value)[1])


class PeakGradient:
    """``da/dw``, or ``da/ds``, of an extreme at a state.

    Parameters
    ----------
    here, value
        The state, and the value of the parameter there.
    over
        The direction: of the frequency or of the parameter.
    z
        ``J^-T g`` where it is known.
    """

    def __init__(
        self, surface: StateSpace, here: Linearization, value: float, extreme: Extreme, over: Move = FREQUENCY,
        z: Array | None = None,
    ) -> None:  # fmt: skip
        self._surface, self._here, self._s, self.extreme, self.over = surface, here, value, extreme, over
        self.R, U = here.change(np.zeros_like(here.x), over)
        self.z = here.jacobian.solve(here.pull(h=extreme.h), transposed=True) if z is None else z
        self.t = -here.jacobian.solve(self.R)
        self.value = float(np.sum(extreme.h * U) - self.z @ self.R)
        self.size = float(np.abs(extreme.h * U).sum() + np.abs(self.z) @ np.abs(self.R))
        """Of the terms that ``value`` is the sum of."""

    def displaced(self, scale: float) -> Displaced:
        """The states on both sides along ``(t, 1)``; ``scale`` is a change of what varies that counts as 1."""
        here, over_w = self._here, self.over.omega
        length, size = float(np.linalg.norm(self.t)), float(np.linalg.norm(here.x))
        step = _STEP * (min(scale, size / length) if length > 0 and size > 0 else scale)
        near = here.detail.carried
        sides = []
        for side in (step, -step):
            moved = (side, 0.0) if over_w else (0.0, side)
            sides.append(self._surface.at(here.x + side * self.t, here.omega + moved[0], self._s + moved[1], near))
        return Displaced(self, (sides[0], sides[1]), step, (self._s + step, self._s - step))


class Displaced:
    """The gradient of a slope from the first derivatives on both sides of a state.

    ``values`` are what varies there, where that is the parameter.
    """

    def __init__(
        self, slope: PeakGradient, sides: tuple[Linearization, Linearization], step: float, values: tuple[float, float]
    ) -> None:
        self._z, self.sides, self._step, self.values = slope.z, sides, step, values
        h, time = slope.extreme.harmonics, slope.extreme.time
        self._h = [Extreme.near(h, side.motion()[0], time).h for side in sides]

    def by_motion(self) -> Array:
        """Over the unknowns (N,)."""
        up, down = (side.pull(h=h, z=-self._z) for side, h in zip(self.sides, self._h, strict=True))
        return np.asarray((up - down) / (2.0 * self._step))

    def along(self, *directions: Move) -> float:
        """Along a direction at fixed motion: one for both sides, or one for each."""
        functionals = []
        for side, h, direction in zip(self.sides, self._h, (directions[0], directions[-1]), strict=True):
            R, U = side.change(np.zeros_like(side.x), direction)
            functionals.append(float(np.sum(h * U) - self._z @ R))
        return (functionals[0] - functionals[1]) / (2.0 * self._step)
