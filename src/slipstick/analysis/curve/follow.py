"""Response curves over frequency or over a parameter: the request, checked once, and the run that finds its points.

``CurveRun.points`` follows a segment from the start of the range and, where that breaks off, a second one from the
other end. Each segment is a ``StateContinuation`` from the first point of ``balance/start.py``.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any, Literal

from slipstick.analysis.curve.observables import OutputObservables
from slipstick.analysis.curve.segments import BROKEN_OFF, ResumeState, Segment, curve_checkpoint, joined, progress
from slipstick.analysis.curve.slip_corners import StartingPoint, beyond_corner, corner_between, may_slip_at_once
from slipstick.analysis.curve.state_continuation import FOLDS, StateContinuation, jumps_text
from slipstick.analysis.peaks.events import Largest, kept_up, peak_events
from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import Checks, Request, ResponseOptions
from slipstick.analysis.road.run import NO_WORK, Run, counted
from slipstick.balance.balance import Balance
from slipstick.balance.checks import peak_faults
from slipstick.balance.evaluation import AnySystem, FrequencySystem, ParameterSystem, unanswered
from slipstick.balance.inputs import Inputs
from slipstick.balance.parameters import parameter_path
from slipstick.balance.physics_checks import parameter_warnings, problem_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.errors import Fault, InputError, Outcome, without_points
from slipstick.faults import frequency, names, numbers, shown
from slipstick.interrupts import pass_on
from slipstick.results.measures import amplitude
from slipstick.results.record import Point, Recorder
from slipstick.results.schema import LARGEST
from slipstick.results.stability import STATE_CHANGE
from slipstick.results.truncation import Reaction
from slipstick.solve.continuation import ContinuationOptions, Step
from slipstick.typing import Array
from slipstick.units import compared

if TYPE_CHECKING:
    from slipstick.analysis.stability.floquet import StabilityWatch
    from slipstick.analysis.stability.special_points import SpecialPoints


StabilityRequest = bool | Literal["full"]
"""The argument ``stability`` of users."""

PEAK_OUTPUTS = 3
"""Number of outputs up to which the peaks of all of them are located."""
LARGEST_OUTPUTS = 100
"""Number of further outputs up to which the largest amplitude of each is located."""
_ORDINARY = ("regular", "interpolated", STATE_CHANGE)
"""Kinds of points at which the two methods of stability are not compared."""


@dataclass(frozen=True, kw_only=True)
class CurveRequest(Request):
    """A request for a curve over frequency or over a parameter.

    Attributes
    ----------
    system
        Equations over the followed quantity.
    inputs, omega
        Inputs of the balance and frequency at its first value.
    peaks_of, largest_of
        Outputs of which all peaks are located, and outputs of which only the largest amplitude is.
    guess
        Unknowns (N,) to try first.
    stability
        Judges every point; None: stability is not computed.
    starting_point
        Solution inside the range at which the branch begins; None: it begins at ``start``.
    context
        Contact states with which the first point is solved, as a continuation hands them on.
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
        """The name "response" over frequency, "parameter" over a parameter."""
        return "parameter" if self.parameter else "response"

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Checkpoint of a curve, from its journal."""
        return curve_checkpoint(plain, self.balance.size)

    def run(self) -> CurveRun:
        """The run that follows the curve."""
        return CurveRun(self)

    def recorder(self) -> Recorder:
        """Recorder with the variables of stability where they are computed."""
        return Recorder(self.balance, parameter=self.parameter, stability=self.stability is not None)

    @property
    def from_other_end(self) -> CurveRequest:
        """Request for the same range from its other end."""
        inputs, omega = self.system.at(self.stop)
        return replace(self, start=self.stop, stop=self.start, omega=omega, inputs=inputs, guess=None)


def frequency_request(problem: Problem, omega: Any, at: Any = (), *shared: Any, **named: Any) -> CurveRequest:
    """Request of ``forced_response``; its arguments in their order. Raises InputError with all faults."""
    checks = Checks(problem)
    ends, points = checks.frequencies(omega, at)
    common = curve_arguments(checks, points, *shared, **named)
    assert checks.problem is not None
    assert ends is not None
    return curve_over(checks.problem, "", None, ends, common)


def parameter_request(
    problem: Problem, parameter: str, span: Any, omega: Any, at: Any = (), *shared: Any, **named: Any
) -> CurveRequest:
    """Request of ``parameter_response``; its arguments in their order. Raises InputError with all faults."""
    checks = Checks(problem)
    parameter = checks.name(parameter)
    w = checks.take(frequency, "omega", omega, checks.units)
    ends, points = checks.range(span, at, parameter)
    checks.takes(parameter, ends)
    common = curve_arguments(checks, points, *shared, **named)
    assert checks.problem is not None
    assert ends is not None
    return curve_over(checks.problem, parameter, w, ends, common)


def curve_over(
    problem: Problem, parameter: str, omega: float | None, ends: tuple[float, float], common: Mapping[str, Any]
) -> CurveRequest:
    """Request from checked arguments: over a parameter at frequency ``omega``, or over frequency if that is empty."""
    balance, start, static = common["balance"], ends[0], common["balance"].receptance.static
    if not parameter:
        balance.anchor_if_undamped(start)
        return CurveRequest(
            problem=problem, system=_with_harmonics(FrequencySystem(balance, problem.inputs), common["options"]),
            inputs=problem.inputs, omega=start, start=start, stop=ends[1],
            warnings=problem_warnings(problem, ends, static), **common,
        )  # fmt: skip
    assert omega is not None
    path = parameter_path(problem, parameter)
    system = _with_harmonics(ParameterSystem(balance, path, omega), common["options"], parameter)
    steady = common["stability"] is not None
    return CurveRequest(
        problem=problem, system=system, inputs=path.at(start)[0], omega=omega, start=start, stop=ends[1],
        parameter=parameter, warnings=parameter_warnings(problem, parameter, ends, omega, static, steady=steady),
        **common,
    )  # fmt: skip


def _with_harmonics(system: AnySystem, options: ResponseOptions, parameter: str = "") -> AnySystem:
    """The system itself, or with adapted harmonics where the options ask for them."""
    tolerance = options.adapt_harmonics
    if tolerance is None:
        return system
    from slipstick.analysis.curve.harmonic_selection import adapted

    return adapted(system, tolerance, parameter)


def curve_arguments(
    checks: Checks,
    requested: tuple[float, ...],
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: Any = None,
    stability: StabilityRequest = False,
) -> dict[str, Any]:
    """Checked fields that the requests of all kinds of curves share.

    Raises
    ------
    InputError
        With these faults and those that ``checks`` found before.
    """
    common, problem = checks.shared(requested, options, listeners), checks.problem
    balance = common["balance"]
    sought = checks.take(_peak_dofs, problem, peaks_of) if problem is not None else None
    start = checks.take(_guess, guess, balance) if guess is not None and balance is not None else None
    judged = checks.take(stability_request, stability)
    watch = checks.take(_watch, balance, judged) if judged and balance is not None else None
    checks.end()
    peaks, largest = sought or ((), ())
    return {**common, "stability": watch, "peaks_of": peaks, "largest_of": largest, "guess": start}


def _watch(balance: Balance, judged: StabilityRequest) -> StabilityWatch:
    from slipstick.analysis.stability.floquet import StabilityWatch

    if balance.problem.structure.covers[1] < inf:
        remedy = (
            "fit modes to it (ss.models.modal_analysis), or say "
            'beyond="line": stability is then counted from the receptance'
        )
        found = (
            "the structure is a table of receptances: it has no states, and does not reach the frequencies "
            "that stability needs"
        )
        raise InputError(Fault("stability", found, remedy=remedy))
    return StabilityWatch(balance, full=judged == "full")


def _guess(value: Any, balance: Balance) -> Array:
    guess = numbers("guess", value, f"{balance.size} finite numbers")
    if guess.shape not in ((balance.size,), (balance.n_ports, balance.L)):
        raise InputError(
            f"guess: found shape {guess.shape}; expected ({balance.n_ports}, {balance.L}): coefficients of the "
            "relative motion of the contacts, first all tangential, then all normal ones"
        )
    return guess.reshape(-1)


def _peak_dofs(problem: Problem, peaks_of: Sequence[str] | str | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs of which all peaks are located, and outputs of which only the largest amplitude is."""
    outputs = tuple(problem.outputs or ())
    if peaks_of is None:
        if len(outputs) <= PEAK_OUTPUTS:
            return outputs, ()
        loaded = [load.dof for load in problem.loads if load.dof in outputs]
        first = [pair.first_direction for pair in problem.contacts[:1]]
        rubbed = [dof for direction in first for dof in direction if dof in outputs]
        chosen = tuple(dict.fromkeys(str(dof) for dof in loaded or rubbed)) or outputs[:1]
        rest = tuple(dof for dof in outputs if dof not in chosen)
        return chosen, rest if len(rest) <= LARGEST_OUTPUTS else ()
    chosen = tuple(dict.fromkeys(names("peaks_of", peaks_of)))
    if chosen == (LARGEST,) and LARGEST not in outputs:
        return chosen, ()
    faults = [fault.inside("peaks_of") for fault in peak_faults(chosen, outputs)]
    if faults:
        raise InputError(faults)
    return chosen, ()


