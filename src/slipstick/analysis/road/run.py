"""The run of an analysis finds points one by one; sinks take them: memory, a file, listeners.

``Run.follow`` is the loop around the ``points`` of an analysis: clock, interrupts, events, and the end of the run.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from math import nan
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import numpy as np

from slipstick.analysis.road.events import Event, EventFunction, Listener, PointFound, Started, Stopped, Working
from slipstick.errors import Outcome, TimeIsUp, without_points
from slipstick.faults import warn
from slipstick.interrupts import held, pass_on, unbroken
from slipstick.results.schema import attributes_of, make_table, requested_attribute
from slipstick.results.solutions import Solutions
from slipstick.solve.continuation.follow import failed
from slipstick.solve.linear.factorisation import one_blas_thread
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.road.checkpoint import Checkpoint
    from slipstick.analysis.road.request import AnalysisRequest


class Work(NamedTuple):
    """Work of continuations so far."""

    runs: int = 0
    evaluations: int = 0
    solves: int = 0
    rejected: int = 0

    def plus(self, other: Work) -> Work:
        """The sum of both."""
        return Work(*(a + b for a, b in zip(self, other, strict=True)))


NO_WORK = Work()


def counted(work: Work) -> dict[str, int]:
    """Work by the names of attributes of results."""
    return {"evaluations": work.evaluations, "linear_solves": work.solves, "rejected_steps": work.rejected}


R = TypeVar("R", bound="AnalysisRequest")

_WAITING_ENTRIES = 5_000_000
"""Entries of one derivative of the points that wait to be recorded: a few hundred megabytes with all derivatives."""

_SILENCE = 1.0
"""Seconds without an event after which a ``Working`` event is sent."""

Guard = Callable[[], AbstractContextManager[Any]]


def one_thread() -> AbstractContextManager[Any]:
    """Context with one BLAS thread: matrices of the balance are so small that further threads only wait."""
    return one_blas_thread()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Context with one BLAS thread in which signals wait. Entering costs a small evaluation: enter it around many."""
    with one_thread(), held():
        yield


def stopped_too(outcome: Outcome) -> None:
    """Stop the enclosing run where an inner one was interrupted or ran out of time."""
    if outcome in (Outcome.INTERRUPTED, Outcome.TIME_LIMIT):
        raise KeyboardInterrupt if outcome is Outcome.INTERRUPTED else TimeIsUp


