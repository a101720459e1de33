"""A curve over frequency or over a parameter, segment by segment: points in order, contact states carried along."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.curve.observables import OutputObservables
from slipstick.analysis.curve.request import curve_arguments
from slipstick.analysis.curve.resume import ResumeState, curve_checkpoint
from slipstick.analysis.curve.segments import BROKEN_OFF, Segment, joined, progress
from slipstick.analysis.curve.state_continuation import FOLDS, StateContinuation, jumps_text
from slipstick.analysis.peaks.events import Largest, kept_up, peak_events
from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.analysis.road.options import adapted_to
from slipstick.analysis.road.request import Checks, Request
from slipstick.analysis.road.run import Run
from slipstick.analysis.road.work import NO_WORK, counted
from slipstick.balance.evaluation import AnySystem, FrequencySystem, ParameterSystem, unanswered
from slipstick.balance.inputs import Inputs
from slipstick.balance.parameters import parameter_path
from slipstick.balance.physics_checks import parameter_warnings, problem_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.errors import InputError, Outcome
from slipstick.faults import frequency
from slipstick.interrupts import pass_on
from slipstick.results.measures import amplitude
from slipstick.results.record import Point, Recorder
from slipstick.results.schema import LARGEST
from slipstick.results.stability import STATE_CHANGE
from slipstick.results.truncation import Reaction
from slipstick.solve.continuation import ContinuationOptions, Step
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.newton import newton_at
from slipstick.solve.norm import norm
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.stability.floquet import StabilityWatch
    from slipstick.analysis.stability.special_points import SpecialPoints

_ORDINARY = ("regular", "interpolated", STATE_CHANGE)


@dataclass(frozen=True, kw_only=True)
class StartingPoint:
    """A solution inside the range that a branch is taken up from: unknowns (N,), value of the followed quantity,
    tangent (N + 1,), and events of its own."""

    x: Array
    at: float
    direction: Array
    events: tuple[BranchEvent, ...] = ()


@dataclass(frozen=True, kw_only=True)
class CurveRequest(Request):
    """A curve to be followed.

    Attributes
    ----------
    system, inputs, omega
        The equations over what is followed; the numbers of the problem and the frequency at its first value.
    peaks_of, largest_of
        Outputs of which all peaks are located, and those of which the largest amplitude is, and no other peak.
    guess
        Unknowns (N,) to try first.
    stability
        Judges every point, where that is asked for.
    starting_point
        Where the branch is taken up inside its range; None: at its start.
    context
        What the first point is solved with, as a point before would hand it on: contact states.
    """

    system: FrequencySystem | ParameterSystem
    inputs: Inputs
    omega: float
    peaks_of: tuple[str, ...] = ()
    largest_of: tuple[str, ...] = ()
    guess: Array | None = None
    stability: StabilityWatch | None = None
    starting_point: StartingPoint | None = None
    context: Any = None

    @property
    def analysis(self) -> str:
        """Over the frequency or over a parameter."""
        return "parameter" if self.parameter else "response"

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """That of a curve."""
        return curve_checkpoint(plain, self.balance.size)

    def run(self) -> CurveRun:
        """What follows it."""
        return CurveRun(self)

    def recorder(self) -> Recorder:
        """With stability, where that is asked for."""
        return Recorder(self.balance, parameter=self.parameter, stability=self.stability is not None)

    @property
    def from_other_end(self) -> CurveRequest:
        """The same range from its other end."""
        inputs, omega = self.system.at(self.stop)
        return replace(self, start=self.stop, stop=self.start, omega=omega, inputs=inputs, guess=None)


def frequency_request(problem: Problem, omega: Any, requested: Any = (), *shared: Any, **named: Any) -> CurveRequest:
    """What ``forced_response`` follows; its arguments in their order."""
    checks = Checks(problem)
    ends, points = checks.frequencies(omega, requested)
    common = curve_arguments(checks, points, *shared, **named)
    assert checks.problem is not None
    assert ends is not None
    return curve_over(checks.problem, "", None, ends, common)


def parameter_request(
    problem: Problem, parameter: str, span: Any, omega: Any, requested: Any = (), *shared: Any
) -> CurveRequest:
    """What ``parameter_response`` follows; its arguments in their order."""
    checks = Checks(problem)
    parameter = checks.name(parameter)
    at = checks.take(frequency, "omega", omega, checks.units)
    ends, points = checks.range(span, requested, parameter)
    checks.takes(parameter, ends)
    common = curve_arguments(checks, points, *shared)
    assert checks.problem is not None
    assert ends is not None
    return curve_over(checks.problem, parameter, at, ends, common)


def curve_over(
    problem: Problem, parameter: str, omega: float | None, ends: tuple[float, float], common: Mapping[str, Any]
) -> CurveRequest:
    """A curve over a parameter at a frequency, or over the frequency; of what was checked already."""
    balance, start, static = common["balance"], ends[0], common["balance"].receptance.static
    if not parameter:
        balance.anchor_if_undamped(start)
        return CurveRequest(
            problem=problem, system=_harmonics_by_need(FrequencySystem(balance, problem.inputs), common["options"]),
            inputs=problem.inputs, omega=start, start=start, stop=ends[1],
            warnings=problem_warnings(problem, ends, static), **common,
        )  # fmt: skip
    assert omega is not None
    path = parameter_path(problem, parameter)
    system = _harmonics_by_need(ParameterSystem(balance, path, omega), common["options"], parameter)
    steady = common["stability"] is not None
    return CurveRequest(
        problem=problem, system=system, inputs=path.at(start)[0], omega=omega, start=start, stop=ends[1],
        parameter=parameter, warnings=parameter_warnings(problem, parameter, ends, omega, static, steady=steady),
        **common,
    )  # fmt: skip


def _harmonics_by_need(system: AnySystem, options: ContinuationOptions, parameter: str = "") -> AnySystem:
    """The system as it is, or with harmonics by need where that is asked for."""
    tolerance = adapted_to(options)
    if tolerance is None:
        return system
    from slipstick.analysis.curve.harmonic_selection import adapted

    return adapted(system, tolerance, parameter)


class CurveRun(Run[CurveRequest]):
    """A curve under way: a segment from the start and, where that breaks off, another one from the other end."""

    def __init__(self, request: CurveRequest) -> None:
        self.state = ResumeState.taken_up(request.start, request.stop, request.checkpoints)
        super().__init__(request)
        self._special: SpecialPoints | None = None
        self._reached: Step | None = None

    def points(self) -> Generator[Point, None, None]:
        """Those of one segment, then of the other."""
        request, segments = self.request, self.state.segments
        if len(segments) == 1:
            yield from self._segment(request)
            yield from self._beyond_corners(request)
            if segments[0].outcome in BROKEN_OFF and request.starting_point is None:
                segments.append(Segment(number=2, start=request.stop, stop=request.start))
        if len(segments) == 2:
            yield from self._segment(request.from_other_end)
            yield from self._beyond_corners(request.from_other_end)
        self.outcome, message = joined(segments, undamped=request.balance.springs is not None)
        self.message, self.error = message + jumps_text(self.state.jumps, request.balance.states), segments[-1].error

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Segments, work, and which peaks were sought."""
        request, accuracy = self.request, adapted_to(self.request.options)
        return {
            "parts": len(self.state.segments), **counted(self.state.done), "peaks_of": "\n".join(request.peaks_of),
            "largest_of": "\n".join(request.largest_of),
            **({} if accuracy is None else {"adapt_harmonics": accuracy}),
        }  # fmt: skip

    @property
    def closing(self) -> str:
        """The message, of a curve that stopped early with the place of its last point; two segments tell it."""
        request, segments, message = self.request, self.state.segments, self.message
        if not message or self.outcome.ok or len(segments) > 1:
            return message
        unit = f" ({request.parameter})" if request.parameter else f" {request.problem.units.angular}"
        last = segments[0].last
        if last is None:
            return f"{message}; no point was found at {request.start:.6g}{unit}"
        return f"{message}; the last of {segments[0].points} points is at {last[0]:.6g}{unit}"

    def _segment(self, request: CurveRequest) -> Generator[Point, None, None]:
        """One continuation from an end of the range; a second one ends where it comes upon the end of the first."""
        state, self._special = self.state, special_points(request)
        segment, meeting = state.segments[-1], state.segments[0].last if len(state.segments) > 1 else None
        steps = self._continuation(request, meeting)
        if steps is None:
            segment.outcome, segment.message = Outcome.NO_FIRST_POINT, Outcome.NO_FIRST_POINT.text
            return
        before = steps.resumed_at
        try:
            while not (meeting is not None and segment.reaches(*meeting)):
                pass_on()
                step = next(steps, None)
                if step is None:
                    segment.outcome = steps.outcome or Outcome.INTERRUPTED
                    segment.message, segment.error = steps.message, steps.error
                    return
                point = self._point(step, before, steps.residual)
                if step.place is None:
                    beyond = request.starting_point is not None and before is None
                    yield from self._full_slip_corner(request, self._reached if beyond else before, step)
                    before = self._reached = step
                segment.add(step.parameter, step.x)
                self.checkpoint = state.checkpoint(step, steps, self.seconds)
                self.progress, self.step = progress(state.segments), steps.step_length
                yield point
            segment.outcome, segment.met = Outcome.COMPLETED, True
        finally:
            state.done = state.done.plus(steps.work)

    def _beyond_corners(self, request: CurveRequest) -> Generator[Point, None, None]:
        """The segment gone on with beyond corners of square roots: that, or the first point, changes the state."""
        segment = self.state.segments[-1]
        while segment.outcome is Outcome.STEP_TOO_SMALL and segment.error is None:
            starting_point = beyond_corner(request, segment)
            if starting_point is None:
                return
            points = self._segment(replace(request, starting_point=starting_point))
            first = next(points, None)
            if first is None:
                return
            yield first._replace(kind=STATE_CHANGE)
            for point in points:
                yield point._replace(kind="regular") if point.kind == "start" else point

    def _full_slip_corner(self, request: CurveRequest, before: Step | None, step: Step) -> Generator[Point, None, None]:
        """The corner between two steps on one side of which a contact sticks at all times, on the other slips."""
        if before is None or not may_slip_at_once(request):
            return
        corner = where_all_slips(request, before, step)
        if corner is not None:
            yield self._point(corner, None, corner.residual_norm)._replace(kind=STATE_CHANGE)

    def _continuation(self, request: CurveRequest, meeting: tuple[float, Array] | None) -> StateContinuation | None:
        """From the first point of a segment, or from where it was interrupted; None without a first point."""
        state, starting_point, special = self.state, request.starting_point, self._special
        restart, state.restart = state.restart, ()
        earlier, state.earlier = state.earlier, NO_WORK
        inside: dict[str, Any] = {"context": request.context}
        if restart:
            x: Array | None = restart[-1].state[:-1]
        elif starting_point is not None:
            x = starting_point.x
            inside |= {"at": starting_point.at, "direction": starting_point.direction}
        else:
            x = self._first(request)
        if x is None:
            return None
        outputs, postprocessing = self.recorder.outputs, self.recorder.postprocessing
        steps = StateContinuation(
            request.system, x, request.start, request.stop, jumps=state.jumps, restart=restart, earlier=earlier,
            each=adapted_to(request.options) is not None,
            options=request.options, scaling=scales(request.balance, request.inputs, request.omega).arclength(),
            requested=(*request.requested, *((meeting[0],) if meeting else ())),
            events=(
                *(starting_point.events if starting_point is not None else ()),
                *kept_up(postprocessing, "the place of peaks", peak_events(outputs, request.peaks_of, request.system)),
                *kept_up(postprocessing, "where stability changes", special.events if special else ()),
            ),
            observables=OutputObservables(outputs, request.system),
            watched=(
                Largest(outputs, request.largest_of, request.system, postprocessing) if request.largest_of else None
            ),
            **inside,
        )  # fmt: skip
        if special is not None and steps.resumed_at is not None:
            special.take_up(steps.resumed_at, restart[-1].values[-1])
        return steps

    def _first(self, request: CurveRequest) -> Array | None:
        return FirstPoint(
            request.balance, request.inputs, request.omega,
            guess=request.guess, report=self.tell, last_resort=lambda: settled_in_time(request), searching=self.tell,
        ).find()  # fmt: skip

    def _point(self, step: Step, before: Step | None, residual: float) -> Point:
        """A step as a point of the results; ``before`` is the solution before it."""
        request, special, take = self.request, self._special, self.recorder.postprocessing.attempt
        kind = step.kind
        if kind == "requested" and step.parameter not in request.requested:
            kind = "regular"
        if special is not None and not take("stability", partial(special.confirmed, step), False):
            kind = "regular"
        peak_of = step.name if kind == "peak" else ""
        if peak_of == LARGEST and LARGEST not in self.recorder.outputs.names:
            peak_of = self._largest(step)
        return Point.at(
            step.evaluation.detail if step.evaluation else unanswered(*request.system.at(step.parameter)),
            x=step.x, residual=residual, iterations=step.iterations, kind=kind, parameter=step.parameter,
            part=self.state.segments[-1].number, peak_of=peak_of,
            stability=special and take("stability", partial(special.judged, step, compare=kind not in _ORDINARY), None),
            reaction=_reaction(step, before),
        )  # fmt: skip

    def _largest(self, step: Step) -> str:
        """The output whose amplitude is the largest at a step."""
        outputs = self.recorder.outputs
        motion, _ = outputs.motion_along(step, self.request.system)
        return outputs.names[int(amplitude(outputs.balance.harmonics, motion).value.argmax())]


