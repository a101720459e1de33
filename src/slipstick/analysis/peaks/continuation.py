"""The continuation of a peak of a response curve over a parameter.

Three events interrupt a smooth curve of peaks:

- a fold, which arclength passes: the points beyond are minima of the response curve;
- a tie, where another extreme of the period becomes as large, ``a_1 = a_2``: the amplitude has a kink and the peak
  ends. The response curve rises further, to another peak, which is followed next;
- a corner, where the peak lies on a change of contact state: the slope jumps through zero, and bracketing finds it.

Two points belong to one peak if its extreme in time continues from one to the other, and the tangents at both lead
across. Where shorter steps do not help, the peak has ended: its last point is located, and the next peak is another
part of the branch.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from slipstick.analysis.peaks.events import peak_events
from slipstick.analysis.peaks.system import FLAT, Extreme, PeakDetail, PeakSystem
from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.analysis.road.run import NO_WORK, Work
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.scaling import scales
from slipstick.errors import Outcome
from slipstick.solve.continuation import (
    ArclengthScaling,
    BranchEvent,
    Continuation,
    ContinuationOptions,
    RestartPoint,
    Step,
    continuation,
)
from slipstick.solve.continuation.events import BracketedRoot
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm, relative
from slipstick.typing import Array

TIE, OPTIMUM, CORNER = "tie", "optimum", "corner"
"""Kinds of points: another extreme of the period is as large; the peak is highest or lowest over the parameter; the
peak lies on a change of contact state."""

NEWTON = NewtonOptions(max_iterations=8, min_damping=1.0, non_monotone=2, patience=2, stagnation=1e-11)
"""Options of the corrector, which gives up early: a shorter step costs less than many iterations."""

LEVEL = 1e-9
"""Relative difference of amplitudes up to which they are equal: extremes by symmetry, points of a plateau."""
_MOST_RUNS = 200
"""Number of smooth curves of peaks up to which a peak is followed."""
_LOST_OUTCOMES = (Outcome.STEP_TOO_SMALL, Outcome.SINGULAR, Outcome.NO_FIRST_POINT)
"""Ends of a smooth curve after which corners are sought."""
_NEAR_TIE = 1e-4
"""Relative change of frequency: from a tie to the points that show where the response curve rises, and up to which
extremes that are equal by symmetry peak at the same frequency."""
_FREQUENCY_WEIGHT = 10.0
"""Weight of a relative change of frequency against a relative change of motion."""
_DEVIATION, _LEAST_DEVIATION = 0.01, 2e-3
"""Distance of a step from the cone of the tangents at its ends, above which it may be a jump to another peak: over the
change of motion in the step, and over the motion."""
_SAME_PEAK = 0.01
"""Relative change of motion and frequency from corner to corner, up to which the peak is the same."""
_END_WIDTH = 1e-6
"""Interval, over the range, in which the end of a peak between two corners is bracketed."""
_TIE_DIFFERENCE = 1e-5
"""Relative difference of the amplitudes on both sides of such an end, up to which it is a tie."""
_CORNER_STEPS = (1e-3, 4e-2)
"""First and largest step from corner to corner, over the range."""


class PeakPoint(NamedTuple):
    """A peak at a value of the parameter."""

    y: Array
    """Unknowns and frequency, (N + 1,)."""
    parameter: float
    detail: PeakDetail
    kind: str
    residual: float
    iterations: int
    part: int = 1
    """Number of the part of the branch: each further peak is one."""
    given: Array | None = None
    """Context with which a peak found by bracketing was evaluated."""

    @property
    def context(self) -> Array:
        """Context for the evaluation of nearby points: time of the extreme, and contact states."""
        carried = self.detail.carried
        return np.append(self.detail.extreme.time, [] if carried is None else carried)


class PeakContinuation:
    """The continuation of a peak, as an iterator of points.

    Parameters
    ----------
    system
        Equations of the peaks of the output over the parameter.
    span
        First and last value of the parameter.
    requested
        Values of the parameter at which points are wanted.
    bounds
        Frequencies between which the next peak is sought where one ends.

    Attributes
    ----------
    outcome, message
        End of the continuation; None and empty before.
    notes
        Sentences about events on the way.
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
        self._forward, self._farthest, self._end_message = 1.0 if span[1] > span[0] else -1.0, span[0], ""
        self._context: Array | None = None
        self._part, self._new_part = 1, False
        self._runs, self._side, self._accepted = 0, 0.0, False
        self._smooth_start = np.zeros(0), span[0]
        self._restart_points: deque[RestartPoint] = deque(maxlen=2)
        self._unit = self.balance.problem.units.angular
        self._size = scales(self.balance, system.at(span[0])[0], bounds[0]).displacement

    def points(self, y: Array) -> Iterator[PeakPoint]:
        """Points from the peak ``y`` (N + 1,) at the start of the range."""
        self._first = y
        yield from self._points(y, self.span[0])

    def resumed(self, checkpoint: Checkpoint) -> Iterator[PeakPoint]:
        """Points after the checkpoint of a continuation with the same arguments."""
        own = checkpoint.own
        self._runs, self._part, self._new_part = own["runs"], checkpoint.part, own["begun"]
        self._farthest, self._length, self._end_message = own["reach"], own["length"], own["reason"]
        self.notes, self.work, y, at = list(own["notes"]), own["work"], own["y"], own["at"]
        if checkpoint.restart_point is None:
            detail = self.system.evaluate(y, at, own["given"]).detail
            self.last = PeakPoint(y, at, detail, own["kind"], own["residual"], own["iterations"], checkpoint.part)
            self._context, self.system.factorisations = self.last.context, own["factorisations"]
            if own["kind"] == "end":
                self._end(Outcome.COMPLETED, Outcome.COMPLETED.text)
                return
        yield from self._points(y, at, checkpoint)

    def checkpoint(self, seconds: float) -> Checkpoint:
        """Checkpoint at the last point, after a computing time in seconds.

        Its ``own`` entries hold the start of the present smooth curve of peaks, or of the next one where bracketing
        found the peak (``y``, ``at``, and its context ``given``), and the state of the search.
        """
        last, smooth = self.last, bool(self._restart_points)
        assert last is not None
        y, at = self._smooth_start if smooth else (last.y, last.parameter)
        restart = tuple(self._restart_points) if self._accepted else ()
        return Checkpoint(
            value=last.parameter, seconds=seconds, part=self._part, goes_on=self._accepted,
            restart_point=restart[-1] if restart else None, before=restart[0] if len(restart) > 1 else None,
            own={
                "y": y, "at": at, "given": last.given, "kind": last.kind, "residual": last.residual,
                "iterations": last.iterations, "side": float(self._side), "reach": self._farthest,
                "length": self._length, "reason": self._end_message, "notes": list(self.notes), "runs": self._runs,
                "begun": self._new_part and not smooth, "work": self.work, "factorisations": self.system.factorisations,
            },
        )  # fmt: skip

    def _points(self, y: Array, at: float, checkpoint: Checkpoint | None = None) -> Iterator[PeakPoint]:
        while self._runs < _MOST_RUNS:
            why, checkpoint = (yield from self._smooth(y, at, checkpoint)), None
            self._runs += 1
            if not why:
                return
            onward = (self._symmetric_peak() or self._larger_peak()) if why == TIE else (yield from self._corners())
            if onward is None:
                return
            y, at = onward
        self._end(Outcome.POINT_LIMIT, Outcome.POINT_LIMIT.text)

    def _smooth(self, y: Array, at: float, checkpoint: Checkpoint | None) -> Generator[PeakPoint, None, str]:
        """Points of a smooth curve of peaks; the value is TIE or CORNER, or empty where the continuation ended."""
        restart = () if checkpoint is None else tuple(filter(None, (checkpoint.before, checkpoint.restart_point)))
        run, side, before = self._run(y, at, restart), 0.0, self.last.detail if self.last is not None else None
        self._smooth_start, self._restart_points = (y, at), deque(restart, maxlen=2)
        if checkpoint is not None and run.resumed_at is not None:
            own, step = checkpoint.own, run.resumed_at
            side, before, self._context = own["side"], step.evaluation.detail, step.evaluation.context
            self.last = PeakPoint(
                step.x, step.parameter, before, own["kind"], own["residual"], own["iterations"], self._part
            )
            self.system.factorisations = own["factorisations"]
        try:
            for step in run:
                self._accepted = run.restart_point is not None and run.restart_point.state is step.state
                if self._accepted and run.restart_point is not None:
                    self._restart_points.append(run.restart_point)
                if before is not None and not _same_extreme(before, step.evaluation.detail):
                    return CORNER
                before = step.evaluation.detail
                if step.kind == "near turning point":
                    return CORNER  # the curve ends there: a step crossed to the other side of a fold, and back
                # smooth curves of peaks turn where the bend of the response passes zero, and nowhere else
                way = np.sign(step.evaluation.detail.bend * step.tangent_parameter)
                if self._slope_of(step) > FLAT or (step.kind != "turning point" and way * side < 0.0):
                    return CORNER
                again, side = step.kind == "start" and self.last is not None, side or way
                self._side = side
                point = self._point(step)
                self._record(point)
                if not again or self._new_part:
                    yield point._replace(kind="regular") if again else point
                self._new_part = False
                if step.kind == "turning point":
                    self.notes.append(f"the peak and a minimum of the curve merge at {step.parameter:.6g}")
        finally:
            self.work = self.work.plus(Work(1, run.evaluations, run.solves, run.rejected))
            self._restart_points.clear()
        if self.last is not None and self.last.kind == TIE:
            return TIE
        if run.outcome in _LOST_OUTCOMES:
            self._end_message = run.message
            return CORNER
        self._end(run.outcome or Outcome.INTERRUPTED, run.message)
        return ""

    def _run(self, y: Array, at: float, restart: Sequence[RestartPoint]) -> Continuation:
        unit = np.full(y.size, self._size)
        unit[-1] = y[-1]
        direction = None
        if at != self.span[0]:
            direction = np.append(np.zeros(y.size), self._forward)
        return continuation(
            self.system, y, *self.span, at=at, direction=direction, options=replace(self.options, output_step=np.inf),
            scaling=ArclengthScaling(x=unit), requested=self.requested, events=(
                BranchEvent(name=TIE, kind=TIE, function=lambda s: s.evaluation.detail.ahead - LEVEL, direction=1,
                            terminal=True),
                BranchEvent(name=OPTIMUM, kind=OPTIMUM, function=self._rate),
            ), context=self._context, restart=restart, doubted=self._may_jump,
        )  # fmt: skip

    def _may_jump(self, last: Step, new: Step, _: Array) -> bool:
        """Whether a step may lead to another extreme of the period, or to another peak of the response curve.

        Along one curve, even with a kink, a step is a sum of positive multiples of the tangents at its ends, up to
        terms of third order. The distance from that cone, by nonnegative least squares, shows a jump.
        """
        from scipy.optimize import nnls

        if not _same_extreme(last.evaluation.detail, new.evaluation.detail):
            return True
        scale = np.append(self._scale(new.x), 1.0 / abs(self.span[1] - self.span[0]))
        tangents = np.column_stack([last.tangent * scale, new.tangent * scale])
        step = (new.state - last.state) * scale
        distance = nnls(tangents / np.linalg.norm(tangents, axis=0), step)[1]
        return bool(distance > max(_DEVIATION * norm(step[:-1]), _LEAST_DEVIATION))

    def _scale(self, y: Array) -> Array:
        """Factors (N + 1,) that make changes of ``y``, unknowns and frequency, relative to the motion.

        The mean has no weight: it may change sign with the rubbing while the vibration continues.
        """
        vibration = np.ones((self.balance.n_ports, self.balance.L))
        vibration[:, 0] = 0.0
        scale = vibration.reshape(-1)
        return np.append(scale / (norm(scale * y[:-1]) or 1.0), _FREQUENCY_WEIGHT / y[-1])

    def _relative(self, change: Array, y: Array) -> float:
        """Relative size of a change (N + 1,) of ``y``, unknowns and frequency."""
        return norm(change * self._scale(y))

    def _rate(self, step: Step) -> float:
        """Derivative of the peak amplitude by the parameter; positive on a plateau, which has no extremes."""
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
        return PeakPoint(step.x, step.parameter, value.detail, step.kind, residual, step.iterations, self._part)

    def _symmetric_peak(self) -> tuple[Array, float] | None:
        """The peak of the other extreme at a tie, if it has the same frequency: both are equal by symmetry."""
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
        near = abs(result.x[-1] - omega) <= _NEAR_TIE * omega
        if not (result.converged and near and result.evaluation.detail.bend < 0.0):
            return None
        self.notes.append(f"at {last.parameter:.6g} another extreme of the period is as large and is followed on")
        self._context = result.evaluation.context
        self._record(last._replace(y=result.x, detail=result.evaluation.detail, kind="regular"))
        return result.x, last.parameter

    def _larger_peak(self) -> tuple[Array, float] | None:
        """The peak to which the larger extreme rises from a tie, at the same parameter."""
        last = self.last
        assert last is not None
        system = FrequencySystem(self.balance, last.detail.inputs)
        x, omega = last.y[:-1], float(last.y[-1])
        outputs = self.system.space.outputs
        sides = [self._amplitude(system, x, omega * (1.0 + side)) for side in (-_NEAR_TIE, _NEAR_TIE)]
        stop = self.bounds[int(np.argmax(sides))]
        run = continuation(
            system, x, omega, stop, options=ContinuationOptions(max_step=0.05, first_step=0.01),
            scaling=ArclengthScaling(x=self._size), events=peak_events(outputs, outputs.names, system),
            context=last.detail.carried,
        )  # fmt: skip
        for step in run:
            if step.kind == "peak":
                y = np.append(step.x, step.parameter)
                peak = self.system.evaluate(y, last.parameter, np.append(np.nan, last.context[1:]))
                there = f"the one at {step.parameter:.6g} {self._unit} is followed on"
                self.notes.append(
                    f"at {last.parameter:.6g} another extreme of the period becomes the largest and the peak ends: "
                    f"{there}"
                )
                self._context = None
                self._part, self._new_part = self._part + 1, True
                self._record(last._replace(y=y, detail=peak.detail, kind="regular"))
                return y, last.parameter
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
        """Peaks found by bracketing at successive parameters; the value is a possible smooth start, None without one.

        Where the peak ends, the next one is sought beyond the largest parameter so far.
        """
        last = self.last
        if last is None:
            return (yield from self._bracketed(bracketed_peak(self.system, self.span[0], self._first, self._context)))
        if last.detail.bend < 0.0:
            peak = self._ahead(last.parameter)
            if peak is None and self._length > _CORNER_STEPS[0]:
                self._length = _CORNER_STEPS[0]
                peak = self._ahead(last.parameter)
            jump = None if peak is None else self._jump(last, peak)
            if jump is not None:  # a long step may find another peak although this one continues
                low, high = jump
                again = bracketed_peak(self.system, high.parameter, low.y, low.context)
                if again is not None and self._same_peak(low, again):
                    peak, jump, self._length = again, None, _CORNER_STEPS[0]
            if peak is not None and jump is None:
                return (yield from self._bracketed(peak))
            if jump is not None:
                yield self._last_point(*jump)
                if self._forward * (jump[1].parameter - self._farthest) >= 0.0:
                    return (yield from self._next(jump[1]))
        return (yield from self._next(self._ahead(self._farthest)))

    def _ahead(self, begin: float) -> PeakPoint | None:
        """The peak one step beyond ``begin``; None at the end of the range, or without a peak."""
        assert self.last is not None
        step = self._forward * self._length * abs(self.span[1] - self.span[0])
        self._length = min(2.0 * self._length, _CORNER_STEPS[1])
        ahead = [v for v in (*self.requested, begin + step, self.span[1]) if self._forward * (v - begin) > 0.0]
        if not ahead:
            return None
        return bracketed_peak(self.system, min(ahead, key=lambda v: self._forward * v), self.last.y, self._context)

    def _last_point(self, before: PeakPoint, after: PeakPoint) -> PeakPoint:
        """The last point of a peak; ``after`` belongs to another one."""
        tie = not _same_extreme(before.detail, after.detail)
        tie = tie and abs(after.detail.amplitude / before.detail.amplitude - 1.0) <= _TIE_DIFFERENCE
        why = "another extreme of the period becomes the largest and the peak ends" if tie else "the peak ends"
        self.notes.append(f"at {before.parameter:.6g} {why}")
        end = before._replace(kind=TIE if tie else CORNER, part=self._part)
        self._record(end)
        self._accepted = False
        return end

    def _next(self, peak: PeakPoint | None) -> Generator[PeakPoint, None, tuple[Array, float] | None]:
        """Follow another peak, as a new part of the branch."""
        if peak is not None:
            self._part += 1
            self.notes.append(f"at {peak.parameter:.6g} the peak at {peak.y[-1]:.6g} {self._unit} is followed on")
        return (yield from self._bracketed(peak))

    def _bracketed(self, peak: PeakPoint | None) -> Generator[PeakPoint, None, tuple[Array, float] | None]:
        """Yield a peak found by bracketing; the value is a possible start of a smooth curve of peaks."""
        if peak is None:
            self._end(Outcome.TURNED_BACK if self.notes else Outcome.STEP_TOO_SMALL, self._end_message)
            return None
        kind = "requested" if peak.kind != CORNER and peak.parameter in self.requested else peak.kind
        kind = "end" if peak.parameter == self.span[1] else kind
        peak = peak._replace(kind="start" if self.last is None else kind, part=self._part)
        self._context = peak.context
        self._record(peak)
        self._accepted = True
        yield peak
        if kind == "end":
            self._end(Outcome.COMPLETED, Outcome.COMPLETED.text)
            return None
        return peak.y, peak.parameter

    def _same_peak(self, before: PeakPoint, after: PeakPoint) -> bool:
        """Whether two neighbouring points belong to one peak."""
        return _same_extreme(before.detail, after.detail) and self._relative(after.y - before.y, after.y) <= _SAME_PEAK

    def _jump(self, low: PeakPoint, high: PeakPoint) -> tuple[PeakPoint, PeakPoint] | None:
        """The last point of a peak and the first one of the next between two points; None where the peak continues."""
        if self._same_peak(low, high):
            return None
        if abs(high.parameter - low.parameter) <= _END_WIDTH * abs(self.span[1] - self.span[0]):
            return low, high
        middle = bracketed_peak(self.system, 0.5 * (low.parameter + high.parameter), low.y, low.context)
        if middle is None:
            return low, high
        same = _same_extreme(low.detail, middle.detail) and _same_extreme(middle.detail, high.detail)
        if same and self._relative(middle.y - 0.5 * (low.y + high.y), high.y) <= 0.5 * _SAME_PEAK:
            return None  # a jump on either side would move the middle by half of it
        return self._jump(low, middle) or self._jump(middle, high)

    def _record(self, point: PeakPoint) -> None:
        """Record a point; after smooth points, steps from corner to corner start small again."""
        self._farthest = self._forward * max(self._forward * self._farthest, self._forward * point.parameter)
        if point.kind not in (CORNER, "start") and self.last is not None and self.last.kind not in (CORNER, "start"):
            self._length = _CORNER_STEPS[0]
        self.last = point


