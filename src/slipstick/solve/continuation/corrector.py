"""The bordered Newton iteration that finds the points of a branch."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite
from typing import Any

import numpy as np

from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import Metric, angle_of
from slipstick.solve.continuation.step import RestartPoint, Step
from slipstick.solve.continuation.step_acceptance import is_near
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.newton import NewtonOptions, NewtonResult, System, iterate
from slipstick.typing import Array

_OFF = 3e-3
"""Relative error of how far states are off the branch, which the Jacobian of another point does not tell better."""
_LOCATED = 1e-14
"""Newton tolerance of located points, whose places are known better than the points between: down to rounding."""
_ROUGH = 1e-5
"""Newton tolerance of solutions that only tell of slopes and heights."""


class Corrector:
    """Newton on ``(x, parameter)`` in a plane across the branch; counts its work.

    ``context`` is what the last accepted point hands to the next ones, see ``System``; ``beside`` is the Jacobian of a
    solution near all that are sought, from which theirs take over what they can.
    """

    def __init__(self, system: System, size: int, metric: Metric, options: NewtonOptions) -> None:
        self._system, self._size, self.metric, self.usual = system, size, metric, options
        self.patient = replace(options, max_iterations=2 * options.max_iterations, min_damping=0.1)
        self.exact = replace(self.patient, tolerance=min(_LOCATED, options.tolerance))
        self.rough = replace(options, tolerance=max(_ROUGH, options.tolerance))
        self.evaluations = self.solves = 0
        self.context: Any = None
        self.beside: Jacobian | None = None
        # each is asked for several times in a row: without these two a curve of the oscillator takes 4 % longer
        self._latest: tuple[Any, HermiteSegment | None] = ((None, None, None), None)
        self._latest_angle: tuple[Any, float] = ((None, None, None), 0.0)

    def _evaluate(self, x: Array, parameter: float, context: Any = None) -> Any:
        context = self.context if context is None else context
        if context is None:
            return self._system.evaluate(x, parameter)
        return self._system.evaluate(x, parameter, context)  # type: ignore[call-arg]

    def take_up(self, point: RestartPoint) -> Step:
        """The step of a restart point with its evaluation; counters and context are as they were when it was found."""
        self.context = point.context
        self.evaluations, self.solves = point.evaluations, point.solves
        return Step.again(point, self._evaluate(point.state[:-1], float(point.state[-1])))

    def correct(
        self,
        guess: Array,
        normal: Array | None,
        kind: str,
        *,
        forward: Array | None = None,
        name: str = "",
        options: NewtonOptions | None = None,
        reach: float = inf,
    ) -> tuple[Step | None, NewtonResult]:
        """The solution on the plane through ``guess`` (N + 1,) across ``normal``, None if the iteration fails.

        ``normal`` None keeps the parameter of ``guess`` exactly; the tangent then points along ``forward`` if given.
        ``options`` are those of the corrector, or its ``exact``, ``patient`` or ``rough`` ones. It is given up where
        the first correction leads further than a scaled ``reach`` away.
        """
        size, weights = self._size, self.metric.weights
        if normal is None:
            row = np.zeros(size + 1)
            row[-1] = 1.0
        else:
            row = normal * weights * weights
            row /= np.abs(row).max()
        options = options or self.usual
        result = self._solve(guess, row, options, reach=reach)
        while result.converged and (finer := _again(result.evaluation)) is not None:
            guess[:] = result.x
            result = self._solve(guess, row, options, finer)
        if not result.converged:
            return None, result
        if normal is None:
            result.x[-1] = guess[-1]
        if self.beside is not None:
            self.beside = result.jacobian  # the next one sought most often is near this one
        tangent = self._null(result, row)
        step = Step(result.x, tangent, result, kind, name, size)
        step.orientation = result.jacobian.sign()
        if normal is None and forward is not None and self.metric.cosine(tangent, forward) < 0:
            step.reverse()
        return step, result

    def _solve(
        self, guess: Array, row: Array, options: NewtonOptions, context: Any = None, reach: float = inf
    ) -> NewtonResult:
        """Iterate on the system bordered by ``row @ (z - guess) = 0``."""
        size, evaluate, level = self._size, self._evaluate, row.dot(guess)

        def bordered(z: Array) -> tuple[Array, Jacobian, Any]:
            value = evaluate(z[:size], float(z[size]), context)
            residual = np.empty(size + 1)
            residual[:size] = value.residual
            residual[size] = row.dot(z) - level
            return residual, value.jacobian.bordered(value.parameter_derivative, row), value

        too_far = None if reach == inf else lambda step: self.metric.length(step) > reach
        result = iterate(bordered, guess, self.metric.inverse, options, too_far, self.beside)
        self.evaluations += result.evaluations
        self.solves += result.solves
        return result

    def _null(self, result: NewtonResult, row: Array) -> Array:
        """Unit tangent with ``row @ tangent > 0`` from the Jacobian at the solution."""
        tangent = self._last_unit(result.jacobian, row.size)
        tangent /= self.metric.length(tangent)
        return tangent

    def _last_unit(self, jacobian: Jacobian, size: int) -> Array:
        """Solution for a right-hand side that is zero but for a one at its end."""
        right = np.zeros(size)
        right[-1] = 1.0
        self.solves += 1
        return jacobian.solve(right)

    def residuals(self, states: Array) -> Array:
        """Residuals (n, N) at n states (n, N + 1)."""
        return np.array([self._evaluate(state[:-1], float(state[-1])).residual for state in states])

    def off(self, residuals: Array, beside: Step) -> Array:
        """How far states (n, N + 1) with ``residuals`` (n, N) are off the branch, by the Jacobian of a step nearby.

        Infinite where that cannot be said.
        """
        if beside.jacobian is None:
            return np.full((len(residuals), self._size + 1), inf)
        right = np.zeros((self._size + 1, len(residuals)))
        right[:-1] = residuals.T
        unknown = None if isfinite(residuals.sum()) else ~np.all(np.isfinite(residuals), axis=1)
        if unknown is not None:
            right[:, unknown] = 0.0
        self.solves += len(residuals)
        off = beside.jacobian.solve_correction(right, _OFF).T
        if unknown is not None:
            off[unknown] = inf
        return off if isfinite(off.sum()) else np.where(np.isfinite(off), off, inf)

    def near(self, off: Array, length: float) -> bool:
        """Whether a solution ``off`` (N + 1,) from where a segment of some ``length`` expects it may be that one."""
        return bool(is_near(self.metric, off, length))

    def tangent_at(self, state: Array, along: Array) -> tuple[Array, int] | None:
        """Direction in which the residual does not change at any state, and its orientation; None if there is none.

        ``along @ direction > 0`` in the scaled sense.
        """
        row = along * self.metric.weights**2
        row /= np.abs(row).max()
        value = self._evaluate(state[:-1], float(state[-1]))
        self.evaluations += 1
        jacobian = value.jacobian.bordered(value.parameter_derivative, row)
        if jacobian.singular:
            return None
        tangent = self._last_unit(jacobian, row.size)
        if not np.all(np.isfinite(tangent)):
            return None
        return tangent / self.metric.length(tangent), jacobian.sign()

    def segment(self, first: Step, second: Step) -> HermiteSegment:
        """The cubic between two neighbouring points in the present metric; the latest is remembered."""
        (one, other, weights), segment = self._latest
        if segment is None or one is not first or other is not second or weights is not self.metric.weights:
            angle = self.angle(first.tangent, second.tangent)
            segment = HermiteSegment.of(
                self.metric, (first.state, first.tangent), (second.state, second.tangent), angle
            )
            self._latest = (first, second, self.metric.weights), segment
        return segment

    def angle(self, a: Array, b: Array) -> float:
        """Scaled angle between two tangents (N + 1,); the latest is remembered."""
        (one, other, weights), angle = self._latest_angle
        if one is not a or other is not b or weights is not self.metric.weights:
            angle = angle_of(self.metric.cosine(a, b))
            self._latest_angle = (a, b, self.metric.weights), angle
        return angle


def _again(value: Any) -> Any:
    """With which context a solution has to be sought once more; None where it is good as it is."""
    again = getattr(value, "again", None)
    return None if again is None else again()