_REACHES = (1e-4, 1e-3, 1e-2, 0.05)
"""Of the range: how far beyond its end the rest of a segment is sought."""
_NEAREST = 1e-7
_AT_ALL_TIMES = 1.0 - 1e-9
"""Change of the part in slip that is one from stick at all times to slip at all times."""
_FARTHEST, _CONTINUOUS = 0.5, 1e-3
"""Of the motion: how far off it is sought, and how far apart both sides of a corner may be."""


def may_slip_at_once(request: CurveRequest) -> bool:
    """Whether a curve can have the corner of a contact that begins to slip at all times at one point."""
    return any(batch.law.slips_at_once for batch in request.balance.batches)


def beyond_corner(request: CurveRequest, segment: Segment) -> StartingPoint | None:
    """Where a segment goes on that ended at the corner of a square root; None where there is none such.

    Friction in two directions begins to slip at all times at one point of a curve where the orbit is a circle: the
    force grows with the root of what the circle is larger than the limit, and Newton's method finds no way from the one
    side to the other. Beyond it the curve is smooth again: a solution is found there and followed back to the corner.
    """
    if segment.last is None or not may_slip_at_once(request):
        return None
    (end, x), span = segment.last, request.stop - request.start
    size = norm(x)

    def solved(value: float, guess: Array) -> Array | None:
        result = newton_at(request.system, guess, value, options=request.options.newton, scale=norm(guess) or 1.0)
        return result.x if result.converged else None

    for reach in _REACHES:
        at = end + reach * span
        if (request.stop - at) * span <= 0.0:
            return None
        inputs, omega = request.system.at(at)
        y = solved(at, x)
        if y is None:
            y = FirstPoint(request.balance, inputs, omega, guess=x).find()
        nearest: tuple[float, Array] | None = None
        while y is not None and norm(y - x) <= _FARTHEST * size:
            nearest = at, y
            if abs(at - end) <= _NEAREST * abs(span):
                break
            at = end + 0.5 * (at - end)
            y = solved(at, x + 0.5 * (y - x))
        if nearest is not None and norm(nearest[1] - x) <= _CONTINUOUS * size:
            direction = np.append(np.zeros(x.size), np.sign(span))
            return StartingPoint(x=nearest[1], at=nearest[0], direction=direction)
    return None


