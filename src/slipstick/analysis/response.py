"""Forced response: branches of steady vibration over frequency or over any named parameter."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.analysis.events import Listener, PointFound, Started, Stopped
from slipstick.analysis.linear import linear_response
from slipstick.analysis.parts import BROKEN_OFF, Part, joined
from slipstick.analysis.peaks import peak_events
from slipstick.analysis.warming import Jump, WarmContinuation, jumps_text, relative_residual
from slipstick.balance.checks import range_faults, requested_faults, requested_values, two_numbers
from slipstick.balance.inputs import Inputs
from slipstick.balance.parameters import parameter_direction
from slipstick.balance.ports import Balance
from slipstick.balance.preflight import parameter_warnings, problem_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.balance.systems import FrequencySystem, ParameterSystem
from slipstick.errors import InputError, Outcome
from slipstick.faults import (
    frequency,
    listed,
    names,
    number,
    numbers,
    one,
    shown,
    suggestion,
    text,
    warn,
    whole,
    wrong,
)  # fmt: skip
from slipstick.results.branch import Branch, attributes_of, make_dataset
from slipstick.results.record import Point, Recorder
from slipstick.results.truncation import truncation_sentence
from slipstick.solve.continuation import ContinuationOptions, NewtonOptions, Step

Array = NDArray[np.float64]

PEAK_OUTPUTS = 3
"""Up to that many outputs, the peaks of all of them are located."""


def response_options(**given: Any) -> ContinuationOptions:
    """Options of a response curve: steps of at most 1/120 of the range, so that figures look smooth.

    Any field of ``ContinuationOptions`` can be given.
    """
    return ContinuationOptions(**({"first_step": 1 / 300, "max_step": 1 / 120, "event_tolerance": 1e-9} | given))


@dataclass(frozen=True, kw_only=True)
class _Task:
    """A branch to be followed: what varies, from where to where."""

    problem: Problem
    balance: Balance
    system: FrequencySystem | ParameterSystem
    inputs: Inputs
    omega: float
    """Frequency of the first point."""
    start: float
    stop: float
    parameter: str = ""
    requested: tuple[float, ...] = ()
    peaks_of: tuple[str, ...] = ()
    options: ContinuationOptions = field(default_factory=response_options)
    listeners: tuple[Listener, ...] = ()
    guess: Array | None = None
    warnings: Sequence[str] = ()
    """What looks wrong, said to the user and written on the results."""


def forced_response(
    problem: Problem,
    *,
    omega: tuple[float, float],
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[Listener] | Listener = (),
    guess: ArrayLike | None = None,
) -> Branch:
    """Follow the steady vibration over frequency.

    Parameters
    ----------
    problem
        What vibrates.
    omega
        First and last principal frequency, rad/s, in either order.
    requested
        Frequencies at which exact points are wanted, rad/s; one or a list.
    peaks_of
        Names of output dofs whose amplitude's local maxima are located; by default all of at most 3 outputs, else those
        that are loaded or, without such, of the first contact's tangential direction.
    options
        Step control; by default ``response_options()``. A dict of its fields will do: ``{"max_step": 0.01}``.
    listeners
        Called with every event (``slipstick.analysis.events``).
    guess
        Unknowns at the first frequency to try first, (n_ports, L): coefficients of the relative motion of the contacts,
        first all tangential, then all normal ones.

    Returns
    -------
    Branch
        With everything found, however it ended: look at ``outcome``. A KeyboardInterrupt ends it early.

    Raises
    ------
    InputError
        For a range, dof, frequency, option or guess that cannot be used.

    Warns
    -----
    SlipstickWarning
        For what looks wrong over that range, such as frequencies in Hz or a structure without damping; all that looks
        wrong, also in the problem itself, is in ``dataset.attrs["warnings"]``, one sentence a line. Also where the
        harmonics left out would add more than 1 % of the amplitude (``truncation`` in the dataset).

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> pair = ss.ContactPair(
    ...     name="damper", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0),
    ...     rubbing=ss.RubbingMotion(velocity=100.0))
    >>> problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=100.0)], harmonics=range(11))
    >>> branch = forced_response(problem, omega=(2.0, 15.0))
    >>> [(round(w, 2), round(a, 2)) for w, a in branch.peaks("x")]
    [(6.14, 18.25)]
    """
    task = _frequency_task(problem, omega, requested, peaks_of, options, listeners, guess)
    return _collect(task)


def follow(
    problem: Problem,
    *,
    omega: tuple[float, float],
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[Listener] | Listener = (),
    guess: ArrayLike | None = None,
) -> Generator[Point, None, tuple[Outcome, str]]:
    """The points behind ``forced_response``, one by one; the generator's value is the outcome and its message."""
    return (yield from _walk(_frequency_task(problem, omega, requested, peaks_of, options, listeners, guess)))


