"""What is asked of an analysis, checked once: the arguments that all analyses share, and the request they become."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from numpy.typing import ArrayLike

from slipstick.analysis.events import EventFunction
from slipstick.balance.balance import Balance
from slipstick.balance.checks import (
    peak_faults,
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
from slipstick.faults import (
    Gathering,
    listed,
    names,
    number,
    numbers,
    one,
    shown,
    suggestion,
    text,
    whole,
    wrong,
)  # fmt: skip
from slipstick.results.record import Recorder
from slipstick.results.result_warnings import result_warnings
from slipstick.results.schema import LARGEST
from slipstick.solve.continuation import ContinuationOptions
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array
from slipstick.units import Units

if TYPE_CHECKING:
    from slipstick.analysis.checkpoint import Checkpoint
    from slipstick.analysis.curve.record import Run
    from slipstick.analysis.stability.floquet import StabilityWatch
    from slipstick.results.solutions import Solutions

StabilityRequest = bool | Literal["full"]
"""What users ask for."""

PEAK_OUTPUTS = 3
"""Up to that many outputs, the peaks of all of them are located."""
LARGEST_OUTPUTS = 100
"""Up to that many others, the largest amplitude of each is located."""


@dataclass(frozen=True, kw_only=True)
class ResponseOptions(ContinuationOptions):
    """Options of a response curve: those of a continuation, with points so near that figures look smooth, and these.

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


def adapted_to(options: ContinuationOptions) -> float | None:
    """The accuracy to which harmonics are adapted; None where all are in use."""
    return options.adapt_harmonics if isinstance(options, ResponseOptions) else None


