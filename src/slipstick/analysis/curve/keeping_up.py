"""Events whose functions may fail, asked with care: the branch is worth more than what is sought along it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from slipstick.results.besides import Besides
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.hermite_segment import HermiteBasis
from slipstick.typing import Array


def kept_up(besides: Besides, what: str, events: Iterable[BranchEvent]) -> Iterator[BranchEvent]:
    """Events whose functions may fail: there they keep the sign they had, and the branch goes on."""
    for event in events:
        yield _LastKnown(besides, what, event).event


class _LastKnown:
    """An event that is asked with care; its last value is what stands where it fails."""

    def __init__(self, besides: Besides, what: str, event: BranchEvent) -> None:
        self._besides, self._what, self._asked, self._last = besides, what, event, 1.0
        place, along, height = event.place and self._place, event.along and self._along, event.height and self._height
        self.event = replace(event, function=self._value, place=place, along=along, height=height)

    def _value(self, step: Any) -> float:
        self._last = self._besides.take(self._what, lambda: float(self._asked.function(step)), self._last)
        return self._last

    def _place(self, first: Any, second: Any, arc: Any) -> float:
        assert self._asked.place is not None
        return self._besides.take(self._what, partial(self._asked.place, first, second, arc), 1.0)

    def _height(self, step: Any) -> float:
        assert self._asked.height is not None
        return self._besides.take(self._what, partial(self._asked.height, step), 0.0)

    def _along(self, first: Any, second: Any, arc: Any, places: HermiteBasis) -> Array:
        assert self._asked.along is not None
        same = np.full(places.u.size, self._last)
        return self._besides.take(self._what, partial(self._asked.along, first, second, arc, places), same)
