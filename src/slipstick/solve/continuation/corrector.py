"""Points of a branch, and the bordered Newton iteration that finds them."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from math import inf, isfinite
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import Marks, Metric, Scalars, angle_of
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.newton import Evaluation, NewtonOptions, NewtonResult, System, iterate
from slipstick.typing import Array

T = TypeVar("T")

_NOT_SOLVED = NewtonResult(np.empty(0))


class RestartPoint(NamedTuple):
    """An accepted point with all that the next points depend on, except the restart point before it.

    Attributes
    ----------
    state, tangent
        ``(x, parameter)`` and its derivative along the branch, (N + 1,).
    kind, orientation, arclength
        Those of the ``Step``.
    step_length
        Scaled length of the next step.
    measure
        The metric in which the point was found, see ``Metric.measure``.
    context
        The context with which the point was solved: that of the point before.
    values
        Event functions at the point, whose signs are compared with those of the next one.
    points, rejected, evaluations, solves
        Work counters.
    """

    state: Array
    tangent: Array
    kind: str
    orientation: int
    arclength: float
    step_length: float
    measure: tuple[float, float, float, float, float]
    context: Any
    values: tuple[float, ...]
    points: int
    rejected: int
    evaluations: int
    solves: int


class Step:
    """A point of a branch.

    Attributes
    ----------
    state, tangent
        ``(x, parameter)`` and its derivative along the branch, both (N + 1,); the tangent points forward and has unit
        length in the scaled arclength of the step which found it.
    kind
        "start", "regular", "requested", "turning point", "end", "interpolated", or the kind of an event such as "peak".
    name
        Name of the event, "" for ordinary points.
    iterations
        Newton corrections taken at this point.
    residual_norm
        Euclidean norm of the residual at ``x``.
    evaluation
        What the system returned at exactly this ``x`` and ``parameter``; None of an interpolated point.
    jacobian
        The bordered Jacobian at the solution; None of an interpolated point.
    apart
        Relative distance between the cubic from the point before and the one that predicted this point, see
        ``cubic_distance``.
    inserted
        Whether it was inserted between two points that the continuation stepped to.
    place
        Of an interpolated point: the steps on both sides, the segment between them and its place ``u``; else None.
    smooth
        Whether the cubics from the point before are close enough to the branch, and to the observables, to locate
        points along them.
    arclength
        Scaled length of the branch from the start (chords).
    orientation
        Sign of the determinant of the Jacobian bordered by the tangent: constant along a branch between bifurcations.
    """

    __slots__ = (
        "apart",
        "arclength",
        "evaluation",
        "inserted",
        "iterations",
        "jacobian",
        "kind",
        "name",
        "orientation",
        "place",
        "residual_norm",
        "smooth",
        "state",
        "tangent",
    )

    def __init__(self, state: Array, tangent: Array, result: NewtonResult, kind: str, name: str, size: int) -> None:
        self.state, self.tangent, self.kind, self.name = state, tangent, kind, name
        self.iterations, self.evaluation = result.iterations, result.evaluation
        residual = result.residual[:size]
        self.residual_norm = float(np.sqrt(residual.dot(residual)))
        self.jacobian: Jacobian | None = getattr(result, "jacobian", None)
        self.orientation = 0
        self.arclength = 0.0
        self.apart, self.smooth, self.inserted = inf, False, False
        self.place: tuple[Step, Step, HermiteSegment, float] | None = None

    @classmethod
    def interpolated(
        cls, state: Array, tangent: Array, place: tuple[Step, Step, HermiteSegment, float], arclength: float
    ) -> Step:
        """The point at a ``place`` of a segment."""
        step = cls(state, tangent, _NOT_SOLVED, "interpolated", "", state.size - 1)
        step.place, step.arclength = place, arclength
        return step

    @classmethod
    def of_restart(cls, point: RestartPoint, evaluation: Any = None) -> Step:
        """The step of a restart point; ``evaluation`` is what the system returned there."""
        result = NewtonResult(point.state)
        result.evaluation = evaluation
        if evaluation is not None:
            result.residual = evaluation.residual
        step = cls(point.state, point.tangent, result, point.kind, "", point.state.size - 1)
        step.orientation, step.arclength = point.orientation, point.arclength
        return step

    def named(self, kind: str, name: str) -> Step:
        """The same solution as a point of another kind."""
        other = copy(self)
        other.state, other.kind, other.name = self.state.copy(), kind, name
        return other

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

    def release(self) -> None:
        """Free memory of the Jacobian, of a solution that hardly becomes a point; see ``Jacobian.release``."""
        if self.jacobian is not None:
            self.jacobian.release()

    def reverse(self) -> None:
        """Turn the direction of travel."""
        self.tangent, self.orientation = -self.tangent, -self.orientation

    def __repr__(self) -> str:
        return f"Step({self.kind}{' ' + self.name if self.name else ''} at {self.parameter:.6g})"


class LatestSteps(Generic[T]):
    """Values at the ``most`` latest steps."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._values: dict[int, tuple[Step, T]] = {}

    def known(self, step: Step) -> T | None:
        """The value at a step, if it is kept."""
        found = self._values.get(id(step))
        return None if found is None or found[0] is not step else found[1]

    def keep(self, step: Step, value: T) -> None:
        """Keep the value at a step in the place of the oldest, and the step, whose identity no other one has then."""
        if len(self._values) >= self._most:
            del self._values[next(iter(self._values))]
        self._values[id(step)] = step, value