def parameter_response(
    problem: Problem,
    parameter: str,
    span: tuple[float, float],
    *,
    omega: float,
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[Listener] | Listener = (),
    guess: ArrayLike | None = None,
) -> Branch:
    """Follow the steady vibration at one frequency over a named parameter.

    Parameters
    ----------
    parameter
        Such as "damper.velocity", "damper.normal_load" (at fixed kn), "*.mu" (all contacts), "load", "friction".
    span
        First and last value.
    omega
        Principal frequency, rad/s.

    The other arguments, the result and the errors are those of ``forced_response``.
    """
    problem, requested = _problem(problem), requested_values(requested)
    parameter = text("parameter", parameter, 'a name such as "damper.mu"')
    span, omega = two_numbers(span, f"range of {parameter}"), frequency("omega", omega)
    faults = range_faults(*span, name=f"range of {parameter}", positive=False) or requested_faults(requested, *span)
    if faults:
        raise InputError(faults)
    for end in span:
        problem.at_parameter(parameter, end)
    balance = Balance(problem)
    base, direction = parameter_direction(problem, parameter)
    task = _Task(
        problem=problem, balance=balance, system=ParameterSystem(balance, base, direction, omega),
        inputs=base.moved(direction, span[0]), omega=omega, start=span[0], stop=span[1], parameter=parameter,
        warnings=parameter_warnings(problem, parameter, span, omega, balance.receptance.static),
        **_common(balance, requested, peaks_of, options, listeners, guess),
    )  # fmt: skip
    return _collect(task)


def _frequency_task(
    problem: Problem,
    omega: tuple[float, float],
    requested: Iterable[float] | float,
    peaks_of: Sequence[str] | str | None,
    options: ContinuationOptions | Mapping[str, Any] | None,
    listeners: Iterable[Listener] | Listener,
    guess: ArrayLike | None,
) -> _Task:
    problem, requested = _problem(problem), requested_values(requested)
    start, stop = two_numbers(omega, "frequency range")
    faults = range_faults(start, stop) or requested_faults(requested, start, stop)
    if faults:
        raise InputError(faults)
    balance, inputs = Balance(problem), problem.inputs
    balance.anchor_if_undamped(start)
    return _Task(
        problem=problem, balance=balance, system=FrequencySystem(balance, inputs), inputs=inputs, omega=start,
        start=start, stop=stop, warnings=problem_warnings(problem, (start, stop), balance.receptance.static),
        **_common(balance, requested, peaks_of, options, listeners, guess),
    )  # fmt: skip


def _problem(given: Any) -> Problem:
    problem = one("problem", given, Problem, "an ss.Problem")
    if not problem.contacts:
        raise InputError("there is no contact; the response is linear: use linear_response, or give a contact")
    return problem


def _common(
    balance: Balance,
    requested: tuple[float, ...],
    peaks_of: Sequence[str] | str | None,
    options: ContinuationOptions | Mapping[str, Any] | None,
    listeners: Iterable[Listener] | Listener,
    guess: ArrayLike | None,
) -> dict[str, Any]:
    return {
        "requested": requested,
        "peaks_of": _peak_dofs(balance.problem, peaks_of),
        "options": _options(options),
        "listeners": _listeners(listeners),
        "guess": None if guess is None else _guess(guess, balance),
    }


def _options(given: Any) -> ContinuationOptions:
    if given is None or isinstance(given, ContinuationOptions):
        return given or response_options()
    if not isinstance(given, Mapping):
        raise wrong("options", given, 'a dict such as {"max_step": 0.01}, or response_options(...)')
    known = [field.name for field in fields(ContinuationOptions)]
    faults = [
        f"options: there is no option {shown(name)}; {suggestion(name, known)}" for name in given if name not in known
    ]
    if faults:
        raise InputError(faults)
    return response_options(**{name: _option(name, value) for name, value in given.items()})


def _option(name: str, value: Any) -> Any:
    default, where = getattr(response_options(), name), f"options, {name}"
    if isinstance(default, NewtonOptions):
        return one(where, value, NewtonOptions, "NewtonOptions(...)")
    if isinstance(default, bool):
        return one(where, value, bool, "True or False")
    return whole(where, value, 1) if isinstance(default, int) else number(where, value, "a number > 0", above=0.0)


