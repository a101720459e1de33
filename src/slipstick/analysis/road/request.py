"""What is asked of an analysis, checked once: the arguments that all analyses share, and the request they become."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.options import ResponseOptions, adapted_to, options_of
from slipstick.balance.balance import Balance, Pulse
from slipstick.balance.checks import (
    range_faults,
    reach_faults,
    requested_faults,
    requested_frequencies,
    requested_values,
    two_frequencies,
    two_numbers,
)
from slipstick.balance.parameters import parameter_path
from slipstick.balance.problem import Problem
from slipstick.balance.support import drift_warnings
from slipstick.errors import InputError
from slipstick.faults import Gathering, listed, one, text, wrong
from slipstick.results.record import Recorder
from slipstick.results.result_warnings import result_warnings
from slipstick.solve.continuation import ContinuationOptions
from slipstick.typing import Array
from slipstick.units import Units

if TYPE_CHECKING:
    from slipstick.analysis.road.checkpoint import Checkpoint
    from slipstick.analysis.road.run import Run
    from slipstick.results.solutions import Solutions


@dataclass(frozen=True, kw_only=True)
class AnalysisRequest(ABC):
    """What is asked of an analysis; each analysis adds what it needs, and the run that computes it.

    Attributes
    ----------
    analysis
        Name of the analysis, as results and journals say it: "response", "track", "wear" ...
    problem
        What vibrates, as given.
    start, stop
        First and last value of what is followed.
    parameter
        Name of what differs from the problem at each point, ``Point.parameter``: the parameter that is followed, or one
        that is found. Empty where that is the frequency alone.
    requested
        Values of it at which points are wanted.
    warnings
        Given to the user and kept with the results.
    checkpoints
        Of every point that was found already, up to one that the analysis can be taken up after: it goes on from there.
    """

    problem: Problem
    start: float
    stop: float
    parameter: str = ""
    requested: tuple[float, ...] = ()
    listeners: tuple[EventFunction, ...] = ()
    warnings: Sequence[str] = ()
    checkpoints: Sequence[Checkpoint] = ()

    @property
    @abstractmethod
    def analysis(self) -> str:
        """Name of the analysis."""

    @property
    def followed(self) -> str:
        """What ``start``, ``stop`` and ``requested`` are values of: "omega", or the parameter."""
        return self.parameter or "omega"

    @property
    def pulse(self) -> Pulse | None:
        """Felt at every evaluation on the way to a point; None where nobody tells of them."""
        return None

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Where a run stood at a point, from its journal; raises InputError where that is damaged."""
        raise InputError(f"{self.analysis} cannot be taken up after a point")

    @abstractmethod
    def run(self) -> Run:
        """What computes it, not begun yet."""

    @abstractmethod
    def recorder(self) -> Any:
        """What makes the numbers of the results from points."""

    @property
    def numerics(self) -> Mapping[str, Any]:
        """What results say of the way it is computed."""
        return {}


@dataclass(frozen=True, kw_only=True)
class Request(AnalysisRequest):
    """What is asked of an analysis by harmonic balance.

    Attributes
    ----------
    balance
        The problem, made ready.
    """

    balance: Balance
    options: ContinuationOptions = field(default_factory=ResponseOptions)

    without: ClassVar[str] = "it was not stored with the results"
    """Why there is no problem that goes with the results, where there is none."""

    @property
    def vibrating(self) -> Problem | None:
        """The problem that goes with the results; None where they are of no problem with loads.

        Points are of this problem at their frequency and ``parameter``: checks in time and sensitivities rely on it.
        """
        return self.problem

    @property
    def pulse(self) -> Pulse:
        """That of the balance."""
        return self.balance.pulse

    @property
    def numerics(self) -> Mapping[str, Any]:
        """The form of the Jacobians."""
        return {"jacobian": self.balance.backend.name}

    def solutions(self) -> Solutions:
        """The points, in memory."""
        return self.run().solutions()

    def recorder(self) -> Recorder:
        """What makes the numbers of the results from points."""
        return Recorder(self.balance, parameter=self.parameter)

    def doubts(self, values: Mapping[str, Array]) -> list[str]:
        """What is suspicious in the values of the results, by variable."""
        problem = self.problem
        unit, asked = problem.units.angular, adapted_to(self.options)
        return [
            *drift_warnings(problem, values),
            *result_warnings(self.followed, values, problem.elements, unit, asked, self.requested),
        ]


