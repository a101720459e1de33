"""The continuation of a peak over a parameter, point by point: folds turned, ties and corners passed.

Three things end a smooth curve of peaks. A fold is turned by arclength: beyond it the points are minima. Where
another extreme of the period becomes as large (a tie, ``a_1 = a_2``) the curve of the largest has a kink, and the peak
is gone: the curve rises on to another one, which is climbed to. Where the peak sits on a change of state the slope
jumps through zero (a corner of the curve): it is found by bracketing.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from slipstick.analysis.curve.state_continuation import NO_WORK, Work
from slipstick.analysis.peaks.events import peak_events
from slipstick.analysis.peaks.gradient import FLAT, Extreme
from slipstick.analysis.peaks.system import PeakDetail, PeakSystem
from slipstick.balance.balance import Balance
from slipstick.balance.scaling import scales
from slipstick.balance.systems import FrequencySystem
from slipstick.errors import Outcome
from slipstick.solve.continuation import (
    ArclengthScaling,
    BranchEvent,
    Continuation,
    ContinuationOptions,
    Step,
    continuation,
)
from slipstick.solve.continuation.events import BracketedRoot
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm, relative
from slipstick.typing import Array

TIE, OPTIMUM, CORNER = "tie", "optimum", "corner"
"""Kinds of points: another extreme of the period is as large; the peak is highest or lowest over the parameter; the
peak sits on a change of state."""

NEWTON = NewtonOptions(max_iterations=8, min_damping=1.0, non_monotone=2, patience=2, stagnation=1e-11)
"""Given up early: a shorter step costs less than a long search."""

LEVEL = 1e-9
"""Extremes that are equal by symmetry differ by rounding, and a plateau is not quite level."""
_MOST_RUNS = 200
_ASIDE = 1e-4
_JUMP = 0.02
"""Change of the frequency from one point to the next that is told."""
_LOST = (Outcome.STEP_TOO_SMALL, Outcome.SINGULAR, Outcome.NO_FIRST_POINT)
_CORNER_STEPS = (1e-3, 4e-2)
"""First and largest step from corner to corner, of the range."""


class PeakPoint(NamedTuple):
    """A peak at a value of the parameter."""

    y: Array
    """Unknowns and frequency, (N + 1,)."""
    parameter: float
    detail: PeakDetail
    kind: str
    residual: float
    iterations: int


class PeakContinuation:
    """The continuation of a peak, as an iterator of points.

    Parameters
    ----------
    system
        With the parameter and the output.
    span
        Of the parameter.
    requested
        Values of the parameter at which points are wanted.
    bounds
        Frequencies between which another peak is sought where one is gone.

    Attributes
    ----------
    outcome, message
        How it ended; None and nothing while it has not.
    notes
        What happened on the way, in words.
    """

    def __init__(
        self, system: PeakSystem, span: tuple[float, float], bounds: tuple[float, float],
        options: ContinuationOptions, requested: tuple[float, ...] = (),
    ) -> None:  # fmt: skip
        self.system, self.span, self.bounds, self.options = system, span, bounds, options
        self.balance: Balance = system.balance
        self.requested = requested
        self.outcome: Outcome | None = None
        self.message, self.notes = "", list[str]()
        self.work: Work = NO_WORK
        self.last: PeakPoint | None = None
        self._first = np.zeros(0)
        self._length = _CORNER_STEPS[0]
        self._way, self._reach, self._reason = 1.0 if span[1] > span[0] else -1.0, span[0], ""
        self._context: Array | None = None
        self._unit = self.balance.problem.units.angular
        self._size = scales(self.balance, system.at(span[0])[0], bounds[0]).displacement

    def points(self, y: Array) -> Iterator[PeakPoint]:
        """From the peak ``y`` (N + 1,) at the start of the range."""
        at, runs, self._first = self.span[0], 0, y
        while runs < _MOST_RUNS:
            why, runs = (yield from self._smooth(y, at)), runs + 1
            if not why:
                return
            onward = (self._rivalled() or self._climbed()) if why == TIE else (yield from self._corners())
            if onward is None:
                return
            y, at = onward
        self._end(Outcome.POINT_LIMIT, Outcome.POINT_LIMIT.text)

    def _smooth(self, y: Array, at: float) -> Generator[PeakPoint, None, str]:
        """Smooth peaks from one on; the value is what ended them: a tie, a corner, or nothing more to do."""
        run, side = self._run(y, at), 0.0
        try:
            for step in run:
                # smooth curves of peaks turn where the bend of the response passes zero, and nowhere else
                way = np.sign(step.evaluation.detail.bend * step.tangent_parameter)
                if self._slope_of(step) > FLAT or (step.kind != "turning point" and way * side < 0.0):
                    return CORNER
                again, side = step.kind == "start" and self.last is not None, side or way
                point = self._point(step)
                self._take(point)
                if not again:
                    yield point
                if step.kind == "turning point":
                    self.notes.append(f"the peak and a minimum of the curve merge at {step.parameter:.6g}")
        finally:
            self.work = self.work.plus(Work(1, run.evaluations, run.solves, run.rejected))
        if self.last is not None and self.last.kind == TIE:
            return TIE
        if run.outcome in _LOST:
            self._reason = run.message
            return CORNER
        self._end(run.outcome or Outcome.INTERRUPTED, run.message)
        return ""

    def _run(self, y: Array, at: float) -> Continuation:
        unit = np.full(y.size, self._size)
        unit[-1] = y[-1]
        direction = None
        if at != self.span[0]:
            direction = np.append(np.zeros(y.size), self._way)
        return continuation(
            self.system, y, *self.span, at=at, direction=direction, options=replace(self.options, output_step=np.inf),
            scaling=ArclengthScaling(x=unit), requested=self.requested, events=(
                BranchEvent(name=TIE, kind=TIE, function=lambda s: s.evaluation.detail.ahead - LEVEL, direction=1,
                            terminal=True),
                BranchEvent(name=OPTIMUM, kind=OPTIMUM, function=self._rate),
            ), context=self._context,
        )  # fmt: skip

    def _rate(self, step: Step) -> float:
        """Derivative of the peak by the parameter; a plateau has no extremes."""
        detail = step.evaluation.detail
        flat = abs(detail.rate * (self.span[1] - self.span[0])) <= LEVEL * detail.amplitude
        return float(np.finfo(float).tiny if flat else detail.rate)

    def _slope_of(self, step: Step) -> float:
        """Slope of the amplitude over the sizes of its terms."""
        value = step.evaluation
        return float(abs(value.residual[-1]) / (value.terms()[-1] or 1.0))

    def _point(self, step: Step) -> PeakPoint:
        value = step.evaluation
        residual = relative(value.residual[:-1], value.terms()[:-1])
        self._context = value.context
        return PeakPoint(step.x, step.parameter, value.detail, step.kind, residual, step.iterations)

    def _rivalled(self) -> tuple[Array, float] | None:
        """The peak of the other extreme at a tie, where it is at the same frequency: equal by symmetry."""
        last, context = self.last, self._context
        assert last is not None
        assert context is not None
        x, omega, carried = last.y[:-1], float(last.y[-1]), context[1:]
        U = self.system.space.at(x, omega, last.parameter, carried if carried.size else None).motion()[0]
        rival = Extreme.near(self.balance.harmonics, U, float(context[0])).rival(U)
        if rival is None:
            return None
        start, scale = np.append(rival.time, carried), np.append(np.full(x.size, norm(x) or 1.0), omega)
        result = newton(lambda y: self.system.evaluate(y, last.parameter, start), last.y, options=NEWTON, scale=scale)
        near = abs(result.x[-1] - omega) <= _ASIDE * omega
        if not (result.converged and near and result.evaluation.detail.bend < 0.0):
            return None
        self.notes.append(f"at {last.parameter:.6g} another extreme of the period is as large and is followed on")
        self._context = result.evaluation.context
        self._take(last._replace(y=result.x, kind="regular"))
        return result.x, last.parameter

    def _climbed(self) -> tuple[Array, float] | None:
        """The peak that the larger extreme rises to from a tie, at the same parameter."""
        last = self.last
        assert last is not None
        system = FrequencySystem(self.balance, last.detail.inputs)
        x, omega = last.y[:-1], float(last.y[-1])
        outputs = self.system.space.outputs
        sides = [self._amplitude(system, x, omega * (1.0 + side)) for side in (-_ASIDE, _ASIDE)]
        stop = self.bounds[int(np.argmax(sides))]
        run = continuation(
            system, x, omega, stop, options=ContinuationOptions(max_step=0.05, first_step=0.01),
            scaling=ArclengthScaling(x=self._size), events=peak_events(outputs, outputs.names, system),
            context=last.detail.carried,
        )  # fmt: skip
        for step in run:
            if step.kind == "peak":
                there = f"the one at {step.parameter:.6g} {self._unit} is followed on"
                self.notes.append(
                    f"at {last.parameter:.6g} another extreme of the period becomes the largest and the peak ends: "
                    f"{there}"
                )
                self._context = None
                self._take(last._replace(y=np.append(step.x, step.parameter), kind="regular"))
                return np.append(step.x, step.parameter), last.parameter
        self._end(Outcome.TURNED_BACK, f"the peak ends at {last.parameter:.6g}, where another extreme of the period "
                  f"becomes the largest, and up to {stop:.6g} {self._unit} there is no other")  # fmt: skip
        return None

    def _amplitude(self, system: FrequencySystem, x: Array, omega: float) -> float:
        result = newton(lambda z: system.evaluate(z, omega), x, options=NEWTON, scale=norm(x) or 1.0)
        here = self.system.space.at(result.x, omega, self.last.parameter if self.last else self.span[0])
        return Extreme.largest(self.balance.harmonics, here.motion()[0]).value if result.converged else 0.0

    def _end(self, outcome: Outcome, message: str) -> None:
        self.outcome, self.message = outcome, "; ".join([message or outcome.text, *self.notes])

    def _corners(self) -> Generator[PeakPoint, None, tuple[Array, float] | None]:
        """Peaks found by bracketing, each further on; the value is one that may be smooth, None where none is left."""
        before, at = self._first, self.span[0]
        if self.last is not None:
            step = self._way * self._length * abs(self.span[1] - self.span[0])
            places = (*self.requested, self._reach + step, self.span[1])
            ahead = [v for v in places if self._way * (v - self._reach) > 0.0]
            before, at = self.last.y, min(ahead, key=lambda v: self._way * v, default=self._reach)
            self._length = min(2.0 * self._length, _CORNER_STEPS[1])
        over = self.last is not None and self._reach == self.span[1]
        peak = None if over else bracketed_peak(self.system, at, before, self._context)
        if peak is None:
            self._end(Outcome.TURNED_BACK if self.notes else Outcome.STEP_TOO_SMALL, self._reason)
            return None
        if abs(peak.y[-1] - before[-1]) > _JUMP * before[-1]:
            self.notes.append(f"at {at:.6g} the peak at {peak.y[-1]:.6g} {self._unit} is followed on")
        smooth = "requested" if at in self.requested else "regular"
        kind = "end" if at == self.span[1] else smooth if peak.slope <= FLAT else CORNER
        kind = "start" if self.last is None else kind
        self._take(PeakPoint(peak.y, at, peak.detail, kind, peak.residual, peak.iterations))
        self._context = peak.context
        assert self.last is not None
        yield self.last
        if kind == "end":
            self._end(Outcome.COMPLETED, Outcome.COMPLETED.text)
            return None
        return peak.y, at

    def _take(self, point: PeakPoint) -> None:
        """Take note of a point; steps from corner to corner begin small again after smooth ones."""
        self._reach = self._way * max(self._way * self._reach, self._way * point.parameter)
        if point.kind not in (CORNER, "start") and self.last is not None and self.last.kind not in (CORNER, "start"):
            self._length = _CORNER_STEPS[0]
        self.last = point


_FIRST, _WIDEST = 2e-4, 0.3
"""Half width of the bracket at first, and at most, of the frequency."""
_NARROW = 1e-11
_TRIALS = 60
_NEWTON = NewtonOptions(max_iterations=20)


class BracketedPeak(NamedTuple):
    """What was found: unknowns and frequency, with the slope there over the sizes of its terms."""

    y: Array
    detail: PeakDetail
    context: Array
    residual: float
    iterations: int
    slope: float


def bracketed_peak(system: PeakSystem, value: float, y: Array, context: Array | None) -> BracketedPeak | None:
    """The maximum of the curve next to ``y`` (N + 1,), for another ``value`` of the parameter; None without one."""
    search = _Search(system, value, context)
    x, omega, half = y[:-1], float(y[-1]), _FIRST
    while half <= _WIDEST:
        sides = [search.slope(omega * (1.0 + side), x) for side in (-half, half)]
        if None in sides:
            return None
        low, high = (float(side) for side in sides if side is not None)
        if low > 0.0 > high:
            return search.narrowed(omega * (1.0 - half), low, omega * (1.0 + half), high)
        # towards the side that rises, so that the bracket walks uphill
        omega *= 1.0 + (half if high > 0.0 else -half)
        half *= 1.6
    return None


class _Search:
    """Solutions of the balance at frequencies asked for, each from the one before."""

    def __init__(self, system: PeakSystem, value: float, context: Array | None) -> None:
        self._system, self._value = system, value
        self._context = None if context is None else np.append(np.nan, context[1:])
        self._balance = FrequencySystem(system.balance, system.at(value)[0])
        self._x: Array | None = None
        self._near = None if context is None or context.size == 1 else context[1:]
        self._solved = 0

    def slope(self, omega: float, x: Array | None = None) -> float | None:
        """Slope of the amplitude over the sizes of its terms; None where there is no solution."""
        start = self._x if self._x is not None else x
        assert start is not None
        result = newton(
            lambda z: self._balance.evaluate(z, omega, self._near), start, options=_NEWTON,
            scale=norm(start) or 1.0,
        )  # fmt: skip
        self._solved += result.iterations
        self._system.factorisations += result.evaluations
        if not result.converged:
            return None
        self._x = result.x
        here = self._system.slope(np.append(result.x, omega), self._value, self._context)
        return None if here is None else here[1].value / (here[1].size or 1.0)

    def narrowed(self, low: float, at_low: float, high: float, at_high: float) -> BracketedPeak | None:
        """The place where the slope passes zero, smooth or with a jump."""
        root = BracketedRoot(low, at_low, high, at_high)
        for _ in range(_TRIALS):
            if root.width <= _NARROW * high:
                break
            slope = self.slope(root.trial)
            if slope is None:
                return None
            root.update(root.trial, slope, _NARROW * high)
        last = self.slope(root.best)
        if last is None or self._x is None:
            return None
        y = np.append(self._x, root.best)
        value = self._system.evaluate(y, self._value, self._context)
        if not np.all(np.isfinite(value.residual)):
            return None
        terms = value.terms()[:-1] if value.terms else np.ones(y.size - 1)
        residual = relative(value.residual[:-1], terms)
        return BracketedPeak(y, value.detail, value.context, residual, self._solved, abs(last))
