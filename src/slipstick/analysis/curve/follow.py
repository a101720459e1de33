"""The walk along a branch, part by part: points in order, listeners told, temperatures watched."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.curve.keeping_up import kept_up
from slipstick.analysis.curve.observables import OutputObservables
from slipstick.analysis.curve.resume import Course
from slipstick.analysis.curve.segments import BROKEN_OFF, Part, joined
from slipstick.analysis.curve.task import Task, adapted_to
from slipstick.analysis.curve.thermal_continuation import FOLDS, NO_WORK, ThermalContinuation, jumps_text
from slipstick.analysis.curve.threads import undisturbed
from slipstick.analysis.events import Event, Listener, PointFound, Started, Stopped
from slipstick.analysis.peaks.events import Largest, peak_events
from slipstick.balance.ports import Balance
from slipstick.balance.residual import unanswered
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.errors import InputError, Outcome, TimeIsUp
from slipstick.faults import warn
from slipstick.interrupts import pass_on
from slipstick.results.afterwards import result_warnings
from slipstick.results.branch import Branch
from slipstick.results.record import Point, Recorder
from slipstick.results.schema import attributes_of, make_table, requested_attribute
from slipstick.results.stability import STATE_CHANGE
from slipstick.results.truncation import Reaction
from slipstick.solve.continuation import Step
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.stability.special_points import SpecialPoints

_KEPT = 5_000_000
"""Entries of one derivative of the points that wait to be recorded: a few hundred megabytes with all of them."""


_ORDINARY = ("regular", "interpolated", STATE_CHANGE)


Guard = Callable[[], AbstractContextManager[Any]]


def walk(
    task: Task, guard: Guard = undisturbed, ends: Listener | None = None
) -> Generator[Point, None, tuple[Outcome, str]]:
    """Points in order, part by part; tells the listeners. The generator's value is the outcome and its message.

    ``guard`` is entered while a point is sought, and left between points: not needed where it surrounds the whole walk.
    ``ends`` is told of the beginning and the end alone.
    """
    recorder = Recorder(task.balance, parameter=task.parameter, stability=task.stability is not None)
    course = Course.taken_up(task.start, task.stop, task.checkpoints)
    clock = time.perf_counter() - course.seconds
    outcome, message = Outcome.INTERRUPTED, ""
    task.problem.warn(task.warnings)
    attributes = attributes_of(task.problem, outcome, "", task.warnings, parameter=task.parameter)
    _tell(task, Started(start=task.start, stop=task.stop, recorder=recorder, attributes=attributes), ends)
    try:
        if len(course.parts) == 1:
            yield from _follow_part(task, course, recorder, clock, guard)
            if course.parts[0].outcome in BROKEN_OFF and task.departure is None:
                course.parts.append(Part(number=2, start=task.stop, stop=task.start))
        if len(course.parts) == 2:
            yield from _follow_part(_from_other_end(task), course, recorder, clock, guard)
        outcome, message = joined(course.parts, undamped=task.balance.springs is not None)
        message = _placed(task, outcome, message + jumps_text(course.jumps), course.parts)
        return outcome, message
    except KeyboardInterrupt as stop:
        outcome = stop.outcome if isinstance(stop, TimeIsUp) else Outcome.INTERRUPTED
        message = _placed(task, outcome, outcome.text, course.parts)
        return outcome, message
    finally:
        seconds, done = time.perf_counter() - clock, course.done
        attributes = attributes_of(
            task.problem, outcome, message, [*task.warnings, *recorder.besides.sentences],
            parameter=task.parameter, parts=len(course.parts),
            evaluations=done.evaluations, linear_solves=done.solves, rejected_steps=done.rejected, seconds=seconds,
            jacobian=task.balance.kind.name, peaks_of="\n".join(task.peaks_of),
            largest_of="\n".join(task.largest_of), **_accuracy(task), **requested_attribute(task.requested),
        )  # fmt: skip
        _tell(task, Stopped(
            outcome=outcome, message=message or outcome.text, points=course.points, seconds=seconds,
            attributes=attributes, error=course.parts[-1].error,
        ), ends)  # fmt: skip


def _accuracy(task: Task) -> dict[str, float]:
    asked = adapted_to(task.options)
    return {} if asked is None else {"adapt_harmonics": asked}


def _follow_part(
    task: Task, course: Course, recorder: Recorder, clock: float, guard: Guard
) -> Generator[Point, None, None]:
    """One continuation from an end of the range; a second one ends where it comes upon the end of the first."""
    part, sought = course.parts[-1], course.parts[0].last if len(course.parts) > 1 else None
    special = _special_points(task)
    with guard():
        run = _run(task, course, recorder, sought, special)
    if run is None:
        part.outcome, part.message = Outcome.NO_FIRST_POINT, Outcome.NO_FIRST_POINT.text
        return
    before = run.standing
    try:
        while not (sought is not None and part.reaches(*sought)):
            with guard():
                step = next(run, None)
            if step is None:
                part.outcome, part.message, part.error = run.outcome or Outcome.INTERRUPTED, run.message, run.error
                return
            point = _point(step, task, part, run.residual, recorder, special, before)
            before = before if step.place is not None else step
            part.add(step.parameter, step.x)
            if task.listeners:
                checkpoint = course.checkpoint(step, run, time.perf_counter() - clock)
                found = PointFound(
                    number=course.points, point=point, progress=_progress(course.parts), step=run.step_length,
                    recorder=recorder, checkpoint=checkpoint,
                )  # fmt: skip
                with guard():
                    _tell(task, found)
            pass_on()
            yield point
        part.outcome, part.met = Outcome.COMPLETED, True
    finally:
        course.done = course.done.plus(run.work)


def _special_points(task: Task) -> SpecialPoints | None:
    """Test functions of the kinds of motion, where stability is asked for."""
    if task.stability is None:
        return None
    from slipstick.analysis.stability.special_points import SpecialPoints

    return SpecialPoints(task.stability, task.system)


def _run(
    task: Task, course: Course, recorder: Recorder, sought: tuple[float, Array] | None, special: SpecialPoints | None
) -> ThermalContinuation | None:
    """The continuation of a part, from its first point or from where it was interrupted; None without a first point."""
    places, course.places = course.places, ()
    earlier, course.earlier = course.earlier, NO_WORK
    from_inside = task.departure
    if from_inside is not None and not places:
        x: Array | None = from_inside.x
        inside: dict[str, Any] = {"at": from_inside.at, "direction": from_inside.direction}
    else:
        x, inside = places[-1].state[:-1] if places else _first(task), {}
    if x is None:
        return None
    own = from_inside.events if from_inside is not None else ()
    run = ThermalContinuation(
        task.system, x, task.start, task.stop, jumps=course.jumps, places=places, earlier=earlier,
        each=(special is not None and special.every) or adapted_to(task.options) is not None,
        options=task.options, scaling=scales(task.balance, task.inputs, task.omega).arclength(),
        requested=(*task.requested, *((sought[0],) if sought else ())),
        events=(
            *own,
            *kept_up(recorder.besides, "the place of peaks", peak_events(recorder.outputs, task.peaks_of, task.system)),
            *kept_up(recorder.besides, "where stability changes", special.events if special else ()),
        ),
        observables=OutputObservables(recorder.outputs, task.system),
        watched=Largest(recorder.outputs, task.largest_of, task.system, recorder.besides) if task.largest_of else None,
        **inside,
    )  # fmt: skip
    if special is not None and run.standing is not None:
        special.take_up(run.standing, places[-1].values[-1])
    return run


def _from_other_end(task: Task) -> Task:
    """The same range from its other end."""
    given, omega = task.system.at(task.stop)
    return replace(task, start=task.stop, stop=task.start, omega=omega, inputs=given, guess=None)


def _progress(parts: list[Part]) -> float:
    """Part of the range that is done; it falls where the branch turns back."""
    first, now = parts[0], parts[-1]
    assert now.last is not None
    done = abs(now.last[0] - now.start) + (abs(first.reach - first.start) if now is not first else 0.0)
    return min(1.0, done / abs(first.stop - first.start))


def _placed(task: Task, outcome: Outcome, message: str, parts: list[Part]) -> str:
    """The message of a curve that stopped early, with the place of its last point; two parts tell it themselves."""
    if outcome.ok or len(parts) > 1:
        return message
    unit, last = f" ({task.parameter})" if task.parameter else f" {task.problem.units.angular}", parts[0].last
    if last is None:
        return f"{message}; no point was found at {task.start:.6g}{unit}"
    return f"{message}; the last of {parts[0].points} points is at {last[0]:.6g}{unit}"


def _tell(task: Task, event: Event, besides: Listener | None = None) -> None:
    for listener in (*task.listeners, *([] if besides is None else [besides])):
        listener(event)


def _first(task: Task) -> Array | None:
    search = FirstPoint(
        task.balance, task.inputs, task.omega,
        guess=task.guess, report=lambda event: _tell(task, event), last_resort=lambda: _settled_in_time(task),
    )  # fmt: skip
    return search.find()


def _settled_in_time(task: Task) -> Array | None:
    """Motion of the contacts (N,) that nature settles to from rest, roughly, by time integration; None without it."""
    from slipstick.analysis.time_domain.transient import transient

    problem = task.problem.at_parameter(task.parameter, task.start) if task.parameter else task.problem
    try:
        found = transient(problem, task.omega, periods=200, tolerance=1e-6)
    except InputError:  # no equations in time, or a law that is not known there: one more way that failed
        return None
    compliance = task.balance.compliance(task.omega, task.inputs.structure, anchored=False)
    by_port = (found.friction_coefficients, found.normal_coefficients)
    forces = [dict(enumerate(F[batch.elements] for F in by_port)) for batch in task.balance.batches]
    return -task.balance.moved_by(forces, task.inputs.P, compliance)


def _point(
    step: Step,
    task: Task,
    part: Part,
    residual: float,
    recorder: Recorder,
    special: SpecialPoints | None,
    before: Step | None,
) -> Point:
    kind = step.kind
    if kind == "requested" and step.parameter not in task.requested:
        kind = "regular"
    take = recorder.besides.take
    if special is not None and not take("stability", partial(special.confirmed, step), False):
        kind = "regular"
    detail = step.evaluation.detail if step.evaluation else unanswered(*task.system.at(step.parameter))
    return Point.at(
        detail, x=step.x, residual=residual,
        iterations=step.iterations, kind=kind, parameter=step.parameter, part=part.number,
        peak_of=step.name if kind == "peak" else "",
        stability=special and take("stability", partial(special.judged, step, compare=kind not in _ORDINARY), None),
        reaction=_reaction(step, before),
    )  # fmt: skip


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


def _in_slices(points: Iterable[Point], balance: Balance) -> Iterator[list[Point]]:
    """Points in lists that are recorded together: their derivatives are let go with them. At least one list."""
    entries = balance.n_contacts * balance.L**2
    if balance.kind.name == "dense":
        entries = max(entries, balance.size**2)  # the factors of the Jacobian wait too
    most, waiting, first = max(1, _KEPT // entries), [], True
    for point in points:
        waiting.append(point)
        if len(waiting) == most:
            yield waiting
            waiting, first = [], False
    if waiting or first:
        yield waiting


def collect(task: Task) -> Branch:
    """The branch of a task."""
    told: dict[type, Any] = {}
    with undisturbed():
        found = _in_slices(walk(task, nullcontext, lambda event: told.update({type(event): event})), task.balance)
        slices = [told[Started].recorder.values(points) for points in found]
    recorder, end = told[Started].recorder, told[Stopped]
    attributes = dict(end.attributes)
    values = {name: np.concatenate([part[name] for part in slices]) for name in recorder.layout.variables}
    problem, followed = task.problem, task.parameter or "omega"
    asked = adapted_to(task.options)
    wrong = partial(result_warnings, followed, values, problem.elements, problem.units.angular, asked, task.requested)
    if sentences := recorder.besides.said(wrong):
        warn(sentences)
        attributes["warnings"] = "\n".join([*task.warnings, *sentences])
    return Branch(make_table(recorder.layout, values, attributes), end.outcome, task.problem, end.message)
