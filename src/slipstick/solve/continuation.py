"""Pseudo-arclength continuation of ``residual(x, parameter) = 0`` as an iterator of points.

H. B. Keller's bordered system (Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977) with a
cubic Hermite predictor through the last two points and a scaled arclength.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import acos
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.errors import InputError, Outcome
from slipstick.solve.arc import Arc, ArclengthScaling, Metric
from slipstick.solve.events import BracketedRoot, Event, turning_points
from slipstick.solve.newton import Evaluation, NewtonOptions, NewtonResult, System, iterate
from slipstick.solve.stepsize import StepOptions, next_step

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

Array = NDArray[np.float64]


def _corrector_options() -> NewtonOptions:
    return NewtonOptions(max_iterations=12, min_damping=0.05, non_monotone=2)


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
        Accuracy of the parameter at located events, relative to the parameter range.
    """

    max_points: int = 5000
    newton: NewtonOptions = field(default_factory=_corrector_options)
    locate_turning_points: bool = True
    event_tolerance: float = 1e-10


class Step:
    """A point of a branch.

    Attributes
    ----------
    state, tangent
        ``(x, parameter)`` and its derivative along the branch, both (N + 1,); the tangent points forward and has unit
        length in the scaled arclength of the step which found it.
    kind
        "start", "regular", "requested", "turning point", "end", or the kind of an event such as "peak".
    name
        Name of the event, "" for ordinary points.
    iterations
        Newton corrections taken at this point.
    residual_norm
        Euclidean norm of the residual at ``x``.
    evaluation
        What the system returned at exactly this ``x`` and ``parameter``.
    arclength
        Scaled length of the branch from the start (chords).
    """

    __slots__ = (
        "arclength",
        "evaluation",
        "iterations",
        "kind",
        "name",
        "orientation",
        "residual_norm",
        "state",
        "tangent",
    )

    def __init__(self, state: Array, tangent: Array, result: NewtonResult, kind: str, name: str, size: int) -> None:
        self.state, self.tangent, self.kind, self.name = state, tangent, kind, name
        self.iterations, self.evaluation = result.iterations, result.evaluation
        residual = result.residual[:size]
        self.residual_norm = float(np.sqrt(residual.dot(residual)))
        self.orientation = 0
        self.arclength = 0.0

    @property
    def x(self) -> Array:
        """Unknowns (N,)."""
        return self.state[:-1]

    @property
    def parameter(self) -> float:
        """Parameter."""
        return float(self.state[-1])

    @property
    def tangent_x(self) -> Array:
        """Derivative of the unknowns along the branch (N,)."""
        return self.tangent[:-1]

    @property
    def tangent_parameter(self) -> float:
        """Derivative of the parameter along the branch."""
        return float(self.tangent[-1])

    def __repr__(self) -> str:
        return f"Step({self.kind}{' ' + self.name if self.name else ''} at {self.parameter:.6g})"


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
        ``start`` when it comes back there.
    events
        Sign changes to locate.
    requested
        Parameter values at which a point is wanted; every passage (also on overhanging branches) gives one.

    Returns
    -------
    Continuation
        An iterator of ``Step``; afterwards its ``outcome``, ``message`` and work counters say how it ended.

    Examples
    --------
    >>> class Line:
    ...     def evaluate(self, x, p):
    ...         return Evaluation(x - p, np.eye(1), -np.ones(1))
    >>> run = continuation(Line(), [0.0], 0.0, 1.0)
    >>> steps = list(run)
    >>> steps[-1].kind, steps[-1].parameter, run.outcome.name
    ('end', 1.0, 'COMPLETED')
    """
    return Continuation(
        system, x0, start, stop, options or ContinuationOptions(), scaling or ArclengthScaling(), events, requested
    )


class Continuation(Iterator[Step]):
    """A continuation under way: iterate over it; it can be abandoned at any point.

    Attributes
    ----------
    outcome, message
        How it ended (None while it has not), and in words.
    evaluations, solves, rejected, points
        Work so far: evaluations of the system, linear solves, rejected steps, points found (located ones not counted).
    step_length
        Scaled length of the next step.
    """

    def __init__(
        self,
        system: System,
        x0: ArrayLike,
        start: float,
        stop: float,
        options: ContinuationOptions,
        scaling: ArclengthScaling,
        events: Sequence[Event],
        requested: Sequence[float],
    ) -> None:
        x = np.array(x0, dtype=float)
        _check(x, start, stop, requested)
        self._system, self._size, self._options = system, x.size, options
        self._start, self._stop = float(start), float(stop)
        self._metric = Metric(scaling, x, abs(stop - start))
        self._events = (*((turning_points(),) if options.locate_turning_points else ()), *events)
        self._values: dict[int, tuple[Step, list[float]]] = {}
        self._requested = np.unique(np.asarray(requested, dtype=float))
        self.outcome: Outcome | None = None
        self.message = ""
        self.evaluations = self.solves = self.rejected = self.points = 0
        self.step_length = min(options.first_step, options.max_step)
        self._generator = self._follow(x)

    def __next__(self) -> Step:
        return next(self._generator)

    def _end(self, outcome: Outcome, message: str = "") -> Outcome:
        self.outcome, self.message = outcome, message or outcome.text
        return outcome

    # -- the walk ---------------------------------------------------------------------------------------------------

    def _follow(self, x: Array) -> Generator[Step, None, Outcome]:
        last, reason = self._first(x)
        if last is None:
            return self._end(Outcome.NO_FIRST_POINT, f"no solution at the start {self._start:g}: {reason}")
        yield last
        self.points, arc = 1, None
        while self.points < self._options.max_points:
            new, reason = self._advance(last, arc)
            if new is None:
                return self._end(Outcome.STEP_TOO_SMALL, f"{Outcome.STEP_TOO_SMALL.text} (last failure: {reason})")
            for located in self._between(last, new):
                yield located
                if self._terminal(located):
                    return self._end(Outcome.COMPLETED, f"ended at the event {located.name}")
            yield new
            self.points += 1
            if new.kind == "end":
                back = new.parameter == self._start
                return self._end(Outcome.COMPLETED, "the branch came back to the start of the range" if back else "")
            arc, last = self._arc(last, new), new
            self._metric.renew(new.x)
        return self._end(Outcome.POINT_LIMIT)

    def _first(self, x: Array) -> tuple[Step | None, str]:
        before = self._metric.inverse[:-1]
        step, result = self._correct(np.append(x, self._start), None, "start")
        if step is None:
            return None, result.reason
        self._metric.renew(step.x)
        if np.any(self._metric.inverse[:-1] > 2.0 * before):
            step, result = self._correct(step.state, None, "start")
            if step is None:
                return None, result.reason
        if step.tangent[-1] * (self._stop - self._start) < 0:
            step.tangent = -step.tangent
            step.orientation = -step.orientation
        return step, ""

    def _advance(self, last: Step, arc: Arc | None) -> tuple[Step | None, str]:
        """The next accepted point, halving the step until there is one; None and the reason if there is none."""
        options, reason = self._options, ""
        length = self.step_length
        while length >= options.min_step:
            guess, normal, fixed = self._predict(last, arc, length)
            new, result = self._correct(guess, None if fixed else normal, "end" if fixed else "regular", last.tangent)
            reason = result.reason if new is None else self._objection(last, new, guess, length)
            if new is not None and not reason:
                self.step_length = self._next_length(last, new, result, length, 2 if arc is None else 4)
                new.arclength = last.arclength + self._metric.length(new.state - last.state)
                return new, ""
            self.rejected += 1
            length, arc = 0.5 * length, None
        return None, reason

    def _predict(self, last: Step, arc: Arc | None, length: float) -> tuple[Array, Array, bool]:
        """Guess and direction ``length`` ahead; clipped to the end of the range if it would pass it (True)."""
        ratio = self._metric.length(last.tangent)
        if arc is None:
            direction = last.tangent / ratio
            guess = last.state + length * direction
        else:
            u = 1.0 + length / (ratio * arc.length)
            guess, direction = arc.point(u), arc.derivative(u)
            if self._metric.cosine(direction, last.tangent) < 0.7:
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
        if metric.length(new.state - guess) > options.max_correction * length:
            return "the solution found is far from the predicted one"
        if length > options.kink_step:
            if _angle(metric.cosine(last.tangent, new.tangent)) > options.max_angle:
                return "the direction of the branch changes too much"
            if last.orientation * new.orientation < 0:
                return "the orientation of the branch changes (bifurcation, or another branch)"
        return ""

    def _next_length(self, last: Step, new: Step, result: NewtonResult, length: float, order: int) -> float:
        return next_step(
            length,
            contraction=result.contraction,
            iterations=result.iterations,
            angle=_angle(self._metric.cosine(last.tangent, new.tangent)),
            order=order,
            options=self._options,
        )

    # -- one point --------------------------------------------------------------------------------------------------

    def _correct(
        self, guess: Array, normal: Array | None, kind: str, forward: Array | None = None, name: str = ""
    ) -> tuple[Step | None, NewtonResult]:
        """Newton on the plane through ``guess`` across ``normal`` (None: at the fixed parameter of ``guess``)."""
        size, evaluate, weights = self._size, self._system.evaluate, self._metric.weights
        if normal is None:
            row = np.zeros(size + 1)
            row[-1] = 1.0
        else:
            row = normal * weights * weights
            row /= np.abs(row).max()
        level = row.dot(guess)

        def bordered(z: Array) -> tuple[Array, Array, Any]:
            value = evaluate(z[:size], float(z[size]))
            residual = np.empty(size + 1)
            residual[:size] = value.residual
            residual[size] = row.dot(z) - level
            jacobian = np.empty((size + 1, size + 1))
            jacobian[:size, :size] = value.jacobian
            jacobian[:size, size] = value.parameter_derivative
            jacobian[size] = row
            return residual, jacobian, value

        result = iterate(bordered, guess, self._metric.inverse, self._options.newton)
        self.evaluations += result.evaluations
        self.solves += result.solves
        if not result.converged or result.factors is None:
            return None, result
        if normal is None:
            result.x[-1] = guess[-1]
        right = np.zeros(size + 1)
        right[size] = 1.0
        tangent = result.factors.solve(right)
        self.solves += 1
        tangent /= self._metric.length(tangent)
        step = Step(result.x, tangent, result, kind, name, size)
        step.orientation = result.factors.sign()
        if normal is None and forward is not None and self._metric.cosine(tangent, forward) < 0:
            step.tangent = -tangent
            step.orientation = -step.orientation
        return step, result

    def _arc(self, first: Step, second: Step) -> Arc:
        """The cubic between two neighbouring points in the present metric."""
        metric = self._metric
        chord = second.state - first.state
        length = metric.length(chord)
        a = first.tangent / metric.length(first.tangent)
        b = second.tangent / metric.length(second.tangent)
        turn = _angle(metric.cosine(a, b))
        return Arc(first.state, a, second.state, b, length * (1.0 + turn * turn / 24.0))

    # -- located points ---------------------------------------------------------------------------------------------

    def _terminal(self, step: Step) -> bool:
        return any(event.terminal and event.name == step.name and event.kind == step.kind for event in self._events)

    def _between(self, first: Step, second: Step) -> list[Step]:
        """Located points between two neighbours, in order along the branch."""
        arc: Arc | None = None
        found: list[tuple[float, Step]] = []
        for event in self._events:
            before, after = float(event.function(first)), float(event.function(second))
            if event.crossed(before, after):
                arc = arc or self._arc(first, second)
                located = self._locate(event, arc, before, after, second.tangent)
                if located is not None:
                    found.append(located)
        found.sort(key=lambda pair: pair[0])
        if self._requested.size:
            nodes = [(0.0, first.parameter), *((u, s.parameter) for u, s in found), (1.0, second.parameter)]
            for (u0, p0), (u1, p1) in pairwise(nodes):
                low, high = min(p0, p1), max(p0, p1)
                inside = self._requested[(self._requested > low) & (self._requested < high)]
                for value in inside:
                    arc = arc or self._arc(first, second)
                    u = arc.where(float(value), u0, u1)
                    guess = arc.point(u)
                    guess[-1] = value
                    step, _ = self._correct(guess, None, "requested", second.tangent)
                    if step is not None:
                        found.append((u, step))
            found.sort(key=lambda pair: pair[0])
        for _, step in found:
            step.arclength = first.arclength + self._metric.length(step.state - first.state)
        return [step for _, step in found]

    def _locate(self, event: Event, arc: Arc, before: float, after: float, forward: Array) -> tuple[float, Step] | None:
        """Solve on the arc until the sign change of the event is known to the tolerance."""
        root = BracketedRoot(0.0, before, 1.0, after)
        best: tuple[float, float, Step] | None = None
        tolerance = self._options.event_tolerance
        for _ in range(60):
            u = root.trial
            step, _result = self._correct(arc.point(u), arc.derivative(u), event.kind, forward, event.name)
            if step is None:
                break
            value = float(event.function(step))
            shift = np.inf if best is None else self._metric.length(step.state - best[2].state)
            if best is None or abs(value) <= abs(best[1]):
                best = (u, value, step)
            if value == 0.0 or shift < tolerance:
                break
            root.update(u, value, tolerance)
            if root.width * arc.length < tolerance:
                break
        return None if best is None else (best[0], best[2])


def _angle(cosine: float) -> float:
    return acos(max(-1.0, min(1.0, cosine)))


def _check(x: Array, start: float, stop: float, requested: Sequence[float]) -> None:
    faults = []
    if x.ndim != 1 or x.size == 0 or not np.all(np.isfinite(x)):
        faults.append(f"continuation x0: found shape {x.shape}; expected finite numbers of shape (N,)")
    if not (np.isfinite(start) and np.isfinite(stop)) or start == stop:
        faults.append(f"continuation range: found {start} to {stop}; expected two different finite numbers")
    if not np.all(np.isfinite(np.asarray(requested, dtype=float))):
        faults.append("requested parameter values: some are not finite; expected numbers within the range")
    if faults:
        raise InputError(faults)