@dataclass(frozen=True, kw_only=True)
class Request(ABC):
    """What is asked of an analysis; each analysis adds what it needs, and the run that computes it.

    Attributes
    ----------
    analysis
        Name of the analysis, as results and journals say it: "response", "track", "wear" ...
    problem, balance
        What vibrates, as given and made ready.
    parameter
        Name of the parameter that is followed; empty where it is the frequency.
    start, stop
        First and last value of what is followed.
    requested
        Values of it at which points are wanted.
    warnings
        Given to the user and kept with the results.
    checkpoints
        Of every point that was found already, up to one that the analysis can be taken up after: it goes on from there.
    """

    problem: Problem
    balance: Balance
    start: float
    stop: float
    parameter: str = ""
    requested: tuple[float, ...] = ()
    options: ContinuationOptions = field(default_factory=ResponseOptions)
    listeners: tuple[EventFunction, ...] = ()
    warnings: Sequence[str] = ()
    checkpoints: Sequence[Checkpoint] = ()

    @property
    @abstractmethod
    def analysis(self) -> str:
        """Name of the analysis."""

    without: ClassVar[str] = "it was not stored with the results"
    """Why there is no problem that goes with the results, where there is none."""

    @property
    def vibrating(self) -> Problem | None:
        """The problem that goes with the results; None where they are of no problem with loads."""
        return self.problem

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Where a run stood at a point, from its journal; raises InputError where that is damaged."""
        raise InputError(f"{self.analysis} cannot be taken up after a point")

    @abstractmethod
    def run(self) -> Run:
        """What computes it, not begun yet."""

    def solutions(self) -> Solutions:
        """The points, in memory."""
        return self.run().solutions()

    def recorder(self) -> Recorder:
        """What makes the numbers of the results from points."""
        return Recorder(self.balance, parameter=self.parameter)

    def doubts(self, values: Mapping[str, Array]) -> list[str]:
        """What is suspicious in the values of the results, by variable."""
        problem, followed = self.problem, self.parameter or "omega"
        unit, asked = problem.units.angular, adapted_to(self.options)
        return [
            *drift_warnings(problem, values),
            *result_warnings(followed, values, problem.elements, unit, asked, self.requested),
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

    def common(self, requested: tuple[float, ...], *arguments: Any, **named: Any) -> dict[str, Any]:
        """The fields that ``common_arguments`` makes of them; InputError with all faults so far."""
        common = self.take(common_arguments, self.problem, requested, *arguments, **named)
        self.end()
        assert common is not None
        return common


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


def common_arguments(
    problem: Problem | None,
    requested: tuple[float, ...],
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
) -> dict[str, Any]:
    """The fields of a ``CurveRequest`` that are asked for alike for every kind of branch, and the problem made ready.

    Without a problem (where it is itself at fault) only what does not need one is checked.

    Raises
    ------
    InputError
        With the faults of all of them.
    """
    checks = Gathering()
    chosen = checks.take(_options, options)
    heard = checks.take(heard_by, listeners)
    sought = checks.take(_peak_dofs, problem, peaks_of) if problem is not None else None
    balance = checks.take(_balance, problem, chosen) if problem is not None and chosen is not None else None
    start = checks.take(_guess, guess, balance) if guess is not None and balance is not None else None
    judged = checks.take(stability_request, stability)
    watch = checks.take(_watch, balance, judged) if judged and balance is not None else None
    checks.end()
    return {
        "balance": balance,
        "stability": watch,
        "requested": requested,
        "peaks_of": sought[0] if sought else (),
        "largest_of": sought[1] if sought else (),
        "options": chosen,
        "listeners": heard,
        "guess": start,
    }


def _watch(balance: Balance, judged: StabilityRequest) -> StabilityWatch:
    from slipstick.analysis.stability.floquet import StabilityWatch

    if balance.problem.structure.covers[1] < inf:
        remedy = (
            'fit modes to it (ss.models.modal_analysis), or say beyond="line": then it is counted from the receptance'
        )
        found = "the structure is a table of receptances: it has no states, and ends where disturbances are asked for"
        raise InputError(Fault("stability", found, remedy=remedy))
    return StabilityWatch(balance, full=judged == "full")


def _balance(problem: Problem, options: ContinuationOptions) -> Balance:
    return Balance(problem, backend=options.jacobian if isinstance(options, ResponseOptions) else "auto")


def _options(chosen: Any) -> ContinuationOptions:
    if chosen is None or isinstance(chosen, ContinuationOptions):
        return chosen or response_options()
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


def _guess(value: Any, balance: Balance) -> Array:
    guess = numbers("guess", value, f"{balance.size} finite numbers")
    if guess.shape not in ((balance.size,), (balance.n_ports, balance.L)):
        raise InputError(
            f"guess: found shape {guess.shape}; expected ({balance.n_ports}, {balance.L}): coefficients of the "
            "relative motion of the contacts, first all tangential, then all normal ones"
        )
    return guess.reshape(-1)


def _peak_dofs(problem: Problem, peaks_of: Sequence[str] | str | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs of which all peaks are located, and those of which the largest amplitude is."""
    outputs = tuple(problem.outputs or ())
    if peaks_of is None:
        if len(outputs) <= PEAK_OUTPUTS:
            return outputs, ()
        loaded = [load.dof for load in problem.loads if load.dof in outputs]
        first = [pair.first_direction for pair in problem.contacts[:1]]
        rubbed = [dof for direction in first for dof in direction if dof in outputs]
        chosen = tuple(dict.fromkeys(str(dof) for dof in loaded or rubbed)) or outputs[:1]
        rest = tuple(dof for dof in outputs if dof not in chosen)
        return chosen, rest if len(rest) <= LARGEST_OUTPUTS else ()
    chosen = names("peaks_of", peaks_of)
    if chosen == (LARGEST,) and LARGEST not in outputs:
        return chosen, ()
    faults = [fault.inside("peaks_of") for fault in peak_faults(chosen, outputs)]
    if faults:
        raise InputError(faults)
    return chosen, ()


def stability_request(stability: object) -> StabilityRequest:
    """Whether stability is asked for; InputError for anything but True, False, "full"."""
    if isinstance(stability, bool) or (isinstance(stability, str) and stability == "full"):
        return stability  # type: ignore[return-value]
    raise InputError(
        Fault("stability", found=shown(stability), expected='True, False, or "full" (all modes in motion)')
    )
