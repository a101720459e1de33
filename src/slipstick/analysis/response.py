"""Forced response: branches of steady vibration over frequency or over any named parameter."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from slipstick.analysis.arguments import common_arguments, followed_problem
from slipstick.analysis.events import Listener
from slipstick.analysis.linear import linear_response
from slipstick.analysis.stability.verdict import StabilityRequest
from slipstick.analysis.task import Task, adapted_to, response_options
from slipstick.analysis.walking import collect, walk
from slipstick.balance.checks import range_faults, requested_faults, requested_values, two_numbers
from slipstick.balance.parameters import parameter_path
from slipstick.balance.preflight import parameter_warnings, problem_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.systems import AnySystem, FrequencySystem, ParameterSystem
from slipstick.errors import Outcome
from slipstick.faults import Gathering, frequency, text
from slipstick.results.branch import Branch
from slipstick.results.record import Point
from slipstick.solve.continuation import ContinuationOptions

T = TypeVar("T")


def forced_response(
    problem: Problem,
    *,
    omega: tuple[float, float],
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[Listener] | Listener = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
) -> Branch:
    """Follow the steady vibration over frequency.

    Parameters
    ----------
    problem
        What vibrates.
    omega
        First and last principal frequency, rad/s, in either order.
    requested
        Frequencies at which exact points are wanted, rad/s; one or a list.
    peaks_of
        Names of output dofs whose amplitude's local maxima are located; by default all of at most 3 outputs, else those
        that are loaded or, without such, of the first contact's tangential direction.
    options
        Step control; by default ``response_options()``. A dict of its fields will do: ``{"max_step": 0.01}``.
    listeners
        Called with every event (``slipstick.analysis.events``).
    guess
        Unknowns at the first frequency to try first, (n_ports, L): coefficients of the relative motion of the contacts,
        first all tangential, then all normal ones.
    stability
        Whether every point is judged stable or not, by the Floquet multipliers of its motion (``multiplier``,
        ``stable`` and more in the dataset). "full" keeps all modes in motion; True those up to four times the highest
        harmonic.

    Returns
    -------
    Branch
        With everything found, however it ended: look at ``outcome``. A KeyboardInterrupt ends it early.

    Raises
    ------
    InputError
        For a range, dof, frequency, option or guess that cannot be used.

    Warns
    -----
    SlipstickWarning
        For what looks wrong over that range, such as frequencies in Hz or a structure without damping; all that looks
        wrong, also in the problem itself, is in ``dataset.attrs["warnings"]``, one sentence a line. Also where the
        harmonics left out would add more than 1 % of the amplitude (``truncation`` in the dataset).

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> pair = ss.ContactPair(
    ...     name="damper", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0),
    ...     rubbing=ss.RubbingMotion(velocity=100.0))
    >>> problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=100.0)], harmonics=range(11))
    >>> branch = forced_response(problem, omega=(2.0, 15.0))
    >>> [(round(w, 2), round(a, 2)) for w, a in branch.peaks("x")]
    [(6.14, 18.25)]
    """
    return collect(frequency_task(problem, omega, requested, peaks_of, options, listeners, guess, stability))


def follow(
    problem: Problem,
    *,
    omega: tuple[float, float],
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[Listener] | Listener = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
) -> Generator[Point, None, tuple[Outcome, str]]:
    """The points behind ``forced_response``, one by one; the generator's value is the outcome and its message."""
    return (yield from walk(frequency_task(problem, omega, requested, peaks_of, options, listeners, guess, stability)))


def parameter_response(
    problem: Problem,
    parameter: str,
    span: tuple[float, float],
    *,
    omega: float,
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[Listener] | Listener = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
) -> Branch:
    """Follow the steady vibration at one frequency over a named parameter.

    Parameters
    ----------
    parameter
        Such as "damper.velocity", "damper.normal_load" (at fixed kn), ``"*.mu"`` (all contacts), "rubbing.cos1",
        "load.x.amplitude", "load.x.phase" (rad; "load.x.2.phase" of one harmonic among several), "loss_factor" and
        "damping" of the structure (a factor on its viscous damping), and the factors "load" and "friction".
    span
        First and last value.
    omega
        Principal frequency, rad/s.

    The other arguments, the result and the errors are those of ``forced_response``.
    """
    given = (requested, peaks_of, options, listeners, guess, stability)
    return collect(parameter_task(problem, parameter, span, omega, *given))


