"""A continuation under way."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from slipstick.errors import Outcome, Reason, reason_of
from slipstick.solve.continuation.arc import Arc
from slipstick.solve.continuation.corner import turn
from slipstick.solve.continuation.corrector import Corrector, angle_of
from slipstick.solve.continuation.dense_output import DenseOutput
from slipstick.solve.continuation.events import BranchEvent, Watched, turning_points
from slipstick.solve.continuation.judging import Rejection, objection, reach
from slipstick.solve.continuation.locate import Locator
from slipstick.solve.continuation.metric import ArclengthScaling, Metric
from slipstick.solve.continuation.options import ContinuationOptions
from slipstick.solve.continuation.place import Place
from slipstick.solve.continuation.predictor import Span, predict
from slipstick.solve.continuation.readings import Readings
from slipstick.solve.continuation.step import Step
from slipstick.solve.continuation.stepsize import next_step
from slipstick.solve.newton import NewtonResult, NewtonStop, System
from slipstick.typing import Array


def failed(error: Exception) -> tuple[Outcome, str]:
    """Outcome and message of what an exception ended after points were found."""
    return Outcome.FAILED, f"failed: {reason_of(error)}; every point found is kept"


class Continuation(Iterator[Step]):
    """A continuation under way: iterate over it; it can be abandoned at any point.

    Attributes
    ----------
    outcome, message
        How it ended (None while it has not), and in words.
    error
        The exception that ended it, where one did after the first point: the outcome is then FAILED.
    points, rejected
        Points found (located ones not counted) and steps rejected so far.
    step_length
        Scaled length of the next step.
    place
        The last accepted point with what the points after it depend on; None before the first.
    standing
        The step it goes on from where it was given ``places``, else None.
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
        places: tuple[Place, ...],
        doubted: Callable[[Step, Step, Array], bool] | None = None,
        readings: Readings | None = None,
        watched: Watched | None = None,
    ) -> None:
        self._options, self._doubted = options, doubted
        self._span = Span(*ends)
        self._metric = Metric(scaling, x, abs(ends[1] - ends[0]))
        self._corrector = Corrector(system, x.size, self._metric, options.newton)
        self._corrector.context = context
        self._events = (*((turning_points(),) if options.locate_turning_points else ()), *events)
        self._locator = Locator(self._corrector, self._events, requested, options.event_tolerance, watched)
        self._dense = DenseOutput(self._corrector, self._span, options.output_step, options.output_tolerance, readings)
        self.outcome: Outcome | None = None
        self.message = ""
        self.error: Exception | None = None
        self.rejected = self.points = 0
        self.step_length = min(options.first_step, options.max_step)
        self.place: Place | None = None
        self.standing: Step | None = None
        arc = self._take_up(places) if places else None
        self._generator = self._follow(np.append(x, at), direction, arc)

    def __next__(self) -> Step:
        try:
            return next(self._generator)
        except StopIteration:
            raise
        except Exception as error:
            if not self.points:
                raise
            self.error = error  # what was found is worth more than the fault
            raise StopIteration(self._end(*failed(error))) from None

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

    def _follow(self, state: Array, direction: Array | None, arc: Arc | None) -> Generator[Step, None, Outcome]:
        last: Step | Reason = self.standing or self._first(state, direction)
        if isinstance(last, Reason):
            return self._end(Outcome.NO_FIRST_POINT, f"no solution at the start {state[-1]:g}: {last.text}")
        if last is not self.standing:
            self._locator.begin(last)
            self._accepted(last)
            yield last
        while last.kind != "end":
            if self.points >= self._options.max_points:
                return self._end(Outcome.POINT_LIMIT)
            new = self._advance(last, arc)
            if isinstance(new, Reason):
                outcome = Outcome.SINGULAR if new is NewtonStop.SINGULAR else Outcome.STEP_TOO_SMALL
                return self._end(outcome, f"{outcome.text} (at {last.parameter:g}: {new.text})")
            for between in self._between(last, new):
                between.inserted = True
                yield between
                if self._terminal(between):
                    return self._end(Outcome.COMPLETED, f"ended at the event {between.name}")
            self._accepted(new)
            yield new
            last, arc = new, self._ahead(last, new)
        return self._end(Outcome.TURNED_BACK if last.parameter == self._span.start else Outcome.COMPLETED)

    def _between(self, last: Step, new: Step) -> Iterator[Step]:
        """What comes between two neighbours: corrected, located and interpolated points, in order."""
        for a, b in pairwise([last, *self._dense.halves(last, new, new.apart), new]):
            for c, d in pairwise([a, *self._locator.between(a, b), b]):
                yield from self._dense.points(c, d, b)
                if d is not new:
                    yield d

    def _ahead(self, last: Step, new: Step) -> Arc | None:
        """The arc that leads on from two neighbours, unless there is a corner between; the metric follows the newer."""
        sharp = angle_of(self._metric.cosine(last.tangent, new.tangent)) > self._options.max_angle
        arc = None if sharp else self._corrector.arc(last, new)
        self._metric.renew(new.x)
        return arc

    def _accepted(self, step: Step) -> None:
        """Take note of a point, and hand what it knows to the points after it."""
        self.points += 1
        self.place = Place(
            state=step.state, tangent=step.tangent, kind=step.kind, orientation=step.orientation,
            arclength=step.arclength, step_length=self.step_length, measure=self._metric.measure,
            given=self._corrector.context, values=self._locator.values,
            points=self.points, rejected=self.rejected, evaluations=self.evaluations, solves=self.solves,
        )  # fmt: skip
        self._carry(step)

    def _take_up(self, places: tuple[Place, ...]) -> Arc | None:
        """Stand where another continuation stood; the arc that leads on."""
        *before, self.place = places
        self._metric.measure, self._locator.values = self.place.measure, self.place.values
        self.step_length, self.points, self.rejected = self.place.step_length, self.place.points, self.place.rejected
        self.standing = self._corrector.take_up(self.place)
        self._carry(self.standing)
        return self._ahead(Step.again(before[-1]), self.standing) if before else None

    def _carry(self, step: Step) -> None:
        """Hand what the accepted point knows to the points after it."""
        self._corrector.context = getattr(step.evaluation, "context", None)

    def _first(self, state: Array, direction: Array | None) -> Step | Reason:
        """The solution at the fixed starting parameter, its tangent pointing forward; or why there is none."""
        before = self._metric.inverse[:-1]
        step, result = self._corrector.correct(state, None, "start")
        if step is not None:
            self._metric.renew(step.x)
            if np.any(self._metric.inverse[:-1] > 2.0 * before):
                step, result = self._corrector.correct(step.state, None, "start")
        if step is None:
            return result.reason or Rejection.NOTHING_AHEAD
        forward = step.tangent_parameter * (self._span.stop - self._span.start)
        if direction is not None:
            forward = self._metric.cosine(step.tangent, direction)
        if forward < 0:
            step.reverse()
        return step

    def _advance(self, last: Step, arc: Arc | None) -> Step | Reason:
        """The next accepted point, halving the step until there is one; or why there is none."""
        options, corrector, span = self._options, self._corrector, self._span
        reason: Reason | None = None
        length = self.step_length
        while length >= options.min_step:
            ahead = predict(self._metric, span, last, arc, length)
            normal, kind = (None, "end") if ahead.at_end else (ahead.direction, "regular")
            new, result = corrector.correct(
                ahead.guess, normal, kind, forward=last.tangent, reach=reach(options, length)
            )
            if new is None:
                reason = result.reason
            else:
                reason = objection(corrector, span, options, last, new, ahead.guess, length)
                if reason is None and self._doubted is not None and length > options.kink_step:
                    reason = Rejection.DOUBTED if self._doubted(last, new, ahead.guess) else None
                if reason is None:
                    new.apart = corrector.apart(new, ahead.guess, ahead.direction, length)
                    return self._accept(last, new, result, length, 2 if arc is None else 4)
            self.rejected += 1
            if length <= options.kink_step:
                new, result = turn(corrector, span, last, length)
                if new is not None:
                    return self._accept(last, new, result, length, 2)
            length, arc = 0.5 * length, None
        return reason or Rejection.NOTHING_AHEAD

    def _accept(self, last: Step, new: Step, result: NewtonResult, length: float, order: int) -> Step:
        metric = self._metric
        # at rounding level neither the contraction nor the count says anything of the step
        self.step_length = next_step(
            length,
            contraction=0.0 if result.stagnated else result.contraction,
            iterations=0 if result.stagnated else result.iterations,
            angle=angle_of(metric.cosine(last.tangent, new.tangent)),
            order=order,
            options=self._options,
        )
        new.arclength = last.arclength + metric.length(new.state - last.state)
        return new

    def _terminal(self, step: Step) -> bool:
        kinds = {event.name: event.kind for event in self._events if event.terminal}
        return step.name in kinds and step.kind in (kinds[step.name], f"near {kinds[step.name]}")
