"""Damped Newton for piecewise smooth systems.

Globalised by natural monotonicity (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3):
the progress of a step is measured by the simplified correction, not by the residual, so that it does not depend on how
the equations are scaled. Where the whole correction does not help, the best fraction of it is taken, and where none
helps a few whole corrections are taken all the same: both carry the iteration across the kinks of stick and slip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import InputError
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.typing import Array

EPSILON = float(np.finfo(float).eps)
_CLEAR_GAIN = 0.5
_WORST_LOSS = 10.0
_STILL_A_SOLUTION = 1e-3
SINGULAR_JACOBIAN = "the Jacobian is singular"


class Evaluation(NamedTuple):
    """Residual (N,), Jacobian and derivative of the residual by the parameter (N,) of a system at one state.

    ``detail`` is handed through untouched: whatever the system wants to find again at a converged point. ``terms``
    gives the sizes (N,) of the largest terms each residual is the sum of, which says what its rounding is; without it
    they are taken from the Jacobian. ``context`` is what the next points of a branch are to be told where this one is
    accepted (None: nothing).
    """

    residual: Array
    jacobian: Jacobian
    parameter_derivative: Array | None = None
    detail: Any = None
    terms: Callable[[], Array] | None = None
    context: Any = None


class System(Protocol):
    """``residual(x, parameter) = 0``, N equations for N unknowns.

    The same arguments give the same answer. A system whose answer depends on the branch it is followed along returns a
    ``context`` with each evaluation and takes that of the point accepted last as a third argument.
    """

    def evaluate(self, x: Array, parameter: float) -> Evaluation:
        """Residual, Jacobian and parameter derivative at ``x`` (N,)."""
        ...


@dataclass(frozen=True, kw_only=True)
class NewtonOptions:
    """How the Newton iteration runs.

    Parameters
    ----------
    tolerance
        Largest scaled norm of the Newton correction at a converged point.
    max_iterations
        Largest number of corrections.
    min_damping
        Smallest fraction of a correction tried.
    non_monotone
        How many whole corrections may be taken although no fraction of them helps.
    stagnation
        Corrections below this which no longer shrink are rounding: accepted, and marked ``stagnated``.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    tolerance: float = 1e-10
    max_iterations: int = 30
    min_damping: float = 1e-5
    non_monotone: int = 4
    stagnation: float = 1e-8

    def __post_init__(self) -> None:
        faults = []
        if not 0 < self.tolerance < 1:
            faults.append(f"Newton tolerance: found {self.tolerance}; expected a number between 0 and 1")
        if self.max_iterations < 1:
            faults.append(f"Newton max_iterations: found {self.max_iterations}; expected at least 1")
        if not 0 < self.min_damping <= 1:
            faults.append(f"Newton min_damping: found {self.min_damping}; expected a number in (0, 1]")
        if self.non_monotone < 0:
            faults.append(f"Newton non_monotone: found {self.non_monotone}; expected 0 or more")
        if not 0 <= self.stagnation < 1:
            faults.append(f"Newton stagnation: found {self.stagnation}; expected a number in [0, 1)")
        if faults:
            raise InputError(faults)


Trial = tuple[Array, Array, Jacobian, Any, float]


