"""Pseudo-arclength continuation of ``residual(x, parameter) = 0`` as an iterator of points.

H. B. Keller's bordered system (Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977) with a
cubic Hermite predictor through the last two points and a scaled arclength.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import InputError, Outcome
from slipstick.solve.arc import Arc, ArclengthScaling, Metric
from slipstick.solve.corrector import Corrector, Step, angle
from slipstick.solve.events import Event, turning_points
from slipstick.solve.locate import Locator
from slipstick.solve.newton import SINGULAR_JACOBIAN, Evaluation, NewtonOptions, NewtonResult, System
from slipstick.solve.stepsize import StepOptions, next_step
from slipstick.typing import Array

__all__ = [
    "ArclengthScaling",
    "Continuation",
    "ContinuationOptions",
    "Evaluation",
    "Event",
    "NewtonOptions",
    "Step",
    "System",
    "continuation",
]


_STRAIGHT = 0.7
_KINK_SHARE = 0.25
_KINK_CORRECTION = 5.0


def _corrector_options() -> NewtonOptions:
    return NewtonOptions(max_iterations=12, min_damping=0.1, non_monotone=1)


@dataclass(frozen=True, kw_only=True)
class ContinuationOptions(StepOptions):
    """Options of a continuation: those of the step control and these.

    Parameters
    ----------
    max_points
        Largest number of points, located ones not counted.
    newton
        Options of the corrector.
    locate_turning_points
        Whether turning points of the parameter are located and yielded.
    event_tolerance
        Scaled arclength to which events are located: relative to the parameter range, or better.
    """

    max_points: int = 5000
    newton: NewtonOptions = field(default_factory=_corrector_options)
    locate_turning_points: bool = True
    event_tolerance: float = 1e-10


def continuation(
    system: System,
    x0: ArrayLike,
    start: float,
    stop: float,
    *,
    options: ContinuationOptions | None = None,
    scaling: ArclengthScaling | None = None,
    events: Sequence[Event] = (),
    requested: Sequence[float] = (),
    at: float | None = None,
    direction: ArrayLike | None = None,
    context: Any = None,
) -> Continuation:
    """Follow the branch through ``x0`` from ``start`` to ``stop``.

    Parameters
    ----------
    system
        Anything with ``evaluate(x, parameter) -> Evaluation``.
    x0
        A solution at ``start`` or a guess near one (N,): it is first corrected at the fixed parameter.
    start, stop
        Range of the parameter, in either order. The branch may turn back inside; it ends exactly on ``stop``, or on
        ``start`` when it comes back there (outcome TURNED_BACK).
    events
        Sign changes to locate.
    requested
        Parameter values within the range at which a point is wanted; every passage (also on overhanging branches)
        gives one. The two ends are points anyway.
    at, direction
        To take up a branch inside the range: ``x0`` belongs to the parameter ``at``, and the branch is followed along
        ``direction`` (N + 1,), the ``tangent`` of an earlier step there. Default: from ``start`` towards ``stop``.
    context
        What the point before handed on, see ``System``; None for a start from nothing.

    Returns
    -------
    Continuation
        An iterator of ``Step``; afterwards its ``outcome``, ``message`` and work counters say how it ended (the
        outcome is also the value of the last ``StopIteration``, so of ``yield from``).

    Raises
    ------
    InputError
        For a range, guess or request that cannot be followed, before anything is computed.

    Examples
    --------
    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> class Line:
    ...     def evaluate(self, x, p):
    ...         return Evaluation(x - p, DenseJacobian(np.eye(1)), -np.ones(1))
    >>> run = continuation(Line(), [0.0], 0.0, 1.0)
    >>> steps = list(run)
    >>> steps[-1].kind, steps[-1].parameter, run.outcome.name
    ('end', 1.0, 'COMPLETED')
    """
    _check(np.asarray(x0, dtype=float), start, stop, np.asarray(requested, dtype=float), at, direction)
    return Continuation(
        system,
        np.array(x0, dtype=float),
        (float(start), float(stop)),
        options=options or ContinuationOptions(),
        scaling=scaling or ArclengthScaling(),
        events=events,
        requested=np.unique(np.asarray(requested, dtype=float)),
        at=float(start if at is None else at),
        direction=None if direction is None else np.asarray(direction, dtype=float),
        context=context,
    )


class Continuation(Iterator[Step]):
    """A continuation under way: iterate over it; it can be abandoned at any point.

    Attributes
    ----------
    outcome, message
        How it ended (None while it has not), and in words.
    points, rejected
        Points found (located ones not counted) and steps rejected so far.
    step_length
        Scaled length of the next step.
    """

    def __init__(
        self,
        system: System,
        x: Array,
        ends: tuple[float, float],
        *,
        options: ContinuationOptions,
        scaling: ArclengthScaling,
        events: Sequence[Event],
        requested: Array,
        at: float,
        direction: Array | None,
        context: Any,
    ) -> None:
        self._options = options
        self._start, self._stop = ends
        self._metric = Metric(scaling, x, abs(self._stop - self._start))
        self._corrector = Corrector(system, x.size, self._metric, options.newton)
        self._corrector.context = context
        self._events = (*((turning_points(),) if options.locate_turning_points else ()), *events)
        self._locator = Locator(self._corrector, self._events, requested, options.event_tolerance)
        self.outcome: Outcome | None = None
        self.message = ""
        self.rejected = self.points = 0
        self.step_length = min(options.first_step, options.max_step)
        self._generator = self._follow(np.append(x, at), direction)

    def __next__(self) -> Step:
        return next(self._generator)

    @property
    def evaluations(self) -> int:
        """Evaluations of the system so far."""
        return self._corrector.evaluations

    @property
    def solves(self) -> int:
        """Linear solves so far."""
        return self._corrector.solves

    def _end(self, outcome: Outcome, message: str = "") -> Outcome:
        self.outcome, self.message = outcome, message or outcome.text
        return outcome

    def _follow(self, state: Array, direction: Array | None) -> Generator[Step, None, Outcome]:
        last, reason = self._first(state, direction)
        if last is None:
            return self._end(Outcome.NO_FIRST_POINT, f"no solution at the start {state[-1]:g}: {reason}")
        self._carry(last)
        yield last
        self._locator.begin(last)
        self.points, arc = 1, None
        while self.points < self._options.max_points:
            new, reason = self._advance(last, arc)
            if new is None:
                outcome = Outcome.SINGULAR if reason == SINGULAR_JACOBIAN else Outcome.STEP_TOO_SMALL
                return self._end(outcome, f"{outcome.text} (at {last.parameter:g}: {reason})")
            for located in self._locator.between(last, new):
                yield located
                if self._terminal(located):
                    return self._end(Outcome.COMPLETED, f"ended at the event {located.name}")
            self._carry(new)
            yield new
            self.points += 1
            if new.kind == "end":
                return self._end(Outcome.TURNED_BACK if new.parameter == self._start else Outcome.COMPLETED)
            sharp = angle(self._metric.cosine(last.tangent, new.tangent)) > self._options.max_angle
            arc, last = None if sharp else self._corrector.arc(last, new), new
            self._metric.renew(new.x)
        return self._end(Outcome.POINT_LIMIT)

    def _carry(self, step: Step) -> None:
        """Hand what the accepted point knows to the points after it."""
        self._corrector.context = getattr(step.evaluation, "context", None)

    def _first(self, state: Array, direction: Array | None) -> tuple[Step | None, str]:
        """The solution at the fixed starting parameter, its tangent pointing forward."""
        before = self._metric.inverse[:-1]
        step, result = self._corrector.correct(state, None, "start")
        if step is not None:
            self._metric.renew(step.x)
            if np.any(self._metric.inverse[:-1] > 2.0 * before):
                step, result = self._corrector.correct(step.state, None, "start")
        if step is None:
            return None, result.reason
        forward = step.tangent_parameter * (self._stop - self._start)
        if direction is not None:
            forward = self._metric.cosine(step.tangent, direction)
        if forward < 0:
            step.reverse()
        return step, ""

    def _advance(self, last: Step, arc: Arc | None) -> tuple[Step | None, str]:
        """The next accepted point, halving the step until there is one; None and the reason if there is none."""
        options, reason = self._options, ""
        length = self.step_length
        while length >= options.min_step:
            guess, normal, fixed = self._predict(last, arc, length)
            new, result = self._corrector.correct(
                guess, None if fixed else normal, "end" if fixed else "regular", forward=last.tangent
            )
            reason = result.reason if new is None else self._objection(last, new, guess, length)
            if new is not None and not reason:
                return self._accept(last, new, result, length, 2 if arc is None else 4), ""
            self.rejected += 1
            if length <= options.kink_step:
                new, result = self._turn(last, length)
                if new is not None:
                    return self._accept(last, new, result, length, 2), ""
            length, arc = 0.5 * length, None
        return None, reason or "no solution was found ahead"

    def _accept(self, last: Step, new: Step, result: NewtonResult, length: float, order: int) -> Step:
        metric = self._metric
        # at rounding level neither the contraction nor the count says anything of the step
        self.step_length = next_step(
            length,
            contraction=0.0 if result.stagnated else result.contraction,
            iterations=0 if result.stagnated else result.iterations,
            angle=angle(metric.cosine(last.tangent, new.tangent)),
            order=order,
            options=self._options,
        )
        new.arclength = last.arclength + metric.length(new.state - last.state)
        return new

    def _predict(self, last: Step, arc: Arc | None, length: float) -> tuple[Array, Array, bool]:
        """Guess and direction ``length`` ahead; clipped to the end of the range if it would pass it (True)."""
        ratio = self._metric.length(last.tangent)
        if arc is None:
            direction = last.tangent / ratio
            guess = last.state + length * direction
        else:
            u = 1.0 + length / (ratio * arc.length)
            guess, direction = arc.point(u), arc.derivative(u)
            if self._metric.cosine(direction, last.tangent) < _STRAIGHT:
                return self._predict(last, None, length)
        end = self._passed(guess[-1])
        if end is None:
            return guess, direction, False
        share = (end - last.state[-1]) / (guess[-1] - last.state[-1])
        guess = last.state + share * (guess - last.state) if arc is None else arc.point(arc.where(end, 1.0, u))
        guess[-1] = end
        return guess, direction, True

    def _passed(self, parameter: float) -> float | None:
        """The end of the range which ``parameter`` lies beyond, or on."""
        forward = 1.0 if self._stop > self._start else -1.0
        if (parameter - self._stop) * forward >= 0:
            return self._stop
        if (parameter - self._start) * forward <= 0:
            return self._start
        return None

    def _objection(self, last: Step, new: Step, guess: Array, length: float) -> str:
        """Why a converged point is not believed to be the next one of this branch ("" if it is)."""
        options, metric = self._options, self._metric
        if new.kind != "end" and self._passed(new.parameter) is not None:
            return "the corrected point lies outside of the range"
        turned = last.orientation * new.orientation < 0
        tiny = length <= options.kink_step
        if turned and tiny:
            new.name = "orientation change"
        elif turned:
            return "the orientation of the branch changes (bifurcation, or another branch)"
        kink = tiny or (length <= _KINK_SHARE * options.max_step and self._corrector.is_kink(last, new))
        if metric.length(new.state - guess) > (_KINK_CORRECTION if kink else options.max_correction) * length:
            return "the solution found is far from the predicted one"
        if not kink and angle(metric.cosine(last.tangent, new.tangent)) > options.max_angle:
            return "the direction of the branch changes too much"
        return ""

    def _turn(self, last: Step, length: float) -> tuple[Step | None, NewtonResult]:
        """Round a sharp corner of a piecewise smooth branch, where no solution lies ahead.

        Beyond the corner the equations of the next piece hold: their null direction, oriented so that the determinant
        keeps its sign (B. C. Eaves, Mathematical Programming Study 10 (1979) 1), leads on.
        """
        unit = last.tangent / self._metric.length(last.tangent)
        ahead = self._corrector.tangent_at(last.state + 4.0 * length * unit, unit)
        if ahead is None:
            return None, NewtonResult(last.state)
        direction = ahead[0] if ahead[1] == last.orientation else -ahead[0]
        guess = last.state + 1.5 * length * unit + 4.0 * length * direction
        new, result = self._corrector.correct(guess, direction, "regular", name="corner")
        if new is None or new.orientation != last.orientation or self._passed(new.parameter) is not None:
            return None, result
        near = self._metric.length(new.state - last.state) <= 10.0 * length
        return (new if near else None), result

    def _terminal(self, step: Step) -> bool:
        return any(event.terminal and event.name == step.name and event.kind == step.kind for event in self._events)


def _check(
    x: Array, start: float, stop: float, requested: Array, at: float | None, direction: ArrayLike | None
) -> None:
    faults = []
    if x.ndim != 1 or x.size == 0 or not np.all(np.isfinite(x)):
        faults.append(f"continuation x0: found shape {x.shape}; expected finite numbers of shape (N,)")
    if not (np.isfinite(start) and np.isfinite(stop)) or start == stop:
        faults.append(f"continuation range: found {start} to {stop}; expected two different finite numbers")
    low, high = min(start, stop), max(start, stop)
    outside = requested[~((requested >= low) & (requested <= high))]
    if outside.size:
        faults.append(f"requested parameter value {outside.flat[0]:g}: outside of the range {low:g} to {high:g}")
    if at is not None and not low <= at <= high:
        faults.append(f"continuation at: found {at:g}; expected a value within the range {low:g} to {high:g}")
    if direction is not None and np.shape(direction) != (x.size + 1,):
        faults.append(f"continuation direction: found shape {np.shape(direction)}; expected ({x.size + 1},)")
    if faults:
        raise InputError(faults)