class Run(ABC, Generic[R]):
    """A run of an analysis. Each analysis defines ``points`` and sets the attributes as it finds them.

    Attributes
    ----------
    request, recorder
        The request, and the recorder that computes the values of its points.
    outcome, message, error
        End of the run, were it to end now; the exception that ended it, if any.
    count, latest
        Points so far, with those of the run that this one resumes; the latest one of its own.
    progress, step, checkpoint
        Of the next point, as in ``PointFound``.
    doing
        Description of a long computation before the next point, for ``Working`` events; may be empty.
    doubts
        Warnings about the results that their values alone do not tell.
    """

    def __init__(self, request: R) -> None:
        self.request, self.recorder, self.count = request, request.recorder(), len(request.checkpoints)
        self.latest: PointFound | None = None
        self.outcome, self.message = Outcome.INTERRUPTED, ""
        self.error: Exception | None = None
        self.progress, self.step = 0.0, nan
        self.checkpoint: Checkpoint | None = None
        self.doing, self.doubts = "", list[str]()
        self._clock = time.perf_counter() - (request.checkpoints[-1].seconds if request.checkpoints else 0.0)
        self._listeners: tuple[EventFunction, ...] = request.listeners
        self._last_event, self._evaluations, self._seeking = time.perf_counter(), 0, False

    @abstractmethod
    def points(self) -> Generator[Any, None, None]:
        """Yield the points in order, and set ``outcome`` and ``message`` at the end.

        Each is a ``Point``, or another type that the recorder of the analysis takes. Signals wait; call ``pass_on``
        where an interrupt leaves nothing inconsistent.
        """

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Attributes of the results about this analysis and its work, by name."""
        return {}

    @property
    def closing(self) -> str:
        """Message of the results."""
        return self.message if self.count else without_points(self.message)

    @property
    def seconds(self) -> float:
        """Time taken so far."""
        return time.perf_counter() - self._clock

    def tell(self, event: Event, listeners: Iterable[EventFunction] | None = None) -> None:
        """Send an event to all listeners, or to some of them."""
        self._last_event = time.perf_counter()
        for listener in self._listeners if listeners is None else listeners:
            listener(event)

    def count_evaluation(self) -> None:
        """Count an evaluation; after a silence, admit interrupts and send a ``Working`` event."""
        self._evaluations += 1
        if self._seeking and time.perf_counter() - self._last_event >= _SILENCE:
            pass_on()
            self.tell(
                Working(doing=self.doing, points=self.count, evaluations=self._evaluations, progress=self.progress)
            )

    @contextmanager
    def _counting(self) -> Iterator[None]:
        """Context in which evaluations of the balance are counted by this run, or by an enclosing one."""
        pulse = self.request.pulse
        if pulse is None or pulse.felt is not None:
            yield
            return
        pulse.felt = self.count_evaluation
        try:
            yield
        finally:
            pulse.felt = None

    @contextmanager
    def keeping_points(self, steps: Sequence[Any] = ()) -> Iterator[None]:
        """Context in which an interrupt ends the run, and an exception too once there are points or ``steps``."""
        try:
            yield
        except KeyboardInterrupt as stop:
            self._interrupted(stop)
        except Exception as error:
            if not (self.count or steps):
                raise
            self.outcome, self.message = failed(error)
            self.error = error

    def follow(self, *sinks: EventFunction, guard: Guard = undisturbed) -> Generator[Any, None, tuple[Outcome, str]]:
        """Yield the points and send their events; the generator's value is the outcome and its message.

        ``guard`` is a context that is entered for each point and left between points.
        """
        request, self._listeners = self.request, (*self.request.listeners, *sinks)
        request.problem.warn(request.warnings)
        attributes = attributes_of(
            request.problem, self.outcome, "", request.warnings, analysis=request.analysis, parameter=request.parameter
        )  # fmt: skip
        points = self.points()
        try:
            self.tell(Started(start=request.start, stop=request.stop, recorder=self.recorder, attributes=attributes))
            with self._counting():
                for point in self.until_ended(points, guard):
                    event = PointFound(
                        number=self.count + 1, point=point, progress=self.progress, step=self.step,
                        recorder=self.recorder, checkpoint=self.checkpoint,
                    )  # fmt: skip
                    with guard():
                        self.tell(event, request.listeners)
                        with unbroken():  # counted if and only if it is kept
                            self.tell(event, sinks)
                            self.count, self.latest = event.number, event
                    yield point
        except KeyboardInterrupt as stop:
            self._interrupted(stop)
        finally:
            points.close()
            self.tell(self._stopped())
        return self.outcome, self.closing

    def until_ended(self, points: Iterator[Any], guard: Guard = nullcontext) -> Iterator[Any]:
        """Yield points until their end, an interrupt, or an exception once there are points."""
        with self.keeping_points():
            while True:
                pass_on()  # points without iterations, such as those of steady sliding, admit no interrupt themselves
                before, self._seeking = self._seeking, True
                try:
                    with guard():
                        point = next(points, None)
                finally:
                    self._seeking = before
                if point is None:
                    return
                yield point

    def _interrupted(self, stop: KeyboardInterrupt) -> None:
        self.outcome = stop.outcome if isinstance(stop, TimeIsUp) else Outcome.INTERRUPTED
        self.message = self.outcome.text

    def _stopped(self) -> Stopped:
        request, message, seconds = self.request, self.closing, self.seconds
        said = [*request.warnings, *self.recorder.postprocessing.failures, *self.doubts]
        attributes = attributes_of(
            request.problem, self.outcome, message, said,
            analysis=request.analysis, parameter=request.parameter, **self.attributes, seconds=seconds,
            **request.numerics, **requested_attribute(request.requested),
        )  # fmt: skip
        return Stopped(
            outcome=self.outcome, message=message or self.outcome.text, points=self.count, seconds=seconds,
            attributes=attributes, error=self.error,
        )  # fmt: skip

    def solutions(self) -> Solutions:
        """Run the analysis and return all points in memory."""
        memory, ended = Memory(self), False
        try:
            with undisturbed():
                for _ in self.follow(memory, guard=nullcontext):
                    pass
                ended = True
        except KeyboardInterrupt:
            if not ended:
                raise  # an interrupt after the last point has nothing left to stop
        return memory.solutions()


class Sink(ABC, Listener):
    """A destination of points. Points wait and are recorded together, which costs less than one at a time.

    Attributes
    ----------
    run
        The run that finds the points.
    end
        The last event of the run; None while it goes on.
    """

    def __init__(self, run: Run[Any]) -> None:
        self.run = run
        self.end: Stopped | None = None
        self._waiting: list[PointFound] = []

    def point_found(self, event: PointFound) -> None:
        """Take a point, and record the waiting ones when they are due."""
        self._waiting.append(event)
        if self.due(self._waiting):
            self._record()

    def stopped(self, event: Stopped) -> None:
        """Record the remaining points."""
        self.end = event
        self._record()

    def _record(self) -> None:
        waiting, self._waiting = self._waiting, []
        if waiting:
            self.keep(waiting, self.run.recorder.values([event.point for event in waiting]))

    def due(self, waiting: Sequence[PointFound]) -> bool:
        """Whether to record the waiting points now; by default at each solution, with interpolated ones before it."""
        return waiting[-1].kind != "interpolated"

    @abstractmethod
    def keep(self, events: Sequence[PointFound], values: Mapping[str, Array]) -> None:
        """Store points, with the values of each variable (n_points, ...)."""

    @abstractmethod
    def values(self) -> Mapping[str, Array]:
        """Values of all points so far, by variable."""

    def said(self) -> list[str]:
        """Sentences about quantities that could not be computed, about suspicious values, and doubts of the run."""
        values = self.values()
        found = self.run.recorder.postprocessing.warnings(
            partial(self.run.request.value_warnings, values) if len(values["omega"]) else list
        )
        return [*found, *self.run.doubts]


class Memory(Sink):
    """Stores the values of all points, for solutions in memory."""

    def __init__(self, run: Run[Any]) -> None:
        super().__init__(run)
        balance = run.request.balance
        entries = balance.n_contacts * balance.L**2
        if balance.backend.name == "dense":
            entries = max(entries, balance.size**2)  # the factors of the Jacobian wait too
        else:
            entries *= 16  # between the ports of a contact, in the Jacobian and twice in the form that replaces it
        self._most = max(1, _WAITING_ENTRIES // entries)
        self._slices: list[dict[str, Array]] = []

    def due(self, waiting: Sequence[PointFound]) -> bool:
        """Whether as many points wait as memory allows: recording frees their derivatives."""
        return len(waiting) == self._most

    def keep(self, events: Sequence[PointFound], values: Mapping[str, Array]) -> None:
        """Store the values only."""
        self._slices.append(dict(values))

    def values(self) -> Mapping[str, Array]:
        """Values of all points, one array for each variable."""
        slices = self._slices or [dict(self.run.recorder.values([]))]
        if len(slices) > 1:  # parts of a variable are freed once they are joined
            slices = [{name: np.concatenate([values.pop(name) for values in slices]) for name in list(slices[0])}]
        self._slices = slices
        return slices[0]

    def solutions(self) -> Solutions:
        """Solutions of all points; their warnings are also issued."""
        assert self.end is not None
        attributes, request = dict(self.end.attributes), self.run.request
        if said := self.said():
            warn(said)
            attributes["warnings"] = "\n".join([*request.warnings, *said])
        table = make_table(self.run.recorder.layout, self.values(), attributes)
        return Solutions(table, self.end.outcome, request.vibrating, self.end.message, request.without)