def parameter_task(
    problem: Problem, parameter: str, span: tuple[float, float], omega: float, requested: Any = (), *given: Any
) -> Task:
    """What ``parameter_response`` follows; its arguments in their order."""
    found = Gathering()
    checked = found.take(followed_problem, problem)
    parameter = found.take(text, "parameter", parameter, 'a name such as "damper.mu"') or ""
    at = found.take(frequency, "omega", omega)
    name = f"range of {parameter}" if parameter else "range"
    ends, points = _range(found, span, requested, name, positive=False)
    if checked is not None and parameter:
        found.take(_takes, checked, parameter, ends)
    common = _common(found, checked, points, given)
    problem, span, omega = _right(checked), _right(ends), _right(at)
    balance, path = common["balance"], parameter_path(problem, parameter)
    return Task(
        problem=problem, system=_harmonics_by_need(ParameterSystem(balance, path, omega), common["options"], parameter),
        inputs=path.at(span[0])[0], omega=omega, start=span[0], stop=span[1], parameter=parameter,
        warnings=parameter_warnings(problem, parameter, span, omega, balance.receptance.static),
        **common,
    )  # fmt: skip


def frequency_task(problem: Problem, omega: tuple[float, float], requested: Any = (), *given: Any) -> Task:
    """What ``forced_response`` follows; its arguments in their order."""
    found = Gathering()
    checked = found.take(followed_problem, problem)
    ends, points = _range(found, omega, requested, "frequency range", positive=True)
    common = _common(found, checked, points, given)
    problem, (start, stop) = _right(checked), _right(ends)
    balance, inputs = common["balance"], problem.inputs
    balance.anchor_if_undamped(start)
    return Task(
        problem=problem, system=_harmonics_by_need(FrequencySystem(balance, inputs), common["options"]),
        inputs=inputs, omega=start,
        start=start, stop=stop, warnings=problem_warnings(problem, (start, stop), balance.receptance.static),
        **common,
    )  # fmt: skip


def _harmonics_by_need(system: AnySystem, options: ContinuationOptions, parameter: str = "") -> AnySystem:
    """The system as it is, or with harmonics by need where that is asked for."""
    tolerance = adapted_to(options)
    if tolerance is None:
        return system
    from slipstick.analysis.adapting import adapted

    return adapted(system, tolerance, parameter)


def _range(
    found: Gathering, span: Any, requested: Any, name: str, *, positive: bool
) -> tuple[tuple[float, float] | None, tuple[float, ...]]:
    """First and last value, None where they are not right, and the values wanted between them."""
    points = found.take(requested_values, requested) or ()
    ends = found.take(two_numbers, span, name)
    if ends is None:
        return None, points
    faults = range_faults(*ends, name=name, positive=positive)
    found.faults += faults or requested_faults(points, *ends)
    return (None if faults else ends), points


def _takes(problem: Problem, parameter: str, span: tuple[float, float] | None) -> None:
    """InputError where the parameter is not known, or does not take an end of its range."""
    parameter_path(problem, parameter)
    for end in span or ():
        problem.at_parameter(parameter, end)


def _common(found: Gathering, problem: Problem | None, points: tuple[float, ...], given: tuple[Any, ...]) -> Any:
    """The arguments that all kinds of branches have; InputError with all that was found until here."""
    common = found.take(common_arguments, problem, points, *given)
    found.end()
    return _right(common)


def _right(value: T | None) -> T:
    """What was found to be right."""
    assert value is not None
    return value


__all__ = ["follow", "forced_response", "linear_response", "parameter_response", "response_options"]
