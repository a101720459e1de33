"""Local maxima of amplitudes along a branch, as events the continuation locates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from slipstick.balance.systems import FrequencySystem, ParameterSystem
from slipstick.results.measures import amplitude_with_slope
from slipstick.results.record import Outputs
from slipstick.solve.continuation.arc import Arc, ArcPlaces
from slipstick.solve.continuation.events import BranchEvent
from slipstick.typing import Array

_TINY = float(np.finfo(float).tiny)
_ROUNDING = 1e-9
"""Relative change of an amplitude over the whole range that is rounding."""
_LEVEL = 1e-6
"""The same below which no peak is sought: solutions are not known better, and a plateau has no peaks."""


def peak_events(
    outputs: Outputs, names: Sequence[str], system: FrequencySystem | ParameterSystem
) -> tuple[BranchEvent, ...]:
    """An event for each named output dof: the derivative of its amplitude along the branch falls through zero."""
    slopes = _Slopes(Outputs(outputs.balance, tuple(names)), system)
    return tuple(_event(name, i, slopes) for i, name in enumerate(names))


def _event(name: str, i: int, slopes: _Slopes) -> BranchEvent:
    return BranchEvent(
        name=name, kind="peak", direction=-1, function=lambda step: float(slopes.at(step)[i]),
        along=lambda first, second, arc, places: slopes.along(first, second, arc, places)[:, i],
    )  # fmt: skip


class _Slopes:
    """Derivatives of amplitudes along the branch; what is found is remembered, as each output asks for it again."""

    def __init__(self, outputs: Outputs, system: FrequencySystem | ParameterSystem) -> None:
        self._outputs, self._system = outputs, system
        self._found: tuple[Any, Array] = (None, np.empty(0))

    def at(self, step: Any) -> Array:
        """Derivatives (n_outputs,) at a step, by the envelope theorem at the time of the extreme."""
        if self._found[0] is not step:
            self._found = step, self._slopes(*self._outputs.motion_along(step, self._system), _ROUNDING)
        return self._found[1]

    def along(self, first: Any, second: Any, arc: Arc, places: ArcPlaces) -> Array:
        """Derivatives (n, n_outputs) at n places between two steps, of the cubics through their motions."""
        if self._found[0] is not arc:
            (a, da), (b, db) = (self._outputs.motion_along(step, self._system) for step in (first, second))
            motion, change = arc.between(a, b, da, db, places)
            self._found = arc, self._slopes(motion, change / arc.length, _LEVEL)
        return self._found[1]

    def _slopes(self, motion: Array, change: Array, level: float) -> Array:
        size, slope = amplitude_with_slope(self._outputs.balance.harmonics, motion, change)
        slope[np.abs(slope) <= level * size] = _TINY
        return slope
