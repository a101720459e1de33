"""Local maxima of amplitudes along a branch, as events that the continuation locates."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from slipstick.balance.evaluation import FrequencySystem, ParameterSystem
from slipstick.results.measures import amplitude, amplitude_with_slope
from slipstick.results.postprocessing import Postprocessing
from slipstick.results.record import Outputs
from slipstick.results.schema import LARGEST
from slipstick.solve.continuation import LatestSteps, Step
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.typing import Array
from slipstick.units import compared

_CACHED = 64
"""Number of steps whose amplitudes are cached."""
AMPLITUDE_NOISE = 1e-11
"""Amplitude over the largest motion of contacts and outputs, up to which it is rounding."""
SLOPE_NOISE = 1e-9
"""Relative change of an amplitude over the whole range, up to which it is rounding."""
PLATEAU = 1e-6
"""Relative change of an amplitude over the whole range, up to which no peak is sought between solutions: their accuracy
is no better, and a plateau has no peaks."""


def peak_events(
    outputs: Outputs, names: Sequence[str], system: FrequencySystem | ParameterSystem
) -> tuple[BranchEvent, ...]:
    """An event for each named output dof: the derivative of its amplitude along the branch falls through zero.

    With ``LARGEST`` alone, one event of the largest amplitude of all outputs that are compared.
    """
    if tuple(names) == (LARGEST,):
        among = tuple(outputs.names[place] for place in compared(outputs.names))
        alike = outputs if among == outputs.names else Outputs(outputs.balance, among)
        return (_envelope(_Slopes(alike, system)),)
    slopes = _Slopes(outputs if tuple(names) == outputs.names else Outputs(outputs.balance, tuple(names)), system)
    return tuple(_event(name, i, slopes) for i, name in enumerate(names))


def _event(name: str, i: int, slopes: _Slopes) -> BranchEvent:
    return BranchEvent(
        name=name, kind="peak", direction=-1, function=lambda step: float(slopes.at(step)[i]),
        along=lambda first, second, segment, places: slopes.along(first, second, segment, places)[:, i],
        height=lambda step: float(slopes.heights(step)[i]),
    )  # fmt: skip


def _envelope(slopes: _Slopes) -> BranchEvent:
    """A peak of the largest amplitude of all outputs; where another becomes the largest its slope jumps up."""

    def slope(step: Step) -> float:
        return float(slopes.at(step)[np.argmax(slopes.heights(step))])

    def along(first: Step, second: Step, arc: HermiteSegment, places: HermiteBasis) -> Array:
        largest = np.argmax(slopes.heights_along(first, second, arc, places), axis=1)
        return slopes.along(first, second, arc, places)[np.arange(largest.size), largest]

    return BranchEvent(
        name=LARGEST, kind="peak", direction=-1, function=slope, along=along,
        height=lambda step: float(slopes.heights(step).max()),
    )  # fmt: skip


_SEARCH = "the place of the largest amplitudes"
"""Description of the search, for messages about its failure."""
_ENDS = HermiteBasis(np.array([0.0, 1.0]))
_DEVIATION = 0.1
"""Difference of the mean slope from that of a parabola, over both slopes at the ends, above which there may be a
maximum inside."""


class Largest:
    """Outputs whose largest amplitude is located: where it exceeds all before, a regular point is inserted.

    See ``slipstick.solve.continuation.events.Watched``.
    """

    def __init__(
        self,
        outputs: Outputs,
        names: Sequence[str],
        system: FrequencySystem | ParameterSystem,
        postprocessing: Postprocessing,
    ) -> None:
        self._slopes, self._postprocessing = _Slopes(Outputs(outputs.balance, tuple(names)), system), postprocessing
        events = (replace(_event("", i, self._slopes), kind="regular") for i in range(len(names)))
        self.events = tuple(kept_up(postprocessing, _SEARCH, events))

    def heights(self, step: Step) -> Array:
        """Amplitudes (n,) at a step."""
        return self._postprocessing.attempt(_SEARCH, lambda: self._slopes.heights(step), np.zeros(len(self.events)))

    def expected(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> tuple[Array, Array]:
        """Slopes (n_places, n) between two steps, and the amplitudes (n,) expected at maxima; 0 without a maximum."""
        nothing = np.zeros((places.u.size, len(self.events))), np.zeros(len(self.events))
        return self._postprocessing.attempt(_SEARCH, lambda: self._expected(first, second, segment, places), nothing)

    def _expected(
        self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis
    ) -> tuple[Array, Array]:
        sizes, ends = (
            self._slopes.heights_along(first, second, segment, _ENDS),
            self._slopes.along(first, second, segment, _ENDS),
        )
        mean = (sizes[1] - sizes[0]) / segment.length
        curved = np.abs(mean - ends.mean(axis=0)) > _DEVIATION * np.abs(ends).sum(axis=0)
        if not np.any(curved | ((ends[0] > 0.0) & (ends[1] <= 0.0))):
            return np.zeros((places.u.size, mean.size)), np.zeros(mean.size)
        slopes, sizes = (
            part(first, second, segment, places) for part in (self._slopes.along, self._slopes.heights_along)
        )
        falls = (slopes[:-1] > 0.0) & (slopes[1:] <= 0.0)
        # without an inflection, the slopes on both sides bound the maximum between them
        way = segment.length * np.diff(places.u)[:, None]
        bound = np.minimum(sizes[:-1] + slopes[:-1] * way, sizes[1:] - slopes[1:] * way)
        return slopes, np.where(falls, bound, 0.0).max(axis=0)


class _Slopes:
    """Derivatives of amplitudes along the branch; the latest are cached, for each output evaluates its own event."""

    def __init__(self, outputs: Outputs, system: FrequencySystem | ParameterSystem) -> None:
        self._outputs, self._system = outputs, system
        self._along: tuple[HermiteSegment | None, Array] = (None, np.empty(0))
        self._at, self._heights = LatestSteps[Array](_CACHED), LatestSteps[Array](_CACHED)

    def at(self, step: Step) -> Array:
        """Derivatives (n_outputs,) at a step, by the envelope theorem at the time of the extreme."""
        slopes = self._at.known(step)
        if slopes is None:
            slopes = self._slopes(*self._outputs.motion_along(step, self._system), SLOPE_NOISE, step)
            self._at.keep(step, slopes)
        return slopes

    def heights(self, step: Step) -> Array:
        """Amplitudes (n_outputs,) at a step."""
        heights = self._heights.known(step)
        if heights is None:
            motion, _ = self._outputs.motion_along(step, self._system)
            heights = amplitude(self._outputs.balance.harmonics, motion).value
            self._heights.keep(step, heights)
        return heights

    def heights_along(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> Array:
        """Amplitudes (n, n_outputs) at n places between two steps, of the cubics through their motions."""
        return amplitude(self._outputs.balance.harmonics, self._between(first, second, segment, places)[0]).value

    def _between(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> tuple[Array, Array]:
        (a, da), (b, db) = (self._outputs.motion_along(step, self._system) for step in (first, second))
        return segment.between(a, b, da, db, places)

    def along(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> Array:
        """Derivatives (n, n_outputs) at n places between two steps, of the cubics through their motions."""
        if self._along[0] is not segment or len(self._along[1]) != places.u.size:
            motion, change = self._between(first, second, segment, places)
            self._along = segment, self._slopes(motion, change / segment.length, PLATEAU, second)
        return self._along[1]

    def _slopes(self, motion: Array, change: Array, level: float, near: Step) -> Array:
        """Slopes (..., n_outputs) of amplitudes; 0 on plateaus, and of motions that are rounding."""
        balance = self._outputs.balance
        size, slope = amplitude_with_slope(balance.harmonics, motion, change)
        largest = np.abs(near.x.reshape(-1, balance.L)[:, 1:]).max(initial=size.max(initial=0.0))
        slope[(np.abs(slope) <= level * size) | (size <= AMPLITUDE_NOISE * largest)] = 0.0
        return slope


def kept_up(postprocessing: Postprocessing, what: str, events: Iterable[BranchEvent]) -> Iterator[BranchEvent]:
    """Events whose functions may fail: they keep their last value then, and the branch goes on."""
    for event in events:
        yield _LastKnown(postprocessing, what, event).event


class _LastKnown:
    """An event that keeps its last value where its functions fail."""

    def __init__(self, postprocessing: Postprocessing, what: str, event: BranchEvent) -> None:
        self._postprocessing, self._what, self._original, self._last = postprocessing, what, event, 1.0
        place, along, height = event.place and self._place, event.along and self._along, event.height and self._height
        self.event = replace(event, function=self._value, place=place, along=along, height=height)

    def _value(self, step: Step) -> float:
        self._last = self._postprocessing.attempt(self._what, lambda: float(self._original.function(step)), self._last)
        return self._last

    def _place(self, first: Step, second: Step, segment: HermiteSegment) -> float:
        assert self._original.place is not None
        return self._postprocessing.attempt(self._what, partial(self._original.place, first, second, segment), 1.0)

    def _height(self, step: Step) -> float:
        assert self._original.height is not None
        return self._postprocessing.attempt(self._what, partial(self._original.height, step), 0.0)

    def _along(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> Array:
        assert self._original.along is not None
        same = np.full(places.u.size, self._last)
        return self._postprocessing.attempt(
            self._what, partial(self._original.along, first, second, segment, places), same
        )
