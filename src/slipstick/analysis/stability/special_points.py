"""Where the kind of motion changes along a branch: test functions for the continuation (THEORY.md section 13).

Folds are turning points, which the continuation knows. Here are the others: a multiplier passes -1 (the period
doubles), a pair leaves the unit circle (Neimark-Sacker: a second frequency appears), one passes +1 without a fold
(symmetry breaks, or branches cross), a travelling wave loses its symmetry (a disturbance of another wave number begins
to grow, by the count), and contacts change the order of their states (touch or stick begins or ends).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from slipstick.analysis.stability.floquet import BEYOND, REAL, StabilityWatch, real_part
from slipstick.analysis.stability.state_sequence import Word, word_at
from slipstick.balance.evaluation import Detail, FrequencySystem, ParameterSystem, unanswered
from slipstick.balance.inputs import Inputs
from slipstick.results.stability import (
    BRANCH_POINT,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    PIECES,
    SPECIAL_KINDS,
    STATE_CHANGE,
    UNKNOWN,
    PointStability,
    Unjudged,
)
from slipstick.solve.continuation import Step
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.typing import Array, ComplexArray

_HALVINGS = 10
"""Halvings of a segment between two points on which contacts have different states."""

_COUNTED = 6
"""The same where disturbances are counted, which costs as much as solving for a point."""

_REMEMBERED = 8

CHEAP_CONTACTS = 4
"""So many contacts cost next to nothing: interpolated points are judged too."""

_NEAR = {PERIOD_DOUBLING: 1e-3, NEIMARK_SACKER: 1e-3, BRANCH_POINT: 5e-2}
"""Distance from the unit circle within which a located multiplier stands on it."""


class SpecialPoints:
    """Test functions of a branch, remembered for the last steps: each step is asked more than once."""

    def __init__(self, watch: StabilityWatch, system: FrequencySystem | ParameterSystem) -> None:
        self._watch, self._system = watch, system
        h = watch.balance.harmonics
        self._complete = h.highest == h.n
        switching = any(batch.law.regimes is not None for batch in watch.balance.batches)
        self.every = watch.systems.in_time and watch.balance.n_contacts <= CHEAP_CONTACTS and not switching
        """Whether interpolated points are judged too."""
        self._of_wave = watch.balance.receptance.waves is not None
        self._known: list[tuple[Step, PointStability]] = []
        self._last: tuple[Word, float] | None = None

    @property
    def events(self) -> tuple[BranchEvent, ...]:
        """What the continuation is to look for."""
        changes = BranchEvent(
            name=STATE_CHANGE, kind=STATE_CHANGE, function=lambda step: self._state(step), place=self._change
        )
        if self._of_wave:
            lost = BranchEvent(name=BRANCH_POINT, kind=BRANCH_POINT, function=self._held, place=self._loss)
            return (lost, changes)
        if not self._watch.systems.in_time:
            return (changes,)
        tests = {PERIOD_DOUBLING: doubling, NEIMARK_SACKER: torus}
        events = [
            BranchEvent(name=kind, kind=kind, function=partial(self._tested, test)) for kind, test in tests.items()
        ]
        crossing = BranchEvent(name=BRANCH_POINT, kind=BRANCH_POINT, function=self._crossing)
        return (*events, crossing, changes)

    def _tested(self, test: Callable[[ComplexArray], float], step: Step) -> float:
        return test(self.at(step).multipliers)

    def take_up(self, step: Step, value: float) -> None:
        """Go on from an accepted step at which the last of the test functions had a value."""
        self._last = self._word_at(step), value

    def judged(self, step: Step, *, compare: bool) -> PointStability | Unjudged:
        """Stability of a step for the record; ``compare``: with the difference of both methods.

        Between solved points the kind of motion does not change: unless ``every`` point is judged, what is interpolated
        is judged as its neighbours are. What is evaluated when it is recorded is judged then too.
        """
        if step.place is not None and not self._judged_itself(*step.place):
            return self._between(*step.place)
        if step.place is not None and step.evaluation is None:
            error = self._error(step)
            return Unjudged(partial(self._alone, step, error), self._together, (step, error))
        stability = self.at(step)
        if not compare:
            return stability
        return replace(stability, difference=self._watch.difference(step.x, step.evaluation.detail, stability))

    def at(self, step: Step) -> PointStability:
        """Stability of a step."""
        for known, stability in self._known:
            if known is step:
                return stability
        odd, error = None, None
        if step.place is not None:
            error = self._error(step)
        elif step.orientation and self._complete:
            odd = step.orientation * step.tangent_parameter < 0.0
        stability = self._watch.at(step.x, step.evaluation.detail, odd=odd, error=error)
        self._known = [*self._known[1 - _REMEMBERED :], (step, stability)]
        return stability

    def _alone(self, step: Step, error: float) -> PointStability:
        """Of an interpolated step that was not evaluated."""
        return self._watch.at(step.x, self._system.evaluate(step.x, step.parameter).detail, error=error)

    def _together(self, steps: Sequence[tuple[Step, float]]) -> list[PointStability | None]:
        """The same of several, with the errors of their multipliers; None of those to be judged alone."""
        details = [unanswered(*self._system.at(step.parameter)) for step, _ in steps]
        return self._watch.between(np.array([step.x for step, _ in steps]), details, [error for _, error in steps])

    def _error(self, step: Step) -> float:
        """How accurate the multipliers of an interpolated step are: as those of its neighbours."""
        assert step.place is not None
        return max(self.at(beside).error for beside in step.place[:2])

    def _judged_itself(self, first: Step, second: Step, *_: object) -> bool:
        """Whether a point between two is judged by itself: where that is cheap, or where these differ."""
        ends = self.at(first), self.at(second)
        return self.every and (all(end.method == PIECES for end in ends) or len({end.unstable for end in ends}) > 1)

    def _between(self, first: Step, second: Step, *_: object) -> PointStability:
        on_the_circle = first.kind == "turning point" or first.kind in SPECIAL_KINDS
        return replace(self.at(second if on_the_circle else first), multipliers=np.zeros(0, dtype=complex))

    def confirmed(self, step: Step) -> bool:
        """Whether a located step is what it was located as: a jump of multipliers is none."""
        test = {PERIOD_DOUBLING: beside_minus_one, NEIMARK_SACKER: torus, BRANCH_POINT: beside_one}.get(step.kind)
        if test is None or self._of_wave:
            return True
        stability = self.at(step)
        return stability.unstable != UNKNOWN and abs(test(stability.multipliers)) < _NEAR[step.kind]

    def _crossing(self, step: Step) -> float:
        """Changes its sign where a multiplier passes 1 and the branch does not turn.

        Where all harmonics are kept the sign is that of the Jacobian bordered by the tangent: a fold leaves it alone,
        however far off its multiplier is.
        """
        value = float(np.prod(1.0 - real_part(self.at(step).multipliers)))
        if step.orientation and self._complete:
            return abs(value) * step.orientation
        return value * (1.0 if step.tangent_parameter >= 0 else -1.0)

    def _held(self, step: Step) -> float:
        """Changes its sign where a travelling wave loses its symmetry, or has it again."""
        return -1.0 if _lost(self.at(step)) else 1.0

    def _loss(self, first: Step, second: Step, segment: HermiteSegment) -> float:
        """Where on the segment it does, by the segment alone."""
        before = self.at(first).unstable
        low, high = 0.0, 1.0
        for _ in range(_COUNTED):
            middle = 0.5 * (low + high)
            state = segment.point(middle)
            detail = self._system.evaluate(state[:-1], float(state[-1])).detail
            low, high = (middle, high) if self._watch.growing(state[:-1], detail) == before else (low, middle)
        return high

    def _state(self, step: Step) -> float:
        """Changes its sign with the states of the contacts, whatever they are; asked of one step after the other."""
        word = self._word_at(step)
        if self._last is None or word != self._last[0]:
            self._last = word, 1.0 if self._last is None else -self._last[1]
        return self._last[1]

    def _change(self, first: Step, second: Step, segment: HermiteSegment) -> float:
        """Where on the segment the states are those of its end, by the segment alone."""
        before = self._word_at(first)
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            state = segment.point(middle)
            if self._word(state[:-1], float(state[-1]), first.evaluation.detail) == before:
                low = middle
            else:
                high = middle
        return high

    def _word_at(self, step: Step) -> Word:
        return self._word(step.x, step.parameter, step.evaluation.detail)

    def _word(self, x: Array, parameter: float, near: Detail) -> Word:
        x, inputs, omega = self._placed(x, parameter)
        values = [response.values for response in near.responses] if near.states else None
        # slip of all times at once is found by itself: beside that corner the branch is a root, not a cubic
        return word_at(self._watch.balance, x, omega, inputs, values, at_once=False)

    def _placed(self, x: Array, parameter: float) -> tuple[Array, Inputs, float]:
        """Motion (N,), inputs and frequency at unknowns and parameter."""
        return x, *self._system.at(parameter)


def _lost(stability: PointStability) -> bool:
    """Whether a disturbance of another wave number than the wave's own grows fastest."""
    return stability.unstable > 0 and stability.wave_number > 0


def doubling(multipliers: ComplexArray) -> float:
    """``prod (1 + m)`` (THEORY.md section 13)."""
    return float(np.prod(1.0 + multipliers).real)


def torus(multipliers: ComplexArray) -> float:
    """Largest magnitude of a pair, less 1 and half of what counts as unstable; -1 without a pair.

    Without damping pairs stay on the circle, but for rounding.
    """
    pairs = multipliers[np.abs(multipliers.imag) > REAL * np.abs(multipliers)]
    return float(np.abs(pairs).max()) - 1.0 - 0.5 * BEYOND if pairs.size else -1.0


def beside_minus_one(multipliers: ComplexArray) -> float:
    """Distance of the nearest real multiplier from -1."""
    return float(np.abs(1.0 + real_part(multipliers)).min(initial=np.inf))


def beside_one(multipliers: ComplexArray) -> float:
    """Distance of the nearest real multiplier from 1."""
    return float(np.abs(1.0 - real_part(multipliers)).min(initial=np.inf))
