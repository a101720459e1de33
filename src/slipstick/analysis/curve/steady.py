"""Steady motions at given frequencies or parameter values, without the curve between them."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest, CurveRun, curve_arguments, curve_over, special_points
from slipstick.analysis.curve.linear import ends_of, frequencies_of
from slipstick.analysis.road.request import Checks
from slipstick.balance.balance import Balance
from slipstick.errors import Fault, InputError, Outcome, without_points
from slipstick.faults import frequency, numbers, wrong
from slipstick.interrupts import pass_on
from slipstick.results.record import Point, contact_states, unknowns
from slipstick.results.solutions import Solutions
from slipstick.typing import Array

_LISTED = 5
"""Number of values without a solution that a message names."""


def steady_request(
    problem: Any, parameter: Any = None, values: Any = None, *, omega: Any, guess: Any = None, options: Any = None,
    listeners: Any = (), stability: Any = False,
) -> SteadyRequest:  # fmt: skip
    """Request of ``steady_response``; its arguments, checked. Raises InputError with all faults."""
    checks = Checks(problem)
    over = parameter is not None
    name = checks.name(parameter) if over else ""
    at = checks.take(frequency, "omega", omega, checks.units) if over else None
    if over and values is None:
        checks.faults.append(Fault("values", "nothing", expected=f"values of {name or 'the parameter'}"))
    elif not over and values is not None:
        checks.faults.append(Fault("parameter", "values are given, but no parameter", remedy="name it"))
    array = checks.take(_values, values) if over and values is not None else None
    if not over:
        array = checks.take(frequencies_of, omega, checks.units)
    points = None if array is None else tuple(array.tolist())
    checks.takes(name, points)
    start, near = (None, guess) if isinstance(guess, Solutions) else (guess, None)
    common = curve_arguments(checks, (), None, options, listeners, start, stability)
    assert checks.problem is not None
    assert points is not None
    ends = (min(points), max(points)) if over else ends_of(omega, np.array(points))
    request = curve_over(checks.problem, name, at, ends, common)
    return SteadyRequest(**(vars(request) | {"peaks_of": (), "largest_of": ()}), values=points, near=near)


def _values(values: Any) -> Array:
    expected = "finite numbers, one or a list"
    array: Array = np.atleast_1d(numbers("values", values, expected))
    if array.ndim > 1 or array.size == 0:
        raise wrong("values", values, expected)
    return array


@dataclass(frozen=True, kw_only=True)
class SteadyRequest(CurveRequest):
    """A request for separate points; ``near`` is a branch whose points are the first guesses."""

    values: tuple[float, ...]
    near: Solutions | None = None
    analysis: ClassVar[str] = "steady"

    def run(self) -> SteadyRun:
        """The run that finds the points."""
        return SteadyRun(self)

    def at(self, value: float) -> CurveRequest:
        """Request for a curve that begins at a value."""
        inputs, omega = self.system.at(value)
        guess, context = self.guess, None
        if self.near is not None:
            guess, context = _nearest(self.near, self.balance, value if self.parameter else omega, self.parameter)
        stop = value + (abs(value) or 1.0)
        return replace(self, start=value, stop=stop, inputs=inputs, omega=omega, guess=guess, context=context)


class SteadyRun(CurveRun):
    """Run that finds separate points."""

    request: SteadyRequest

    def points(self) -> Generator[Point, None, None]:
        """A point for each value at which one is found."""
        values, missed = self.request.values, list[tuple[float, Outcome, str]]()
        self._special = special_points(self.request)
        for number, value in enumerate(values, 1):
            point = self._at(value, missed)
            self.progress = number / len(values)
            if point is not None:
                yield point
            pass_on()
        self.outcome = missed[0][1] if missed else Outcome.COMPLETED
        self.message = self._said(missed) if missed else "completed: every point that was asked for was found"

    def _at(self, value: float, missed: list[tuple[float, Outcome, str]]) -> Point | None:
        request = self.request.at(value)
        steps = self._continuation(request, None)
        if steps is None:
            missed.append((value, Outcome.NO_FIRST_POINT, ""))
            return None
        step = next(steps, None)
        self.state.done = self.state.done.plus(steps.work)
        if step is None:
            missed.append((value, steps.outcome or Outcome.NO_FIRST_POINT, steps.message))
            return None
        return self._point(step, None, steps.residual)._replace(kind="requested")

    def _said(self, missed: Sequence[tuple[float, Outcome, str]]) -> str:
        request = self.request
        unit = f" ({request.parameter})" if request.parameter else f" {request.problem.units.angular}"
        where = ", ".join(f"{value:.6g}" for value, _, _ in missed[:_LISTED])
        more = " and more" if len(missed) > _LISTED else ""
        why = next((said for _, _, said in missed if said), "") or missed[0][1].text
        return f"{len(missed)} of {len(request.values)} points were not found, at {where}{more}{unit}: {why}"

    @property
    def closing(self) -> str:
        """The message, which names the points itself."""
        return self.message if self.count else without_points(self.message)


def _nearest(branch: Solutions, balance: Balance, value: float, parameter: str) -> tuple[Array, Array | None]:
    """Unknowns (N,) and contact states, where there are any, at the point of a branch nearest to a value.

    InputError where the branch holds no motion of such contacts.
    """
    if not len(branch):
        raise InputError(f"guess: the branch has no points; its outcome is: {branch.message}")
    table = branch.table
    if not any(str(name).startswith("contact_") for name in table):
        raise InputError("guess: the branch is of a linear response, which holds no motion of contacts")
    followed = "parameter" if parameter and str(table.attrs.get("parameter", "")) == parameter else "omega"
    point = int(np.argmin(np.abs(table[followed].to_numpy() - value)))
    guess = unknowns(table, branch.problem_at(point), point)
    if guess.shape != (balance.n_ports, balance.L):
        held = f"a branch of {guess.shape[0]} contact motions and {guess.shape[1]} coefficients"
        raise InputError(Fault("guess", held, expected=f"{balance.n_ports} and {balance.L}"))
    states = contact_states(table, balance, point)
    if states is not None:  # those that are sought near a guess: a slow one is the problem's, whatever is guessed
        by_state = zip(balance.states, balance.by_state(states), strict=True)
        states = np.concatenate([state.start if state.slow else value for state, value in by_state])
    return guess.reshape(-1), states
