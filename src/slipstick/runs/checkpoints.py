"""Checkpoints of the points in a journal, from which a run goes on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from slipstick.analysis.road.checkpoint import Checkpoint, resumable
from slipstick.analysis.road.request import AnalysisRequest
from slipstick.io.journal import Recorded, unpacked


def checkpoints_in(recorded: Recorded, request: AnalysisRequest) -> Sequence[Checkpoint]:
    """Those of the points up to the last one that a run can go on from; raises InputError where one is damaged."""
    count = resumable(request.checkpoint(unpacked(note)) for note in recorded.notes())
    return _Checkpoints(recorded, range(count), request)


class _Checkpoints(Sequence[Checkpoint]):
    """Checkpoints of some points of a journal, read whenever they are asked for: each holds all unknowns twice."""

    def __init__(self, recorded: Recorded, points: range, request: AnalysisRequest) -> None:
        self._recorded, self._points, self._request = recorded, points, request

    @overload
    def __getitem__(self, number: int) -> Checkpoint: ...
    @overload
    def __getitem__(self, number: slice) -> _Checkpoints: ...
    def __getitem__(self, number: int | slice) -> Checkpoint | _Checkpoints:
        if isinstance(number, slice):
            return _Checkpoints(self._recorded, self._points[number], self._request)
        return self._request.checkpoint(unpacked(self._recorded.note(self._points[number])))

    def __len__(self) -> int:
        return len(self._points)