def stability_request(stability: object) -> StabilityRequest:
    """The argument ``stability``, checked; raises InputError for anything but True, False and "full"."""
    if isinstance(stability, bool) or (isinstance(stability, str) and stability == "full"):
        return stability  # type: ignore[return-value]
    raise InputError(
        Fault("stability", found=shown(stability), expected='True, False, or "full" (all modes in motion)')
    )


class CurveRun(Run[CurveRequest]):
    """Run of a curve: a segment from the start and, where that breaks off, another one from the other end."""

    def __init__(self, request: CurveRequest) -> None:
        self.state = ResumeState.taken_up(request.start, request.stop, request.checkpoints)
        super().__init__(request)
        self._special: SpecialPoints | None = None
        self._last_step: Step | None = None

    def points(self) -> Generator[Point, None, None]:
        """Points of the first segment, then of the second."""
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
        """Number of segments, work, and the outputs whose peaks were sought."""
        request, accuracy = self.request, self.request.options.adapt_harmonics
        return {
            "parts": len(self.state.segments), **counted(self.state.done), "peaks_of": "\n".join(request.peaks_of),
            "largest_of": "\n".join(request.largest_of),
            **({} if accuracy is None else {"adapt_harmonics": accuracy}),
        }  # fmt: skip

    @property
    def closing(self) -> str:
        """The message, with the last point where a single segment stopped early."""
        request, segments, message = self.request, self.state.segments, self.message
        if not message or self.outcome.ok or len(segments) > 1:
            return message
        unit = f" ({request.parameter})" if request.parameter else f" {request.problem.units.angular}"
        known = segments[0].last
        if not self.count or known is None:
            at = f" at {request.start:.6g}{unit}"
            said = without_points(message, at)
            return said if said != message else f"{message}; no point was found{at}"
        last = known[0] if self.latest is None else self.latest.parameter
        return f"{message}; the last of {self.count} points is at {last:.6g}{unit}"

    def _segment(self, request: CurveRequest) -> Generator[Point, None, None]:
        """Points of one continuation from an end of the range; a second one stops at the end of the first."""
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
                    at_start = request.starting_point is not None and before is None
                    yield from self._full_slip_corner(request, self._last_step if at_start else before, step)
                    before = self._last_step = step
                segment.add(step.parameter, step.x)
                self.checkpoint = state.checkpoint(step, steps, self.seconds)
                self.progress, self.step = progress(state.segments), steps.step_length
                yield point
            segment.outcome, segment.met = Outcome.COMPLETED, True
        finally:
            state.done = state.done.plus(steps.work)

    def _beyond_corners(self, request: CurveRequest) -> Generator[Point, None, None]:
        """Points beyond corners at which the segment ended; the first one beyond each is a change of state."""
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
        """The corner between two steps where a contact goes from stick at all times to slip at all times, if any."""
        if before is None or not may_slip_at_once(request):
            return
        corner = corner_between(request, before, step)
        if corner is not None:
            yield self._point(corner, None, corner.residual_norm)._replace(kind=STATE_CHANGE)

    def _continuation(self, request: CurveRequest, meeting: tuple[float, Array] | None) -> StateContinuation | None:
        """The continuation of a segment from its first or its last known point; None where no first point is found."""
        state, starting_point, special = self.state, request.starting_point, self._special
        restart, state.restart = state.restart, ()
        earlier, state.earlier = state.earlier, NO_WORK
        start: dict[str, Any] = {"context": request.context}
        if restart:
            x: Array | None = restart[-1].state[:-1]
        elif starting_point is not None:
            x = starting_point.x
            start |= {"at": starting_point.at, "direction": starting_point.direction}
        else:
            x = self._first(request)
        if x is None:
            return None
        outputs, postprocessing = self.recorder.outputs, self.recorder.postprocessing
        steps = StateContinuation(
            request.system, x, request.start, request.stop, jumps=state.jumps, restart=restart, earlier=earlier,
            each=request.options.adapt_harmonics is not None,
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
            **start,
        )  # fmt: skip
        if special is not None and steps.resumed_at is not None:
            special.take_up(steps.resumed_at, restart[-1].values[-1])
        return steps

    def _first(self, request: CurveRequest) -> Array | None:
        """Unknowns (N,) of the first point; None where every strategy fails."""
        return FirstPoint(
            request.balance, request.inputs, request.omega,
            guess=request.guess, report=self.tell, last_resort=lambda: settled_in_time(request), searching=self.tell,
        ).find()  # fmt: skip

    def _point(self, step: Step, before: Step | None, residual: float) -> Point:
        """Point of the results from a step; ``before`` is the solution before it."""
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
        """Output with the largest amplitude at a step, among those that are compared."""
        outputs = self.recorder.outputs
        motion, _ = outputs.motion_along(step, self.request.system)
        among = compared(outputs.names)
        return outputs.names[among[int(amplitude(outputs.balance.harmonics, motion).value[among].argmax())]]


