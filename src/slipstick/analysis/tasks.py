"""From what users ask for to the task of following it: versus frequency, or over a named parameter."""

from __future__ import annotations

from typing import Any, TypeVar

from slipstick.analysis.arguments import common_arguments, followed_problem
from slipstick.analysis.task import Task, adapted_to
from slipstick.balance.checks import (
    range_faults,
    requested_faults,
    requested_frequencies,
    requested_values,
    two_frequencies,
    two_numbers,
)  # fmt: skip
from slipstick.balance.parameters import parameter_path
from slipstick.balance.preflight import parameter_warnings, problem_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.systems import AnySystem, FrequencySystem, ParameterSystem
from slipstick.faults import Gathering, frequency, text
from slipstick.solve.continuation import ContinuationOptions

T = TypeVar("T")


def parameter_task(problem: Problem, parameter: str, span: Any, omega: Any, requested: Any = (), *given: Any) -> Task:
    """What ``parameter_response`` follows; its arguments in their order."""
    found = Gathering()
    checked = found.take(followed_problem, problem)
    parameter = found.take(text, "parameter", parameter, 'a name such as "damper.mu"') or ""
    at = found.take(frequency, "omega", omega, checked.units if checked else None)
    name = f"range of {parameter}" if parameter else "range"
    points = found.take(requested_values, requested) or ()
    ends = _range(found, found.take(two_numbers, span, name), points, name, positive=False)
    if checked is not None and parameter:
        found.take(_takes, checked, parameter, ends)
    common = _common(found, checked, points, given)
    problem, span, omega = _right(checked), _right(ends), _right(at)
    balance, path = common["balance"], parameter_path(problem, parameter)
    static, steady = balance.receptance.static, common["stability"] is not None
    return Task(
        problem=problem, system=_harmonics_by_need(ParameterSystem(balance, path, omega), common["options"], parameter),
        inputs=path.at(span[0])[0], omega=omega, start=span[0], stop=span[1], parameter=parameter,
        warnings=parameter_warnings(problem, parameter, span, omega, static, steady=steady),
        **common,
    )  # fmt: skip


def frequency_task(problem: Problem, omega: Any, requested: Any = (), *given: Any) -> Task:
    """What ``forced_response`` follows; its arguments in their order."""
    found = Gathering()
    checked = found.take(followed_problem, problem)
    units = checked.units if checked else None
    points = found.take(requested_frequencies, requested, units) or ()
    ends = _range(found, found.take(two_frequencies, omega, units), points, "frequency range", positive=True)
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
    found: Gathering, ends: tuple[float, float] | None, points: tuple[float, ...], name: str, *, positive: bool
) -> tuple[float, float] | None:
    """First and last value, None where they are not right or do not fit the values wanted between them."""
    if ends is None:
        return None
    faults = range_faults(*ends, name=name, positive=positive)
    found.faults += faults or requested_faults(points, *ends)
    return None if faults else ends


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
