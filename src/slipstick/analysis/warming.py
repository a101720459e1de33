"""Contact temperatures along a branch: carried from point to point, and over the folds where their equilibrium ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.settling import settled_body
from slipstick.balance.residual import Balance, FrequencySystem, ParameterSystem
from slipstick.errors import Outcome
from slipstick.solve.continuation import Continuation, Step, continuation

Array = NDArray[np.float64]

_FOLD = 0.5
_BEYOND = (1e-5, 1e-4, 1e-3)
_FAR = 1e-3
_MOST_JUMPS = 50


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A place where the thermal equilibrium ended and the contacts went on to the next one."""

    parameter: float
    before: Array
    """Temperatures (n_contacts,), as are those after."""
    after: Array

    def far(self, balance: Balance) -> bool:
        """Whether the temperatures changed; they do not where an equilibrium is only unstable at fixed motion."""
        assert balance.heated is not None
        low, high = balance.heated.limits
        return bool(np.any(np.abs(self.after - self.before) > _FAR * (high - low)))

    def text(self, names: list[str]) -> str:
        """Where, and between which temperatures; the contacts whose temperature changes most."""
        order = np.argsort(-np.abs(self.after - self.before), kind="stable")
        changes = [f"{names[i]} from {self.before[i]:.5g} to {self.after[i]:.5g}" for i in order[:3]]
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        return f"{self.parameter:.6g} (temperature of {', '.join(changes)}{more})"


class WarmContinuation(Iterator[Step]):
    """A continuation that hands the temperatures of each point on to the next; a plain one without heat.

    Near the temperatures of the last point the balance has a solution only as long as their equilibrium exists. Where
    it ends, the body is let go and the branch is followed from where it settles. Arguments and attributes are those of
    ``continuation``; besides:

    Attributes
    ----------
    jumps
        Every ``Jump`` so far.
    """

    def __init__(
        self,
        system: FrequencySystem | ParameterSystem,
        x: Array,
        start: float,
        stop: float,
        **options: Any,
    ) -> None:
        self._system, self._ends, self._options = system, (start, stop), options
        self._balance: Balance = system.balance
        self._names = [pair.name for pair in self._balance.problem.contacts]
        self.jumps: list[Jump] = []
        self.outcome: Outcome | None = None
        self.message = ""
        self._runs: list[Continuation] = [continuation(system, x, start, stop, **options)]
        self._steps = self._follow()

    def __next__(self) -> Step:
        return next(self._steps)

    @property
    def step_length(self) -> float:
        """Scaled length of the next step."""
        return self._runs[-1].step_length

    @property
    def evaluations(self) -> int:
        """Evaluations of the system so far."""
        return sum(run.evaluations for run in self._runs)

    @property
    def solves(self) -> int:
        """Linear solves so far."""
        return sum(run.solves for run in self._runs)

    @property
    def rejected(self) -> int:
        """Steps rejected so far."""
        return sum(run.rejected for run in self._runs)

    def _follow(self) -> Iterator[Step]:
        last: Step | None = None
        while True:
            run, landed = self._runs[-1], len(self._runs) > 1
            for step in run:
                fault = self._carry(step)
                if fault:
                    self._end(Outcome.OUTSIDE_TABLE, f"{Outcome.OUTSIDE_TABLE.text} (at {step.parameter:g}: {fault})")
                    return
                if landed:
                    step.kind, landed = "regular", False
                last = step
                yield step
            self.outcome, self.message = run.outcome, run.message + self._remark()
            if last is None or run.outcome not in (Outcome.STEP_TOO_SMALL, Outcome.SINGULAR) or not self._jump(last):
                return

    def _carry(self, step: Step) -> str | None:
        """Take the temperatures of a step; a sentence where they are no result."""
        heat = step.evaluation.detail.heat
        if heat is None:
            return None
        fault: str | None = heat.equilibrium.problem(self._names)
        if fault is None:
            self._balance.temperature = heat.temperature
        return fault

    def _jump(self, last: Step) -> bool:
        """Go on beyond the fold of the thermal equilibrium that ended the last run; False if there is none."""
        heat = last.evaluation.detail.heat
        if heat is None or abs(heat.equilibrium.margin) > _FOLD or len(self._runs) > _MOST_JUMPS:
            return False
        start, stop = self._ends
        forward = 1.0 if last.tangent_parameter >= 0 else -1.0
        for share in _BEYOND:
            p = min(max(last.parameter + forward * share * abs(stop - start), min(start, stop)), max(start, stop))
            found = settled_body(self._balance, *self._system.at(p), last.x, heat.temperature)
            if found is None:
                continue
            x, there = found
            if fault := there.equilibrium.problem(self._names):
                jump = Jump(parameter=last.parameter, before=heat.temperature, after=there.temperature)
                said = f"the thermal equilibrium ends at {jump.text(self._names)}, and {fault}"
                self._end(Outcome.OUTSIDE_TABLE, f"{Outcome.OUTSIDE_TABLE.text} ({said})")
                return False
            if abs(there.equilibrium.margin) > 2.0 * abs(heat.equilibrium.margin):
                jump = Jump(parameter=last.parameter, before=heat.temperature, after=there.temperature)
                if jump.far(self._balance):
                    self.jumps.append(jump)
                self._balance.temperature = there.temperature
                direction = np.append(np.zeros(x.size), forward)
                self._runs.append(
                    continuation(self._system, x, start, stop, at=p, direction=direction, **self._options)
                )
                return True
        return False

    def _end(self, outcome: Outcome, message: str) -> None:
        self.outcome, self.message = outcome, message + self._remark()

    def _remark(self) -> str:
        """What to add to the message of the outcome, or nothing."""
        if not self.jumps:
            return ""
        where = ", at ".join(jump.text(self._names) for jump in self.jumps[:5])
        more = f" and at {len(self.jumps) - 5} further places" if len(self.jumps) > 5 else ""
        return (
            f"; the thermal equilibrium ended and the contacts took another one at {where}{more}: "
            "several exist nearby, and the way back may differ"
        )
