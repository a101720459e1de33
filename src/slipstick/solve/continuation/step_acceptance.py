"""Whether a converged point is the next one of its branch.

Formulas hold for one state (N + 1,) and for k states (k, N + 1); lengths are scaled arc lengths.
"""

from __future__ import annotations

import numpy as np

from slipstick.errors import Reason
from slipstick.solve.continuation.metric import Marks, Metric, Scalars, chosen, column, dots, larger, norms
from slipstick.solve.continuation.options import StepOptions
from slipstick.solve.continuation.predictor import Span
from slipstick.solve.continuation.step import Step
from slipstick.typing import Array

TOO_FAR = 0.5
"""Largest distance of a solution from where a segment expects it, over the segment's length; further off is another."""
KINK_SHARE = 0.25
"""Largest step at which a corner is looked for, over the largest step: sides that are longer are not straight."""
KINK_CORRECTION = 5.0
"""Largest distance from prediction to solution at a corner, in steps: the branch may go on steeply there."""
SHARPEST = 0.1
"""Least cosine between the two sides of a corner; those that turn by a right angle are left to ``turn``."""
CORNER_FIT = 0.05
"""Largest part of the chord that is no sum of both tangents, at a corner: its sides may be curved that much."""
ENOUGH_DIMENSIONS = 5
"""Least entries of a state: among fewer, a chord to another branch lies between both tangents by chance."""
REST_OF_BOTH = 0.125
"""What counts of two differences that cancel in the middle: as much as is left of them on a smooth branch."""
BEYOND_CORNER = 4.0
"""Steps ahead of the last point at which the equations of the next piece are asked for: safely beyond the corner."""
CORNER_PASSED = 1.5
"""Steps along the last tangent to where the corner is expected: it lies within the step that failed."""
BEYOND_CORNER_ALONG = 4.0
"""Steps along the next piece, from there to the guess: so far that it does not lead back over the corner."""
CORNER_NEAR = 10.0
"""Largest distance of the point beyond a corner, in steps: about twice that of the guess."""


class Rejection(Reason):
    """Why no next point was found, or one was not believed."""

    NOTHING_AHEAD = "no solution was found ahead"
    OUTSIDE = "the corrected point lies outside of the range"
    ORIENTATION = "the orientation of the branch changes (bifurcation, or another branch)"
    FAR = "the solution found is far from the predicted one"
    DOUBTED = "part of the solution is not as predicted"
    SHARP = "the direction of the branch changes too much"


def is_short(options: StepOptions, length: Scalars) -> Marks:
    """Whether a step is short enough for a corner to be looked for."""
    return length <= KINK_SHARE * options.max_step


def reach(options: StepOptions, length: Scalars) -> Scalars:
    """Largest distance from its prediction at which the solution of a step of ``length`` may lie."""
    at_corner = max(KINK_CORRECTION, options.max_correction)
    return chosen(is_short(options, length), at_corner, options.max_correction) * length


def is_far(metric: Metric, options: StepOptions, state: Array, guess: Array, length: Scalars, kink: Marks) -> Marks:
    """Whether a solution lies too far from its prediction; further is allowed at a ``kink``."""
    return metric.length(state - guess) > chosen(kink, KINK_CORRECTION, options.max_correction) * length


def is_near(metric: Metric, off: Array, length: Scalars) -> Marks:
    """Whether a solution ``off`` where a segment of some ``length`` expects it may be that one."""
    return metric.length(off) <= TOO_FAR * length


def is_kink(metric: Metric, first: tuple[Array, Array], second: tuple[Array, Array]) -> Marks:
    """Whether two points with different tangents lie on the two straight sides of one corner.

    Each point is a state and a tangent. The chord is then a sum of positive multiples of the tangents, which another
    branch would not respect: with few unknowns it might, so the answer is no.
    """
    (state, before), (other, after) = first, second
    chord = (other - state) * metric.weights
    a, b = before * metric.weights, after * metric.weights
    a, b = a / column(norms(a)), b / column(norms(b))
    g, p, q = dots(a, b), dots(a, chord), dots(b, chord)
    along_first, along_second, square_of_sine = p - g * q, q - g * p, 1.0 - g * g
    rest = norms(column(square_of_sine) * chord - column(along_first) * a - column(along_second) * b)
    fits = (rest <= CORNER_FIT * square_of_sine * norms(chord)) & (chord.shape[-1] >= ENOUGH_DIMENSIONS)
    return (g >= SHARPEST) & (along_first >= 0.0) & (along_second >= 0.0) & fits


def cubic_distance(
    metric: Metric, found: tuple[Array, Array], expected: tuple[Array, Array], length: Scalars
) -> Scalars:
    """Distance in the middle between two cubics of some ``length``, over the size of the row that it is largest of.

    They share an end, the first for a positive ``length``. The state and tangent at their other ends are those
    ``found`` and those ``expected``.
    """
    (state, tangent), (guess, direction) = found, expected
    turned = tangent / column(metric.length(tangent)) - direction / column(metric.length(direction))
    by_state, by_slope = 0.5 * (state - guess), column(0.125 * length) * turned
    changes = np.array((by_state - by_slope, by_state, by_slope))
    both, of_state, of_slope = metric.judged(changes, metric.sizes(state))
    return larger(both, REST_OF_BOTH * (of_state + of_slope))


def objection(
    metric: Metric, span: Span, options: StepOptions, last: Step, new: Step, guess: Array, length: float, angle: float
) -> Rejection | None:
    """Why ``new`` is not believed to follow ``last``; None if it is.

    It was found from ``guess`` by a step of ``length``; ``angle`` is that between the tangents of both (radians).
    """
    if new.kind != "end" and span.outside(new.parameter):
        return Rejection.OUTSIDE
    turned = last.orientation * new.orientation < 0
    tiny = length <= options.kink_step
    if turned and tiny:
        new.name = "orientation change"
    elif turned:
        return Rejection.ORIENTATION
    kink = tiny or (is_short(options, length) and is_kink(metric, (last.state, last.tangent), (new.state, new.tangent)))
    if is_far(metric, options, new.state, guess, length, kink):
        return Rejection.FAR
    if not kink and angle > options.max_angle:
        return Rejection.SHARP
    return None
