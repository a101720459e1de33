"""The balance of self-excited vibration as a system of equations: the frequency is unknown.

Nothing prescribes the phase of motion that nothing excites. One more equation fixes it, ``p . X = 0``, and the
frequency is one more unknown: ``R(X, w, s) = 0``, ``p . X = 0`` for ``(X, w)`` over a parameter s.
"""

from __future__ import annotations

from math import isfinite

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.peaks.gradient import StateSpace
from slipstick.analysis.sensitivity.linearization import FREQUENCY
from slipstick.analysis.stability.floquet import StabilityWatch
from slipstick.analysis.stability.harmonic_form import HarmonicForm
from slipstick.analysis.stability.special_points import SpecialPoints
from slipstick.balance.evaluation import Detail
from slipstick.balance.inputs import Inputs
from slipstick.results.stability import PointStability
from slipstick.typing import Array, ComplexArray


class CycleSystem(Augmented):
    """``(R, p . X) = 0`` for the unknowns ``(X, w)`` over a parameter; its Jacobian is written out.

    Without the border the Jacobian of the balance is singular at every limit cycle: the phase is free.

    Parameters
    ----------
    space
        The states, with a parameter.
    phase
        ``p`` (N,), such as the rate of a motion that the cycles resemble: then they are in phase with it.
    """

    def __init__(self, space: StateSpace, phase: Array) -> None:
        self.space, self.balance = space, space.outputs.balance
        self.phase = phase / np.linalg.norm(phase)

    def state(self, y: Array, parameter: float, context: Array | None = None) -> Bordered | None:
        """The balance at ``y = (X, w)`` with ``p . X = 0``."""
        if not (isfinite(y.dot(y)) and y[-1] > 0.0 and isfinite(parameter)):
            return None
        x, still = y[:-1], np.zeros(y.size - 1)
        here = self.space.at(x, float(y[-1]), parameter)
        by_omega, by_parameter = (here.change(still, way)[0] for way in (FREQUENCY, self.space.along(parameter)))
        size = np.abs(self.phase) @ np.abs(x)
        return Bordered(
            here, here.jacobian.bordered(by_omega, np.append(self.phase, 0.0)), np.array([self.phase @ x]),
            np.array([size]), lambda way: np.zeros(1), np.append(by_parameter, 0.0), here.detail,
        )  # fmt: skip


class CycleWatch(StabilityWatch):
    """Judges limit cycles: the multiplier 1 of a shift in time is left out."""

    free = True

    def at(self, x: Array, detail: Detail, *, odd: bool | None = None, error: float | None = None) -> PointStability:
        """Stability at ``(X, w)``; the sign of the bordered Jacobian tells nothing."""
        return super().at(x[:-1], detail, error=error)

    def growing(self, x: Array, detail: Detail) -> int:
        """How many disturbances of a wave grow at ``(X, w)``."""
        return super().growing(x[:-1], detail)

    def judged(self, multipliers: ComplexArray) -> ComplexArray:
        """All but the multiplier 1 of a shift in time."""
        return np.delete(multipliers, int(np.argmin(np.abs(multipliers - 1.0)))) if multipliers.size else multipliers

    def form(self, x: Array, detail: Detail) -> HarmonicForm:
        """The harmonic form at ``(X, w)``."""
        return super().form(x[: self.balance.size], detail)


class CycleSpecialPoints(SpecialPoints):
    """Where the kind of motion changes along a branch of limit cycles."""

    def __init__(self, watch: CycleWatch, system: CycleSystem) -> None:
        super().__init__(watch, system)  # type: ignore[arg-type]
        self._cycles = system

    def _placed(self, x: Array, parameter: float) -> tuple[Array, Inputs, float]:
        """Motion (N,), inputs and frequency at unknowns and parameter."""
        return x[:-1], self._cycles.space.at_value(parameter), float(x[-1])