def where_all_slips(request: CurveRequest, first: Step, second: Step) -> Step | None:
    """The last step at which a contact sticks at all times, where it slips at all times beyond; None: there is none.

    The corner of ``beyond_corner``, when a step leads across: it is narrowed down from the side that sticks, where
    the motion is smooth.
    """
    before, after = slip_fractions(request, first), slip_fractions(request, second)
    crossing = np.abs(after - before) > _AT_ALL_TIMES
    if not crossing.any():
        return None
    sticking, slipping = (second, first) if before[crossing][0] > after[crossing][0] else (first, second)
    low, high, found = sticking.parameter, slipping.parameter, copy(sticking)
    least = 1e-12 * abs(request.stop - request.start)
    while abs(high - low) > least:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        options, scale = request.options.newton, norm(found.x) or 1.0
        result = newton_at(request.system, found.x, middle, options=options, scale=scale)
        there = copy(sticking)
        there.state, there.evaluation = np.append(result.x, middle), result.evaluation
        there.iterations, there.residual_norm = result.iterations, result.residual_norm
        if result.converged and not slip_fractions(request, there)[crossing].any():
            low, found = middle, there
        else:
            high = middle
    return found


def slip_fractions(request: CurveRequest, step: Step) -> Array:
    """Parts of the period in slip of the contacts that can begin to slip at all times at once."""
    batches, responses = request.balance.batches, step.evaluation.detail.responses
    pairs = zip(batches, responses, strict=True)
    return np.concatenate([response.detail.slip_fraction for batch, response in pairs if batch.law.slips_at_once])


