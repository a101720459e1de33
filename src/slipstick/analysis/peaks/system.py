"""A peak of an amplitude as a system of equations: the balance with zero slope of the amplitude.

A peak is ``R(X, w, s) = 0`` with ``G = da/dw = 0``: one more unknown, w, and one more equation. Its Jacobian is that of
the balance with a border, which is eliminated: one factorisation gives ``t``, ``z`` and the Newton step.

For an amplitude ``a`` with gradient ``g`` and one factorisation of ``J = R_X``: ``t = -J^-1 R_w``, ``z = J^-T g`` and
``G = da/dw = g . t + a_w = a_w - z . R_w``. With z and t held, G is the derivative of ``a - z . R`` along ``(t, 1)``.
The gradient of G is therefore the change of the gradient of ``a - z . R`` along ``(t, 1)``: one central difference of
exact first derivatives, without a further factorisation. The same holds over s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.sensitivity.linearization import FREQUENCY, NOTHING, Linearization, Move
from slipstick.balance.evaluation import Detail
from slipstick.balance.inputs import Inputs, Path
from slipstick.results.measures import amplitude
from slipstick.results.record import Outputs
from slipstick.solve.linear.jacobian import Eliminated
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_DIFFERENCE_STEP = 1e-6
"""Relative step of the central differences of exact first derivatives."""
_SAME_TIME = 1e-6
"""Difference (rad) up to which two times are the same."""
_EQUAL = 1e-8
"""Relative difference up to which extremes are equal; points are solved more accurately than that."""
_SAMPLED = 0.7
"""Smallest ratio of the largest sample at an extreme to the extreme: cos(pi / 8) for the highest order, and less."""
_STEP_PARTS = np.linspace(0.0, 1.0, 9)[1:]
_PART_CHANGE, _END_CHANGE = 1.0, 1e-3
"""Change in time (rad) above which an extreme is another one: over a part of a step, times the highest order, and at
the end of a step."""
FLAT = 1e-6
"""Slope over the sizes of its terms, up to which a point is a smooth peak."""


@dataclass(frozen=True)
class Extreme:
    """An extreme in time of a motion relative to its mean."""

    harmonics: Harmonics
    value: float
    """Its absolute value: the amplitude, where it is the largest extreme."""
    time: float
    sign: float

    @classmethod
    def largest(cls, harmonics: Harmonics, U: Array) -> Extreme:
        """The largest extreme of a motion ``U`` (L,)."""
        largest = amplitude(harmonics, U)
        return cls(harmonics, float(largest.value), float(largest.time), float(largest.sign))

    @classmethod
    def near(cls, harmonics: Harmonics, U: Array, time: float) -> Extreme:
        """The extreme that Newton's method reaches uphill from ``time``; the largest one where it reaches none."""
        from slipstick.trig.extremes import extreme_above

        t, value, curvature = extreme_above(harmonics, U, time)
        if value * curvature >= 0.0:
            return cls.largest(harmonics, U)
        return cls(harmonics, abs(value), t % (2.0 * np.pi), float(np.sign(value)))

    def continues_as(self, other: Extreme, first: Array, second: Array) -> bool:
        """Whether this extreme becomes ``other`` as the motion (L,) changes linearly from ``first`` to ``second``."""
        now = self
        for part in _STEP_PARTS:
            moved = Extreme.near(self.harmonics, first + part * (second - first), now.time)
            if moved.sign != now.sign or _distance(moved.time, now.time) > _PART_CHANGE / self.harmonics.highest:
                return False
            now = moved
        return _distance(now.time, other.time) <= _END_CHANGE and now.sign == other.sign

    def ahead(self, U: Array) -> float:
        """The ratio of the largest other extreme of the motion to this one, minus 1; -1 without another."""
        rival = self.rival(U)
        return rival.value / self.value - 1.0 if rival is not None and self.value > 0.0 else -1.0

    def rival(self, U: Array) -> Extreme | None:
        """The largest other extreme of the motion."""
        return max(self._others(U), key=lambda other: other.value, default=None)

    def tied(self, U: Array) -> list[Extreme]:
        """The other extremes that are as large as this one, as in a motion that is symmetric about its mean."""
        least = (1.0 - _EQUAL) * self.value
        return [other for other in self._others(U, least) if other.value >= least] if self.value > 0.0 else []

    def _others(self, U: Array, least: float = 0.0) -> Iterator[Extreme]:
        """All other extremes that may be larger than ``least``."""
        times, H = _samples(self.harmonics)
        size = np.abs(H @ U[1:])
        tops = (size >= np.roll(size, 1)) & (size >= np.roll(size, -1)) & (size >= _SAMPLED * least)
        for k in np.flatnonzero(tops):
            other = Extreme.near(self.harmonics, U, float(times[k]))
            if _distance(other.time, self.time) > _SAME_TIME:
                yield other

    @property
    def h(self) -> Array:
        """Its derivative by the motion, (1, L): ``sign H_-(time)`` without the mean."""
        H = self.sign * self.harmonics.H_minus(self.time)[None]
        H[0, 0] = 0.0
        return H