def _listeners(given: Any) -> tuple[Listener, ...]:
    if callable(given):
        return (given,)
    expected = "a function of one event, or a list of them"
    found = listed("listeners", given, expected)
    for listener in found:
        if not callable(listener):
            raise wrong("listeners", listener, expected)
    return found


def _guess(given: Any, balance: Balance) -> Array:
    guess = numbers("guess", given, f"{balance.size} finite numbers")
    if guess.shape not in ((balance.size,), (balance.n_ports, balance.L)):
        raise InputError(
            f"guess: found shape {guess.shape}; expected ({balance.n_ports}, {balance.L}): coefficients of the "
            "relative motion of the contacts, first all tangential, then all normal ones"
        )
    return guess.reshape(-1)


def _peak_dofs(problem: Problem, given: Sequence[str] | str | None) -> tuple[str, ...]:
    outputs = tuple(problem.outputs or ())
    if given is None:
        if len(outputs) <= PEAK_OUTPUTS:
            return outputs
        loaded = [load.dof for load in problem.loads if load.dof in outputs]
        first = [pair.direction(pair.contact.ports[0]) or {} for pair in problem.contacts[:1]]
        rubbed = [dof for direction in first for dof in direction if dof in outputs]
        return tuple(dict.fromkeys(str(dof) for dof in loaded or rubbed)) or outputs[:1]
    chosen = names("peaks_of", given)
    faults = [
        f"peaks_of: '{name}' is not among the outputs; {suggestion(name, outputs)}"
        for name in chosen
        if name not in outputs
    ]
    if faults:
        raise InputError(faults)
    return chosen


@cache
def _blas() -> Any:
    """Finding the BLAS libraries takes milliseconds: once a process."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _one_thread() -> AbstractContextManager[Any]:
    """Matrices of the balance are small: more BLAS threads only wait for each other."""
    limit: AbstractContextManager[Any] = _blas().limit(limits=1, user_api="blas")
    return limit


def _walk(task: _Task) -> Generator[Point, None, tuple[Outcome, str]]:
    """Points in order, part by part; tells the listeners. The generator's value is the outcome and its message."""
    begin, recorder = time.perf_counter(), Recorder(task.balance, parameter=task.parameter)
    outcome, message = Outcome.INTERRUPTED, ""
    work = dict.fromkeys(("evaluations", "linear_solves", "rejected_steps"), 0)
    jumps: list[Jump] = []
    parts = [Part(number=1, start=task.start, stop=task.stop)]
    task.problem.warn(task.warnings)
    attributes = attributes_of(task.problem, outcome, "", task.warnings, parameter=task.parameter)
    _tell(task, Started(start=task.start, stop=task.stop, recorder=recorder, attributes=attributes))
    try:
        yield from _follow_part(task, parts, recorder, jumps, work)
        if parts[0].outcome in BROKEN_OFF:
            parts.append(Part(number=2, start=task.stop, stop=task.start))
            yield from _follow_part(_from_other_end(task), parts, recorder, jumps, work)
        outcome, message = joined(parts, undamped=task.balance.springs is not None)
        message += jumps_text(jumps, task.balance.heated_names)
        message = _placed(task, outcome, message, parts)
        return outcome, message
    except KeyboardInterrupt:
        message = _placed(task, outcome, outcome.text, parts)
        return outcome, message
    finally:
        seconds, number = time.perf_counter() - begin, sum(part.points for part in parts)
        attributes = attributes_of(
            task.problem, outcome, message, task.warnings,
            parameter=task.parameter, parts=len(parts), **work, seconds=seconds,
        )  # fmt: skip
        _tell(task, Stopped(
            outcome=outcome, message=message or outcome.text, points=number, seconds=seconds, attributes=attributes
        ))  # fmt: skip


