"""From what users ask for to the task of following it: over frequency, or over a named parameter."""

from __future__ import annotations

from typing import Any, TypeVar

from slipstick.analysis.curve.request import common_arguments, followed_problem
from slipstick.analysis.curve.task import Task, adapted_to
from slipstick.balance.checks import range_faults, requested_faults, requested_values, two_numbers
from slipstick.balance.parameters import parameter_path
from slipstick.balance.preflight import parameter_warnings, problem_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.systems import AnySystem, FrequencySystem, ParameterSystem
from slipstick.faults import Gathering, frequency, text
from slipstick.solve.continuation import ContinuationOptions

T = TypeVar("T")


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
    from slipstick.analysis.curve.harmonic_selection import adapted

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
