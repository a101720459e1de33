"""Contact states along a branch: carried from point to point, and over the folds where their equilibrium ends.

Beyond a fold they are let go and settle, the structure answering at once: ``dz/dt = r(z, P)``. Vibration settles within
periods, a body within seconds: on the way the motion is the steady one at each value.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np

from slipstick.analysis.curve.observables import context_between
from slipstick.analysis.road.work import NO_WORK, Work
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

_SMALL = 1e-8
"""Of the states' range: a rate at which they are at rest, and the error of the values on the way."""
_LONGEST_TIME = 1e5
"""In time constants of a state without friction."""
_NEWTON = NewtonOptions(max_iterations=40)


class MotionLostError(Exception):
    """No steady motion was found at some values of the states."""


def relaxed(
    balance: Balance, inputs: Inputs, omega: float, x: Array, z: Array, *, reach: float = np.inf
) -> tuple[Array, Detail] | None:
    """Motion (N,) and evaluation where fast contact states come to rest from values z (n_states,) at the motion x (N,).

    Beyond their limits the parameters are held. None where the motion is lost on the way, or no rest is found, or the
    motion at z is further from x than ``reach`` times its size.
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
        return float(np.max(np.abs(rate(t, z)) / span)) - _SMALL

    moving.terminal, moving.direction = True, -1  # type: ignore[attr-defined]
    low = float(span.min())
    try:
        rates(z)
        if np.linalg.norm(rates.x - x) > reach * np.linalg.norm(x):
            return None
        way = solve_ivp(
            rate, (0.0, _LONGEST_TIME), z, method="LSODA", events=moving, rtol=_SMALL, atol=_SMALL * low, max_step=1e3
        )
    except MotionLostError:
        return None
    if way.status != 1:
        return None
    result = _solve(balance, inputs, omega, rates.x, way.y[:, -1])
    return (result.x, result.evaluation.detail) if result.converged else None


class SlowRates:
    """Rates (n_states,) of contact states held at values (n_states,), at the steady motion there.

    ``x`` is the last motion, from which the next is sought, ``detail`` its evaluation.

    Raises
    ------
    MotionLostError
        Where there is no steady motion near it.
    """

    def __init__(self, balance: Balance, inputs: Inputs, omega: float, x: Array) -> None:
        self._balance, self._inputs, self._omega, self.x = balance.holding(), inputs, omega, x
        self.detail: Detail | None = None

    def __call__(self, z: Array) -> Array:
        """At values (n_states,)."""
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
"""A point whose relative residual rounding keeps above this is no solution: the branch ends before it."""

FOLDS = ("turning point", NEAR_FOLD)
_ROUNDING = 1e-11
_FOLD = 0.5
_BEYOND = (1e-5, 1e-4, 1e-3)
_FAR = 1e-3
_NEAR = 0.02
_MOST_JUMPS = 50


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A place where the equilibrium of a fast contact state ended and the contacts went on to the next one."""

    parameter: float
    before: Detail
    after: Detail
    turned: bool
    """Whether the branch turned back there."""

    @property
    def beyond_fold(self) -> bool:
        """Whether this is another equilibrium, not the one that was about to end."""
        return abs(_margin(self.after)) > 2.0 * abs(_margin(self.before))

    @property
    def far(self) -> bool:
        """Whether the values changed."""
        # an equilibrium that becomes unstable at held motion only goes on beside itself
        least = 20.0 * _FAR if _margin(self.after) < 0 and not self.turned else _FAR
        pairs = zip(self.before.states, self.after.states, strict=True)
        return any(bool(np.any(np.abs(new.values - old.values) > least * new.state.span)) for old, new in pairs)

    @property
    def text(self) -> str:
        """Where, and between which values; the contacts whose value changes most."""
        pairs = zip(self.before.states, self.after.states, strict=True)
        changes = [_change(old, new) for old, new in pairs if not new.state.slow]
        return f"{self.parameter:.6g} ({'; '.join(changes)})"


def _change(old: Carried, new: Carried) -> str:
    before, after, names = old.values, new.values, new.state.names
    order = np.argsort(-np.abs(after - before), kind="stable")
    changes = [f"{names[i]} from {before[i]:.5g} to {after[i]:.5g}" for i in order[:3]]
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f"{new.state.variable.name} of {', '.join(changes)}{more}"


def _margin(detail: Detail) -> float:
    """Of the state whose equilibrium is nearest to a fold."""
    return min((state.margin for state in detail.states), key=abs)


