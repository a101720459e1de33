"""Test functions of a branch for changes of the kind of motion (THEORY.md section 13).

Folds are turning points, found by the continuation. The others follow here: a multiplier passes -1 (the period
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
from slipstick.analysis.stability.state_sequence import StateOrder, state_order_at
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
    WARNED_DIFFERENCE,
    PointStability,
    Unjudged,
)
from slipstick.solve.continuation import LatestSteps, Step
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.typing import Array, ComplexArray

_HALVINGS, _HALVINGS_BY_COUNT = 10, 6
"""Halvings of a segment until a change of states, or of symmetry, is located: each count costs as much as a point."""

_STORED_STEPS = 8
"""Latest steps whose stability is stored: the continuation evaluates several test functions at each."""

CHEAP_CONTACTS = 4
"""Number of contacts up to which stability costs little: interpolated points are judged by themselves then."""

_ON_CIRCLE = {PERIOD_DOUBLING: 1e-3, NEIMARK_SACKER: 1e-3, BRANCH_POINT: 5e-2}
"""Distance from -1, 1 or the circle within which a located multiplier counts as there."""


class SpecialPoints:
    """Test functions of a branch, with the stability of the latest steps."""

    def __init__(self, watch: StabilityWatch, system: FrequencySystem | ParameterSystem) -> None:
        self._watch, self._system = watch, system
        h = watch.balance.harmonics
        self._complete = h.highest == h.n
        switching = any(batch.law.regimes is not None for batch in watch.balance.batches)
        self.every = watch.systems.in_time and watch.balance.n_contacts <= CHEAP_CONTACTS and not switching
        """Whether interpolated points are judged too."""
        self._of_wave = watch.balance.receptance.waves is not None
        self._recent = LatestSteps[PointStability](_STORED_STEPS)
        self._last: tuple[StateOrder, float] | None = None

    @property
    def events(self) -> tuple[BranchEvent, ...]:
        """Events for the continuation to locate."""
        changes = BranchEvent(
            name=STATE_CHANGE, kind=STATE_CHANGE, function=lambda step: self._state(step), place=self._state_change
        )
        if self._of_wave:
            lost = BranchEvent(name=BRANCH_POINT, kind=BRANCH_POINT, function=self._symmetry, place=self._symmetry_loss)
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
        """Resume at an accepted step, where the test function of states had a value."""
        self._last = self._order_at(step), value

    def judged(self, step: Step, *, compare: bool) -> PointStability | Unjudged:
        """Stability of a step for the record; ``compare`` adds the difference of both methods.

        Between solved points the kind of motion does not change: unless ``every`` point is judged, an interpolated one
        takes the stability of its neighbours. A step that is evaluated when it is recorded is judged then.
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
        if (known := self._recent.known(step)) is not None:
            return known
        odd, error = None, None
        if step.place is not None:
            error = self._error(step)
        elif step.orientation and self._complete:
            odd = step.orientation * step.tangent_parameter < 0.0
        stability = self._watch.at(step.x, step.evaluation.detail, odd=odd, error=error)
        self._recent.keep(step, stability)
        return stability

    def _alone(self, step: Step, error: float) -> PointStability:
        """Stability of an interpolated step that was not evaluated."""
        return self._watch.at(step.x, self._system.evaluate(step.x, step.parameter).detail, error=error)

    def _together(self, steps: Sequence[tuple[Step, float]]) -> list[PointStability | None]:
        """As ``_alone``, of several steps with the errors of their multipliers; None for those to be judged alone."""
        details = [unanswered(*self._system.at(step.parameter)) for step, _ in steps]
        return self._watch.between(np.array([step.x for step, _ in steps]), details, [error for _, error in steps])

    def _error(self, step: Step) -> float:
        """Error of the multipliers of an interpolated step: the larger one of its neighbours."""
        assert step.place is not None
        return max(self.at(neighbour).error for neighbour in step.place[:2])

    def _judged_itself(self, first: Step, second: Step, *_: object) -> bool:
        """Whether a point between two is judged by itself: where that is cheap, or where these differ."""
        ends = self.at(first), self.at(second)
        return self.every and (all(end.method == PIECES for end in ends) or len({end.unstable for end in ends}) > 1)

    def _between(self, first: Step, second: Step, *_: object) -> PointStability:
        on_the_circle = first.kind == "turning point" or first.kind in SPECIAL_KINDS
        return replace(self.at(second if on_the_circle else first), multipliers=np.zeros(0, dtype=complex))

    def confirmed(self, step: Step) -> bool:
        """Whether a located step is of its kind, and not a jump of multipliers.

        The multiplier sought lies on the circle there, so how many disturbances grow need not be settled.
        """
        test = {PERIOD_DOUBLING: distance_from_minus_one, NEIMARK_SACKER: torus, BRANCH_POINT: distance_from_one}.get(
            step.kind
        )
        if test is None or self._of_wave:
            return True
        stability = self.at(step)
        trusted = stability.unstable != UNKNOWN or stability.error < WARNED_DIFFERENCE
        return trusted and abs(test(stability.multipliers)) < _ON_CIRCLE[step.kind]

    def _crossing(self, step: Step) -> float:
        """Changes its sign where a multiplier passes 1 and the branch does not turn.

        Where all harmonics are present the sign is that of the Jacobian bordered by the tangent: a fold does not change
        it, however inaccurate its multiplier is.
        """
        value = float(np.prod(1.0 - real_part(self.at(step).multipliers)))
        if step.orientation and self._complete:
            return abs(value) * step.orientation
        return value * (1.0 if step.tangent_parameter >= 0 else -1.0)

    def _symmetry(self, step: Step) -> float:
        """Changes its sign where a travelling wave loses or regains its symmetry."""
        return -1.0 if _symmetry_lost(self.at(step)) else 1.0

    def _symmetry_loss(self, first: Step, second: Step, segment: HermiteSegment) -> float:
        """Place (0 to 1) on the segment where it does, by halving; no further solution is computed."""
        before = self.at(first).unstable
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS_BY_COUNT):
            middle = 0.5 * (low + high)
            state = segment.point(middle)
            detail = self._system.evaluate(state[:-1], float(state[-1])).detail
            low, high = (middle, high) if self._watch.growing(state[:-1], detail) == before else (low, middle)
        return high

    def _state(self, step: Step) -> float:
        """Changes its sign whenever the order of contact states changes; to be called step after step."""
        order = self._order_at(step)
        if self._last is None or order != self._last[0]:
            self._last = order, 1.0 if self._last is None else -self._last[1]
        return self._last[1]

    def _state_change(self, first: Step, second: Step, segment: HermiteSegment) -> float:
        """Place (0 to 1) on the segment where the states become those of its end, by halving."""
        before = self._order_at(first)
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            state = segment.point(middle)
            if self._order(state[:-1], float(state[-1]), first.evaluation.detail) == before:
                low = middle
            else:
                high = middle
        return high

    def _order_at(self, step: Step) -> StateOrder:
        return self._order(step.x, step.parameter, step.evaluation.detail)

    def _order(self, x: Array, parameter: float, near: Detail) -> StateOrder:
        x, inputs, omega = self._placed(x, parameter)
        values = [response.values for response in near.responses] if near.states else None
        # full slip at once is located by itself: at that corner the branch behaves as a square root, not as a cubic
        return state_order_at(self._watch.balance, x, omega, inputs, values, at_once=False)

    def _placed(self, x: Array, parameter: float) -> tuple[Array, Inputs, float]:
        """Motion (N,), inputs and frequency at unknowns and parameter."""
        return x, *self._system.at(parameter)


def _symmetry_lost(stability: PointStability) -> bool:
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


def distance_from_minus_one(multipliers: ComplexArray) -> float:
    """Distance of the nearest real multiplier from -1."""
    return float(np.abs(1.0 + real_part(multipliers)).min(initial=np.inf))


def distance_from_one(multipliers: ComplexArray) -> float:
    """Distance of the nearest real multiplier from 1."""
    return float(np.abs(1.0 - real_part(multipliers)).min(initial=np.inf))
