"""Damped Newton for piecewise smooth systems.

Globalised by natural monotonicity (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3):
the progress of a step is measured by the simplified correction, not by the residual, so that it does not depend on how
the equations are scaled. Where the whole correction does not help, the best fraction of it is taken, and where none
helps a few whole corrections are taken all the same: both carry the iteration across the kinks of stick and slip.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.interrupts import pass_on
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.newton.line_search import Evaluate, line_search
from slipstick.solve.newton.options import NewtonOptions
from slipstick.solve.newton.result import NewtonResult, NewtonStop
from slipstick.solve.newton.system import Evaluation, System
from slipstick.solve.norm import norm
from slipstick.typing import Array


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
    too_far: Callable[[Array], bool] | None = None,
) -> NewtonResult:
    """The iteration behind ``newton``: ``evaluate(x)`` returns residual, Jacobian and anything to keep with them.

    Where the first correction is ``too_far`` it is given up.
    """
    result = NewtonResult(x)
    result.residual, result.jacobian, result.evaluation = evaluate(x)
    result.evaluations = 1
    result.residual_norm = norm(result.residual)
    allowance = options.non_monotone
    while True:
        pass_on()
        step = _correction(result, inverse_scale)
        if step is None or _finished(result, options):
            return result if result.converged else _at_rounding_level(result)
        if too_far is not None and result.iterations == 0 and too_far(step):
            result.reason = NewtonStop.TOO_FAR
            return result
        allowance = line_search(evaluate, result, step, inverse_scale, options, allowance)
        if result.reason is not None:
            return _at_rounding_level(result)
        result.iterations += 1


def _correction(result: NewtonResult, inverse_scale: Array) -> Array | None:
    """Newton correction at the current state; None (with the reason) when it cannot be had."""
    result.history.append(result.residual_norm)
    if not isfinite(result.residual_norm):
        result.reason = NewtonStop.NOT_FINITE
        return None
    if result.jacobian.singular:
        result.correction_norm, result.reason = np.inf, NewtonStop.SINGULAR
        return None
    step = result.jacobian.solve(result.residual)
    result.solves += 1
    result.correction_norm = norm(step * inverse_scale)
    result.corrections.append(result.correction_norm)
    if not isfinite(result.correction_norm):
        result.reason = NewtonStop.SINGULAR
        return None
    return step


def _finished(result: NewtonResult, options: NewtonOptions) -> bool:
    size = result.correction_norm
    if size <= options.tolerance:
        result.reason = NewtonStop.CONVERGED
    elif _no_longer_shrinks(result.corrections) and (size <= options.stagnation or result.is_rounding()):
        result.reason = NewtonStop.ROUNDING
    elif result.iterations >= options.max_iterations:
        result.reason = NewtonStop.TOO_MANY
    elif options.patience is not None and _since_best(result.corrections) >= options.patience:
        result.reason = NewtonStop.NO_PROGRESS
    return result.reason is not None


def _at_rounding_level(result: NewtonResult) -> NewtonResult:
    """Accept a failed iteration after all when its residual is nothing but the rounding of its own terms."""
    if result.is_rounding():
        result.reason = NewtonStop.ROUNDING
    return result


def _since_best(sizes: list[float]) -> int:
    """How many corrections ago one was last half the smallest before it."""
    best, at = sizes[0], 0
    for i, size in enumerate(sizes):
        if size <= 0.5 * best:
            best, at = size, i
    return len(sizes) - 1 - at


def _no_longer_shrinks(sizes: list[float]) -> bool:
    return len(sizes) > 2 and sizes[-1] > 0.5 * sizes[-2] and sizes[-2] > 0.1 * sizes[-3]
