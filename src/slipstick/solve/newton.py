"""Damped Newton for piecewise smooth systems: ``System`` and ``Evaluation`` in, ``NewtonResult`` out.

Globalised by natural monotonicity (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3):
the progress of a step is measured by the simplified correction, not by the residual, so that it does not depend on how
the equations are scaled. Where the whole correction does not help, the best fraction of it is taken, and where none
helps a few whole corrections are taken all the same: both carry the iteration across the kinks of stick and slip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import InputError, Reason
from slipstick.interrupts import pass_on
from slipstick.solve.linear.jacobian import OF_CORRECTIONS, Jacobian, UndefinedJacobian
from slipstick.solve.norm import norm
from slipstick.typing import Array

# Gain of a correction: norm of the simplified correction over that of the Newton correction.
_CLEAR_GAIN = 0.5
"""Ratio up to which a whole correction is taken without a search: Newton's method contracts much faster than that."""
_WORST_LOSS = 10.0
"""Ratio up to which a whole correction may be taken although it does not help: across a kink the ratio says little."""
_SUFFICIENT_GAIN = 0.1
"""Part of its damping by which a damped correction has to reduce the ratio below 1, as in Armijo's rule."""
_DAMPING_RATIO = 0.5
"""Ratio of a damping to the one tried before it."""

# Stagnation and rounding.
_STALLED, _CONTRACTION = 0.45, 0.1
"""A correction that is more than the first factor of the one before has stalled, unless that one had fallen below the
second factor of its predecessor: the next correction then shows whether rounding is reached. At a double root, as at a
corner, corrections contract by one half."""
_NO_CONTRACTION = 0.5
"""Ratio to the smallest correction so far above which there is no progress."""
_ROUNDING_CORRECTION = 1e-3
"""Largest scaled correction of a state that may be a solution to rounding: with a larger one it is not near any."""
_ROUNDING_ERROR = 16.0 * float(np.finfo(float).eps)
"""Largest residual that is rounding, over the norm of its terms: a few unit roundoffs for each sum."""

# Accuracy of linear solves by iteration; direct ones are exact.
_CORRECTION_ERROR = 0.1
"""Largest error of a correction, over the tolerance of the iteration."""
_SIZE_ERROR = 0.03
"""Relative error of a simplified correction, of which only the norm is used, and largest one of any correction."""


class Evaluation(NamedTuple):
    """Residual (N,), Jacobian and derivative of the residual by the parameter (N,) of a system at one state.

    Attributes
    ----------
    detail
        Any data that the system needs at a converged point; passed through unchanged.
    terms
        Returns the sizes (N,) of the largest terms that each residual is the sum of, which bound its rounding error.
        Without it they are taken from the Jacobian.
    context
        Passed to the evaluations of the next points of a branch where this point is accepted; None: nothing.
    again
        Returns the context with which a solution has to be solved again, of a system that refines itself where it
        must; None where the solution is final.
    """

    residual: Array
    jacobian: Jacobian
    parameter_derivative: Array | None = None
    detail: Any = None
    terms: Callable[[], Array] | None = None
    context: Any = None
    again: Callable[[], Any] | None = None

    @classmethod
    def undefined(cls, size: int) -> Evaluation:
        """The evaluation of a state at which the system has no value: all nan."""
        return cls(np.full(size, np.nan), UndefinedJacobian(size), np.full(size, np.nan))


class System(Protocol):
    """``residual(x, parameter) = 0``, N equations for N unknowns.

    The same arguments give the same answer. A system whose answer depends on the branch it is followed along returns a
    ``context`` with each evaluation and takes the context of the last accepted point as a third argument.
    """

    def evaluate(self, x: Array, parameter: float) -> Evaluation:
        """Residual, Jacobian and parameter derivative at ``x`` (N,)."""


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
        Largest number of whole corrections that are taken although no fraction of them helps.
    patience
        Largest number of consecutive corrections that are not half the smallest one before them; None: any number.
    stagnation
        Corrections below this that no longer shrink are rounding: the state is accepted and marked ``stagnated``.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    tolerance: float = 1e-10
    max_iterations: int = 30
    min_damping: float = 1e-5
    non_monotone: int = 4
    patience: int | None = None
    stagnation: float = 1e-8

    def __post_init__(self) -> None:
        ranges = {
            "tolerance": (0 < self.tolerance < 1, "a number between 0 and 1"),
            "max_iterations": (self.max_iterations >= 1, "at least 1"),
            "min_damping": (0 < self.min_damping <= 1, "a number in (0, 1]"),
            "non_monotone": (self.non_monotone >= 0, "0 or more"),
            "patience": (self.patience is None or self.patience >= 1, "at least 1, or None"),
            "stagnation": (0 <= self.stagnation < 1, "a number in [0, 1)"),
        }
        faults = [
            f"Newton {name}: found {getattr(self, name)}; expected {expected}"
            for name, (inside, expected) in ranges.items()
            if not inside
        ]
        if faults:
            raise InputError(faults)


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
"""State, residual, Jacobian, evaluation and residual norm."""

