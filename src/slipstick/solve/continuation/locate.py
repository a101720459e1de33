"""Located points between two neighbouring points of a branch: events and requested parameter values."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slipstick.solve.continuation.arc import Arc
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import BracketedRoot, BranchEvent
from slipstick.solve.continuation.step import Step
from slipstick.typing import Array

_MAX_TRIALS = 60
_TOO_FAR = 0.5


class Locator:
    """Finds events and requested parameter values by solving again on the arc between two points.

    Parameters
    ----------
    corrector
        Solver of the branch.
    events, requested
        What to look for; ``requested`` are parameter values.
    tolerance
        Scaled arclength to which an event is located.
    """

    def __init__(self, corrector: Corrector, events: Sequence[BranchEvent], requested: Array, tolerance: float) -> None:
        self._corrector, self._events, self._requested, self._tolerance = corrector, events, requested, tolerance
        self.values: tuple[float, ...] = ()
        """Event functions at the last point."""

    def begin(self, first: Step) -> None:
        """Take note of the event functions at the first point."""
        self.values = self._at_step(first)

    def _at_step(self, step: Step) -> tuple[float, ...]:
        return tuple(float(event.function(step)) for event in self._events)

    def between(self, first: Step, second: Step) -> list[Step]:
        """Located points between two neighbours in order along the branch."""
        arc: Arc | None = None
        found: list[tuple[float, Step]] = []
        values = self._at_step(second)
        for event, before, after in zip(self._events, self.values, values, strict=True):
            if event.crossed(before, after):
                arc = arc or self._corrector.arc(first, second)
                jump = event.place
                located = (
                    self._event(event, arc, (0.0, before), (1.0, after))
                    if jump is None
                    else self._jump(event, arc, jump(first, second, arc))
                )
                if located is not None:
                    found.append(located)
        self.values = values
        if self._requested.size:
            found += self._passages(first, second, sorted(found, key=_place), arc)
        found.sort(key=_place)
        for _, step in found:
            step.arclength = first.arclength + self._corrector.metric.length(step.state - first.state)
        return [step for _, step in found]

    def _passages(
        self, first: Step, second: Step, found: list[tuple[float, Step]], arc: Arc | None
    ) -> list[tuple[float, Step]]:
        """Points at the requested parameter values; turning points in between (already found) part the passages."""
        passages = []
        nodes = [(0.0, first.parameter), *((u, s.parameter) for u, s in found), (1.0, second.parameter)]
        for (u0, p0), (u1, p1) in pairwise(nodes):
            values = self._requested
            inside = values[(values > p0) & (values <= p1)] if p1 > p0 else values[(values < p0) & (values >= p1)]
            for value in inside.tolist():
                if second.kind == "end" and value == second.parameter:
                    continue
                arc = arc or self._corrector.arc(first, second)
                passage = self._passage(value, arc, (u0, p0 - value), (u1, p1 - value))
                if passage is not None:
                    passages.append(passage)
        return passages

    def _passage(
        self, value: float, arc: Arc, low: tuple[float, float], high: tuple[float, float]
    ) -> tuple[float, Step] | None:
        """Solve at the exact parameter; near a turning point first approach along the arc."""
        u = arc.where(value, low[0], high[0])
        step = self._at(value, arc.point(u), arc.derivative(u), arc.length)
        if step is not None:
            return u, step
        event = BranchEvent(name="", kind="requested", function=lambda point: point.parameter - value)
        near = self._event(event, arc, low, high)
        if near is None:
            return None
        exact = self._at(value, near[1].state.copy(), near[1].tangent, arc.length)
        return near[0], exact or near[1]

    def _at(self, value: float, guess: Array, forward: Array, length: float) -> Step | None:
        guess[-1] = value
        step, _ = self._corrector.correct(guess, None, "requested", forward=forward)
        if step is None or self._corrector.metric.length(step.state - guess) > _TOO_FAR * length:
            return None
        return step

    def _jump(self, event: BranchEvent, arc: Arc, u: float) -> tuple[float, Step] | None:
        """The solution at a place on the arc."""
        guess = arc.point(u)
        step, _ = self._corrector.correct(guess, arc.derivative(u), event.kind, name=event.name)
        if step is None or self._corrector.metric.length(step.state - guess) > _TOO_FAR * arc.length:
            return None
        return u, step

    def _event(
        self, event: BranchEvent, arc: Arc, low: tuple[float, float], high: tuple[float, float]
    ) -> tuple[float, Step] | None:
        """Solve on the arc until the place of the sign change is known to the tolerance."""
        metric = self._corrector.metric
        root = BracketedRoot(*low, *high)
        best: tuple[float, float, Step] | None = None
        for _ in range(_MAX_TRIALS):
            u = root.trial
            guess = arc.point(u)
            step, _result = self._corrector.correct(guess, arc.derivative(u), event.kind, name=event.name)
            if step is None or metric.length(step.state - guess) > _TOO_FAR * arc.length:
                break
            value = float(event.function(step))
            shift = np.inf if best is None else metric.length(step.state - best[2].state)
            if best is None or abs(value) <= abs(best[1]):
                best = (u, value, step)
            root.update(u, value, self._tolerance)
            if value == 0.0 or shift < self._tolerance or root.width * arc.length < self._tolerance:
                break
        return None if best is None else (best[0], best[2])


def _place(located: tuple[float, Step]) -> float:
    return located[0]