def special_points(request: CurveRequest) -> SpecialPoints | None:
    """Test functions for changes of the kind of motion; None where stability is not computed."""
    if request.stability is None:
        return None
    from slipstick.analysis.stability.special_points import SpecialPoints

    return SpecialPoints(request.stability, request.system)


def _reaction(step: Step, before: Step | None) -> Reaction | None:
    """Response to neglected harmonics, by the last Jacobian of a point or of the one after an interpolated point."""
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
    """Approximate motion of the contacts (N,) from time integration; None where that is not possible."""
    from slipstick.analysis.time_domain.transient import transient

    problem = request.problem
    if problem.support is not None:  # the mean forces do not determine the mean motion
        return None
    if request.parameter:
        problem = problem.at_parameter(request.parameter, request.start)
    try:
        motion = transient(problem, request.omega, periods=200, tolerance=1e-6)
    except InputError:  # no equations in time, or a law without a rate: this strategy fails too
        return None
    balance = request.balance
    compliance = balance.compliance(request.omega, request.inputs.structure, anchored=False)
    by_port = (motion.friction_coefficients, motion.normal_coefficients)
    forces = [dict(enumerate(F[batch.elements] for F in by_port)) for batch in balance.batches]
    return -balance.moved_by(forces, request.inputs.P, compliance)