def _distance(time: float, other: float) -> float:
    """Distance (rad) of two times in a period."""
    return abs(float(np.remainder(time - other + np.pi, 2.0 * np.pi)) - np.pi)


@lru_cache(maxsize=16)
def _samples(harmonics: Harmonics) -> tuple[Array, Array]:
    """Closely spaced times (k,) over a period, and ``H_-`` without the mean at them, (k, 2 n)."""
    count = 8 * max(1, harmonics.highest)
    times = np.asarray(np.arange(2 * count) * (np.pi / count), dtype=float)
    return times, harmonics.H_minus(times)[:, 1:]


class StateSpace:
    """The states ``(X, w, s)`` of a problem with one output; ``path`` is that of the parameter s, if there is one."""

    def __init__(self, outputs: Outputs, inputs: Inputs, path: Path | None = None) -> None:
        self.outputs, self.inputs, self.path = outputs, inputs, path
        self._latest: tuple[float, Inputs] | None = None

    def at(self, x: Array, omega: float, value: float, near: Array | None = None) -> Linearization:
        """The balance linearised at a state."""
        return Linearization(self.outputs, x, omega, self.at_value(value), near)

    def at_value(self, value: float) -> Inputs:
        """Inputs at a value of the parameter; the latest are cached."""
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
        The linearised state, and the value of its parameter.
    over
        Direction of the derivative: of the frequency or of the parameter.
    z
        ``J^-T g``; None: it is computed.
    """

    def __init__(
        self, space: StateSpace, here: Linearization, value: float, extreme: Extreme, over: Move = FREQUENCY,
        z: Array | None = None,
    ) -> None:  # fmt: skip
        self._space, self._here, self._s, self.extreme, self.over = space, here, value, extreme, over
        self.R, U = here.change(np.zeros_like(here.x), over)
        self.z = here.jacobian.solve(here.pull(h=extreme.h), transposed=True) if z is None else z
        self.t = -here.jacobian.solve(self.R)
        self.value = float(np.sum(extreme.h * U) - self.z @ self.R)
        self.size = float(np.abs(extreme.h * U).sum() + np.abs(self.z) @ np.abs(self.R))
        """Sum of the absolute values of the terms of ``value``."""

    def displaced(self, scale: float) -> Displaced:
        """The states on both sides along ``(t, 1)``; ``scale`` is a typical change of frequency or parameter."""
        here, over_w = self._here, self.over.omega
        length, size = float(np.linalg.norm(self.t)), float(np.linalg.norm(here.x))
        step = _DIFFERENCE_STEP * (min(scale, size / length) if length > 0 and size > 0 else scale)
        near = here.detail.carried
        sides = []
        for side in (step, -step):
            moved = (side, 0.0) if over_w else (0.0, side)
            sides.append(self._space.at(here.x + side * self.t, here.omega + moved[0], self._s + moved[1], near))
        return Displaced(self, (sides[0], sides[1]), step, (self._s + step, self._s - step))


class Displaced:
    """The gradient of a slope, from first derivatives on both sides of a state.

    ``values`` are those of the parameter on both sides, where the slope is over the parameter.
    """

    def __init__(
        self, slope: PeakGradient, sides: tuple[Linearization, Linearization], step: float, values: tuple[float, float]
    ) -> None:
        self._z, self.sides, self._step, self.values = slope.z, sides, step, values
        h, time = slope.extreme.harmonics, slope.extreme.time
        self._h = [Extreme.near(h, side.motion()[0], time).h for side in sides]

    def by_motion(self) -> Array:
        """Gradient by the unknowns (N,)."""
        up, down = (side.pull(h=h, z=-self._z) for side, h in zip(self.sides, self._h, strict=True))
        return np.asarray((up - down) / (2.0 * self._step))

    def along(self, *directions: Move) -> float:
        """Derivative along a direction at fixed motion; one direction for both sides, or one for each."""
        functionals = []
        for side, h, direction in zip(self.sides, self._h, (directions[0], directions[-1]), strict=True):
            R, U = side.change(np.zeros_like(side.x), direction)
            functionals.append(float(np.sum(h * U) - self._z @ R))
        return (functionals[0] - functionals[1]) / (2.0 * self._step)


@dataclass(frozen=True, kw_only=True, slots=True)
class PeakDetail(Detail):
    """Quantities of an evaluation at a peak.

    Attributes
    ----------
    amplitude, rate
        Amplitude of the followed extreme, and its derivative by the parameter.
    bend
        Second derivative of the amplitude by the frequency along the solutions: negative at a maximum.
    ahead
        Ratio of the largest other extreme in time to the followed one, minus 1.
    motion, extreme
        Motion (L,) of the output, and its followed extreme in time.
    """

    amplitude: float
    rate: float
    bend: float
    ahead: float
    motion: Array
    extreme: Extreme


class PeakSystem(Augmented):
    """``(R, G) = 0`` for the unknowns ``(X, w)`` over a parameter.

    Parameters
    ----------
    space
        The states, with one output and, where the peak is followed, a parameter.

    Attributes
    ----------
    factorisations
        Number of factorised Jacobians of the balance so far.
    """

    def __init__(self, space: StateSpace) -> None:
        self.space = space
        self.balance = space.outputs.balance
        self.factorisations = 0

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs at ``parameter``, and nan: the frequency is an unknown."""
        return self.space.at_value(parameter), float("nan")

    def slope(
        self, y: Array, parameter: float, context: Array | None = None
    ) -> tuple[Linearization, PeakGradient] | None:
        """The balance linearised at ``y`` and the slope of its amplitude over frequency; None where ``y`` is no motion.

        ``context`` holds the time of the followed extreme (nan: the largest one), and contact states (n_states,).
        """
        if not (isfinite(y.dot(y)) and y[-1] > 0.0 and isfinite(parameter)):
            return None
        near = None if context is None or context.size == 1 else context[1:]
        here = self.space.at(y[:-1], float(y[-1]), parameter, near)
        if here.lost or not np.all(np.isfinite(here.at.residual)) or here.jacobian.singular:
            return None
        U, h = here.motion()[0], self.balance.harmonics
        extreme = (
            Extreme.largest(h, U) if context is None or np.isnan(context[0]) else Extreme.near(h, U, float(context[0]))
        )
        self.factorisations += 1
        return here, PeakGradient(self.space, here, parameter, extreme)

    def state(self, y: Array, parameter: float, context: Array | None = None) -> Bordered | None:
        """The balance with ``G = 0``; ``detail`` is a ``PeakDetail``."""
        sloped = self.slope(y, parameter, context)
        if sloped is None:
            return None
        here, slope = sloped
        sides = slope.displaced(here.omega)
        row = np.append(sides.by_motion(), sides.along(FREQUENCY))
        along = NOTHING if self.space.path is None else self.space.along(parameter)
        R, U = here.change(np.zeros_like(here.x), along)
        carried = np.zeros(0) if here.detail.carried is None else here.detail.carried
        detail = PeakDetail(
            responses=here.detail.responses, inputs=here.detail.inputs, omega=here.omega, states=here.detail.states,
            amplitude=slope.extreme.value, rate=float(np.sum(slope.extreme.h * U) - slope.z @ R),
            bend=float(row @ np.append(slope.t, 1.0)), ahead=slope.extreme.ahead(here.motion()[0]),
            motion=here.motion()[0], extreme=slope.extreme,
        )  # fmt: skip
        return Bordered(
            here, Eliminated(here.jacobian, slope.R[:, None], row[None], -slope.t[:, None]),
            np.array([slope.value]), np.array([slope.size]), lambda way: np.array([sides.along(way)]),
            np.append(R, sides.along(along)), detail, np.append(slope.extreme.time, carried),
        )  # fmt: skip
