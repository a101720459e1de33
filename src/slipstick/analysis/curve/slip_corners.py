"""Corners of a curve where a contact begins to slip at all times at one point.

Friction in two directions with a circular orbit sticks throughout the period or slips throughout. Where slip begins,
the force grows with the square root of the excess of the circle over the limit. Newton's method does not converge
across such a corner; the curve is smooth on each side of it.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slipstick.balance.start import FirstPoint
from slipstick.solve.continuation import Step
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.newton import newton_at
from slipstick.solve.norm import norm
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.curve.follow import CurveRequest
    from slipstick.analysis.curve.segments import Segment

_DISTANCES_BEYOND = (1e-4, 1e-3, 1e-2, 0.05)
"""Distances beyond the end of a segment at which a solution is sought, over the range."""
_DISTANCE_END = 1e-7
"""Distance from the end of the segment, over the range, at which the search back to the corner stops."""
_WIDTH = 1e-12
"""Width of the interval in which a corner is bracketed, over the range."""
_LARGEST_CHANGE = 0.5
"""Change of the motion, over its size, beyond which a solution is another motion."""
_CONTINUOUS_CHANGE = 1e-3
"""Change of the motion across a corner, over its size, up to which the branch is continuous there."""
_WHOLE_PERIOD = 1.0 - 1e-9
"""Change of a slip fraction from stick at all times to slip at all times."""


@dataclass(frozen=True, kw_only=True)
class StartingPoint:
    """A solution inside the range at which a branch begins.

    Attributes
    ----------
    x, at
        Unknowns (N,) and value of the followed quantity.
    direction
        Tangent (N + 1,).
    events
        Further events to locate on this branch.
    """

    x: Array
    at: float
    direction: Array
    events: tuple[BranchEvent, ...] = ()


def may_slip_at_once(request: CurveRequest) -> bool:
    """Whether a contact of the problem can begin to slip at all times at one point of a curve."""
    return any(batch.law.slips_at_once for batch in request.balance.batches)


def beyond_corner(request: CurveRequest, segment: Segment) -> StartingPoint | None:
    """Starting point beyond the corner at which a segment ended; None where it did not end at one.

    A solution is found beyond the end and followed back to the corner by bisection.
    """
    if segment.last is None or not may_slip_at_once(request):
        return None
    (end, x), span = segment.last, request.stop - request.start
    size = norm(x)

    def solved(value: float, guess: Array) -> Array | None:
        result = newton_at(request.system, guess, value, options=request.options.newton, scale=norm(guess) or 1.0)
        return result.x if result.converged else None

    for distance in _DISTANCES_BEYOND:
        at = end + distance * span
        if (request.stop - at) * span <= 0.0:
            return None
        inputs, omega = request.system.at(at)
        y = solved(at, x)
        if y is None:
            y = FirstPoint(request.balance, inputs, omega, guess=x).find()
        nearest: tuple[float, Array] | None = None
        while y is not None and norm(y - x) <= _LARGEST_CHANGE * size:
            nearest = at, y
            if abs(at - end) <= _DISTANCE_END * abs(span):
                break
            at = end + 0.5 * (at - end)
            y = solved(at, x + 0.5 * (y - x))
        if nearest is not None and norm(nearest[1] - x) <= _CONTINUOUS_CHANGE * size:
            direction = np.append(np.zeros(x.size), np.sign(span))
            return StartingPoint(x=nearest[1], at=nearest[0], direction=direction)
    return None


def corner_between(request: CurveRequest, first: Step, second: Step) -> Step | None:
    """The last step at which a contact sticks at all times before it slips at all times; None where there is none.

    Bisection from the sticking side, where the motion is smooth.
    """
    before, after = slip_fractions(request, first), slip_fractions(request, second)
    crossing = np.abs(after - before) > _WHOLE_PERIOD
    if not crossing.any():
        return None
    sticking, slipping = (second, first) if before[crossing][0] > after[crossing][0] else (first, second)
    low, high, last = sticking.parameter, slipping.parameter, copy(sticking)
    width = _WIDTH * abs(request.stop - request.start)
    while abs(high - low) > width:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        options, scale = request.options.newton, norm(last.x) or 1.0
        result = newton_at(request.system, last.x, middle, options=options, scale=scale)
        trial = copy(sticking)
        trial.state, trial.evaluation = np.append(result.x, middle), result.evaluation
        trial.iterations, trial.residual_norm = result.iterations, result.residual_norm
        if result.converged and not slip_fractions(request, trial)[crossing].any():
            low, last = middle, trial
        else:
            high = middle
    return last


def slip_fractions(request: CurveRequest, step: Step) -> Array:
    """Fractions of the period in slip, of the contacts that can begin to slip at all times at one point."""
    batches, responses = request.balance.batches, step.evaluation.detail.responses
    pairs = zip(batches, responses, strict=True)
    return np.concatenate([response.detail.slip_fraction for batch, response in pairs if batch.law.slips_at_once])