class NewtonResult:
    """End of a Newton iteration.

    Attributes
    ----------
    x, residual, jacobian
        Last accepted state (N,), its residual (N,) and Jacobian, factorised.
    residual_norm
        Euclidean norm of the residual.
    correction_norm
        Scaled norm of the Newton correction at ``x``: an estimate of the error of ``x`` in units of the scale.
    iterations, evaluations, solves
        Corrections applied, evaluations of the system, linear solves (back substitutions).
    converged, stagnated
        Whether the tolerance was met; ``stagnated`` if only down to rounding level.
    reason
        Why it stopped, in words.
    history, corrections
        Residual norms and scaled correction norms at every accepted state, first to last.
    contraction
        Ratio of the first simplified correction to the first correction (0 if there was none): the rate of convergence.
    evaluation
        What the system returned at ``x``.
    """

    __slots__ = (
        "contraction",
        "converged",
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
        "stagnated",
        "x",
    )

    def __init__(self, x: Array) -> None:
        self.x = x
        self.residual = np.empty(0)
        self.residual_norm = self.correction_norm = np.inf
        self.iterations = self.evaluations = self.solves = 0
        self.converged = self.stagnated = False
        self.reason = ""
        self.history: list[float] = []
        self.corrections: list[float] = []
        self.contraction = 0.0
        self.evaluation: Any = None
        self.jacobian: Jacobian

    def accept(self, trial: Trial) -> None:
        """Move to a trial state: x, residual, Jacobian, evaluation, residual norm."""
        self.x, self.residual, self.jacobian, self.evaluation, self.residual_norm = trial

    def __repr__(self) -> str:
        return f"NewtonResult({self.reason}, iterations={self.iterations}, residual_norm={self.residual_norm:.2e})"


def newton(
    system: Callable[[Array], Evaluation],
    x0: ArrayLike,
    *,
    options: NewtonOptions | None = None,
    scale: ArrayLike = 1.0,
) -> NewtonResult:
    """Solve ``system(x).residual = 0``.

    Parameters
    ----------
    system
        Function of ``x`` (N,) that returns ``residual`` (N,) and ``jacobian`` as attributes.
    x0
        First guess (N,).
    scale
        Typical size of the unknowns, scalar or (N,), positive: corrections are measured relative to it.

    Returns
    -------
    NewtonResult
        Look at ``converged``; nothing is raised when the iteration fails.

    Examples
    --------
    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> result = newton(lambda x: Evaluation(x**3 - 8.0, DenseJacobian(np.diag(3.0 * x**2))), [5.0])
    >>> result.converged, round(float(result.x[0]), 9)
    (True, 2.0)
    """
    start = np.array(x0, dtype=float)
    inverse = 1.0 / np.asarray(scale, dtype=float)
    return iterate(_plain(system), start, inverse, options or NewtonOptions())


def newton_at(
    system: System, x0: ArrayLike, parameter: float, *, options: NewtonOptions | None = None, scale: ArrayLike = 1.0
) -> NewtonResult:
    """``newton`` for a parametrised system at a fixed parameter."""
    return newton(lambda x: system.evaluate(x, parameter), x0, options=options, scale=scale)


def _plain(system: Callable[[Array], Evaluation]) -> Callable[[Array], tuple[Array, Jacobian, Any]]:
    def evaluate(x: Array) -> tuple[Array, Jacobian, Any]:
        value = system(x)
        return value.residual, value.jacobian, value

    return evaluate


def norm(vector: Array) -> float:
    """Euclidean norm, quick for short vectors; inf if not finite."""
    square = float(vector.dot(vector))
    return sqrt(square) if isfinite(square) else np.inf


def iterate(
    evaluate: Callable[[Array], tuple[Array, Jacobian, Any]], x: Array, inverse_scale: Array, options: NewtonOptions
) -> NewtonResult:
    """The iteration behind ``newton``: ``evaluate(x)`` returns residual, Jacobian and anything to keep with them."""
    result = NewtonResult(x)
    result.residual, result.jacobian, result.evaluation = evaluate(x)
    result.evaluations = 1
    result.residual_norm = norm(result.residual)
    allowance = options.non_monotone
    while True:
        step = _correction(result, inverse_scale)
        if step is None or _finished(result, options):
            return result if result.converged else _at_rounding_level(result)
        allowance = _line_search(evaluate, result, step, inverse_scale, options, allowance)
        if result.reason:
            return _at_rounding_level(result)
        result.iterations += 1


