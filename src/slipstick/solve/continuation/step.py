"""A point of a branch."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.solve.continuation.place import Place
from slipstick.solve.newton.result import NewtonResult
from slipstick.typing import Array


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
    orientation
        Sign of the determinant of the Jacobian bordered by the tangent: constant along a branch between bifurcations.
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

    @classmethod
    def again(cls, place: Place, evaluation: Any = None) -> Step:
        """The step of a place; ``evaluation`` is what the system returned there."""
        result = NewtonResult(place.state)
        result.evaluation = evaluation
        if evaluation is not None:
            result.residual = evaluation.residual
        step = cls(place.state, place.tangent, result, place.kind, "", place.state.size - 1)
        step.orientation, step.arclength = place.orientation, place.arclength
        return step

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
