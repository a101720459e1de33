"""A point of a branch, and the restart point: what a continuation can be taken up from, in another process too."""

from __future__ import annotations

from copy import copy
from math import inf
from typing import Any, NamedTuple

import numpy as np

from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.newton import NewtonResult
from slipstick.typing import Array

_NOT_SOLVED = NewtonResult(np.empty(0))


class RestartPoint(NamedTuple):
    """An accepted point and what the points after it depend on; with the restart point before it, that is everything.

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
        The context the point was solved with: what the point before handed on.
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
    measure: tuple[float, float, float, float]
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
        The bordered Jacobian that it was corrected with last; None of a point that was not.
    apart
        Distance in the middle between the cubic from the point before and the one that predicted this point, over the
        size of the solution, see ``cubic_distance``.
    inserted
        Whether it was put between two points that the continuation stepped to.
    place
        Of an interpolated point: the steps on both sides, the segment between them and its place ``u``; else None.
    smooth
        Whether the cubics from the point before are as near to the branch, and to what is read off it, as they should
        be where something is sought along them.
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
        """A point of a segment, at a ``place``."""
        step = cls(state, tangent, _NOT_SOLVED, "interpolated", "", state.size - 1)
        step.place, step.arclength = place, arclength
        return step

    @classmethod
    def again(cls, point: RestartPoint, evaluation: Any = None) -> Step:
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
        again = copy(self)
        again.state, again.kind, again.name = self.state.copy(), kind, name
        return again

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

    def reverse(self) -> None:
        """Turn the direction of travel."""
        self.tangent, self.orientation = -self.tangent, -self.orientation

    def __repr__(self) -> str:
        return f"Step({self.kind}{' ' + self.name if self.name else ''} at {self.parameter:.6g})"