Evaluate = Callable[[Array], tuple[Array, Jacobian, Any]]
"""Residual, Jacobian and any further data, of unknowns (N,)."""


@dataclass(slots=True, eq=False)
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

    x: Array
    residual: Array = field(default_factory=lambda: np.empty(0))
    residual_norm: float = inf
    correction_norm: float = inf
    iterations: int = 0
    evaluations: int = 0
    solves: int = 0
    reason: NewtonStop | None = None
    history: list[float] = field(default_factory=list)
    corrections: list[float] = field(default_factory=list)
    contraction: float = 0.0
    evaluation: Any = None
    jacobian: Jacobian = field(init=False)
    _expected: float = field(default=inf, init=False, repr=False)

    @property
    def converged(self) -> bool:
        """Whether the tolerance was met, or the residual is no more than rounding."""
        return self.reason is NewtonStop.CONVERGED or self.stagnated

    @property
    def stagnated(self) -> bool:
        """Whether it converged to rounding level only."""
        return self.reason is NewtonStop.ROUNDING

    def is_rounding(self) -> bool:
        """Whether the residual is no larger than the rounding error of its own terms."""
        if not self.correction_norm < _ROUNDING_CORRECTION:
            return False
        size = norm(self.jacobian.bound(self.x))
        terms = self.evaluation.terms if isinstance(self.evaluation, Evaluation) else None
        if terms is not None:
            size = max(size, norm(terms()))
        return self.residual_norm <= _ROUNDING_ERROR * size

    def accept(self, trial: Trial, expected: float) -> None:
        """Move to a trial state; ``expected`` is the scaled norm of the next correction."""
        self._expected, before = expected, self.jacobian
        self.x, self.residual, self.jacobian, self.evaluation, self.residual_norm = trial
        self.jacobian.take_over(before)

    def __repr__(self) -> str:
        ended = "under way" if self.reason is None else self.reason.text
        return f"NewtonResult({ended}, iterations={self.iterations}, residual_norm={self.residual_norm:.2e})"


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
        With ``converged``; nothing is raised when the iteration fails.

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


def _plain(system: Callable[[Array], Evaluation]) -> Evaluate:
    def evaluate(x: Array) -> tuple[Array, Jacobian, Any]:
        value = system(x)
        return value.residual, value.jacobian, value

    return evaluate


def iterate(
    evaluate: Evaluate,
    x: Array,
    inverse_scale: Array,
    options: NewtonOptions,
    is_too_far: Callable[[Array], bool] | None = None,
    neighbour: Jacobian | None = None,
) -> NewtonResult:
    """The iteration of ``newton``.

    It stops where ``is_too_far`` of the first correction is true. ``neighbour`` is the Jacobian of a neighbouring
    state, whose preconditioner may serve.
    """
    result = NewtonResult(x)
    result.residual, result.jacobian, result.evaluation = evaluate(x)
    if neighbour is not None:
        result.jacobian.take_over(neighbour)
    result.evaluations = 1
    result.residual_norm = norm(result.residual)
    allowance = options.non_monotone
    while True:
        pass_on()
        step = _correction(result, inverse_scale, options)
        if step is None or _finished(result, options):
            return result if result.converged else _at_rounding_level(result)
        if is_too_far is not None and result.iterations == 0 and is_too_far(step):
            result.reason = NewtonStop.TOO_FAR
            return result
        allowance = line_search(evaluate, result, step, inverse_scale, options, allowance)
        if result.reason is not None:
            return _at_rounding_level(result)
        result.iterations += 1


def _correction(result: NewtonResult, inverse_scale: Array, options: NewtonOptions) -> Array | None:
    """Newton correction at the current state; None, with the reason set, where there is none."""
    result.history.append(result.residual_norm)
    if not isfinite(result.residual_norm):
        result.reason = NewtonStop.NOT_FINITE
        return None
    if result.jacobian.singular:
        result.correction_norm, result.reason = np.inf, NewtonStop.SINGULAR
        return None
    step = result.jacobian.solve_correction(result.residual, _correction_error(result, options))
    result.solves += 1
    result.correction_norm = norm(step * inverse_scale)
    result.corrections.append(result.correction_norm)
    if not isfinite(result.correction_norm):
        result.reason = NewtonStop.SINGULAR
        return None
    return step


