"""The road of every analysis: its run finds points one by one, and sinks take them: a branch, a file, a listener."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from math import nan
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from slipstick.analysis.road.events import Event, EventFunction, Listener, PointFound, Started, Stopped, Working
from slipstick.errors import Outcome, TimeIsUp
from slipstick.faults import warn
from slipstick.interrupts import held, pass_on
from slipstick.results.schema import attributes_of, make_table, requested_attribute
from slipstick.results.solutions import Solutions
from slipstick.solve.continuation.follow import failed
from slipstick.solve.linear.factorisation import one_blas_thread
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.road.checkpoint import Checkpoint
    from slipstick.analysis.road.request import AnalysisRequest

R = TypeVar("R", bound="AnalysisRequest")

_KEPT = 5_000_000
"""Entries of one derivative of the points that wait to be recorded: a few hundred megabytes with all of them."""

_PAUSE = 1.0
"""Seconds without a word, after which it is told what is being done."""

Guard = Callable[[], AbstractContextManager[Any]]


def one_thread() -> AbstractContextManager[Any]:
    """Matrices of the balance are small: more BLAS threads only wait for each other."""
    return one_blas_thread()


@contextmanager
def undisturbed() -> Iterator[None]:
    """One thread, and signals wait. It takes as long to enter as a small evaluation: once round many of them."""
    with one_thread(), held():
        yield


def stopped_too(outcome: Outcome) -> None:
    """What stopped a run stops the one that it is part of."""
    if outcome in (Outcome.INTERRUPTED, Outcome.TIME_LIMIT):
        raise KeyboardInterrupt if outcome is Outcome.INTERRUPTED else TimeIsUp


class Run(ABC, Generic[R]):
    """An analysis under way. Each analysis adds its ``points``, and sets what it knows of them as it goes.

    Attributes
    ----------
    request, recorder
        What was asked for, and what makes numbers of its points.
    outcome, message, error
        How it ended, or would if it did now; the exception that ended it, if one did.
    count
        Points so far, with those of a run that this one goes on with.
    progress, step, checkpoint
        Of the point that comes, as in ``PointFound``.
    doing
        What is done on the way to it, in words, for those who wait; empty where that needs no words.
    """

    def __init__(self, request: R) -> None:
        self.request, self.recorder, self.count = request, request.recorder(), len(request.checkpoints)
        self.outcome, self.message = Outcome.INTERRUPTED, ""
        self.error: Exception | None = None
        self.progress, self.step = 0.0, nan
        self.checkpoint: Checkpoint | None = None
        self.doing = ""
        self._clock = time.perf_counter() - (request.checkpoints[-1].seconds if request.checkpoints else 0.0)
        self._listeners: tuple[EventFunction, ...] = request.listeners
        self._told, self._felt, self._seeking = time.perf_counter(), 0, False

    @abstractmethod
    def points(self) -> Generator[Any, None, None]:
        """The points in their order; at the end ``outcome`` and ``message`` say how it ended.

        Each is a ``Point``, or what the recorder of the analysis makes numbers of. Signals wait: ``pass_on`` lets them
        in where nothing is half done.
        """

    @property
    def attributes(self) -> Mapping[str, Any]:
        """What the results say of this analysis and its work, by name."""
        return {}

    @property
    def closing(self) -> str:
        """``message`` as the results say it."""
        return self.message

    @property
    def seconds(self) -> float:
        """Time taken so far."""
        return time.perf_counter() - self._clock

    def tell(self, event: Event) -> None:
        """Tell all who listen."""
        self._told = time.perf_counter()
        for listener in self._listeners:
            listener(event)

    def feel(self) -> None:
        """An evaluation on the way to a point: where nothing was told for a while, tell, and let interrupts in."""
        self._felt += 1
        if self._seeking and time.perf_counter() - self._told >= _PAUSE:
            pass_on()
            self.tell(Working(doing=self.doing, points=self.count, evaluations=self._felt, progress=self.progress))

    @contextmanager
    def _felt_by(self) -> Iterator[None]:
        """Evaluations are felt by this run, or by the one that it is part of."""
        pulse = self.request.pulse
        if pulse is None or pulse.felt is not None:
            yield
            return
        pulse.felt = self.feel
        try:
            yield
        finally:
            pulse.felt = None

    @contextmanager
    def kept(self, steps: Sequence[Any] = ()) -> Iterator[None]:
        """An interrupt, or an exception once there are points or ``steps`` to them, ends it and they are kept."""
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
        """The points one by one, of which all are told; the generator's value is the outcome and its message.

        ``guard`` is entered while a point is sought, and left between points: not needed where it surrounds the whole.
        """
        request, self._listeners = self.request, (*self.request.listeners, *sinks)
        request.problem.warn(request.warnings)
        attributes = attributes_of(
            request.problem, self.outcome, "", request.warnings, analysis=request.analysis, parameter=request.parameter
        )  # fmt: skip
        points = self.points()
        try:
            self.tell(Started(start=request.start, stop=request.stop, recorder=self.recorder, attributes=attributes))
            with self._felt_by():
                for point in self.until_ended(points, guard):
                    self.count += 1
                    with guard():
                        self.tell(PointFound(
                            number=self.count, point=point, progress=self.progress, step=self.step,
                            recorder=self.recorder, checkpoint=self.checkpoint,
                        ))  # fmt: skip
                    yield point
        except KeyboardInterrupt as stop:
            self._interrupted(stop)
        finally:
            points.close()
            self.tell(self._stopped())
        return self.outcome, self.closing

    def until_ended(self, points: Iterator[Any], guard: Guard = nullcontext) -> Iterator[Any]:
        """Points until they end, or are ended by an interrupt, or by an exception once there are some."""
        with self.kept():
            while True:
                pass_on()  # points without iterations, such as those of steady sliding, let no interrupt in
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
        attributes = attributes_of(
            request.problem, self.outcome, message, [*request.warnings, *self.recorder.postprocessing.failures],
            analysis=request.analysis, parameter=request.parameter, **self.attributes, seconds=seconds,
            **request.numerics, **requested_attribute(request.requested),
        )  # fmt: skip
        return Stopped(
            outcome=self.outcome, message=message or self.outcome.text, points=self.count, seconds=seconds,
            attributes=attributes, error=self.error,
        )  # fmt: skip

    def solutions(self) -> Solutions:
        """All points in memory."""
        memory, ended = Memory(self), False
        try:
            with undisturbed():
                for _ in self.follow(memory, guard=nullcontext):
                    pass
                ended = True
        except KeyboardInterrupt:
            if not ended:
                raise  # it came after the last point otherwise: nothing is left to interrupt
        return memory.solutions()


class Sink(ABC, Listener):
    """Where points go. Those that wait are recorded together, which costs less than one by one.

    Attributes
    ----------
    run
        What finds them.
    end
        How it ended; None while it has not.
    """

    def __init__(self, run: Run[Any]) -> None:
        self.run = run
        self.end: Stopped | None = None
        self._waiting: list[PointFound] = []

    def point_found(self, event: PointFound) -> None:
        """Take a point; record those that wait, where that is to be done."""
        self._waiting.append(event)
        if self.due(self._waiting):
            self._record()

    def stopped(self, event: Stopped) -> None:
        """Record what is left."""
        self.end = event
        self._record()

    def _record(self) -> None:
        waiting, self._waiting = self._waiting, []
        if waiting:
            self.keep(waiting, self.run.recorder.values([event.point for event in waiting]))

    def due(self, waiting: Sequence[PointFound]) -> bool:
        """Whether the points that wait are to be recorded now: solutions, with the interpolated ones before them."""
        return waiting[-1].kind != "interpolated"

    @abstractmethod
    def keep(self, events: Sequence[PointFound], values: Mapping[str, Array]) -> None:
        """Keep points, whose values by variable are (n_points, ...)."""

    @abstractmethod
    def values(self) -> Mapping[str, Array]:
        """Those of all points so far."""

    def said(self) -> list[str]:
        """What could not be computed about the points, and what is suspicious in their values."""
        values = self.values()
        return self.run.recorder.postprocessing.warnings(
            partial(self.run.request.doubts, values) if len(values["omega"]) else list
        )


class Memory(Sink):
    """Keeps the values of all points, for solutions in memory."""

    def __init__(self, run: Run[Any]) -> None:
        super().__init__(run)
        balance = run.request.balance
        entries = balance.n_contacts * balance.L**2
        if balance.backend.name == "dense":
            entries = max(entries, balance.size**2)  # the factors of the Jacobian wait too
        else:
            entries *= 16  # between the ports of a contact; in the Jacobian and twice in what stands for it too
        self._most = max(1, _KEPT // entries)
        self._slices: list[dict[str, Array]] = []

    def due(self, waiting: Sequence[PointFound]) -> bool:
        """As many at once as memory allows: their derivatives are let go with them."""
        return len(waiting) == self._most

    def keep(self, events: Sequence[PointFound], values: Mapping[str, Array]) -> None:
        """Keep the values alone."""
        self._slices.append(dict(values))

    def values(self) -> Mapping[str, Array]:
        """Those of all points, one array each."""
        slices = self._slices or [dict(self.run.recorder.values([]))]
        if len(slices) > 1:  # pieces of a variable are let go once they are joined
            slices = [{name: np.concatenate([values.pop(name) for values in slices]) for name in list(slices[0])}]
        self._slices = slices
        return slices[0]

    def solutions(self) -> Solutions:
        """The points, with warnings, which are given to the user too."""
        assert self.end is not None
        attributes, request = dict(self.end.attributes), self.run.request
        if said := self.said():
            warn(said)
            attributes["warnings"] = "\n".join([*request.warnings, *said])
        table = make_table(self.run.recorder.layout, self.values(), attributes)
        return Solutions(table, self.end.outcome, request.vibrating, self.end.message, request.without)
