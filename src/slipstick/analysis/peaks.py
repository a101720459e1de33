"""Local maxima of amplitudes along a branch, as events the continuation locates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from slipstick.balance.systems import FrequencySystem, ParameterSystem
from slipstick.results.measures import amplitude, amplitude_slope
from slipstick.results.record import Outputs
from slipstick.solve.continuation.events import BranchEvent
from slipstick.typing import Array

_FLAT = 1e-9
"""Relative change of an amplitude over the whole range that is rounding: a plateau has no peaks."""


def peak_events(
    outputs: Outputs, names: Sequence[str], system: FrequencySystem | ParameterSystem
) -> tuple[BranchEvent, ...]:
    """An event for each named output dof: the derivative of its amplitude along the branch falls through zero."""
    slopes = _Slopes(Outputs(outputs.balance, tuple(names)), system)
    return tuple(
        BranchEvent(name=name, kind="peak", function=lambda step, i=i: float(slopes.at(step)[i]), direction=-1)
        for i, name in enumerate(names)
    )


class _Slopes:
    """Derivatives of amplitudes along the branch, remembered for the last steps: each step is asked more than once."""

    def __init__(self, outputs: Outputs, system: FrequencySystem | ParameterSystem) -> None:
        self._outputs, self._system = outputs, system
        self._known: list[tuple[Any, Array]] = []

    def at(self, step: Any) -> Array:
        """Derivatives (n_outputs,) at a step, by the envelope theorem at the time of the extreme."""
        for known, value in self._known:
            if known is step:
                return value
        motion, change = self._outputs.motion_along(step, self._system)
        h = self._outputs.balance.harmonics
        size = amplitude(h, motion)
        value = amplitude_slope(h, size, change)
        value[np.abs(value) <= _FLAT * size.value] = np.finfo(float).tiny
        self._known = [*self._known[-2:], (step, value)]
        return value