def _correction_error(result: NewtonResult, options: NewtonOptions) -> float:
    """Relative error of the next correction that is small against the tolerance."""
    largest = _CORRECTION_ERROR * options.tolerance / max(result._expected, options.tolerance)
    return min(max(largest, OF_CORRECTIONS), _SIZE_ERROR)


def _finished(result: NewtonResult, options: NewtonOptions) -> bool:
    size = result.correction_norm
    if size <= options.tolerance:
        result.reason = NewtonStop.CONVERGED
    elif (
        len(result.corrections) > 2
        and stalls(*result.corrections[:-4:-1])
        and (size <= options.stagnation or result.is_rounding())
    ):
        result.reason = NewtonStop.ROUNDING
    elif result.iterations >= options.max_iterations:
        result.reason = NewtonStop.TOO_MANY
    elif options.patience is not None and _since_best(result.corrections) >= options.patience:
        result.reason = NewtonStop.NO_PROGRESS
    return result.reason is not None


def _at_rounding_level(result: NewtonResult) -> NewtonResult:
    """Accept a failed iteration whose residual is no larger than the rounding error of its own terms."""
    if result.is_rounding():
        result.reason = NewtonStop.ROUNDING
    return result


def _since_best(sizes: list[float]) -> int:
    """Number of corrections since one was half the smallest before it."""
    best, at = sizes[0], 0
    for i, size in enumerate(sizes):
        if size <= _NO_CONTRACTION * best:
            best, at = size, i
    return len(sizes) - 1 - at


# Criteria of the iteration, for floats or for arrays of many iterations


def stalls(size: Any, before: Any, earlier: Any) -> Any:
    """Whether corrections no longer shrink, from the last size and the two before it."""
    return (size > _STALLED * before) & (before > _CONTRACTION * earlier)


def is_clear_gain(natural: Any, size: Any, options: NewtonOptions) -> Any:
    """Whether a whole correction is taken without a search: by its gain, or because it is no more than rounding."""
    return (natural <= _CLEAR_GAIN) | ((size <= options.stagnation) & (natural < inf))


def may_be_taken_whole(natural: Any) -> Any:
    """Whether a whole correction may be taken although it does not help."""
    return natural < _WORST_LOSS


def gains(natural: Any, damping: float) -> Any:
    """Whether a damped correction brings the solution nearer in proportion to its damping."""
    return natural < 1.0 - _SUFFICIENT_GAIN * damping


def line_search(
    evaluate: Evaluate,
    result: NewtonResult,
    step: Array,
    inverse_scale: Array,
    options: NewtonOptions,
    allowance: int,
) -> int:
    """Take the whole correction if it brings the solution nearer, else the best fraction; return the allowance left.

    The search does not stop at the first fraction that helps. Between kinks the ratio falls and rises piecewise, and
    the first gain from above is often a tiny one, beyond the kink that matters.
    """
    size, damping = result.correction_norm, 1.0
    best, level, full = None, np.inf, None
    while damping >= options.min_damping:
        trial = _trial(evaluate, result.x - step if damping == 1.0 else result.x - damping * step)
        result.evaluations += 1
        natural = np.inf
        if isfinite(trial[4]):
            simplified = result.jacobian.solve_correction(trial[1], _SIZE_ERROR)
            natural = norm(simplified * inverse_scale) / size
            result.solves += 1
        if damping == 1.0:
            result.contraction = natural if result.iterations == 0 else result.contraction
            usable = may_be_taken_whole(natural)
            if is_clear_gain(natural, size, options) or (usable and result.is_rounding()):
                result.accept(trial, natural * size)
                return allowance
            full = trial if usable else None
        if natural < level:
            best, level = trial, natural
        elif gains(level, damping):
            break
        damping *= _DAMPING_RATIO
    if not gains(level, options.min_damping) and full is not None and allowance > 0:
        best, level, allowance = full, -1.0, allowance - 1
    if best is None or level >= 1.0:
        result.reason = NewtonStop.NO_GAIN
    else:
        result.accept(best, inf if level < 0.0 else level * size)
    return allowance


def _trial(evaluate: Evaluate, x: Array) -> Trial:
    residual, jacobian, value = evaluate(x)
    return x, residual, jacobian, value, norm(residual)
