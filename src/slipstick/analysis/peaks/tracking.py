"""Tracking a peak of the response over a parameter, without the response curves between."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from numbers import Real as Number
from typing import Any, ClassVar, NamedTuple

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest
from slipstick.analysis.peaks.continuation import NEWTON, OPTIMUM, PeakContinuation, PeakPoint
from slipstick.analysis.peaks.system import Extreme, PeakSystem, StateSpace
from slipstick.analysis.road.checkpoint import Checkpoint, undamaged, vector
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import Checks, Request
from slipstick.analysis.road.run import Run, Work, counted, stopped_too
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.parameters import parameter_path
from slipstick.balance.physics_checks import parameter_warnings
from slipstick.balance.problem import Problem
from slipstick.branch import Branch
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import number, old_names, shown, suggestion, text
from slipstick.interrupts import held, pass_on
from slipstick.results.record import Outputs, Point
from slipstick.typing import Array, FrequencyRange, Real

TRACKING = {"first_step": 0.04, "max_step": 0.1, "event_tolerance": 1e-8, "newton": NEWTON}
"""Default options of a tracked peak: steps of at most a tenth of the range."""
_HIGHER = 1e-5
"""Relative difference from which a peak is higher than another; curves locate theirs to a tenth of that."""


@old_names(requested="at")
def track_peak(
    problem: Problem,
    parameter: str,
    span: tuple[Real, Real],
    *,
    omega: FrequencyRange,
    at: Iterable[Real] | Real = (),
    dof: str | None = None,
    options: Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> Branch:
    """Follow a peak of the response over a parameter: where it is and how high, without the curves between.

    Parameters
    ----------
    problem
        What vibrates.
    parameter, span
        As of ``parameter_response``: a name such as "damper.normal_load", its first and last value.
    omega
        Range of frequencies, rad/s: the highest peak in it, at the first value of the parameter, is followed. It may
        leave the range.
    at
        Values of the parameter at which exact points are wanted; one or a list.
    dof
        Name of the output whose amplitude peaks; by default the first.
    options
        Step control, as of ``forced_response``; steps are at most a tenth of the range by default.
    listeners
        Functions, or subclasses of ``slipstick.analysis.events.Listener``, told of each point and, where it takes long,
        of what is done: ``listeners=ss.Progress()``.

    Returns
    -------
    Branch
        Peaks, one a point: ``omega``, ``amplitude`` and all else over ``parameter``. ``kind`` is "optimum" where the
        peak is highest or lowest over the parameter, "turning point" where it merges with a minimum of the curve (the
        points beyond, with ``peak_dof`` -1, are minima), "tie" where another extreme of the period becomes as large
        (the peak ends there, and the one that the curve rises to is followed on), "corner" where it sits on a change of
        state, or ends on one. ``branch_part`` is one more where another peak is followed on. Look at ``outcome``;
        ``message`` says what happened on the way. At optima and at the last point a whole curve tells whether another
        peak in the range is higher.

    Raises
    ------
    InputError
        For a parameter, range, dof or option that cannot be used.

    Warns
    -----
    SlipstickWarning
        As ``parameter_response``, and where another peak is higher.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))
    >>> locus = track_peak(problem, "damper.normal_load", (300.0, 800.0), omega=(2.0, 15.0))
    >>> best = locus.dataset.isel(point=locus.dataset.kind == "optimum")
    >>> round(float(best.parameter[0]), 4), round(float(best.omega[0]), 5), round(float(best.amplitude[0, 0]), 6)
    (471.6962, 9.50476, 2.803733)
    """
    request = tracked_peak(problem, parameter, span, omega, at, dof, options, listeners)
    return Branch.of(request.solutions())


def tracked_peak(
    problem: Any, parameter: Any, span: Any, omega: Any, at: Any, dof: Any, options: Any, listeners: Any = ()
) -> TrackedPeak:
    """Request of ``track_peak``; its arguments, checked.

    A ``span`` that is one value, or None for the value of the problem, becomes a range from there.

    Raises
    ------
    InputError
        With all faults.
    """
    checks = Checks(problem)
    name = checks.name(parameter)
    if checks.problem is not None and name:
        checks.takes(name, None)
        checks.end()
        span = _start(checks.problem, name, span) if span is None or isinstance(span, Number) else span
    ends, points = checks.range(span, at, name)
    sought, _ = checks.frequencies(omega)
    checks.takes(name, ends)
    output = checks.take(one_dof, checks.problem, dof) if checks.problem is not None and name else None
    chosen = {**TRACKING, **options} if isinstance(options, Mapping) else TRACKING if options is None else options
    if isinstance(chosen, Mapping) and chosen.get("adapt_harmonics") is not None:
        with_all = Fault("options, adapt_harmonics", "a peak is tracked with all harmonics", remedy="leave it out")
        checks.faults.append(with_all)
    common = checks.common(points, options=chosen, listeners=listeners)
    assert checks.problem is not None
    assert ends is not None
    assert sought is not None
    assert output is not None
    balance = common["balance"]
    return TrackedPeak(
        problem=checks.problem, balance=balance, parameter=name, start=ends[0], stop=ends[1], omega=sought, dof=output,
        requested=points, options=common["options"], listeners=common["listeners"],
        warnings=parameter_warnings(checks.problem, name, ends, sought[0], balance.receptance.static),
    )  # fmt: skip


def _start(problem: Problem, name: str, start: Any) -> tuple[float, float]:
    """A range that starts at a value, or at that of the problem."""
    value = problem.parameter(name) if start is None else number("start", start)
    if value == 0.0:
        raise InputError(Fault("start", f"{name} is 0, round which nothing is sought", remedy="give another start"))
    return value, 2.0 * value


def one_dof(problem: Problem, dof: Any) -> str:
    """Name of an output, by default the first; raises InputError for an unknown one."""
    known = tuple(problem.outputs or ())
    if dof is None and known:
        return known[0]
    name = text("dof", dof, 'the name of an output such as "x"')
    if name not in known:
        raise InputError(f"dof: there is no output {shown(name)}; {suggestion(name, known)}")
    return name


@dataclass(frozen=True, kw_only=True)
class TrackedPeak(Request):
    """A request to follow a peak of the amplitude at ``dof`` that lies between the frequencies ``omega``."""

    analysis: ClassVar[str] = "track"
    omega: tuple[float, float]
    dof: str

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Checkpoint of ``PeakContinuation.checkpoint``, from its journal."""
        with undamaged():
            point, own = Checkpoint.from_plain(plain, size=self.balance.size + 2), dict(plain)
            given = None if own["given"] is None else np.asarray(own["given"], dtype=float)
            if given is not None and given.ndim != 1:
                raise ValueError
            numbers = {name: float(own[name]) for name in ("at", "residual", "side", "reach", "length")}
            counts = {name: int(own[name]) for name in ("iterations", "runs", "factorisations")}
            return replace(point, own={
                **numbers, **counts, "y": vector(own["y"], self.balance.size + 1), "given": given,
                "kind": str(own["kind"]), "reason": str(own["reason"]), "notes": list(map(str, own["notes"])),
                "begun": bool(own["begun"]), "work": Work._make(map(int, own["work"])),
                "doubts": list(map(str, own["doubts"])), "curves": int(own["curves"]),
            })  # fmt: skip

    def run(self) -> PeakRun:
        """The run that follows the peak."""
        return PeakRun(self)

    def highest(self, system: PeakSystem, value: float) -> Highest | None:
        """The highest peak at a value of the parameter."""
        return highest_peak(system.space, value, self.omega, self.dof)


