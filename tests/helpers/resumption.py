"""What a run tells, kept so that two runs can be compared to the last bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.analysis.events import PointFound, Stopped
from slipstick.analysis.road.request import Request
from slipstick.io.journal import packed_notes


class Heard:
    """Points, checkpoints as a journal holds them, and how it ended, of a whole run."""

    def __init__(self, request: Request) -> None:
        self.points: list[bytes] = []
        self.notes: list[bytes] = []
        self.end: dict[str, Any] = {}
        for _ in replace(request, listeners=(self,)).run().follow():
            pass

    def __call__(self, event: Any) -> None:
        if isinstance(event, PointFound):
            values = [np.asarray(value) for _, value in sorted(event.values.items())]
            self.points.append(b"".join(v.tobytes() if v.dtype.kind in "fiu" else repr(v).encode() for v in values))
            assert event.checkpoint is not None
            self.notes.append(packed_notes(event.checkpoint.plain()))
        elif isinstance(event, Stopped):
            self.end = {name: value for name, value in event.attributes.items() if name != "seconds"}
