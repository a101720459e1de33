"""Contact states along a branch: handed from point to point, and across folds where their equilibrium ends.

Beyond such a fold the states relax to another equilibrium: ``dz/dt = r(z, P)``. Vibration settles within periods, the
temperature of a body within seconds: the motion is the steady one at each value of the states.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np

from slipstick.analysis.curve.observables import context_between
from slipstick.analysis.road.run import NO_WORK, Work
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail, FrequencySystem, ParameterSystem, evaluated_together
from slipstick.balance.inputs import Inputs
from slipstick.errors import Outcome
from slipstick.results.schema import NEAR_FOLD
from slipstick.solve.continuation import Continuation, RestartPoint, Step, continuation
from slipstick.solve.continuation.follow import failed
from slipstick.solve.newton import NewtonOptions, NewtonResult, newton
from slipstick.solve.norm import norm, relative
from slipstick.state.contact_state import Carried, ContactState
from slipstick.typing import Array
from slipstick.units import Units

_REST = 1e-8
"""Rate over the span of the states at which they have relaxed, and tolerance of the integration."""
_LONGEST_TIME, _LONGEST_STEP = 1e5, 1e3
"""Longest integration and step, in time constants of a state without friction."""
_NEWTON = NewtonOptions(max_iterations=40)


class MotionLostError(Exception):
    """No steady motion was found at some values of the states."""


def relaxed(
    balance: Balance, inputs: Inputs, omega: float, x: Array, z: Array, *, reach: float = np.inf
) -> tuple[Array, Detail] | None:
    """Motion (N,) and evaluation after fast contact states have relaxed from z (n_states,) at the motion x (N,).

    Beyond their limits the parameters are held. None where no motion or no equilibrium is found, or where the motion
    at z differs from x by more than ``reach`` times its size.
    """
    from scipy.integrate import solve_ivp

    rates = SlowRates(balance, inputs, omega, x)
    fast = np.concatenate([np.full(len(state.names), not state.slow) for state in balance.states])
    span = np.concatenate([state.span for state in balance.states])
    moves = fast & np.isfinite(span)
    span = np.where(np.isfinite(span), span, 1.0)

    def rate(t: float, z: Array) -> Array:
        return np.where(moves, rates(z), 0.0)

    def moving(t: float, z: Array) -> float:
        return float(np.max(np.abs(rate(t, z)) / span)) - _REST

    moving.terminal, moving.direction = True, -1  # type: ignore[attr-defined]
    low = float(span.min())
    try:
        rates(z)
        if np.linalg.norm(rates.x - x) > reach * np.linalg.norm(x):
            return None
        solution = solve_ivp(
            rate,
            (0.0, _LONGEST_TIME),
            z,
            method="LSODA",
            events=moving,
            rtol=_REST,
            atol=_REST * low,
            max_step=_LONGEST_STEP,
        )
    except MotionLostError:
        return None
    if solution.status != 1:
        return None
    result = _solve(balance, inputs, omega, rates.x, solution.y[:, -1])
    return (result.x, result.evaluation.detail) if result.converged else None


class SlowRates:
    """Rates (n_states,) of contact states held at given values (n_states,), in steady motion.

    ``x`` is the last motion, from which the next is sought, and ``detail`` its evaluation.

    Raises
    ------
    MotionLostError
        Where no steady motion is found from the last one.
    """

    def __init__(self, balance: Balance, inputs: Inputs, omega: float, x: Array) -> None:
        self._balance, self._inputs, self._omega, self.x = balance.holding(), inputs, omega, x
        self.detail: Detail | None = None

    def __call__(self, z: Array) -> Array:
        """Rates at values (n_states,)."""
        result = _solve(self._balance, self._inputs, self._omega, self.x, z)
        if not result.converged:
            raise MotionLostError
        self.x, detail = result.x, result.evaluation.detail
        self.detail = detail
        return np.concatenate([state.rate.value for state in detail.states])


def _solve(balance: Balance, inputs: Inputs, omega: float, x: Array, z: Array) -> NewtonResult:
    system = FrequencySystem(balance, inputs)
    scale = float(np.linalg.norm(x)) or 1.0
    return newton(lambda y: system.evaluate(y, omega, z), x, options=_NEWTON, scale=scale)


UNSOLVED = 1e-8
"""Relative residual above which a point is no solution, for rounding: the branch ends before it."""

FOLDS = ("turning point", NEAR_FOLD)
"""Kinds of points at which a branch turns back, or nearly does."""
_ROUNDING = 1e-11
"""Residual over the norm of the motion, up to which it is rounding."""
_FOLD_MARGIN = 0.5
"""Margin of the equilibrium of a state, up to which a fold of it may have ended the continuation."""
_DISTANCES_BEYOND = (1e-5, 1e-4, 1e-3)
"""Distances beyond a fold at which the states relax, over the range."""
_CHANGED, _CHANGED_UNSTABLE = 1e-3, 20e-3
"""Change of a state over its span, above which it is named: at a fold, and where stability was lost."""
_SAME_MOTION = 0.02
"""Relative change of motion beyond a turning point, up to which the held states still have their motion."""
_MOST_JUMPS = 50


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A parameter at which the equilibrium of a fast contact state ended and the states relaxed to another one."""

    parameter: float
    before: Detail
    after: Detail
    turned: bool
    """Whether the branch turned back there."""
    units: Units
    of_frequency: bool
    """Whether the parameter is the frequency."""

    @property
    def beyond_fold(self) -> bool:
        """Whether the states reached another equilibrium, not the one near its fold."""
        return abs(_margin(self.after)) > 2.0 * abs(_margin(self.before))

    @property
    def far(self) -> bool:
        """Whether the values changed."""
        # an equilibrium that becomes unstable at held motion continues close to itself
        least = _CHANGED_UNSTABLE if _margin(self.after) < 0 and not self.turned else _CHANGED
        pairs = zip(self.before.states, self.after.states, strict=True)
        return any(bool(np.any(np.abs(new.values - old.values) > least * new.state.span)) for old, new in pairs)

    @property
    def text(self) -> str:
        """The parameter and the values before and after, of the contacts that change most."""
        pairs = zip(self.before.states, self.after.states, strict=True)
        changes = [_change(old, new, self.units) for old, new in pairs if not new.state.slow]
        unit = f" {self.units.angular}" if self.of_frequency else ""
        return f"{self.parameter:.6g}{unit} ({'; '.join(changes)})"


