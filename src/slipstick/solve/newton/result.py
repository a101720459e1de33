"""How a Newton iteration ended."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.errors import Reason
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.newton.system import Evaluation
from slipstick.solve.norm import norm
from slipstick.typing import Array

_EPSILON = float(np.finfo(float).eps)
_STILL_A_SOLUTION = 1e-3


class NewtonStop(Reason):
    """Why an iteration stopped."""

    CONVERGED = "converged"
    ROUNDING = "converged to rounding level"
    NOT_FINITE = "the residual is not finite"
    SINGULAR = "the Jacobian is singular"
    NO_GAIN = "the line search found no step that brings the solution nearer"
    TOO_MANY = "no convergence in the iterations allowed"
    NO_PROGRESS = "given up: the corrections did not become smaller"
    TOO_FAR = "given up: the first correction leads too far away"


Trial = tuple[Array, Array, Jacobian, Any, float]


class NewtonResult:
    """End of a Newton iteration.

    Attributes
    ----------
    x, residual, jacobian
        Last accepted state (N,), its residual (N,) and Jacobian.
    residual_norm
        Euclidean norm of the residual.
    correction_norm
        Scaled norm of the Newton correction at ``x``: an estimate of the error of ``x`` in units of the scale.
    iterations, evaluations, solves
        Corrections applied, evaluations of the system, linear solves (back substitutions).
    reason
        Why it stopped; None while it has not.
    history, corrections
        Residual norms and scaled correction norms at every accepted state, first to last.
    contraction
        Ratio of the first simplified correction to the first correction (0 if there was none): the rate of convergence.
    evaluation
        What the system returned at ``x``.
    """

    __slots__ = (
        "contraction",
        "correction_norm",
        "corrections",
        "evaluation",
        "evaluations",
        "history",
        "iterations",
        "jacobian",
        "reason",
        "residual",
        "residual_norm",
        "solves",
        "x",
    )

    def __init__(self, x: Array) -> None:
        self.x = x
        self.residual = np.empty(0)
        self.residual_norm = self.correction_norm = np.inf
        self.iterations = self.evaluations = self.solves = 0
        self.reason: NewtonStop | None = None
        self.history: list[float] = []
        self.corrections: list[float] = []
        self.contraction = 0.0
        self.evaluation: Any = None
        self.jacobian: Jacobian

    @property
    def converged(self) -> bool:
        """Whether the tolerance was met, or all but the rounding of the residual's own terms is gone."""
        return self.reason is NewtonStop.CONVERGED or self.stagnated

    @property
    def stagnated(self) -> bool:
        """Whether it converged to rounding level only."""
        return self.reason is NewtonStop.ROUNDING

    def is_rounding(self) -> bool:
        """Whether the residual is nothing but the rounding of its own terms."""
        if not self.correction_norm < _STILL_A_SOLUTION:
            return False
        size = norm(self.jacobian.bound(self.x))
        terms = self.evaluation.terms if isinstance(self.evaluation, Evaluation) else None
        if terms is not None:
            size = max(size, norm(terms()))
        return self.residual_norm <= 16.0 * _EPSILON * size

    def accept(self, trial: Trial) -> None:
        """Move to a trial state: x, residual, Jacobian, evaluation, residual norm."""
        self.x, self.residual, self.jacobian, self.evaluation, self.residual_norm = trial

    def __repr__(self) -> str:
        ended = "under way" if self.reason is None else self.reason.text
        return f"NewtonResult({ended}, iterations={self.iterations}, residual_norm={self.residual_norm:.2e})"
