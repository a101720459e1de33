"""Newton homotopy, followed around its turning points and corners, for starts far from a solution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from slipstick.solve.continuation import ArclengthScaling, ContinuationOptions, continuation
from slipstick.solve.newton import Evaluation, NewtonOptions, NewtonResult, newton
from slipstick.typing import Array

_FIRST_STEP, _MAX_STEP = 0.05, 0.3
"""Steps of the homotopy, in its whole length: long ones, because only the end is used."""


class _Shifted:
    """``residual(x) - (1 - t) residual(x0)``: zero at x0 for t = 0, the system itself for t = 1."""

    def __init__(self, system: Callable[[Array], Evaluation], x0: Array) -> None:
        self._system = system
        self._offset = system(x0).residual.copy()

    def evaluate(self, x: Array, parameter: float) -> Evaluation:
        value = self._system(x)
        return Evaluation(value.residual - (1.0 - parameter) * self._offset, value.jacobian, self._offset)


def homotopy(
    system: Callable[[Array], Evaluation],
    x0: ArrayLike,
    *,
    scale: ArrayLike = 1.0,
    options: NewtonOptions | None = None,
    max_points: int = 400,
) -> NewtonResult:
    """Solve ``system(x).residual = 0`` where ``newton`` fails from ``x0``; it is much slower and much more robust.

    The residual of the first guess is reduced to zero (H. B. Keller, Global homotopies and Newton methods, 1978) by
    arclength continuation, so that the path may turn back. ``scale`` is as for ``newton``: a change of the unknowns of
    that size counts as much as the whole homotopy.

    Examples
    --------
    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> saturation = lambda x: Evaluation(np.arctan(x), DenseJacobian(np.diag(1.0 / (1.0 + x * x))))
    >>> result = homotopy(saturation, [50.0], scale=50.0)
    >>> result.converged, abs(float(result.x[0])) < 1e-9
    (True, True)
    """
    start = np.array(x0, dtype=float)
    settings = ContinuationOptions(
        first_step=_FIRST_STEP, max_step=_MAX_STEP, locate_turning_points=False, max_points=max_points
    )
    scaling = ArclengthScaling(x=scale, adaptive=False, weight=1.0)
    last = start
    path = continuation(_Shifted(system, start), start, 0.0, 1.0, options=settings, scaling=scaling)
    for step in path:
        last = step.x
    result = newton(system, last, options=options, scale=scale)
    result.evaluations += path.evaluations + 1
    result.solves += path.solves
    return result