class PeakRun(Run[TrackedPeak]):
    """Run that follows a peak.

    Attributes
    ----------
    system
        Equations of the peaks of the output over the parameter.
    curves
        Number of whole curves computed, for the highest peak at a value.
    """

    def __init__(self, request: TrackedPeak) -> None:
        super().__init__(request)
        self.curves = 0
        balance = request.balance
        balance.anchor_if_undamped(request.omega[0])
        path = parameter_path(request.problem, request.parameter)
        self.system = PeakSystem(StateSpace(Outputs(balance, (request.dof,)), request.problem.inputs, path))
        self._peaks = self.continuation(request.start, request.stop)

    def continuation(self, start: float, stop: float) -> PeakContinuation:
        """The continuation of the peak between two values of the parameter."""
        request = self.request
        bounds = min(request.omega), max(request.omega)
        return PeakContinuation(self.system, (start, stop), bounds, request.options, request.requested)

    def points(self) -> Generator[Point, None, None]:
        """Points from the highest peak at the first value."""
        peaks, request = self._peaks, self.request
        if request.checkpoints:
            own = request.checkpoints[-1].own
            self.doubts, self.curves = list(own["doubts"]), own["curves"]
            found = peaks.resumed(request.checkpoints[-1])
        else:
            first = self.highest(request.start)
            if first is None:
                self.outcome, self.message = Outcome.NO_FIRST_POINT, self.none_found
                return
            found = peaks.points(first.y)
        for peak in found:
            if peak.kind in (OPTIMUM, "end"):
                self.doubt(peak)
            point = peaks.checkpoint(self.seconds)
            self.checkpoint = replace(point, own={**point.own, "doubts": list(self.doubts), "curves": self.curves})
            self.progress = min(1.0, abs((peak.parameter - request.start) / (request.stop - request.start)))
            yield self.point(peak)
            pass_on()
        if peaks.last is not None and peaks.last.kind not in (OPTIMUM, "end"):
            self.doubt(peaks.last)
        self.outcome, self.message = peaks.outcome or Outcome.INTERRUPTED, peaks.message

    def highest(self, value: float) -> Highest | None:
        """The highest peak at a value of the parameter, by a whole curve."""
        self.doing = f"looking for the highest peak at {self.request.parameter} = {value:g}"
        self.curves += 1
        found, self.doing = self.request.highest(self.system, value), ""
        return found

    def higher(self, peak: PeakPoint) -> Highest | None:
        """The highest peak at the value of a peak, where it is another one that is higher."""
        found = self.highest(peak.parameter)
        if found is None or found.amplitude <= (1.0 + _HIGHER) * peak.detail.amplitude:
            return None
        return found

    def doubt(self, peak: PeakPoint) -> None:
        """Warn where another peak is higher than the one followed; beyond a fold there is none to compare."""
        other = self.higher(peak) if peak.detail.bend < 0.0 else None
        if other is not None:
            request = self.request
            unit = request.problem.units.angular
            self.doubts.append(
                f"at {request.parameter} = {peak.parameter:.6g} another peak of {request.dof} is higher than the one "
                f"followed: {other.amplitude:.6g} at {other.omega:.6g} {unit}, against {peak.detail.amplitude:.6g} at "
                f"{peak.detail.omega:.6g} {unit}; follow the peak from there to see it"
            )

    def point(self, peak: PeakPoint) -> Point:
        """Point of the results; beyond a fold it is a minimum of the response curve, and a peak of no output."""
        return Point.at(
            peak.detail, x=peak.y[:-1], residual=peak.residual, iterations=peak.iterations, kind=peak.kind,
            parameter=peak.parameter, part=peak.part, peak_of=self.request.dof if peak.detail.bend < 0.0 else "",
        )  # fmt: skip

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Output and work."""
        return {
            "peak_of": self.request.dof, **counted(self._peaks.work), "factorisations": self.system.factorisations,
            "curves": self.curves,
        }  # fmt: skip

    @property
    def none_found(self) -> str:
        """Message where there is no peak."""
        request = self.request
        where = " to ".join(f"{w:g}" for w in request.omega)
        none = f"no peak of {request.dof} was found from {where} {request.problem.units.angular}"
        return f"{none} at {request.parameter} = {request.start:g}"


class Highest(NamedTuple):
    """The highest peak of a response curve."""

    y: Array
    """Unknowns and frequency, (N + 1,)."""
    amplitude: float

    @property
    def omega(self) -> float:
        """Its frequency, rad/s."""
        return float(self.y[-1])


def highest_peak(space: StateSpace, value: float, omega: tuple[float, float], dof: str) -> Highest | None:
    """The highest peak of the curve at a value of the parameter."""
    balance, inputs = space.outputs.balance, space.at_value(value)
    run = CurveRequest(
        problem=balance.problem, balance=balance, system=FrequencySystem(balance, inputs), inputs=inputs,
        omega=omega[0], start=omega[0], stop=omega[1], peaks_of=(dof,),
    ).run()  # fmt: skip
    highest: Highest | None = None
    for point in run.follow(guard=held):
        if point.kind == "peak":
            here = space.at(point.x, point.omega, value, point.detail.carried)
            size = Extreme.largest(balance.harmonics, here.motion()[0]).value
            if highest is None or size > highest.amplitude:
                highest = Highest(np.append(point.x, point.omega), size)
    stopped_too(run.outcome)
    return highest