_NEAR = 0.5
"""Largest distance of a solution from its place on a segment, over the segment's length: a farther one is another."""
_DISTANCE_ERROR = 3e-3
"""Relative error of distances from the branch: the Jacobian of a neighbouring point gives them no better."""
_LOCATED_TOLERANCE = 1e-14
"""Newton tolerance of located points, which are located more closely than points follow one another: to rounding."""
_ROUGH_TOLERANCE = 1e-5
"""Newton tolerance of solutions that only supply slopes and heights."""
_PATIENT_ITERATIONS, _PATIENT_DAMPING = 2, 0.1
"""Iterations, over the usual ones, and least damping where no shorter step can be taken after a failure."""


def is_near(metric: Metric, off: Array, length: Scalars) -> Marks:
    """Whether a solution ``off`` its place on a segment of some ``length`` may be the one expected there."""
    return metric.length(off) <= _NEAR * length


class Corrector:
    """Newton on ``(x, parameter)`` in a plane across the branch; counts its work.

    Attributes
    ----------
    usual, patient, exact, rough
        Options of the iteration: for steps, where no shorter step is possible, for located points, for slopes alone.
    evaluations, solves
        Evaluations of the system and linear solves so far.
    context
        What the last accepted point passes to the next ones, see ``System``.
    neighbour
        The Jacobian of a neighbouring solution, whose preconditioner may serve.
    """

    def __init__(self, system: System, size: int, metric: Metric, options: NewtonOptions) -> None:
        self._system, self._size, self.metric, self.usual = system, size, metric, options
        self.patient = patient(options)
        self.exact = replace(self.patient, tolerance=min(_LOCATED_TOLERANCE, options.tolerance))
        self.rough = replace(options, tolerance=max(_ROUGH_TOLERANCE, options.tolerance))
        self.evaluations = self.solves = 0
        self.context: Any = None
        self.neighbour: Jacobian | None = None
        # both are needed several times in a row: without these caches a curve of the oscillator takes 4 % longer
        self._latest: tuple[Any, HermiteSegment | None] = ((None, None, None), None)
        self._latest_angle: tuple[Any, float] = ((None, None, None), 0.0)

    def _evaluate(self, x: Array, parameter: float, context: Any = None) -> Any:
        context = self.context if context is None else context
        if context is None:
            return self._system.evaluate(x, parameter)
        return self._system.evaluate(x, parameter, context)  # type: ignore[call-arg]

    def resume(self, point: RestartPoint) -> Step:
        """The step of a restart point with its evaluation; restores the counters and the context at that point."""
        self.context = point.context
        self.evaluations, self.solves = point.evaluations, point.solves
        return Step.of_restart(point, self._evaluate(point.state[:-1], float(point.state[-1])))

    def correct(
        self,
        guess: Array,
        normal: Array | None,
        kind: str,
        *,
        forward: Array | None = None,
        name: str = "",
        options: NewtonOptions | None = None,
        max_distance: float = inf,
    ) -> tuple[Step | None, NewtonResult]:
        """The solution on the plane through ``guess`` (N + 1,) across ``normal``, None if the iteration fails.

        ``normal`` None keeps the parameter of ``guess`` exactly; the tangent then points along ``forward`` if given.
        ``options`` are ``usual`` unless given. The iteration fails where the scaled length of the first correction
        exceeds ``max_distance``.
        """
        size, weights = self._size, self.metric.weights
        if normal is None:
            row = np.zeros(size + 1)
            row[-1] = 1.0
        else:
            row = normal * weights * weights
            row /= np.abs(row).max()
        options = options or self.usual
        value = float(guess[-1]) if normal is None else None
        result = self._solve(guess, row, options, value, max_distance=max_distance)
        while result.converged and (finer := _refined_context(result.evaluation)) is not None:
            guess[:] = result.x
            if value is not None:
                guess[-1] = value
            result = self._solve(guess, row, options, value, finer)
        if not result.converged:
            return None, result
        if value is not None:
            result.x[-1] = value
        if self.neighbour is not None:
            self.neighbour = result.jacobian  # the next solution is most often near this one
        tangent = self._null(result, row)
        step = Step(result.x, tangent, result, kind, name, size)
        step.orientation = result.jacobian.sign()
        if normal is None and forward is not None and self.metric.cosine(tangent, forward) < 0:
            step.reverse()
        return step, result

    def _solve(
        self, guess: Array, row: Array, options: NewtonOptions, fixed: float | None, context: Any = None,
        max_distance: float = inf,
    ) -> NewtonResult:  # fmt: skip
        """Iterate on the system bordered by ``row @ (z - guess) = 0``.

        ``fixed`` is the parameter where it is kept: solutions by refinement keep that of ``z`` but for their error.
        """
        size, evaluate, level = self._size, self._evaluate, row.dot(guess)

        def bordered(z: Array) -> tuple[Array, Jacobian, Any]:
            value = evaluate(z[:size], float(z[size]) if fixed is None else fixed, context)
            residual = np.empty(size + 1)
            residual[:size] = value.residual
            residual[size] = row.dot(z) - level
            return residual, value.jacobian.bordered(value.parameter_derivative, row), value

        is_too_far = None if max_distance == inf else lambda step: self.metric.length(step) > max_distance
        result = iterate(bordered, guess, self.metric.inverse, options, is_too_far, self.neighbour)
        self.evaluations += result.evaluations
        self.solves += result.solves
        return result

    def _null(self, result: NewtonResult, row: Array) -> Array:
        """Unit tangent with ``row @ tangent > 0`` from the Jacobian at the solution."""
        tangent = self._last_unit(result.jacobian, row.size)
        tangent /= self.metric.length(tangent)
        return tangent

    def _last_unit(self, jacobian: Jacobian, size: int) -> Array:
        """Solution for the last unit vector."""
        right = np.zeros(size)
        right[-1] = 1.0
        self.solves += 1
        return jacobian.solve(right)

    def residuals(self, states: Array) -> Array:
        """Residuals (n, N) at n states (n, N + 1)."""
        return np.array([self._evaluate(state[:-1], float(state[-1])).residual for state in states])

    def off(self, residuals: Array, neighbour: Step) -> Array:
        """Distances (n, N + 1) from the branch of states with ``residuals`` (n, N), by the Jacobian of a neighbour.

        Infinite where the residuals are not finite or the neighbour has no Jacobian.
        """
        if neighbour.jacobian is None:
            return np.full((len(residuals), self._size + 1), inf)
        right = np.zeros((self._size + 1, len(residuals)))
        right[:-1] = residuals.T
        unknown = None if isfinite(residuals.sum()) else ~np.all(np.isfinite(residuals), axis=1)
        if unknown is not None:
            right[:, unknown] = 0.0
        self.solves += len(residuals)
        off = neighbour.jacobian.solve_correction(right, _DISTANCE_ERROR).T
        if unknown is not None:
            off[unknown] = inf
        return off if isfinite(off.sum()) else np.where(np.isfinite(off), off, inf)

    def near(self, off: Array, length: float) -> bool:
        """See ``is_near``."""
        return bool(is_near(self.metric, off, length))

    def tangent_at(self, state: Array, along: Array) -> tuple[Array, int] | None:
        """Null direction of the Jacobian at any state, and its orientation; None if the bordered Jacobian is singular.

        It points along ``along``: their scaled product is positive.
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
        """The cubic between two neighbouring points in the present metric; the latest is cached."""
        (one, other, weights), segment = self._latest
        if segment is None or one is not first or other is not second or weights is not self.metric.weights:
            angle = self.angle(first.tangent, second.tangent)
            segment = HermiteSegment.of(
                self.metric, (first.state, first.tangent), (second.state, second.tangent), angle
            )
            self._latest = (first, second, self.metric.weights), segment
        return segment

    def angle(self, a: Array, b: Array) -> float:
        """Scaled angle between two tangents (N + 1,); the latest is cached."""
        (one, other, weights), angle = self._latest_angle
        if one is not a or other is not b or weights is not self.metric.weights:
            angle = angle_of(self.metric.cosine(a, b))
            self._latest_angle = (a, b, self.metric.weights), angle
        return angle


def patient(options: NewtonOptions) -> NewtonOptions:
    """More iterations and more damping, where no shorter step can be taken after a failure."""
    return replace(options, max_iterations=_PATIENT_ITERATIONS * options.max_iterations, min_damping=_PATIENT_DAMPING)


def _refined_context(evaluation: Evaluation) -> Any:
    """The context with which a solution has to be solved again; None where it is final."""
    return None if evaluation.again is None else evaluation.again()
