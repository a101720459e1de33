"""Self-excited vibration as a branch: limit cycles from the first Hopf point, and steady sliding over the range."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from slipstick.analysis.cycle_start import CycleStart
from slipstick.analysis.cycle_system import CycleSpecialPoints, CycleWatch
from slipstick.analysis.sliding import Sliding, SteadySliding, damped_as_vibrating
from slipstick.analysis.slope import StateSpace
from slipstick.analysis.warming import NO_WORK, Work
from slipstick.balance.parameters import parameter_path
from slipstick.balance.ports import Balance
from slipstick.balance.preflight import parameter_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.residual import terms
from slipstick.errors import InputError, Outcome
from slipstick.faults import warn
from slipstick.results.afterwards import result_warnings
from slipstick.results.branch import Branch
from slipstick.results.record import Outputs, Point, Recorder
from slipstick.results.schema import SELF_EXCITED, attributes_of, make_table, requested_attribute
from slipstick.results.stability import HOPF, STATE_CHANGE
from slipstick.solve.continuation import ArclengthScaling, BranchEvent, ContinuationOptions, Step, continuation
from slipstick.solve.continuation.path import failed
from slipstick.solve.norm import relative
from slipstick.typing import Array

CYCLE_PART, SLIDING_PART = 1, 2
"""Parts of the branch."""

_SLIDING_POINTS = 61
_SAME = 1e-9
"""Values of the parameter that are one, of the range."""
_TOLD = 1e-6
"""Of the range, that two Hopf points are apart: each is reported."""
_GONE = 1e-3
"""Of the first cycle's motion: what has less vibrates no more."""
_NONE = "no limit cycle beside the Hopf point is in the range"
_HYSTERETIC = (
    "hysteretic damping has no meaning for disturbances that grow: steady sliding and multipliers have viscous "
    "damping, equal to it at {}; the limit cycles have hysteretic damping"
)


