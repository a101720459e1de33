"""Single steady motions: at given values of what would be followed, without the curve between them."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest, CurveRun, curve_over, special_points
from slipstick.analysis.curve.linear import ends_of, frequencies_of
from slipstick.analysis.curve.request import StabilityRequest, curve_arguments
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import Checks
from slipstick.balance.balance import Balance
from slipstick.balance.problem import Problem
from slipstick.balance.systems import FrequencySystem
from slipstick.branch import Branch
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import frequency, numbers, wrong
from slipstick.interrupts import pass_on
from slipstick.results.record import Point, Recorder, contact_states, unknowns
from slipstick.solve.continuation import ContinuationOptions
from slipstick.solve.newton import newton
from slipstick.solve.norm import norm
from slipstick.typing import AnyArray, Array, FrequencyList, Reals

_LISTED = 5
"""So many values without a solution are named."""


def steady_response(
    problem: Problem,
    parameter: str | None = None,
    values: Reals | None = None,
    *,
    omega: FrequencyList,
    guess: Branch | Reals | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    stability: StabilityRequest = False,
) -> Branch:
    """Steady vibration at given frequencies, or at given values of a parameter: these points alone.

    Each point is found by itself, from ``guess`` or from nothing: where several motions exist, which one is found does
    not depend on the other points. A curve (``forced_response``) follows one from an end of its range.

    Parameters
    ----------
    problem
        What vibrates.
    parameter, values
        Name of a parameter as of ``parameter_response`` and its values, one or a list. Without, points are those of
        the frequencies.
    omega
        Fundamental frequencies, rad/s, one or a list; one alone with a ``parameter``.
    guess
        What to try first: a branch, of which the point nearest to each one is taken (with its contact states), or
        unknowns as of ``forced_response``, such as ``branch.guess(point)``.
    options, listeners, stability
        As of ``forced_response``.

    Returns
    -------
    Branch
        Points of kind "requested", in the order of the values given. Values at which no motion is found are left out:
        the ``outcome`` is that of the first of them, and ``message`` names them.

    Raises
    ------
    InputError
        For values, a parameter, a guess or an option that cannot be used.

    Warns
    -----
    SlipstickWarning
        As ``forced_response``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))
    >>> branch = steady_response(problem, omega=[8.0, 9.5])
    >>> branch.dataset.amplitude.values.round(4).tolist()
    [[1.3146], [2.0042]]
    >>> steady_response(problem, "damper.mu", 0.2, omega=9.5).dataset.amplitude.values.round(4).tolist()
    [[2.7585]]
    """
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
    start = None if isinstance(guess, Branch) else guess
    common = curve_arguments(checks, (), None, options, listeners, start, stability)
    assert checks.problem is not None
    assert points is not None
    ends = (min(points), max(points)) if over else ends_of(omega, np.array(points))
    request = curve_over(checks.problem, name, at, ends, common)
    return SteadyRequest(
        **(vars(request) | {"peaks_of": (), "largest_of": ()}), values=points,
        near=guess if isinstance(guess, Branch) else None,
    ).branch()  # fmt: skip


def _values(values: Any) -> Array:
    expected = "finite numbers, one or a list"
    array: Array = np.atleast_1d(numbers("values", values, expected))
    if array.ndim > 1 or array.size == 0:
        raise wrong("values", values, expected)
    return array


@dataclass(frozen=True, kw_only=True)
class SteadyRequest(CurveRequest):
    """Points to be found, each by itself; ``near`` is a branch near which they are sought."""

    values: tuple[float, ...]
    near: Branch | None = None
    analysis: ClassVar[str] = "steady"

    def run(self) -> SteadyRun:
        """What finds them."""
        return SteadyRun(self)

    def at(self, value: float) -> CurveRequest:
        """A curve that begins at a value."""
        inputs, omega = self.system.at(value)
        guess, context = self.guess, None
        if self.near is not None:
            guess, context = _nearest(self.near, self.balance, value if self.parameter else omega, self.parameter)
        stop = value + (abs(value) or 1.0)
        return replace(self, start=value, stop=stop, inputs=inputs, omega=omega, guess=guess, context=context)


class SteadyRun(CurveRun):
    """Steady points under way."""

    request: SteadyRequest

    def points(self) -> Generator[Point, None, None]:
        """One for each value, but those where there is none."""
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
        """The message as it is."""
        return self.message


def _nearest(branch: Branch, balance: Balance, value: float, parameter: str) -> tuple[Array, Array | None]:
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


def corrected(branch: Branch, point: int) -> Mapping[str, AnyArray]:
    """Every variable of the schema at the frequency and parameter of a point, solved for from there.

    The point's own numbers where no solution is found next to them. Raises InputError where the problem is not known.
    """
    numbers_there, problem = branch.point(point), branch.problem_at(point)
    balance, omega = Balance(problem), float(numbers_there["omega"])
    balance.anchor_if_undamped(omega)
    near = contact_states(branch.table, balance, point)
    system, start = FrequencySystem(balance, problem.inputs), branch.guess(point).ravel()
    result = newton(lambda x: system.evaluate(x, omega, near), start, scale=norm(start) or 1.0)
    if not result.converged:
        return {str(name): np.asarray(numbers_there[name]) for name in numbers_there}
    solution = Point.at(
        result.evaluation.detail, x=result.x, residual=result.residual_norm, iterations=result.iterations,
        kind="regular", parameter=omega, peak_of="",
    )  # fmt: skip
    return Recorder(balance).record(solution)