class Checks(Gathering):
    """Checks of what is given to an analysis; ``end`` raises InputError with the faults of all of them."""

    def __init__(self, problem: Any) -> None:
        super().__init__()
        self.problem = self.take(followed_problem, problem)

    def name(self, value: Any, example: str = "damper.mu") -> str:
        """Name of the parameter; empty where it is none."""
        return self.take(_name, value, f'a name such as "{example}"') or ""

    @property
    def units(self) -> Units | None:
        """Those of the problem, in which texts such as "15 Hz" are read."""
        return None if self.problem is None else self.problem.units

    def range(self, span: Any, requested: Any, name: str) -> tuple[tuple[float, float] | None, tuple[float, ...]]:
        """First and last value of a parameter, None where they are not right, and the values wanted between them."""
        points, where = self.take(requested_values, requested) or (), f"range of {name}" if name else "range"
        with self:
            return self._between(two_numbers(span, where), points, where, positive=False), points
        return None, points

    def frequencies(self, span: Any, requested: Any = ()) -> tuple[tuple[float, float] | None, tuple[float, ...]]:
        """The same of frequencies, rad/s."""
        points = self.take(requested_frequencies, requested, self.units) or ()
        with self:
            ends = self._between(two_frequencies(span, self.units), points, "frequency range", positive=True)
            if ends is not None and self.problem is not None:
                self.faults += reach_faults(self.problem, ends)
            return ends, points
        return None, points

    def _between(
        self, ends: tuple[float, float], points: tuple[float, ...], name: str, *, positive: bool
    ) -> tuple[float, float] | None:
        faults = range_faults(*ends, name=name, positive=positive)
        self.faults += faults or requested_faults(points, *ends)
        return None if faults else ends

    def takes(self, parameter: str, values: Iterable[float] | None) -> None:
        """That the problem has the parameter, and that it takes the values."""
        if self.problem is not None and parameter:
            self.take(_takes, self.problem, parameter, values or ())

    def common(self, requested: tuple[float, ...], options: Any = None, listeners: Any = ()) -> dict[str, Any]:
        """The fields of a request that all analyses ask for alike; InputError with all faults so far."""
        common = self.shared(requested, options, listeners)
        self.end()
        return common

    def shared(self, requested: tuple[float, ...], options: Any, listeners: Any) -> dict[str, Any]:
        """The same, None where one of them is at fault; without a problem only what does not need one is checked."""
        chosen, heard = self.take(options_of, options), self.take(heard_by, listeners)
        balance = None
        if self.problem is not None and chosen is not None:
            balance = self.take(_balance, self.problem, chosen)
        return {"balance": balance, "requested": requested, "options": chosen, "listeners": heard}


def _name(value: Any, expected: str) -> str:
    if not (name := text("parameter", value, expected)):
        raise wrong("parameter", value, expected)
    return name


def _takes(problem: Problem, parameter: str, values: Iterable[float]) -> None:
    parameter_path(problem, parameter)
    for value in values:
        problem.at_parameter(parameter, value)


def followed_problem(value: Any) -> Problem:
    """A problem that has contacts."""
    problem = one("problem", value, Problem, "an ss.Problem")
    if not problem.contacts:
        raise InputError("there is no contact; the response is linear: use linear_response, or give a contact")
    return problem


def _balance(problem: Problem, options: ContinuationOptions) -> Balance:
    return Balance(problem, backend=options.jacobian if isinstance(options, ResponseOptions) else "auto")


def heard_by(listeners: Any) -> tuple[EventFunction, ...]:
    """Who listens: one function of an event, or several; InputError for what is none."""
    if callable(listeners):
        return (listeners,)
    expected = "a function of one event, or a list of them"
    several = listed("listeners", listeners, expected)
    for listener in several:
        if not callable(listener):
            raise wrong("listeners", listener, expected)
    return several
