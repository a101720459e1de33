"""Where a peak goes over a parameter, without the curves between."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Any

import numpy as np

from slipstick.analysis.curve.follow import walk
from slipstick.analysis.curve.request import common_arguments, followed_problem
from slipstick.analysis.curve.task import Task
from slipstick.analysis.curve.threads import one_thread
from slipstick.analysis.peaks.continuation import NEWTON, PeakContinuation, PeakPoint
from slipstick.analysis.peaks.gradient import Extreme, StateSpace
from slipstick.analysis.peaks.system import PeakSystem
from slipstick.balance.checks import range_faults, requested_faults, requested_values, two_numbers
from slipstick.balance.parameters import parameter_path
from slipstick.balance.ports import Balance
from slipstick.balance.preflight import parameter_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.systems import FrequencySystem
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import Gathering, number, shown, suggestion, text, warn
from slipstick.interrupts import held
from slipstick.results.afterwards import result_warnings
from slipstick.results.branch import Branch
from slipstick.results.record import Outputs, Point, Recorder
from slipstick.results.schema import attributes_of, make_table, requested_attribute
from slipstick.solve.continuation import ContinuationOptions
from slipstick.solve.continuation.path import failed
from slipstick.typing import Array

TRACKING = {"first_step": 0.04, "max_step": 0.1, "event_tolerance": 1e-8, "newton": NEWTON}
"""Options of a locus where nothing else is said: steps of a tenth of the range."""


def track_peak(
    problem: Problem,
    parameter: str,
    span: tuple[float, float],
    *,
    omega: tuple[float, float],
    dof: str | None = None,
    requested: Iterable[float] | float = (),
    options: Mapping[str, Any] | None = None,
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
    dof
        Name of the output whose amplitude peaks; by default the first.
    requested
        Values of the parameter at which exact points are wanted; one or a list.
    options
        Step control, as of ``forced_response``; steps are at most a tenth of the range by default.

    Returns
    -------
    Branch
        Points of the locus: ``omega``, ``amplitude`` and all else over ``parameter``. ``kind`` is "optimum" where the
        peak is highest or lowest over the parameter, "turning point" where it merges with a minimum of the curve (the
        points beyond, with ``peak_dof`` -1, are minima), "tie" where another extreme of the period becomes as large
        (the peak ends there, and the one that the curve rises to is followed on), "corner" where it sits on a change of
        state. Look at ``outcome``; ``message`` tells what happened on the way.

    Raises
    ------
    InputError
        For a parameter, range, dof or option that cannot be used.

    Warns
    -----
    SlipstickWarning
        As ``parameter_response``.

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
    request = tracked_peak(problem, parameter, span, omega, dof, requested, options)
    with one_thread():
        return request.branch()


def tracked_peak(
    problem: Any, parameter: Any, span: Any, omega: Any, dof: Any, requested: Any, options: Any
) -> TrackedPeak:
    """What is asked for, checked; of a ``span`` that is one value, or None for that of the problem, its vicinity.

    Raises
    ------
    InputError
        With all faults.
    """
    found = Gathering()
    checked = found.take(followed_problem, problem)
    name = found.take(text, "parameter", parameter, 'a name such as "damper.mu"') or ""
    points = found.take(requested_values, requested) or ()
    if checked is not None and name:
        found.take(parameter_path, checked, name)
        found.end()
        span = _start(checked, name, span) if span is None or isinstance(span, Real) else span
    ends = found.take(two_numbers, span, f"range of {name}" if name else "range")
    sought = found.take(two_numbers, omega, "frequency range")
    if ends is not None:
        found.faults += range_faults(*ends, name=f"range of {name}", positive=False) or requested_faults(points, *ends)
    if sought is not None:
        found.faults += range_faults(*sought, name="frequency range", positive=True)
    if checked is not None and name:
        found.take(_takes, checked, name, ends)
        found.take(one_dof, checked, dof)
    given = {**TRACKING, **options} if isinstance(options, Mapping) else TRACKING if options is None else options
    if isinstance(given, Mapping) and given.get("adapt_harmonics") is not None:
        with_all = Fault("options, adapt_harmonics", "a peak is tracked with all harmonics", remedy="leave it out")
        found.faults.append(with_all)
    common = found.take(common_arguments, checked, points, None, given)
    found.end()
    assert checked is not None
    assert ends is not None
    assert sought is not None
    assert common is not None
    return TrackedPeak(
        problem=checked, balance=common["balance"], parameter=name, span=ends, omega=sought,
        dof=one_dof(checked, dof), requested=points, options=common["options"],
    )  # fmt: skip


def _start(problem: Problem, name: str, given: Any) -> tuple[float, float]:
    """A value to begin at, and another beyond."""
    value = problem.parameter(name) if given is None else number("start", given)
    if value == 0.0:
        raise InputError(Fault("start", f"{name} is 0, round which nothing is sought", remedy="give another start"))
    return value, 2.0 * value


def _takes(problem: Problem, parameter: str, span: tuple[float, float] | None) -> None:
    parameter_path(problem, parameter)
    for end in span or ():
        problem.at_parameter(parameter, end)


def one_dof(problem: Problem, given: Any) -> str:
    """The output asked for, by default the first; InputError where there is none of that name."""
    known = tuple(problem.outputs or ())
    if given is None and known:
        return known[0]
    name = text("dof", given, 'the name of an output such as "x"')
    if name not in known:
        raise InputError(f"dof: there is no output {shown(name)}; {suggestion(name, known)}")
    return name


@dataclass(frozen=True, kw_only=True)
class TrackedPeak:
    """A peak to be followed."""

    problem: Problem
    balance: Balance
    parameter: str
    span: tuple[float, float]
    omega: tuple[float, float]
    dof: str
    requested: tuple[float, ...]
    options: ContinuationOptions

    def branch(self) -> Branch:
        """The locus as a branch."""
        clock, warnings, system = time.perf_counter(), self.warned(), self.system()
        locus, found = self.locus(system, self.span), list[PeakPoint]()
        try:
            first = self.first(system)
            if first is None:
                locus.outcome, locus.message = Outcome.NO_FIRST_POINT, self.none_found
            else:
                found.extend(locus.points(first))
        except KeyboardInterrupt:
            locus.outcome, locus.message = Outcome.INTERRUPTED, Outcome.INTERRUPTED.text
        except Exception as error:
            if not found:
                raise
            locus.outcome, locus.message = failed(error)
        work = locus.work
        return self.recorded(
            found, locus.outcome or Outcome.INTERRUPTED, locus.message, warnings,
            evaluations=work.evaluations, linear_solves=work.solves, rejected_steps=work.rejected,
            factorisations=system.factorisations, seconds=time.perf_counter() - clock,
        )  # fmt: skip

    def warned(self) -> Sequence[str]:
        """What looks wrong, said."""
        static = self.balance.receptance.static
        warnings = parameter_warnings(self.problem, self.parameter, self.span, self.omega[0], static)
        self.problem.warn(warnings)
        return warnings

    def system(self) -> PeakSystem:
        """The peaks of the output over the parameter."""
        self.balance.anchor_if_undamped(self.omega[0])
        outputs = Outputs(self.balance, (self.dof,))
        return PeakSystem(StateSpace(outputs, self.problem.inputs, parameter_path(self.problem, self.parameter)))

    def locus(self, system: PeakSystem, span: tuple[float, float]) -> PeakContinuation:
        """The locus, to be followed."""
        return PeakContinuation(system, span, (min(self.omega), max(self.omega)), self.options, self.requested)

    def first(self, system: PeakSystem) -> Array | None:
        """The highest peak at the first value, (N + 1,)."""
        return highest_peak(system.space, self.span[0], self.omega, self.dof)

    @property
    def none_found(self) -> str:
        """What is said where there is none."""
        where = " to ".join(f"{w:g}" for w in self.omega)
        none = f"no peak of {self.dof} was found from {where} {self.problem.units.angular}"
        return f"{none} at {self.parameter} = {self.span[0]:g}"

    def recorded(
        self, found: Sequence[PeakPoint], outcome: Outcome, message: str, warnings: Sequence[str], **work: Any
    ) -> Branch:
        """Points as a branch."""
        recorder, problem = Recorder(self.balance, parameter=self.parameter), self.problem
        points = [
            Point.at(
                p.detail, x=p.y[:-1], residual=p.residual, iterations=p.iterations, kind=p.kind, parameter=p.parameter,
                peak_of=self.dof if p.detail.bend < 0.0 else "",
            )
            for p in found
        ]  # fmt: skip
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
            problem, outcome, message, warnings, parameter=self.parameter, peak_of=self.dof,
            jacobian=self.balance.kind.name, **requested_attribute(self.requested), **work,
        )  # fmt: skip
        return Branch(make_table(recorder.layout, values, attributes), outcome, problem, message)


def highest_peak(space: StateSpace, value: float, omega: tuple[float, float], dof: str) -> Array | None:
    """Unknowns and frequency (N + 1,) of the highest peak of the curve at a value of the parameter."""
    balance, inputs = space.outputs.balance, space.at_value(value)
    task = Task(
        problem=balance.problem, balance=balance, system=FrequencySystem(balance, inputs), inputs=inputs,
        omega=omega[0], start=omega[0], stop=omega[1], peaks_of=(dof,),
    )  # fmt: skip
    best: tuple[float, Array] | None = None
    for point in walk(task, held):
        if point.kind == "peak":
            heat = point.detail.heat
            here = space.at(point.x, point.omega, value, None if heat is None else heat.temperature)
            size = Extreme.largest(balance.harmonics, here.motion()[0]).value
            if best is None or size > best[0]:
                best = size, np.append(point.x, point.omega)
    return None if best is None else best[1]
