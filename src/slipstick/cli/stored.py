"""Points of a run on their way to the results file, shown as they come."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from slipstick.analysis.curve.record import Run, Sink
from slipstick.analysis.events import Listener, PointFound, Started, StrategyTried
from slipstick.case.case import Case
from slipstick.cli.terminal.progress import Progress
from slipstick.errors import TimeIsUp
from slipstick.io.store import ResultStore
from slipstick.results.record import Point
from slipstick.typing import Array


class Stored(Sink):
    """Writes points to the store and shows them.

    The points of an earlier run that this one goes on with are in the store already.
    """

    def __init__(self, run: Run[Any], store: ResultStore, shown: Progress, case: Case) -> None:
        super().__init__(run)
        self._store, self._shown, self._case = store, shown, case
        self._factor, self._unit = case.shown_in
        self._last: float | None = None
        self._part = 1
        for point in run.request.checkpoints[-1:]:
            self._part, self._last = point.part, float(point.state[-1]) / self._factor
            shown.go_on(run.count, self._last)

    def strategy_tried(self, event: StrategyTried) -> None:
        """Show how the first point is sought."""
        why = f": {event.reason.text}" if event.reason else ""
        result = "found" if event.found else f"not found{why}"
        self._shown.note(f"  first point at {self._case.frequency_text(event.omega)}, {event.name}: {result}")

    def keep(self, events: Sequence[PointFound], values: Mapping[str, Array]) -> None:
        """Write each point, with the checkpoint a run goes on from."""
        for i, event in enumerate(events):
            record = {name: value[i] for name, value in values.items()}
            self._store.append(record, None if event.checkpoint is None else event.checkpoint.plain())
            self._show(event.point, record)

    def values(self) -> Mapping[str, Array]:
        """Those of all points in the store."""
        return self._store.layout.unpack(self._store.rows())

    def _show(self, point: Point, record: Mapping[str, Any]) -> None:
        value = float(point.parameter) / self._factor
        if point.part != self._part:
            self._part, self._last = point.part, None
            where = f"{value:.6g}{self._unit}"
            self._shown.note(f"  the branch broke off: it is followed from the other end too, from {where}")
        step = abs(value - self._last) if self._last is not None else 0.0
        self._last = value
        self._shown.at(value, step, states_text(record))


class Clock(Listener):
    """Ends a computation when its time is up; ``until`` is when that is, of the monotonic clock."""

    def __init__(self, until: float) -> None:
        self._until = until

    def started(self, event: Started) -> None:
        """Look at the clock."""
        self._look()

    def strategy_tried(self, event: StrategyTried) -> None:
        """Look at the clock."""
        self._look()

    def point_found(self, event: PointFound) -> None:
        """Look at the clock."""
        self._look()

    def _look(self) -> None:
        if time.monotonic() > self._until:
            raise TimeIsUp


def states_text(record: Mapping[str, Any]) -> str:
    """How the contacts share stick, slip and separation, averaged over those that have such states.

    >>> states_text({"stick_fraction": [0.25], "slip_fraction": [0.75], "separation_fraction": [0.0]})
    'stick 25 % slip 75 %'
    """
    parts = []
    for name in ("stick", "slip", "separation"):
        value = np.asarray(record.get(f"{name}_fraction", ()), dtype=float)
        known = value[np.isfinite(value)]
        parts.append((name, float(known.mean()) if known.size else 0.0))
    return " ".join(f"{name} {part:.0%}".replace("%", " %") for name, part in parts if part > 0.0005) or "no contact"