@dataclass(frozen=True, kw_only=True)
class SelfExcited:
    """Self-excited vibration to be followed over a parameter."""

    problem: Problem
    balance: Balance
    parameter: str
    span: tuple[float, float]
    requested: tuple[float, ...]
    options: ContinuationOptions

    @cached_property
    def space(self) -> StateSpace:
        """The states over the parameter."""
        path = parameter_path(self.problem, self.parameter)
        return StateSpace(Outputs(self.balance, ()), self.problem.inputs, path)

    def branch(self) -> Branch:
        """Limit cycles, then steady sliding."""
        clock, sliding = time.perf_counter(), SteadySliding(self.balance, self.parameter)
        if not sliding.in_time:
            raise InputError("limit cycles need equations in time: give the structure as matrices or modes")
        if self._hysteretic:
            sliding = damped_as_vibrating(self.balance, self.parameter, self._values)
        warnings = self._warned(sliding.damping_at)
        known, hopf = self._slid(sliding)
        cycles = Cycles(self, hopf[0], sliding.damping_at) if hopf else None
        if cycles is not None:
            cycles.follow()
        points = [*(cycles.found if cycles else ()), *(self._sliding_point(s, known, hopf) for s in known)]
        outcome, message = self._ended(known, hopf, cycles)
        return self._recorded(
            points, outcome, message, warnings, cycles.work if cycles else NO_WORK, time.perf_counter() - clock
        )

    def point(self, x: Array, omega: float, value: float, **names: Any) -> Point:
        """A motion (N,) that was not corrected, with what is left of the balance."""
        here = self.space.at(x, omega, value)
        residual = relative(here.at.residual, terms(self.balance, x, here.at))
        return Point.at(here.found, x=x, residual=residual, iterations=0, parameter=value, peak_of="", **names)

    @property
    def _hysteretic(self) -> bool:
        """Whether there is hysteretic damping anywhere in the range."""
        ends = (self.problem.at_parameter(self.parameter, end).structure for end in self.span)
        return any(np.any(np.asarray(getattr(structure, "loss_factor", 0.0))) for structure in ends)

    @property
    def _values(self) -> list[float]:
        """Of the parameter, at which steady sliding is looked at; in their order."""
        values = {*np.linspace(*self.span, _SLIDING_POINTS).tolist(), *self.requested}
        return sorted(values, reverse=self.span[1] < self.span[0])

    def _warned(self, damping_at: float | None) -> Sequence[str]:
        """The warnings; of hysteretic damping that it is viscous, equal at a frequency."""
        static = self.balance.receptance.static
        warnings = [*parameter_warnings(self.problem, self.parameter, self.span, 1.0, static, steady=True)]
        if damping_at is not None:
            warnings.append(_HYSTERETIC.format(self.problem.units.frequency_text(damping_at)))
        self.problem.warn(warnings)
        return warnings

    def _slid(self, sliding: SteadySliding) -> tuple[list[Sliding], list[Sliding]]:
        """Steady sliding over the range, and its Hopf points, which are among it."""
        known = list(sliding.over(self._values))
        hopf = sliding.hopf_points(known)
        near = _SAME * abs(self.span[1] - self.span[0])
        apart = [s for s in known if all(abs(s.value - point.value) > near for point in hopf)]
        return sorted([*apart, *hopf], key=lambda s: s.value, reverse=self.span[1] < self.span[0]), hopf

    def _sliding_point(self, own: Sliding, known: Sequence[Sliding], hopf: Sequence[Sliding]) -> Point:
        kind = "start" if own is known[0] else "end" if own is known[-1] else "regular"
        kind = HOPF if own in hopf else "requested" if own.value in self.requested else kind
        x = at_rest(self.balance, own)
        return self.point(x, own.omega, own.value, kind=kind, part=SLIDING_PART, stability=own.stability)

    def _ended(self, known: Sequence[Sliding], hopf: Sequence[Sliding], cycles: Cycles | None) -> tuple[Outcome, str]:
        if not known:
            return Outcome.NO_FIRST_POINT, "no steady sliding was found"
        if cycles is not None:
            others = ", ".join(f"{s.value:.6g}" for s in hopf[1:])
            more = f"; further Hopf points, not followed from: {others}" if others else ""
            at = f"{cycles.beginning:.6g} ({self.parameter})"
            if abs(cycles.beginning - hopf[0].value) > _TOLD * abs(self.span[1] - self.span[0]):
                at += f", by eigenvalues at {hopf[0].value:.6g}: equations in time leave out part of the compliance"
            return cycles.outcome, f"{cycles.message}; Hopf point at {at}{more}"
        where = f"over the whole range of {self.parameter}"
        if any(s.growing for s in known):
            return Outcome.NO_FIRST_POINT, (
                f"steady sliding is unstable and there is no Hopf point {where}: begin where it is stable, such as at "
                "a smaller friction coefficient"
            )
        return Outcome.COMPLETED, f"steady sliding is stable {where}: no vibration begins by itself"

    def _recorded(
        self, points: Sequence[Point], outcome: Outcome, message: str, warnings: Sequence[str], work: Work,
        seconds: float,
    ) -> Branch:  # fmt: skip
        recorder, problem = Recorder(self.balance, parameter=self.parameter, stability=True), self.problem
        values = recorder.values(points)
        if points:
            wrong = partial(
                result_warnings, self.parameter, values, problem.elements, problem.units.angular,
                requested=self.requested,
            )  # fmt: skip
            said = recorder.besides.said(wrong)
            warn(said)
            warnings = [*warnings, *said]
        attributes = attributes_of(
            problem, outcome, message, warnings, parameter=self.parameter, vibration=SELF_EXCITED,
            evaluations=work.evaluations, linear_solves=work.solves, rejected_steps=work.rejected,
            jacobian=self.balance.kind.name, seconds=seconds, **requested_attribute(self.requested),
        )  # fmt: skip
        return Branch(make_table(recorder.layout, values, attributes), outcome, problem, message)