def _equilibria(states: Sequence[ContactState]) -> str:
    return " or ".join(state.equilibrium_name for state in states if not state.slow)


def relative_residual(step: Step) -> float:
    """Norm of the residual of a step, each entry over the size of its own terms.

    Where it is rounding beside the motion alone, which is one of the terms, that ratio is given: it is an upper bound.
    """
    value, size = step.evaluation, norm(step.x)
    if step.residual_norm <= _ROUNDING * size:
        return step.residual_norm / size if size else 0.0
    return relative(value.residual, value.terms())


class StateContinuation(Iterator[Step]):
    """A continuation that hands the contact states of each point on to the next; a plain one without.

    Near the states of the last point the balance has a solution only as long as their equilibrium exists. Where it
    ends, they are let go and the branch is followed from where they settle. Arguments and attributes are those of
    ``continuation``; besides:

    Attributes
    ----------
    jumps
        The text of every ``Jump`` so far, added to those of the list given.
    residual
        Relative residual of the last step; nan of an interpolated one that is evaluated with others later.
    earlier
        Work of the runs before the present one; given, together with ``restart``, to go on where another stood.

    ``each`` asks for an evaluation of every interpolated point; without, those that can are evaluated together later.
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
        except Exception as error:  # of what is done here besides: a run keeps its own
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
        """Where the present run stands."""
        return self._run.restart_point

    @property
    def resumed_at(self) -> Step | None:
        """The step it goes on from where it was given ``restart``."""
        return self._run.resumed_at

    @property
    def work(self) -> Work:
        """Work of all runs so far."""
        run = self._run
        return self.earlier.plus(Work(1, run.evaluations, run.solves, run.rejected))

    def _follow(self) -> Iterator[Step]:
        landed = False
        while True:
            run, over = self._run, False
            last = run.resumed_at
            outcome, message, waiting = run.outcome, run.message, list[Step]()
            for step in run:
                if step.kind == "interpolated":  # it counts once the point it leads to does
                    waiting.append(step)
                    continue
                self.residual = relative_residual(step)
                if self.residual > UNSOLVED and step.inserted and step.kind != "requested":
                    continue  # where next to nothing moves rounding is all there is, but the branch goes on
                if self.residual > UNSOLVED:
                    outcome = Outcome.STEP_TOO_SMALL
                    message = f"{outcome.text} (at {step.parameter:g}: rounding leaves {self.residual:.0e})"
                    break
                if self._ended(step.evaluation.detail, f"at {step.parameter:g}: "):
                    return
                if landed:
                    step.kind, landed = "regular", False
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
            landed = True

    def _evaluated(self, waiting: Sequence[Step]) -> Iterator[Step]:
        """Interpolated points, each evaluated where all together cannot be."""
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
        """Begin a run beyond a place where the equilibrium of a state ends; False if it does not end there.

        ``before`` shows the direction of travel. At a turning point it is the state that turns the branch where the
        motion at the values as they are goes on.
        """
        here: Detail = fold.evaluation.detail
        z = here.carried
        if z is None or all(carried.state.slow for carried in here.states) or self.earlier.runs >= _MOST_JUMPS:
            return False
        if not (turned or abs(_margin(here)) < _FOLD):
            return False
        low, high = min(self._ends), max(self._ends)
        forward = 1.0 if before.tangent_parameter >= 0 else -1.0
        for share in _BEYOND:
            p = min(max(fold.parameter + forward * share * (high - low), low), high)
            rest = relaxed(self._balance, *self._system.at(p), fold.x, z, reach=_NEAR if turned else np.inf)
            if rest is None:
                continue
            x, there = rest
            jump = Jump(parameter=fold.parameter, before=here, after=there, turned=turned)
            if self._ended(there, f"the {_equilibria(self._balance.states)} ends at {jump.text}, and "):
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

    def _ended(self, detail: Detail, where: str) -> bool:
        """Whether a contact state is no result, which ends the branch."""
        for carried in detail.states:
            if fault := carried.fault():
                self.outcome, self.message = Outcome.OUTSIDE_TABLE, f"{carried.state.left} ({where}{fault})"
                return True
        return False


def jumps_text(jumps: Sequence[str], states: Sequence[ContactState]) -> str:
    """What to add to the message of the outcome, or nothing."""
    if not jumps:
        return ""
    where = ", at ".join(jumps[:5])
    more = f" and at {len(jumps) - 5} further places" if len(jumps) > 5 else ""
    return (
        f"; the {_equilibria(states)} ended and the contacts took another one at {where}{more}: "
        "several exist nearby, and the way back may differ"
    )