def _correction(result: NewtonResult, inverse_scale: Array) -> Array | None:
    """Newton correction at the current state; None (with the reason) when it cannot be had."""
    result.history.append(result.residual_norm)
    if not isfinite(result.residual_norm):
        result.reason = "the residual is not finite"
        return None
    if result.jacobian.singular:
        result.correction_norm, result.reason = np.inf, SINGULAR_JACOBIAN
        return None
    step = result.jacobian.solve(result.residual)
    result.solves += 1
    result.correction_norm = norm(step * inverse_scale)
    result.corrections.append(result.correction_norm)
    if not isfinite(result.correction_norm):
        result.reason = SINGULAR_JACOBIAN
        return None
    return step


def _finished(result: NewtonResult, options: NewtonOptions) -> bool:
    size = result.correction_norm
    if size <= options.tolerance:
        result.converged, result.reason = True, "converged"
    elif _no_longer_shrinks(result.corrections) and (size <= options.stagnation or _is_rounding(result)):
        _stagnate(result)
    elif result.iterations >= options.max_iterations:
        result.reason = f"no convergence in {options.max_iterations} iterations"
    return bool(result.reason)


def _at_rounding_level(result: NewtonResult) -> NewtonResult:
    """Accept a failed iteration after all when its residual is nothing but the rounding of its own terms."""
    if isfinite(result.correction_norm) and _is_rounding(result):
        _stagnate(result)
    return result


def _is_rounding(result: NewtonResult) -> bool:
    if result.correction_norm >= _STILL_A_SOLUTION:
        return False
    size = norm(result.jacobian.bound(result.x))
    terms = result.evaluation.terms if isinstance(result.evaluation, Evaluation) else None
    if terms is not None:
        size = max(size, norm(terms()))
    return result.residual_norm <= 16.0 * EPSILON * size


def _stagnate(result: NewtonResult) -> None:
    result.converged = result.stagnated = True
    result.reason = "converged to rounding level"


def _no_longer_shrinks(sizes: list[float]) -> bool:
    return len(sizes) > 2 and sizes[-1] > 0.5 * sizes[-2] and sizes[-2] > 0.1 * sizes[-3]


def _line_search(
    evaluate: Callable[[Array], tuple[Array, Jacobian, Any]],
    result: NewtonResult,
    step: Array,
    inverse_scale: Array,
    options: NewtonOptions,
    allowance: int,
) -> int:
    """Take the whole correction if it brings the solution nearer, else the best fraction; return the allowance left.

    The search does not stop at the first fraction that helps: between kinks the measure falls and rises by pieces, and
    the first gain found from above is often a tiny one beyond the kink that matters.
    """
    size, damping = result.correction_norm, 1.0
    best, level, full = None, np.inf, None
    while damping >= options.min_damping:
        trial = _trial(evaluate, result.x - step if damping == 1.0 else result.x - damping * step)
        result.evaluations += 1
        natural = np.inf
        if isfinite(trial[4]):
            natural = norm(result.jacobian.solve(trial[1]) * inverse_scale) / size
            result.solves += 1
        if damping == 1.0:
            result.contraction = natural if result.iterations == 0 else result.contraction
            tiny = size <= options.stagnation and isfinite(natural)
            if natural <= _CLEAR_GAIN or tiny or (natural < _WORST_LOSS and _is_rounding(result)):
                result.accept(trial)
                return allowance
            full = trial if natural < _WORST_LOSS else None
        if natural < level:
            best, level = trial, natural
        elif level < 1.0 - 0.1 * damping:
            break
        damping *= 0.5
    if level >= 1.0 - 0.1 * options.min_damping and full is not None and allowance > 0:
        best, level, allowance = full, 0.0, allowance - 1
    if best is None or level >= 1.0:
        result.reason = "the line search found no step that brings the solution nearer"
    else:
        result.accept(best)
    return allowance


def _trial(evaluate: Callable[[Array], tuple[Array, Jacobian, Any]], x: Array) -> Trial:
    residual, jacobian, value = evaluate(x)
    return x, residual, jacobian, value, norm(residual)