def _follow_part(
    task: _Task, parts: list[Part], recorder: Recorder, jumps: list[Jump], work: dict[str, int]
) -> Generator[Point, None, None]:
    """One continuation from an end of the range; a second one ends where it comes upon the end of the first."""
    part, sought = parts[-1], parts[0].last if len(parts) > 1 else None
    with _one_thread():
        x = _first(task)
    if x is None:
        part.outcome, part.message = Outcome.NO_FIRST_POINT, Outcome.NO_FIRST_POINT.text
        return
    run = WarmContinuation(
        task.system, x, task.start, task.stop, jumps=jumps,
        options=task.options, scaling=scales(task.balance, task.inputs, task.omega).arclength(),
        requested=(*task.requested, *((sought[0],) if sought else ())),
        events=peak_events(recorder.outputs, task.peaks_of, task.system),
    )  # fmt: skip
    try:
        while True:
            with _one_thread():
                step = next(run, None)
            if step is None:
                break
            point = _point(step, task, part)
            part.add(step.parameter, step.x)
            if task.listeners:
                _tell(task, PointFound(
                    number=sum(p.points for p in parts), point=point, progress=_progress(parts), step=run.step_length,
                    recorder=recorder,
                ))  # fmt: skip
            yield point
            if sought is not None and part.reaches(*sought):
                part.outcome, part.met = Outcome.COMPLETED, True
                return
        part.outcome, part.message = run.outcome or Outcome.INTERRUPTED, run.message
    finally:
        counts = (run.evaluations, run.solves, run.rejected)
        work.update({name: work[name] + count for name, count in zip(work, counts, strict=True)})


def _from_other_end(task: _Task) -> _Task:
    """The same range from its other end."""
    given = task.inputs
    if isinstance(task.system, ParameterSystem):
        given = task.system.base.moved(task.system.direction, task.stop)
    omega = task.omega if task.parameter else task.stop
    return replace(task, start=task.stop, stop=task.start, omega=omega, inputs=given, guess=None)


def _progress(parts: list[Part]) -> float:
    """Part of the range that is done; it falls where the branch turns back."""
    first, now = parts[0], parts[-1]
    assert now.last is not None
    done = abs(now.last[0] - now.start) + (abs(first.reach - first.start) if now is not first else 0.0)
    return min(1.0, done / abs(first.stop - first.start))


def _placed(task: _Task, outcome: Outcome, message: str, parts: list[Part]) -> str:
    """The message of a curve that stopped early, with the place of its last point; two parts tell it themselves."""
    if outcome.ok or len(parts) > 1:
        return message
    unit, last = f" ({task.parameter})" if task.parameter else " rad/s", parts[0].last
    if last is None:
        return f"{message}; no point was found at {task.start:.6g}{unit}"
    return f"{message}; the last of {parts[0].points} points is at {last[0]:.6g}{unit}"


def _tell(task: _Task, event: Any) -> None:
    for listener in task.listeners:
        listener(event)


def _first(task: _Task) -> Array | None:
    search = FirstPoint(
        task.balance, task.inputs, task.omega,
        guess=task.guess, report=lambda event: _tell(task, event), last_resort=lambda: _settled_in_time(task),
    )  # fmt: skip
    return search.find()


def _settled_in_time(task: _Task) -> Array | None:
    """Motion of the contacts (N,) that nature settles to from rest, roughly, by time integration."""
    from slipstick.analysis.transient import transient

    problem = task.problem.at_parameter(task.parameter, task.start) if task.parameter else task.problem
    found = transient(problem, task.omega, periods=200, tolerance=1e-6)
    compliance = task.balance.compliance(task.omega, anchored=False)
    by_port = (found.friction_coefficients, found.normal_coefficients)
    forces = [dict(enumerate(F[batch.elements] for F in by_port)) for batch in task.balance.batches]
    return -task.balance.moved_by(forces, task.inputs.P, compliance)


def _point(step: Step, task: _Task, part: Part) -> Point:
    value, kind = step.evaluation, step.kind
    if kind == "requested" and step.parameter not in task.requested:
        kind = "regular"
    return Point.at(
        value.detail, x=step.x, residual=relative_residual(step),
        iterations=step.iterations, kind=kind, parameter=step.parameter, part=part.number,
        peak_of=step.name if kind == "peak" else "",
    )  # fmt: skip


def _collect(task: _Task) -> Branch:
    points: list[Point] = []
    last: list[Stopped] = []

    def remember(event: Any) -> None:
        if isinstance(event, Stopped):
            last.append(event)

    task = replace(task, listeners=(*task.listeners, remember))
    points.extend(_walk(task))
    end = last[-1]
    recorder = Recorder(task.balance, parameter=task.parameter)
    values, followed = recorder.values(points), task.parameter or "omega"
    at, attributes = values["parameter" if task.parameter else "omega"], dict(end.attributes)
    if sentence := truncation_sentence(followed, at, values["truncation"]):
        warn([sentence])
        attributes["warnings"] = "\n".join([*task.warnings, sentence])
    return Branch(lambda: make_dataset(recorder, values, attributes), end.outcome, task.problem, end.message)


__all__ = ["follow", "forced_response", "linear_response", "parameter_response", "response_options"]
