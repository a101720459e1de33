"""The fraction of a Newton correction that is taken."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np

from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.newton.options import NewtonOptions
from slipstick.solve.newton.result import NewtonResult, NewtonStop, Trial
from slipstick.solve.norm import norm
from slipstick.typing import Array

_CLEAR_GAIN = 0.5
_WORST_LOSS = 10.0

Evaluate = Callable[[Array], tuple[Array, Jacobian, Any]]
"""Residual, Jacobian and anything to keep with them, of unknowns (N,)."""


def line_search(
    evaluate: Evaluate,
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
            if natural <= _CLEAR_GAIN or tiny or (natural < _WORST_LOSS and result.is_rounding()):
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
        result.reason = NewtonStop.NO_GAIN
    else:
        result.accept(best)
    return allowance


def _trial(evaluate: Evaluate, x: Array) -> Trial:
    residual, jacobian, value = evaluate(x)
    return x, residual, jacobian, value, norm(residual)
