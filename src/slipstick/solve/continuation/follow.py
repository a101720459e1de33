"""Pseudo-arclength continuation of ``residual(x, parameter) = 0`` as an iterator of points.

H. B. Keller's bordered system (Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977) with a
cubic Hermite predictor through the last two points and a scaled arclength.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import KEPT, InputError, Outcome, Reason, reason_of
from slipstick.solve.continuation.corrector import Corrector, RestartPoint, Step
from slipstick.solve.continuation.dense_output import DenseOutput, Observables
from slipstick.solve.continuation.events import BranchEvent, Watched, turning_points
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.locate import Locator
from slipstick.solve.continuation.metric import ArclengthScaling, Measure, Metric
from slipstick.solve.continuation.step_control import (
    CUBIC_ORDER,
    SCALE_CHANGE,
    TANGENT_ORDER,
    ContinuationOptions,
    Rejection,
    Span,
    cubic_distance,
    max_distance,
    next_step,
    predict,
    rejection_of,
    turn_corner,
)
from slipstick.solve.newton import NewtonResult, NewtonStop, System
from slipstick.typing import Array


def continuation(
    system: System,
    x0: ArrayLike,
    start: float,
    stop: float,
    *,
    options: ContinuationOptions | None = None,
    scaling: ArclengthScaling | None = None,
    events: Sequence[BranchEvent] = (),
    requested: Sequence[float] = (),
    at: float | None = None,
    direction: ArrayLike | None = None,
    context: Any = None,
    restart: Sequence[RestartPoint] = (),
    doubted: Callable[[Step, Step, Array], bool] | None = None,
    observables: Observables | None = None,
    watched: Watched | None = None,
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
        To start inside the range: ``x0`` belongs to the parameter ``at``, and the branch is followed along
        ``direction`` (N + 1,), the ``tangent`` of an earlier step there. Default: from ``start`` towards ``stop``.
    context
        The context of an earlier point, see ``System``; None without one.
    restart
        To resume another continuation with the same arguments: its last ``restart_point``, preceded by the one before
        where there is one. The points to come are those that it would have found, bit for bit on one machine.
    doubted
        Whether a point is to be rejected, given the last point, the new one and its predicted state. A shorter step is
        then taken, down to ``kink_step``.
    observables
        Quantities computed from the states, which are interpolated as accurately as these.
    watched
        Quantities whose largest values are located, see ``Watched``: a point is inserted where one exceeds all before.

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
    >>> from slipstick.solve.newton import Evaluation
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
        restart=tuple(restart),
        doubted=doubted,
        observables=observables,
        watched=watched,
    )


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


def failed(error: Exception) -> tuple[Outcome, str]:
    """Outcome and message of a continuation that an exception ended after points were found."""
    return Outcome.FAILED, f"failed: {reason_of(error)}; {KEPT}"


class Continuation(Iterator[Step]):
    """A continuation under way: iterate over it; it can be abandoned at any point.

    Attributes
    ----------
    outcome, message
        How it ended (None while it runs), and a sentence about it.
    error
        An exception that ended it after the first point: the outcome is then FAILED.
    points, rejected
        Points found (located ones not counted) and steps rejected so far.
    step_length
        Scaled length of the next step.
    restart_point
        The last accepted point with all that the next points depend on; None before the first.
    resumed_at
        The step of the ``restart`` point, if one was given.
    """

    def __init__(
        self,
        system: System,
        x: Array,
        ends: tuple[float, float],
        *,
        options: ContinuationOptions,
        scaling: ArclengthScaling,
        events: Sequence[BranchEvent],
        requested: Array,
        at: float,
        direction: Array | None,
        context: Any,
        restart: tuple[RestartPoint, ...],
        doubted: Callable[[Step, Step, Array], bool] | None = None,
        observables: Observables | None = None,
        watched: Watched | None = None,
    ) -> None:
        self._options, self._doubted = options, doubted
        self._span = Span(*ends)
        self._corrector = Corrector(system, x.size, Metric(scaling, x, abs(ends[1] - ends[0])), options.newton)
        self._corrector.context = context
        self._events = (*((turning_points(),) if options.locate_turning_points else ()), *events)
        self._locator = Locator(self._corrector, self._events, requested, options.event_tolerance, watched)
        self._dense = DenseOutput(
            self._corrector, self._span, options.output_step, options.output_tolerance, observables
        )
        self.outcome: Outcome | None = None
        self.message = ""
        self.error: Exception | None = None
        self.rejected = self.points = 0
        self.step_length = self._last_length = min(options.first_step, options.max_step)
        self.restart_point: RestartPoint | None = None
        self.resumed_at: Step | None = None
        segment = self._resume(restart) if restart else None
        self._generator = self._follow(np.append(x, at), direction, segment)

    def __next__(self) -> Step:
        try:
            return next(self._generator)
        except StopIteration:
            raise
        except Exception as error:
            if not self.points:
                raise
            self.error = error  # the points found are kept
            raise StopIteration(self._end(*failed(error))) from None

    @property
    def evaluations(self) -> int:
        """Evaluations of the system so far."""
        return self._corrector.evaluations

    @property
    def solves(self) -> int:
        """Linear solves so far."""
        return self._corrector.solves

    @property
    def _metric(self) -> Metric:
        """The metric, which follows the last accepted point."""
        return self._corrector.metric

    def _end(self, outcome: Outcome, message: str = "") -> Outcome:
        self.outcome, self.message = outcome, message or outcome.text
        return outcome

    def _follow(
        self, state: Array, direction: Array | None, segment: HermiteSegment | None
    ) -> Generator[Step, None, Outcome]:
        last: Step | Reason = self.resumed_at or self._first(state, direction)
        if isinstance(last, Reason):
            return self._end(Outcome.NO_FIRST_POINT, f"no solution at the start {state[-1]:g}: {last.text}")
        if last is not self.resumed_at:
            self._locator.begin(last)
            self._accepted(last)
            yield last
        while last.kind != "end":
            if self.points >= self._options.max_points:
                return self._end(Outcome.POINT_LIMIT)
            new = self._advance(last, segment)
            if isinstance(new, Reason):
                outcome = Outcome.SINGULAR if new is NewtonStop.SINGULAR else Outcome.STEP_TOO_SMALL
                return self._end(outcome, f"{outcome.text} (at {last.parameter:g}: {new.text})")
            new, halves = self._without_gap(last, new)
            for between in self._between([last, *halves, new]):
                between.inserted = True
                yield between
                if self._terminal(between):
                    return self._end(Outcome.COMPLETED, f"ended at the event {between.name}")
            self._accepted(new)
            yield new
            last, segment = new, self._segment_ahead(last, new)
        return self._end(Outcome.TURNED_BACK if last.parameter == self._span.start else Outcome.COMPLETED)

    def _without_gap(self, last: Step, new: Step) -> tuple[Step, list[Step]]:
        """The next point and the corrected points before it, with solutions all along the step.

        Where there is no solution in the middle, the step may have passed two turning points: shorter steps are taken,
        and the long one only where these fail.
        """
        step = new, self._halves(last, new)
        lost, length = self._dense.lost, self._last_length
        while lost and length > self._options.kink_step:
            next_length, self.step_length = self.step_length, 0.5 * length
            shorter = self._advance(last, None)
            if isinstance(shorter, Reason):
                self.step_length = next_length
                return step[0], self._halves(last, step[0])
            self.rejected += 1
            step = shorter, self._halves(last, shorter)
            lost, length = self._dense.lost, self._last_length
        return step

    def _halves(self, last: Step, new: Step) -> list[Step]:
        self._corrector.neighbour = new.jacobian
        return self._dense.halves(last, new, new.apart)

    def _between(self, points: list[Step]) -> Iterator[Step]:
        """Corrected, located and interpolated points between two neighbours, in order.

        ``points`` are both neighbours with the corrected points between them.
        """
        for a, b in pairwise(points):
            for c, d in pairwise([a, *self._locator.between(a, b), b]):
                yield from self._dense.points(c, d, b)
                if d is not points[-1]:
                    yield d

    def _segment_ahead(self, last: Step, new: Step) -> HermiteSegment | None:
        """Segment for the next prediction, None at a corner between both points; the metric follows the newer."""
        sharp = self._corrector.angle(last.tangent, new.tangent) > self._options.max_angle
        segment = None if sharp else self._corrector.segment(last, new)
        self._corrector.metric = self._metric.renewed(new.x)
        return segment

    def _accepted(self, step: Step) -> None:
        """Count an accepted point, make its restart point, and pass its context to the next points."""
        self.points += 1
        self.restart_point = RestartPoint(
            state=step.state, tangent=step.tangent, kind=step.kind, orientation=step.orientation,
            arclength=step.arclength, step_length=self.step_length, measure=self._metric.measure,
            context=self._corrector.context, values=self._locator.values,
            points=self.points, rejected=self.rejected, evaluations=self.evaluations, solves=self.solves,
        )  # fmt: skip
        self._corrector.context = step.evaluation.context

    def _resume(self, restart: tuple[RestartPoint, ...]) -> HermiteSegment | None:
        """Restore the state of another continuation; the segment for the next prediction."""
        *before, self.restart_point = restart
        self._corrector.metric = self._metric.measuring(Measure(*self.restart_point.measure))
        self._locator.values = self.restart_point.values
        self.step_length, self.points, self.rejected = (
            self.restart_point.step_length,
            self.restart_point.points,
            self.restart_point.rejected,
        )
        self.resumed_at = self._corrector.resume(self.restart_point)
        self._corrector.context = self.resumed_at.evaluation.context
        return self._segment_ahead(Step.of_restart(before[-1]), self.resumed_at) if before else None

    def _first(self, state: Array, direction: Array | None) -> Step | Reason:
        """The solution at the fixed starting parameter, its tangent pointing forward; or why there is none.

        Where it is much smaller than the guess it is corrected once more, to a tolerance relative to its own size.
        """
        before = self._metric.inverse[:-1]
        step, result = self._corrector.correct(state, None, "start")
        if step is not None:
            self._corrector.metric = self._metric.renewed(step.x)
            if np.any(self._metric.inverse[:-1] > SCALE_CHANGE * before):
                step, result = self._corrector.correct(step.state, None, "start")
        if step is None:
            return result.reason or Rejection.NOTHING_AHEAD
        forward = step.tangent_parameter * (self._span.stop - self._span.start)
        if direction is not None:
            forward = self._metric.cosine(step.tangent, direction)
        if forward < 0:
            step.reverse()
        return step

    def _advance(self, last: Step, segment: HermiteSegment | None) -> Step | Reason:
        """The next accepted point, halving the step until there is one; or why there is none."""
        options, corrector, span = self._options, self._corrector, self._span
        reason: Reason | None = None
        length = self.step_length
        corrector.neighbour = None  # a resumed branch has none either
        while length >= options.min_step:
            ahead = predict(corrector.metric, span, last, segment, length)
            normal, kind = (None, "end") if ahead.at_end else (ahead.direction, "regular")
            new, result = corrector.correct(
                ahead.guess, normal, kind, forward=last.tangent, max_distance=max_distance(options, length)
            )
            if new is None:
                reason = result.reason
            else:
                angle = corrector.angle(last.tangent, new.tangent)
                reason = rejection_of(corrector.metric, span, options, last, new, ahead.guess, length, angle)
                if reason is None and self._doubted is not None and length > options.kink_step:
                    reason = Rejection.DOUBTED if self._doubted(last, new, ahead.guess) else None
                if reason is None:
                    new.apart = cubic_distance(
                        corrector.metric, (new.state, new.tangent), (ahead.guess, ahead.direction), length
                    )
                    return self._accept(last, new, result, length, TANGENT_ORDER if segment is None else CUBIC_ORDER)
            self.rejected += 1
            if length <= options.kink_step:
                new, result = turn_corner(corrector, span, last, length)
                if new is not None:
                    return self._accept(last, new, result, length, TANGENT_ORDER)
            length, segment = 0.5 * length, None
        return reason or Rejection.NOTHING_AHEAD

    def _accept(self, last: Step, new: Step, result: NewtonResult, length: float, order: int) -> Step:
        self._last_length = length
        # at rounding level neither the contraction nor the count depends on the step
        self.step_length = next_step(
            length,
            contraction=0.0 if result.stagnated else result.contraction,
            iterations=0 if result.stagnated else result.iterations,
            angle=self._corrector.angle(last.tangent, new.tangent),
            order=order,
            options=self._options,
        )
        new.arclength = last.arclength + self._metric.length(new.state - last.state)
        return new

    def _terminal(self, step: Step) -> bool:
        kinds = {event.name: event.kind for event in self._events if event.terminal}
        return step.name in kinds and step.kind in (kinds[step.name], f"near {kinds[step.name]}")
