"""What a computation tells its listeners; it never prints."""

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
    """A branch begins; ``recorder.layout`` tells what will be recorded."""

    start: float
    stop: float
    recorder: Recorder = field(repr=False)
    attributes: Mapping[str, Any] = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class PointFound:
    """A point was found; ``parameter`` is the frequency or the named parameter that is followed."""

    number: int
    point: Point = field(repr=False)
    progress: float
    """Part of the range that is done, 0 to 1; it falls where the branch turns back."""
    step: float
    """Scaled length of the next step; nan where there is none."""
    recorder: Recorder = field(repr=False)
    checkpoint: Checkpoint | None = field(repr=False)
    """What a curve can be followed on from; None for other analyses."""

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
    """What an analysis does, sent now and then where it takes long and no other event comes."""

    doing: str
    """In words, such as "steady sliding"; empty where it is on the way to the next point."""
    points: int
    """Found so far."""
    evaluations: int
    """Of the balance, so far."""
    progress: float
    """Part of the whole that is done, 0 to 1."""

    @property
    def text(self) -> str:
        """What it says in one line.

        >>> Working(doing="", points=3, evaluations=41, progress=0.2).text
        'on the way to point 4, evaluation 41'
        """
        return f"{self.doing or f'on the way to point {self.points + 1}'}, evaluation {self.evaluations}"


Event = Started | Searching | StrategyTried | PointFound | Working | Stopped | CaseDone | StageProgress


class Listener:
    """Is told what a computation does: a subclass overrides the methods it wants. A function of one event will do too.

    An exception raised here ends the computation; a KeyboardInterrupt ends it with the outcome INTERRUPTED.
    """

    def __call__(self, event: Event) -> None:
        """Tell of an event."""
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
        """A way to the first point was tried."""

    def point_found(self, event: PointFound) -> None:
        """A point was found."""

    def working(self, event: Working) -> None:
        """It takes long."""

    def stopped(self, event: Stopped) -> None:
        """The computation ended."""

    def stage(self, event: StageProgress) -> None:
        """A stage of a reduction has come so far: with it as ``listener`` of ``ss.reduce`` and the like."""

    def case_done(self, event: CaseDone) -> None:
        """A case of a study was computed."""


EventFunction = Callable[[Any], None]
"""A listener, or a function of one event."""