def _same_extreme(before: PeakDetail, after: PeakDetail) -> bool:
    """Whether the extremes of the period at two points are the same one."""
    return before.extreme.continues_as(after.extreme, before.motion, after.motion)


_FIRST_WIDTH, _LARGEST_WIDTH, _WIDTH_FACTOR = 2e-4, 0.3, 1.6
"""First and largest half width of a bracket, relative to the frequency, and the growth between trials."""
_ROOT_WIDTH, _ROOT_TRIALS = 1e-11, 60
"""Width at which a bracket ends, relative to the frequency, and largest number of trials."""
_BRACKET_NEWTON = NewtonOptions(max_iterations=20)


def bracketed_peak(system: PeakSystem, value: float, y: Array, context: Array | None) -> PeakPoint | None:
    """The maximum of the response curve next to ``y`` (N + 1,), for a ``value`` of the parameter; None without one.

    Its kind is "corner" where the slope of the amplitude jumps.
    """
    search = _Search(system, value, context)
    x, omega, half = y[:-1], float(y[-1]), _FIRST_WIDTH
    while half <= _LARGEST_WIDTH:
        sides = [search.slope(omega * (1.0 + side), x) for side in (-half, half)]
        if None in sides:
            return None
        low, high = (float(side) for side in sides if side is not None)
        if low > 0.0 > high:
            return search.narrowed(omega * (1.0 - half), low, omega * (1.0 + half), high)
        # towards the side that rises, so that the bracket walks uphill
        omega *= 1.0 + (half if high > 0.0 else -half)
        half *= _WIDTH_FACTOR
    return None


