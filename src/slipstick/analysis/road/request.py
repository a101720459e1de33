"""Requests: what an analysis is to compute. ``Checks`` checks the arguments that all analyses share, once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

from slipstick.analysis.road.events import EventFunction
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
from slipstick.balance.jacobian_backends import BACKENDS, JacobianBackend
from slipstick.balance.parameters import parameter_path
from slipstick.balance.problem import Problem
from slipstick.balance.support import drift_warnings
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, listed, number, one, shown, suggestion, text, whole, wrong
from slipstick.results.record import Recorder
from slipstick.results.result_warnings import result_warnings
from slipstick.solve.continuation import ContinuationOptions
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array
from slipstick.units import Units

if TYPE_CHECKING:
    from slipstick.analysis.road.checkpoint import Checkpoint
    from slipstick.analysis.road.run import Run
    from slipstick.results.solutions import Solutions


@dataclass(frozen=True, kw_only=True)
class ResponseOptions(ContinuationOptions):
    """Options of a response curve: those of a continuation, with points close enough for smooth figures, and these.

    Parameters
    ----------
    jacobian
        In which form Jacobians are made: "dense", all entries, factorised; "iterative", products alone, for hundreds of
        contacts on a structure known by its modes; "auto", which of the two costs less. Or a kind of one's own, see
        ``slipstick.balance.jacobian_backends``.
    adapt_harmonics
        Relative accuracy, such as 1e-3: each point is computed with as few of the problem's harmonics as that asks for;
        ``harmonics_in_use`` in the results says how many. None: all of them at every point.
    """

    first_step: float = 1 / 60
    max_step: float = 1 / 30
    output_step: float = 1 / 120
    event_tolerance: float = 1e-9
    jacobian: JacobianBackend | str = "auto"
    adapt_harmonics: float | None = None


def response_options(**options: Any) -> ResponseOptions:
    """``ResponseOptions`` with the fields given: steps of at most 1/30 of the range, points each 1/120 by default."""
    return ResponseOptions(**options)


def options_of(chosen: Any) -> ResponseOptions:
    """Options from a dict, from an object of options, or the default for None; raises InputError for anything else."""
    if chosen is None or isinstance(chosen, ResponseOptions):
        return chosen or response_options()
    if isinstance(chosen, ContinuationOptions):
        return response_options(**{f.name: getattr(chosen, f.name) for f in fields(ContinuationOptions)})
    if not isinstance(chosen, Mapping):
        raise wrong("options", chosen, 'a dict such as {"max_step": 0.01}, or response_options(...)')
    known, checks = [field.name for field in fields(ResponseOptions)], Gathering()
    for name in chosen:
        if name not in known:
            checks.faults.append(Fault("options", f"there is no option {shown(name)}", remedy=suggestion(name, known)))
    values = {name: checks.take(_option, name, value) for name, value in chosen.items() if name in known}
    options = checks.take(response_options, **values) if not checks.faults else None
    checks.end()
    assert options is not None
    return options


def _option(name: str, value: Any) -> Any:
    default, where = getattr(response_options(), name), f"options, {name}"
    if name == "adapt_harmonics":
        return _accuracy(where, value)
    if name == "jacobian":
        return _jacobian(where, value)
    if isinstance(default, NewtonOptions):
        return one(where, value, NewtonOptions, "NewtonOptions(...)")
    if isinstance(default, bool):
        return one(where, value, bool, "True or False")
    return whole(where, value, 1) if isinstance(default, int) else number(where, value, "a number > 0", above=0.0)


def _accuracy(name: str, value: Any) -> float | None:
    expected = "a number between 0 and 1 such as 1e-3, or None"
    accuracy = None if value is None else number(name, value, expected)
    if accuracy is not None and not 0.0 < accuracy < 1.0:
        raise wrong(name, value, expected)
    return accuracy


def _jacobian(name: str, value: Any) -> JacobianBackend | str:
    if isinstance(value, JacobianBackend) or (isinstance(value, str) and value in ("auto", *BACKENDS)):
        return value
    raise wrong(name, value, '"auto", "dense", "iterative", or an object of a kind of one\'s own')


@dataclass(frozen=True, kw_only=True)
class AnalysisRequest(ABC):
    """A request to an analysis: each analysis adds its fields and the run that computes it.

    Attributes
    ----------
    analysis
        Name of the analysis in results and journals: "response", "track", "wear" ...
    problem
        The problem, as given.
    start, stop
        First and last value of the followed quantity.
    parameter
        Name of the parameter that differs from the problem at each point, ``Point.parameter``: the followed one, or one
        that is found. Empty where that is the frequency alone.
    requested
        Values at which points are wanted.
    warnings
        Sentences that are issued and stored with the results.
    checkpoints
        Checkpoints of the points of an earlier run, the last one resumable: the run goes on from there.
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
        """Called at every evaluation of the balance; None where evaluations are not counted."""
        return None

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """A checkpoint from its entry in the journal; raises InputError where that is damaged."""
        raise InputError(f"{self.analysis} cannot be taken up after a point")

    @abstractmethod
    def run(self) -> Run:
        """The run that computes it, not started."""

    @abstractmethod
    def recorder(self) -> Any:
        """The recorder that computes the values of the results from points."""

    @property
    def numerics(self) -> Mapping[str, Any]:
        """Attributes of the results about the numerical method."""
        return {}


