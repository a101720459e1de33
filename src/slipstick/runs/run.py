"""A case computed into a folder: every point is in its results file as soon as it is found."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.analysis.road.events import Event, Listener, PointFound, Searching, Started, StrategyTried, Working
from slipstick.analysis.road.run import Run, Sink, undisturbed
from slipstick.case.case import Case
from slipstick.errors import KEPT, InputError, Outcome, SlipstickWarning, TimeIsUp, without_points
from slipstick.faults import real_path
from slipstick.io.journal import Recorded
from slipstick.io.problem import fingerprint
from slipstick.io.store import ResultStore, save_branch
from slipstick.results.record import Point
from slipstick.results.schema import ANALYSIS, Layout, attributes_of
from slipstick.results.solutions import Solutions
from slipstick.results.table import ResultTable
from slipstick.runs.failures import fault_sentence, os_sentence
from slipstick.runs.folder import SUBHARMONICS, OutputFolder
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.road.request import Request

UNFINISHED = (Outcome.INTERRUPTED, Outcome.TIME_LIMIT)
"""Outcomes of a run that can be gone on with."""


@dataclass(frozen=True)
class Begun:
    """A run that ended before it was done: its journal, and the checkpoints of the points that are kept."""

    recorded: Recorded
    checkpoints: Sequence[Checkpoint]


@dataclass(frozen=True, kw_only=True)
class GoingOn:
    """A run goes on: points found before; the followed value and the branch part of the last of them."""

    points: int
    value: float
    part: int


@dataclass(frozen=True, kw_only=True)
class PointKept:
    """A point is in the results file."""

    point: Point = field(repr=False)
    values: Mapping[str, Any] = field(repr=False)
    """Every variable of the results at this point, by name."""
    value: float
    """The followed frequency or parameter."""
    progress: float
    """As in ``PointFound``."""


class RunListener(Listener):
    """Hears also that a run goes on and that points are stored."""

    def __call__(self, event: Event | GoingOn | PointKept) -> None:
        """Pass an event to its method."""
        match event:
            case GoingOn():
                self.going_on(event)
            case PointKept():
                self.point_kept(event)
            case _:
                super().__call__(event)

    def going_on(self, event: GoingOn) -> None:
        """A run goes on from where it stopped."""

    def point_kept(self, event: PointKept) -> None:
        """A point is in the results file."""


class _Stored(Sink):
    """Writes points to the store, in which those of an earlier run that this one goes on with are already."""

    def __init__(self, run: Run[Any], store: ResultStore, listener: RunListener) -> None:
        super().__init__(run)
        self._store, self._listener = store, listener

    def keep(self, events: Sequence[PointFound], values: Mapping[str, Array]) -> None:
        """Write each point, with the checkpoint a run goes on from."""
        for i, event in enumerate(events):
            record = {name: value[i] for name, value in values.items()}
            checkpoint, value = event.checkpoint, event.parameter
            self._store.append(record, None if checkpoint is None else checkpoint.plain())
            self._listener(PointKept(
                point=event.point, values=record, value=value if checkpoint is None else checkpoint.value,
                progress=event.progress,
            ))  # fmt: skip

    def values(self) -> Mapping[str, Array]:
        """Those of all points in the store."""
        return self._store.values()


class Clock(Listener):
    """Ends a computation at the time ``until`` of the monotonic clock."""

    def __init__(self, until: float) -> None:
        self._until = until

    def started(self, event: Started) -> None:
        """Raise TimeIsUp after the time limit."""
        self._check_time()

    def searching(self, event: Searching) -> None:
        """Raise TimeIsUp after the time limit."""
        self._check_time()

    def strategy_tried(self, event: StrategyTried) -> None:
        """Raise TimeIsUp after the time limit."""
        self._check_time()

    def point_found(self, event: PointFound) -> None:
        """Raise TimeIsUp after the time limit."""
        self._check_time()

    def working(self, event: Working) -> None:
        """Raise TimeIsUp after the time limit."""
        self._check_time()

    def _check_time(self) -> None:
        if time.monotonic() > self._until:
            raise TimeIsUp


@dataclass
class CaseRun:
    """One run of a case into a folder; its points survive however it ends."""

    case: Case
    folder: OutputFolder
    case_warnings: Sequence[str] = ()
    """Warnings of the case."""
    begun: Begun | None = None
    table: str = ""
    """The table that asks for it, such as "wear"; empty for ``[response]``."""
    until: float = math.inf
    """When it has to end, of the monotonic clock."""
    run_warnings: Sequence[str] = ()
    """Warnings of the points: suspicious values, and values that could not be computed."""
    outcome: Outcome = Outcome.INTERRUPTED
    message: str = ""
    failures: list[str] = field(default_factory=list)
    seconds: float = 0.0
    attributes: Mapping[str, Any] = field(default_factory=dict)
    """Those of the branch."""
    doubled: Mapping[Path, Solutions] = field(default_factory=dict)
    """Branches of twice the period, by their files."""

    def compute(self, listener: RunListener | None = None) -> None:
        """Follow the branch; every point goes to the store at once."""
        self._open(replace(self.layout, attributes=self._unfinished()))
        self._follow(listener or RunListener())
        self._close()

    def finish(self) -> None:
        """Follow motion of twice the period, where requested, and replace earlier results."""
        if self.doubles and self.complete and self.points:
            try:
                self._follow_doubled()
            except Exception as error:
                self.failures.append(f"twice the period: {fault_sentence(error)}")
        if self.complete:
            self.folder.complete()

    @property
    def analysis(self) -> str:
        """The analysis, as results and journals name it."""
        return self.request.analysis

    @property
    def layout(self) -> Layout:
        """Variables of the results."""
        return self.request.recorder().layout

    @property
    def doubles(self) -> bool:
        """Whether motion of twice the period is followed too, where it begins."""
        return self.case.response.follow is not None and not self.table

    @property
    def shown_in(self) -> tuple[float, str]:
        """The unit of the followed quantity: its size, and its text after a number."""
        return (1.0, self.case.further[self.table].shown_in(self.case)) if self.table else self.case.shown_in

    @property
    def span(self) -> tuple[float, float]:
        """First and last value of the followed quantity."""
        return self.request.start, self.request.stop

    @property
    def description(self) -> str:
        """The computation in words."""
        return self.case.further[self.table].description(self.case) if self.table else self.case.request

    @property
    def points(self) -> int:
        """Number of points in the results file."""
        return len(self.store)

    @cached_property
    def found(self) -> ResultTable:
        """The results as they were written, or as they stand in the journal."""
        return self.store.table()

    @cached_property
    def branch(self) -> Solutions:
        """The same with the problem that goes with them, and its balance, which is made once for a run."""
        problem = self.request.vibrating
        branch = Solutions.from_dataset(self.found, problem, self.request.without)
        if problem is not None:
            branch.balance = self.request.balance
        return branch

    @property
    def complete(self) -> bool:
        """Whether everything requested was computed."""
        return self.outcome.ok and not self.failures

    @property
    def nothing(self) -> bool:
        """Whether a table gave no point at all; such a run leaves no files."""
        return bool(self.table) and not self.points and self.begun is None

    @property
    def unfinished(self) -> bool:
        """Whether ``resume`` can go on with it."""
        return bool(self.failures) or self.outcome in UNFINISHED

    @property
    def text(self) -> str:
        """How it ended, in words."""
        if self.failures:
            return "stopped: " + "; ".join(self.failures)
        said = self.message or self.outcome.text
        return said if self.points else without_points(said)

    @cached_property
    def request(self) -> Request:
        """The analysis; its warnings are those of the case, or among ``run_warnings``."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            return self.case.asks(self.table)

    def _open(self, layout: Layout) -> None:
        stored, without = self.request.vibrating, self.request.without
        if self.begun is not None:
            recorded, keep = self.begun.recorded, len(self.begun.checkpoints)
            self.store = ResultStore(
                self.folder.results, recorded.layout, stored, recorded=recorded, keep=keep, without=without
            )
            return
        about = {ANALYSIS: self.analysis, "case_path": str(real_path(self.case.path))}
        about["problem"] = fingerprint(self.request.problem)
        self.store = ResultStore(self.folder.results, layout, stored, about=about, without=without)
        self.folder.copy_case()

    def _follow(self, listener: RunListener) -> None:
        checkpoints = () if self.begun is None else self.begun.checkpoints
        sink: _Stored | None = None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SlipstickWarning)  # of the case, or among ``run_warnings``
                run = replace(self.request, checkpoints=checkpoints).run()
                sink = _Stored(run, self.store, listener)
                for last in checkpoints[-1:]:
                    listener(GoingOn(points=run.count, value=last.value, part=last.part))
                with undisturbed():
                    for _ in run.follow(sink, Clock(self.until), listener, guard=nullcontext):
                        pass
        except KeyboardInterrupt:
            self.outcome = Outcome.INTERRUPTED
        except Exception as error:
            self._fail(error)
        if sink is not None and sink.end is not None:
            self.attributes = {**sink.end.attributes, **self.case.names}
            further = [text for text in sink.run.request.warnings if text not in self.case_warnings]
            self.run_warnings = [*further, *sink.said()]
            if sink.end.error is not None:
                self._fail(sink.end.error)
            if not self.failures:
                self.outcome, self.message = sink.end.outcome, sink.end.message

    def _fail(self, error: Exception) -> None:
        """Note the failure that ended the run."""
        self.failures += error.sentences if isinstance(error, InputError) else [fault_sentence(error)]

    def _close(self) -> None:
        ended = {**self.attributes, "outcome": self.outcome.name, "outcome_text": self.text}
        ended["warnings"] = "\n".join([*self.case_warnings, *self.run_warnings])
        self.seconds = float(self.attributes.get("seconds", 0.0))
        try:
            self.store.close(ended, finished=not self.unfinished)
        except OSError as error:
            kept = f"every point is kept in {self.store.path}.journal, which slipstick reads"
            said = os_sentence(error)
            self.failures = [*(f for f in self.failures if f != said), f"{said}; {kept}"]

    def _unfinished(self) -> Mapping[str, Any]:
        """Attributes of an unfinished file."""
        unfinished = f"unfinished: the run ended before it could say why; {KEPT}"
        attributes = attributes_of(
            self.request.problem, Outcome.INTERRUPTED, unfinished, self.case_warnings, analysis=self.analysis,
            parameter=self.request.parameter,
        )  # fmt: skip
        return {**attributes, **self.case.names}

    def _follow_doubled(self) -> None:
        """Branches from every point of the results at which the period doubles, a file each."""
        from slipstick.io.loading import load

        branches = self.case.subharmonics(load(self.folder.results), listeners=(Clock(self.until),))
        self.doubled = {}
        for number, branch in enumerate(branches, 1):
            file = self.folder.results.with_name(SUBHARMONICS.format(number))
            branch.table.attrs.update(title=self.case.title, frequency_unit=self.case.frequency_unit)
            save_branch(branch, file)
            self.doubled[file] = branch