class _Search:
    """Solutions of the balance at successive frequencies, each from the one before."""

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
            lambda z: self._balance.evaluate(z, omega, self._near), start, options=_BRACKET_NEWTON,
            scale=norm(start) or 1.0,
        )  # fmt: skip
        self._solved += result.iterations
        self._system.factorisations += result.evaluations
        if not result.converged:
            return None
        self._x = result.x
        here = self._system.slope(np.append(result.x, omega), self._value, self._context)
        return None if here is None else here[1].value / (here[1].size or 1.0)

    def narrowed(self, low: float, at_low: float, high: float, at_high: float) -> PeakPoint | None:
        """The peak at the frequency where the slope crosses zero, continuously or with a jump."""
        root = BracketedRoot(low, at_low, high, at_high)
        for _ in range(_ROOT_TRIALS):
            if root.width <= _ROOT_WIDTH * high:
                break
            slope = self.slope(root.trial)
            if slope is None:
                return None
            root.update(root.trial, slope, _ROOT_WIDTH * high)
        last = self.slope(root.best)
        if last is None or self._x is None:
            return None
        y = np.append(self._x, root.best)
        value = self._system.evaluate(y, self._value, self._context)
        if not np.all(np.isfinite(value.residual)):
            return None
        terms = value.terms()[:-1] if value.terms else np.ones(y.size - 1)
        residual = relative(value.residual[:-1], terms)
        kind = "regular" if abs(last) <= FLAT else CORNER
        return PeakPoint(y, self._value, value.detail, kind, residual, self._solved, given=self._context)