@dataclass(frozen=True, kw_only=True)
class Request(AnalysisRequest):
    """A request to an analysis by harmonic balance.

    Attributes
    ----------
    balance
        The balance of the problem.
    """

    balance: Balance
    options: ResponseOptions = field(default_factory=ResponseOptions)

    without: ClassVar[str] = "it was not stored with the results"
    """Reason why results have no problem, where they have none."""

    @property
    def vibrating(self) -> Problem | None:
        """Problem of the results; None where the loads do not act in them.

        Points are of this problem at their frequency and ``parameter``: checks in time and sensitivities rely on it.
        """
        return self.problem

    @property
    def pulse(self) -> Pulse:
        """Pulse of the balance."""
        return self.balance.pulse

    @property
    def numerics(self) -> Mapping[str, Any]:
        """Form of the Jacobians."""
        return {"jacobian": self.balance.backend.name}

    def solutions(self) -> Solutions:
        """Compute all points and return them in memory."""
        return self.run().solutions()

    def recorder(self) -> Recorder:
        """The recorder that computes the values of the results from points."""
        return Recorder(self.balance, parameter=self.parameter)

    def value_warnings(self, values: Mapping[str, Array]) -> list[str]:
        """Warnings about suspicious values of the results, given by variable."""
        problem = self.problem
        unit, accuracy = problem.units.angular, self.options.adapt_harmonics
        return [
            *drift_warnings(problem, values),
            *result_warnings(
                self.followed, values, problem.elements, unit, accuracy, self.requested, problem.preloaded_elements
            ),
        ]


class Checks(Gathering):
    """Checks of the arguments of an analysis; ``end`` raises InputError with all faults."""

    def __init__(self, problem: Any) -> None:
        super().__init__()
        self.problem = self.take(followed_problem, problem)

    def name(self, value: Any, example: str = "damper.mu") -> str:
        """Name of the parameter; empty where the value is no name."""
        return self.take(_name, value, f'a name such as "{example}"') or ""

    @property
    def units(self) -> Units | None:
        """Units of the problem, in which texts such as "15 Hz" are read."""
        return None if self.problem is None else self.problem.units

    def range(self, span: Any, at: Any, name: str) -> tuple[tuple[float, float] | None, tuple[float, ...]]:
        """First and last value of a parameter, None where they are at fault, and the values wanted between them."""
        points, where = self.take(requested_values, at) or (), f"range of {name}" if name else "range"
        with self:
            return self._between(two_numbers(span, where), points, where, positive=False), points
        return None, points

    def frequencies(self, span: Any, at: Any = ()) -> tuple[tuple[float, float] | None, tuple[float, ...]]:
        """First and last frequency and those wanted between them, rad/s, as ``range`` has them."""
        points = self.take(requested_frequencies, at, self.units) or ()
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
        """Check that the problem has the parameter and takes the values."""
        if self.problem is not None and parameter:
            self.take(_takes, self.problem, parameter, values or ())

    def common(self, requested: tuple[float, ...], options: Any = None, listeners: Any = ()) -> dict[str, Any]:
        """Fields that the requests of all analyses share; raises InputError with all faults so far."""
        common = self.shared(requested, options, listeners)
        self.end()
        return common

    def shared(self, requested: tuple[float, ...], options: Any, listeners: Any) -> dict[str, Any]:
        """The same fields, None where one is at fault; without a problem the balance is None."""
        chosen, functions = self.take(options_of, options), self.take(heard_by, listeners)
        balance = None
        if self.problem is not None and chosen is not None:
            balance = self.take(_balance, self.problem, chosen)
        return {"balance": balance, "requested": requested, "options": chosen, "listeners": functions}


def _name(value: Any, expected: str) -> str:
    if not (name := text("parameter", value, expected)):
        raise wrong("parameter", value, expected)
    return name


def _takes(problem: Problem, parameter: str, values: Iterable[float]) -> None:
    parameter_path(problem, parameter)
    for value in values:
        problem.at_parameter(parameter, value)


def followed_problem(value: Any) -> Problem:
    """A problem with contacts; raises InputError for anything else."""
    problem = one("problem", value, Problem, "an ss.Problem")
    if not problem.contacts:
        raise InputError("there is no contact; the response is linear: use linear_response, or give a contact")
    return problem


def _balance(problem: Problem, options: ResponseOptions) -> Balance:
    return Balance(problem, backend=options.jacobian)


def heard_by(listeners: Any) -> tuple[EventFunction, ...]:
    """Listeners: one function of an event, or several; raises InputError for anything else."""
    if callable(listeners):
        return (listeners,)
    expected = "a function of one event, or a list of them"
    several = listed("listeners", listeners, expected)
    for listener in several:
        if not callable(listener):
            raise wrong("listeners", listener, expected)
    return several
