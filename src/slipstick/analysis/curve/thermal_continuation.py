"""Contact temperatures along a branch: carried from point to point, and over the folds where their equilibrium ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any, NamedTuple

import numpy as np

from slipstick.analysis.curve.observables import context_between
from slipstick.analysis.curve.thermal_relaxation import settled_body
from slipstick.balance.many import evaluated_together
from slipstick.balance.ports import Balance
from slipstick.balance.systems import FrequencySystem, ParameterSystem
from slipstick.errors import Outcome
from slipstick.results.schema import NEAR_FOLD
from slipstick.solve.continuation import Continuation, RestartPoint, Step, continuation
from slipstick.solve.continuation.follow import failed
from slipstick.solve.norm import norm, relative
from slipstick.thermal.model import Heat
from slipstick.typing import Array

UNSOLVED = 1e-8
"""A point whose relative residual rounding keeps above this is no solution: the branch ends before it."""

FOLDS = ("turning point", NEAR_FOLD)
_ROUNDING = 1e-11
_FOLD = 0.5
_BEYOND = (1e-5, 1e-4, 1e-3)
_FAR = 1e-3
_NEAR = 0.02
_MOST_JUMPS = 50


class Work(NamedTuple):
    """What was done so far."""

    runs: int = 0
    evaluations: int = 0
    solves: int = 0
    rejected: int = 0

    def plus(self, other: Work) -> Work:
        """Both together."""
        return Work(*(a + b for a, b in zip(self, other, strict=True)))


NO_WORK = Work()


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A place where the thermal equilibrium ended and the contacts went on to the next one."""

    parameter: float
    before: Heat
    after: Heat
    turned: bool
    """Whether the branch turned back there."""

    @property
    def beyond_fold(self) -> bool:
        """Whether this is another equilibrium, not the one that was about to end."""
        return abs(self.after.equilibrium.margin) > 2.0 * abs(self.before.equilibrium.margin)

    def far(self, balance: Balance) -> bool:
        """Whether the temperatures changed."""
        assert balance.heated is not None
        low, high = balance.heated.limits
        # an equilibrium that becomes unstable at held motion only goes on beside itself
        least = 20.0 * _FAR if self.after.equilibrium.margin < 0 and not self.turned else _FAR
        return bool(np.any(np.abs(self.after.temperature - self.before.temperature) > least * (high - low)))

    def text(self, names: Sequence[str]) -> str:
        """Where, and between which temperatures; the contacts whose temperature changes most."""
        before, after = self.before.temperature, self.after.temperature
        order = np.argsort(-np.abs(after - before), kind="stable")
        changes = [f"{names[i]} from {before[i]:.5g} to {after[i]:.5g}" for i in order[:3]]
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        return f"{self.parameter:.6g} (temperature of {', '.join(changes)}{more})"


def relative_residual(step: Step) -> float:
    """Norm of the residual of a step, each entry over the size of its own terms.

    Where it is rounding beside the motion alone, which is one of the terms, that ratio is given: it is an upper bound.
    """
    value, size = step.evaluation, norm(step.x)
    if step.residual_norm <= _ROUNDING * size:
        return step.residual_norm / size if size else 0.0
    return relative(value.residual, value.terms())


class ThermalContinuation(Iterator[Step]):
    """A continuation that hands the temperatures of each point on to the next; a plain one without heat.

    Near the temperatures of the last point the balance has a solution only as long as their equilibrium exists. Where
    it ends, the body is let go and the branch is followed from where it settles. Arguments and attributes are those of
    ``continuation``; besides:

    Attributes
    ----------
    jumps
        The text of every ``Jump`` so far, added to those of the list given.
    residual
        Relative residual of the last step; nan of an interpolated one that is evaluated with others later.
    earlier
        Work of the runs before the present one; given, together with ``places``, to go on where another stood.

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
        places: Sequence[RestartPoint] = (),
        each: bool = False,
        **options: Any,
    ) -> None:
        self._balance: Balance = system.balance
        self._system, self._ends, self._options = system, (start, stop), options
        self._names, self._together = self._balance.heated_names, not each and evaluated_together(self._balance)
        self.jumps: list[str] = [] if jumps is None else jumps
        self.outcome: Outcome | None = None
        self.message, self.residual, self.earlier = "", 0.0, earlier
        self._run: Continuation = continuation(system, x, start, stop, places=places, **options)
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
    def place(self) -> RestartPoint | None:
        """Where the present run stands."""
        return self._run.place

    @property
    def standing(self) -> Step | None:
        """The step it goes on from where it was given ``places``."""
        return self._run.standing

    @property
    def work(self) -> Work:
        """Work of all runs so far."""
        run = self._run
        return self.earlier.plus(Work(1, run.evaluations, run.solves, run.rejected))

    def _follow(self) -> Iterator[Step]:
        landed = False
        while True:
            run, over = self._run, False
            last = run.standing
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
                if fault := self._fault(step):
                    self._end(Outcome.OUTSIDE_TABLE, f"at {step.parameter:g}: {fault}")
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

    def _fault(self, step: Step) -> str | None:
        """A sentence where the temperatures of a step are no result."""
        heat = step.evaluation.detail.heat
        fault: str | None = None if heat is None else heat.equilibrium.problem(self._names)
        return fault

    def _jump(self, fold: Step, before: Step, *, turned: bool = False) -> bool:
        """Begin a run beyond a place where the thermal equilibrium ends; False if it does not end there.

        ``before`` shows the direction of travel. At a turning point it is the heat that turns the branch where the
        motion at the temperatures as they are goes on.
        """
        heat = fold.evaluation.detail.heat
        if heat is None or self.earlier.runs >= _MOST_JUMPS or not (turned or abs(heat.equilibrium.margin) < _FOLD):
            return False
        low, high = min(self._ends), max(self._ends)
        forward = 1.0 if before.tangent_parameter >= 0 else -1.0
        for share in _BEYOND:
            p = min(max(fold.parameter + forward * share * (high - low), low), high)
            found = settled_body(
                self._balance, *self._system.at(p), fold.x, heat.temperature, reach=_NEAR if turned else np.inf
            )
            if found is None:
                continue
            x, there = found
            jump = Jump(parameter=fold.parameter, before=heat, after=there, turned=turned)
            if fault := there.equilibrium.problem(self._names):
                said = f"the thermal equilibrium ends at {jump.text(self._names)}, and {fault}"
                self._end(Outcome.OUTSIDE_TABLE, said)
                return False
            if jump.far(self._balance) if turned else jump.beyond_fold:
                if jump.far(self._balance):
                    self.jumps.append(jump.text(self._names))
                direction = np.append(np.zeros(x.size), forward)
                options = self._options | {"at": p, "direction": direction, "context": there.temperature}
                self.earlier = self.work
                self._run = continuation(self._system, x, *self._ends, **options)
                return True
        return False

    def _end(self, outcome: Outcome, message: str) -> None:
        self.outcome, self.message = outcome, f"{outcome.text} ({message})"


def jumps_text(jumps: Sequence[str]) -> str:
    """What to add to the message of the outcome, or nothing."""
    if not jumps:
        return ""
    where = ", at ".join(jumps[:5])
    more = f" and at {len(jumps) - 5} further places" if len(jumps) > 5 else ""
    return (
        f"; the thermal equilibrium ended and the contacts took another one at {where}{more}: "
        "several exist nearby, and the way back may differ"
    )