def special_points(request: CurveRequest) -> SpecialPoints | None:
    """Test functions of the kinds of motion, where stability is asked for."""
    if request.stability is None:
        return None
    from slipstick.analysis.stability.special_points import SpecialPoints

    return SpecialPoints(request.stability, request.system)


def _reaction(step: Step, before: Step | None) -> Reaction | None:
    """By the Jacobian that a point, or the one an interpolated point leads to, was corrected with last."""
    first, second = (before, step) if step.place is None else step.place[:2]
    if second.jacobian is None:
        return None
    bend = 0.0
    if step.kind in FOLDS:
        bend = inf
    elif first is not None and first.arclength != second.arclength:
        bend = float(second.tangent[-1] - first.tangent[-1]) / abs(second.arclength - first.arclength)
    return Reaction(second.jacobian, step.tangent, bend)


def settled_in_time(request: CurveRequest) -> Array | None:
    """Motion of the contacts (N,) settled from rest, roughly, by time integration; None without it."""
    from slipstick.analysis.time_domain.transient import transient

    problem = request.problem
    if problem.support is not None:  # the mean of the forces does not tell the mean of the motion
        return None
    if request.parameter:
        problem = problem.at_parameter(request.parameter, request.start)
    try:
        motion = transient(problem, request.omega, periods=200, tolerance=1e-6)
    except InputError:  # no equations in time, or a law that is not known there: one more way that failed
        return None
    balance = request.balance
    compliance = balance.compliance(request.omega, request.inputs.structure, anchored=False)
    by_port = (motion.friction_coefficients, motion.normal_coefficients)
    forces = [dict(enumerate(F[batch.elements] for F in by_port)) for batch in balance.batches]
    return -balance.moved_by(forces, request.inputs.P, compliance)
