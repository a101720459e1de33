"""Events of a computation for its listeners; it never prints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.balance.start import Searching, StrategyTried
from slipstick.errors import Outcome
from slipstick.results.record import Point, Recorder
from slipstick.solve.linear.modes import StageProgress

if TYPE_CHECKING:
    from slipstick.studies.solving import CaseSolved

__all__ = [
    "CaseDone", "Event", "Listener", "PointFound", "Searching", "StageProgress", "Started", "Stopped", "StrategyTried",
    "Working",
]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Started:
    """A branch begins; ``recorder.layout`` has the variables of its results."""

    start: float
    stop: float
    recorder: Recorder = field(repr=False)
    attributes: Mapping[str, Any] = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class PointFound:
    """A point was found; ``parameter`` is the value of the followed frequency or parameter."""

    number: int
    point: Point = field(repr=False)
    progress: float
    """Covered share of the range, 0 to 1; it falls where the branch turns back."""
    step: float
    """Scaled length of the next step; nan without a step length."""
    recorder: Recorder = field(repr=False)
    checkpoint: Checkpoint | None = field(repr=False)
    """State from which a run can resume; None where the analysis has no checkpoints."""

    @property
    def omega(self) -> float:
        """Fundamental frequency, rad/s."""
        return self.point.omega

    @property
    def parameter(self) -> float:
        """Value of the followed quantity."""
        return self.point.parameter

    @property
    def kind(self) -> str:
        """ "start", "regular", "peak", "turning point", "requested" or "end"."""
        return self.point.kind

    @property
    def values(self) -> Mapping[str, Any]:
        """Every variable of the results at this point, by name."""
        return self.recorder.record(self.point)


@dataclass(frozen=True, kw_only=True)
class Stopped:
    """The computation ended."""

    outcome: Outcome
    message: str
    points: int
    seconds: float
    attributes: Mapping[str, Any] = field(repr=False)
    error: Exception | None = None
    """The exception that ended it after points were found: ``outcome`` is FAILED."""


@dataclass(frozen=True, kw_only=True)
class CaseDone:
    """A case of a study was computed."""

    case: int
    values: Mapping[str, float]
    """The parameters of the case."""
    solved: CaseSolved
    done: int
    total: int


@dataclass(frozen=True, kw_only=True)
class Working:
    """Progress of a long computation, sent about once a second without other events."""

    doing: str
    """Present task, such as "steady sliding"; empty on the way to the next point."""
    points: int
    """Number of points so far."""
    evaluations: int
    """Number of evaluations of the balance so far."""
    progress: float
    """Completed share of the computation, 0 to 1."""

    @property
    def text(self) -> str:
        """The event in one line.

        >>> Working(doing="", points=3, evaluations=41, progress=0.2).text
        'on the way to point 4, evaluation 41'
        """
        return f"{self.doing or f'on the way to point {self.points + 1}'}, evaluation {self.evaluations}"


Event = Started | Searching | StrategyTried | PointFound | Working | Stopped | CaseDone | StageProgress


class Listener:
    """Receives the events of a computation: a subclass overrides methods. A function of one event will do too.

    An exception raised here ends the computation; a KeyboardInterrupt ends it with the outcome INTERRUPTED.
    """

    def __call__(self, event: Event) -> None:
        """Call the method of an event."""
        match event:
            case Started():
                self.started(event)
            case Searching():
                self.searching(event)
            case StrategyTried():
                self.strategy_tried(event)
            case PointFound():
                self.point_found(event)
            case Working():
                self.working(event)
            case Stopped():
                self.stopped(event)
            case CaseDone():
                self.case_done(event)
            case StageProgress():
                self.stage(event)

    def started(self, event: Started) -> None:
        """A branch begins."""

    def searching(self, event: Searching) -> None:
        """A first point has been sought for a while."""

    def strategy_tried(self, event: StrategyTried) -> None:
        """A strategy for the first point was tried."""

    def point_found(self, event: PointFound) -> None:
        """A point was found."""

    def working(self, event: Working) -> None:
        """The computation takes long."""

    def stopped(self, event: Stopped) -> None:
        """The computation ended."""

    def stage(self, event: StageProgress) -> None:
        """A stage of a reduction made progress: of ``ss.reduce`` and the like, with this as ``listener``."""

    def case_done(self, event: CaseDone) -> None:
        """A case of a study was computed."""


EventFunction = Callable[[Any], None]
"""A listener, or a function of one event."""