def _change(old: Carried, new: Carried, units: Units) -> str:
    before, after, names = old.values, new.values, new.state.names
    order, unit = np.argsort(-np.abs(after - before), kind="stable"), units.after(new.state.variable.units)
    changes = [f"{names[i]} from {before[i]:.5g} to {after[i]:.5g}{unit}" for i in order[:3]]
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f"{new.state.variable.name} of {', '.join(changes)}{more}"


def _margin(detail: Detail) -> float:
    """Margin of the state whose equilibrium is nearest to a fold."""
    return min((state.margin for state in detail.states), key=abs)


def _equilibria(states: Sequence[ContactState]) -> str:
    return " or ".join(state.equilibrium_name for state in states if not state.slow)


def relative_residual(step: Step) -> float:
    """Norm of the residual of a step, each entry over the size of its own terms.

    Where it is rounding relative to the motion, which is one of the terms, that ratio is returned, an upper bound.
    """
    value, size = step.evaluation, norm(step.x)
    if step.residual_norm <= _ROUNDING * size:
        return step.residual_norm / size if size else 0.0
    return relative(value.residual, value.terms())


class StateContinuation(Iterator[Step]):
    """A continuation that hands the contact states of each point to the next one.

    The balance has a solution near the states of the last point only while their equilibrium exists. Where that ends,
    the states relax, and a new continuation follows the branch from there. Arguments and attributes are those of
    ``continuation``, and these:

    Attributes
    ----------
    jumps
        Texts of all jumps so far, appended to the given list.
    residual
        Relative residual of the last step; nan of an interpolated one that is evaluated with others later.
    earlier
        Work of the continuations before the present one; given with ``restart`` to resume.

    ``each``: whether to evaluate every interpolated point here; by default they are evaluated together later.
    """

    def __init__(
        self,
        system: FrequencySystem | ParameterSystem,
        x: Array,
        start: float,
        stop: float,
        *,
        jumps: list[str] | None = None,
        earlier: Work = NO_WORK,
        restart: Sequence[RestartPoint] = (),
        each: bool = False,
        **options: Any,
    ) -> None:
        self._balance: Balance = system.balance
        self._system, self._ends, self._options = system, (start, stop), options
        self._of_frequency = isinstance(system, FrequencySystem)
        self._unit = f" {self._balance.problem.units.angular}" if self._of_frequency else ""
        self._together = not each and evaluated_together(self._balance)
        self.jumps: list[str] = [] if jumps is None else jumps
        self.outcome: Outcome | None = None
        self.message, self.residual, self.earlier = "", 0.0, earlier
        self._run: Continuation = continuation(system, x, start, stop, restart=restart, **options)
        self._steps = self._follow()
        self._error: Exception | None = None

    def __next__(self) -> Step:
        try:
            return next(self._steps)
        except StopIteration:
            raise
        except Exception as error:  # errors of this class; a continuation handles its own
            if not self._run.points:
                raise
            self._error = error
            self.outcome, self.message = failed(error)
            raise StopIteration from None

    @property
    def error(self) -> Exception | None:
        """The exception that ended it after points were found."""
        return self._error or self._run.error

    @property
    def step_length(self) -> float:
        """Scaled length of the next step."""
        return self._run.step_length

    @property
    def restart_point(self) -> RestartPoint | None:
        """Restart point of the present continuation."""
        return self._run.restart_point

    @property
    def resumed_at(self) -> Step | None:
        """The step from which a continuation with ``restart`` resumes."""
        return self._run.resumed_at

    @property
    def work(self) -> Work:
        """Work of all continuations so far."""
        run = self._run
        return self.earlier.plus(Work(1, run.evaluations, run.solves, run.rejected))

    def _follow(self) -> Iterator[Step]:
        jumped = False
        while True:
            run, over = self._run, False
            last = run.resumed_at
            outcome, message, waiting = run.outcome, run.message, list[Step]()
            for step in run:
                if step.kind == "interpolated":  # it waits for the solution after it
                    waiting.append(step)
                    continue
                self.residual = relative_residual(step)
                if self.residual > UNSOLVED and step.inserted and step.kind != "requested":
                    continue  # rounding of a very small motion: the branch goes on
                if self.residual > UNSOLVED:
                    outcome = Outcome.STEP_TOO_SMALL
                    message = f"{outcome.text} (at {step.parameter:g}{self._unit}: rounding leaves {self.residual:.0e})"
                    break
                if self._out_of_range(step.evaluation.detail, f"at {step.parameter:g}{self._unit}: "):
                    return
                if jumped:
                    step.kind, jumped = "regular", False
                residual = self.residual
                yield from self._evaluated(waiting)
                self.residual, waiting = residual, []
                yield step
                over = step.kind in FOLDS and last is not None and self._jump(step, last, turned=True)
                if over:
                    break
                last = step
            else:
                outcome, message = run.outcome, run.message
            if self.outcome is Outcome.OUTSIDE_TABLE:
                return
            if not over:
                self.outcome, self.message = outcome, message
                stuck = outcome in (Outcome.STEP_TOO_SMALL, Outcome.SINGULAR)
                if last is None or not stuck or not self._jump(last, last):
                    return
            jumped = True

    def _evaluated(self, waiting: Sequence[Step]) -> Iterator[Step]:
        """Interpolated points, evaluated one by one where they cannot be evaluated together."""
        for step in waiting:
            self.residual = nan
            if not self._together:
                assert step.place is not None
                step.evaluation = self._system.evaluate(step.x, step.parameter, context_between(*step.place[:2]))
                if step.evaluation.detail is None:
                    continue
                step.residual_norm = norm(step.evaluation.residual)
                self.residual = relative_residual(step)
            yield step

    def _jump(self, fold: Step, before: Step, *, turned: bool = False) -> bool:
        """Begin a continuation beyond the end of the equilibrium of a state; False if it does not end at ``fold``.

        ``before`` gives the direction of travel. A turning point is due to the states if the motion at their held
        values continues beyond it.
        """
        here: Detail = fold.evaluation.detail
        z = here.carried
        if z is None or all(carried.state.slow for carried in here.states) or self.earlier.runs >= _MOST_JUMPS:
            return False
        if not (turned or abs(_margin(here)) < _FOLD_MARGIN):
            return False
        low, high = min(self._ends), max(self._ends)
        forward = 1.0 if before.tangent_parameter >= 0 else -1.0
        for share in _DISTANCES_BEYOND:
            p = min(max(fold.parameter + forward * share * (high - low), low), high)
            rest = relaxed(self._balance, *self._system.at(p), fold.x, z, reach=_SAME_MOTION if turned else np.inf)
            if rest is None:
                continue
            x, there = rest
            jump = Jump(
                parameter=fold.parameter, before=here, after=there, turned=turned, units=self._balance.problem.units,
                of_frequency=self._of_frequency,
            )  # fmt: skip
            if self._out_of_range(there, f"the {_equilibria(self._balance.states)} ends at {jump.text}, and "):
                return False
            if jump.far if turned else jump.beyond_fold:
                if jump.far:
                    self.jumps.append(jump.text)
                direction = np.append(np.zeros(x.size), forward)
                options = self._options | {"at": p, "direction": direction, "context": there.carried}
                self.earlier = self.work
                self._run = continuation(self._system, x, *self._ends, **options)
                return True
        return False

    def _out_of_range(self, detail: Detail, where: str) -> bool:
        """Whether a contact state has left its valid range, which ends the branch."""
        for carried in detail.states:
            if fault := carried.fault(self._balance.problem.units):
                self.outcome, self.message = Outcome.OUTSIDE_TABLE, f"{carried.state.left} ({where}{fault})"
                return True
        return False


def jumps_text(jumps: Sequence[str], states: Sequence[ContactState]) -> str:
    """Addition to the message of the outcome; empty without jumps."""
    if not jumps:
        return ""
    where = ", at ".join(jumps[:5])
    more = f" and at {len(jumps) - 5} further places" if len(jumps) > 5 else ""
    return (
        f"; the {_equilibria(states)} ended and the contacts took another one at {where}{more}: "
        "several exist nearby, and the way back may differ"
    )