class Cycles:
    """The limit cycles from a Hopf point; state lives here because points come one by one.

    Attributes
    ----------
    found
        Points so far.
    beginning
        Value of the parameter at which they begin.
    outcome, message
        How it ended.
    """

    def __init__(self, request: SelfExcited, hopf: Sliding, damping_at: float | None) -> None:
        self._request, self._hopf = request, hopf
        self._watch = CycleWatch(request.balance, damping_at=damping_at)
        self.found: list[Point] = []
        self.beginning = hopf.value
        self.work = NO_WORK
        self.outcome, self.message = Outcome.NO_FIRST_POINT, _NONE

    def follow(self) -> None:
        """Find all points; a KeyboardInterrupt ends it early."""
        try:
            self.found.extend(self._points())
        except KeyboardInterrupt:
            self.outcome, self.message = Outcome.INTERRUPTED, Outcome.INTERRUPTED.text
        except Exception as error:
            if not self.found:
                raise
            self.outcome, self.message = failed(error)

    def _points(self) -> Iterator[Point]:
        request, hopf = self._request, self._hopf
        request.balance.anchor_if_undamped(hopf.omega)
        start = CycleStart(request.space, hopf, at_rest(request.balance, hopf), request.span)
        if not start.found:
            self.message = "the balance has no vibration near the Hopf point of the eigenvalues"
            return
        self.beginning = start.value
        yield self._rising(start, 0.0, "start")
        if start.largest is None:
            self.message = "vibration grows at the Hopf point without bound: no contact changes its state"
            return
        if not start.smooth:
            yield self._rising(start, start.largest, STATE_CHANGE)
        first = start.first()
        if first is not None:
            yield from self._beyond(start, first)

    def _rising(self, start: CycleStart, size: float, kind: str) -> Point:
        """Of the straight rise at the Hopf point."""
        x, stability = start.vibrating(size), self._hopf.stability
        return self._request.point(x, start.omega, start.value, kind=kind, part=CYCLE_PART, stability=stability)

    def _beyond(self, start: CycleStart, first: Step) -> Iterator[Point]:
        """Where contacts change their states, along the branch."""
        request, system = self._request, start.system
        special = CycleSpecialPoints(self._watch, system)
        least = _GONE * start.size(first.x[:-1])
        gone = BranchEvent(
            name="the vibration dies away in steady sliding", kind="end", terminal=True, direction=-1,
            function=lambda step: start.size(step.x[:-1]) - least,
        )  # fmt: skip
        run = continuation(
            system, first.x, *request.span, at=first.parameter, direction=first.tangent, options=request.options,
            scaling=ArclengthScaling(x=start.unit(first.x[:-1]), weight=0.1), requested=request.requested,
            events=(gone, *special.events),
        )  # fmt: skip
        for step in run:
            # steady sliding solves the balance at every frequency: what is located there is no cycle
            if start.size(step.x[:-1]) > 0.5 * least:
                yield self._followed(step, special)
        self.outcome, self.message = run.outcome or Outcome.INTERRUPTED, run.message
        self.work = Work(1, run.evaluations, run.solves, run.rejected)

    def _followed(self, step: Step, special: CycleSpecialPoints) -> Point:
        value = step.evaluation
        kind = step.kind if special.confirmed(step) and step.kind != "start" else "regular"
        return Point.at(
            value.detail, x=step.x[:-1], residual=relative(value.residual, value.terms()), iterations=step.iterations,
            kind=kind, parameter=step.parameter, peak_of="", part=CYCLE_PART,
            stability=special.judged(step, compare=kind not in ("regular", STATE_CHANGE)),
        )  # fmt: skip


def at_rest(balance: Balance, sliding: Sliding) -> Array:
    """Unknowns (N,) of steady sliding."""
    X = np.zeros((balance.n_ports, balance.L))
    X[:, 0] = sliding.x
    return X.reshape(-1)
