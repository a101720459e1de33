"""The steps of a continuation: how long they are, where the next point is predicted, whether a solution is accepted.

Formulas hold for one state (N + 1,) and for k states (k, N + 1); lengths are scaled arclengths.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, pi
from typing import NamedTuple

import numpy as np

from slipstick.errors import InputError, Reason
from slipstick.solve.continuation.corrector import Corrector, Step
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import Marks, Metric, Scalars, chosen, column, dots, larger, norms, smaller
from slipstick.solve.newton import NewtonOptions, NewtonResult
from slipstick.typing import Array

# Length of a step, from how the last one converged.
_MAX_GROWTH, _MIN_GROWTH = 2.0, 0.5
"""Largest and smallest ratio of a step to the last one: a single point does not justify a larger change."""
_LEAST_CHANGE = 1e-12
"""Least contraction and angle, which may be zero: they ask for the largest growth."""

# Prediction.
TANGENT_ORDER, CUBIC_ORDER = 2, 4
"""Orders of the predictor's error in the step."""
SCALE_CHANGE = 2.0
"""Ratio of the size of the first guess to that of its solution above which it is corrected once more: the tolerance,
relative to the size, was too coarse."""
_CUBIC_MIN_COSINE = 0.7
"""Least cosine between tangent and extrapolated cubic: one that has turned by 45 degrees predicts worse than a line."""

# Acceptance: error of the cubic, and corners.
_CANCELLATION = 0.125
"""Part of two differences that counts where they cancel in the middle: what is left of them on a smooth branch."""
_CORNER_MAX_STEP = 0.25
"""Longest step that may cross a corner, over the largest step: the sides of a corner are not straight over more."""
_CORNER_MAX_CORRECTION = 5.0
"""Largest distance from prediction to solution at a corner, in steps: the branch may go on steeply there."""
_CORNER_MIN_COSINE = 0.1
"""Least cosine between the sides of a corner; ``turn_corner`` takes those that turn by a right angle."""
_CORNER_MISFIT = 0.05
"""Largest part of the chord that is no sum of both tangents, at a corner: its sides may be curved that much."""
_CORNER_MIN_DIMENSIONS = 5
"""Least entries of a state: among fewer, a chord to another branch lies between both tangents by chance."""

# Turning a corner, in steps. The corner lies within the last step, which failed.
_CORNER_PROBE = 4.0
"""Distance ahead along the tangent at which the equations of the next piece are evaluated: safely beyond the corner."""
_CORNER_PLACE = 1.5
"""Distance along the tangent at which the corner is expected."""
_CORNER_EXIT = 4.0
"""Distance from there to the guess, along the next piece: so far that it does not lead back over the corner."""
_CORNER_MAX_DISTANCE = 10.0
"""Largest distance of the point beyond the corner from the last one: about twice that of the guess."""


@dataclass(frozen=True, kw_only=True)
class StepOptions:
    """Step control; lengths are scaled arclengths (1 is the whole parameter range).

    Parameters
    ----------
    first_step, max_step, min_step
        First, largest and smallest step.
    target_iterations
        Newton corrections per point that leave the step as it is.
    contraction
        Desired ratio of the second to the first Newton correction.
    aimed_angle, max_angle
        Desired angle between neighbouring tangents, and the angle above which a step is rejected (radians).
    max_correction
        Largest distance from prediction to solution, in steps; beyond it the step is rejected.
    kink_step
        Below this length a large angle is accepted as a kink of the branch: no other branch would be that close.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    first_step: float = 1.0 / 200.0
    max_step: float = 1.0 / 60.0
    min_step: float = 1e-8
    target_iterations: int = 4
    contraction: float = 0.1
    aimed_angle: float = pi / 15
    max_angle: float = pi / 6
    max_correction: float = 0.5
    kink_step: float = 1e-5

    def __post_init__(self) -> None:
        faults = [
            f"continuation {name}: found {getattr(self, name)}; expected a positive number"
            for name in ("first_step", "max_step", "min_step", "target_iterations", "contraction", "max_correction")
            if not getattr(self, name) > 0
        ]
        if self.min_step > self.max_step:
            faults.append(
                f"continuation min_step {self.min_step} is above max_step {self.max_step}; give a smaller min_step"
            )
        if not 0 < self.aimed_angle <= self.max_angle < pi / 2:
            faults.append(
                f"continuation angles: found aimed_angle {self.aimed_angle} and max_angle {self.max_angle}; "
                "expected 0 < aimed_angle <= max_angle < pi/2"
            )
        if faults:
            raise InputError(faults)


def _corrector_options() -> NewtonOptions:
    return NewtonOptions(max_iterations=8, min_damping=0.4, non_monotone=1)


@dataclass(frozen=True, kw_only=True)
class ContinuationOptions(StepOptions):
    """Options of a continuation: those of the step control and these.

    Parameters
    ----------
    max_points
        Largest number of points, located and interpolated ones not counted.
    newton
        Options of the corrector.
    locate_turning_points
        Whether turning points of the parameter are located and yielded.
    event_tolerance
        Scaled arclength to which events are located: relative to the parameter range, or better.
    output_step
        Largest scaled arclength between points of the result: longer gaps are filled by points of kind "interpolated".
        Values up to ``max_step`` fill none.
    output_tolerance
        Largest error of an interpolated point: of each row of the unknowns, and of all quantities computed from them,
        relative to its own size nearby. Where the error would be larger, a corrected point is inserted instead.
    """

    max_points: int = 5000
    newton: NewtonOptions = field(default_factory=_corrector_options)
    locate_turning_points: bool = True
    event_tolerance: float = 1e-10
    output_step: float = inf
    output_tolerance: float = 2e-4

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("output_step", "output_tolerance"):
            if not getattr(self, name) > 0:
                raise InputError(f"continuation {name}: found {getattr(self, name)}; expected a positive number")


def next_step(
    step: Scalars, *, contraction: Scalars, iterations: Scalars, angle: Scalars, order: Scalars, options: StepOptions
) -> Scalars:
    """Length of the step after an accepted one of length ``step``; all are floats, or (k,) of k branches.

    Newton's first contraction is proportional to the error of the predictor, so to ``step ** order``; the angle
    between tangents is proportional to ``step``. The step grows at most twofold, and shrinks at most to a half.

    >>> options = StepOptions()
    >>> next_step(0.001, contraction=1e-6, iterations=1, angle=1e-3, order=4, options=options)
    0.002
    """
    by_contraction = (options.contraction / larger(_LEAST_CHANGE, contraction)) ** (1.0 / order)
    by_angle = options.aimed_angle / larger(_LEAST_CHANGE, angle)
    few = iterations <= options.target_iterations
    by_iterations = chosen(few, _MAX_GROWTH, options.target_iterations / larger(1, iterations))
    factor = smaller(smaller(by_contraction, by_angle), by_iterations)
    return smaller(options.max_step, step * larger(_MIN_GROWTH, smaller(_MAX_GROWTH, factor)))


# Prediction


@dataclass(frozen=True)
class Span:
    """The range of the parameter, in the order in which it is followed; values are floats, or (k,) of k states."""

    start: float
    stop: float

    def beyond(self, parameter: Scalars) -> Marks:
        """Whether ``parameter`` is at ``stop`` or beyond it."""
        return (parameter - self.stop) * (self.stop - self.start) >= 0.0

    def behind(self, parameter: Scalars) -> Marks:
        """Whether ``parameter`` is at ``start`` or before it."""
        return (parameter - self.start) * (self.stop - self.start) <= 0.0

    def outside(self, parameter: Scalars) -> Marks:
        """Whether ``parameter`` is outside of the range or at an end."""
        return (parameter - self.start) * (parameter - self.stop) >= 0.0

    def passed(self, parameter: float) -> float | None:
        """The end that one ``parameter`` has reached or passed; None inside the range."""
        if self.beyond(parameter):
            return self.stop
        return self.start if self.behind(parameter) else None


class Prediction(NamedTuple):
    """A guess (N + 1,) and the direction of the branch there; ``at_end``: its parameter is an end of the range."""

    guess: Array
    direction: Array
    at_end: bool


def along_tangent(metric: Metric, state: Array, tangent: Array, length: Scalars) -> tuple[Array, Array]:
    """Guess and direction (..., N + 1) at an arc ``length`` along the tangent."""
    direction = tangent / column(metric.length(tangent))
    return state + column(length) * direction, direction


def place_ahead(metric: Metric, segment: HermiteSegment, tangent: Array, length: Scalars) -> Scalars:
    """Place ``u`` at an arc ``length`` beyond the second end of a segment, which has that tangent."""
    return 1.0 + length / (metric.length(tangent) * segment.length)


def is_cubic_valid(metric: Metric, direction: Array, tangent: Array) -> Marks:
    """Whether the extrapolated cubic has not turned too far from the tangent to predict a point."""
    return metric.cosine(direction, tangent) >= _CUBIC_MIN_COSINE


def shortened(state: Array, guess: Array, end: float) -> Array:
    """The place (..., N + 1) on the line from a state to a guess where the parameter is ``end``."""
    change = guess - state
    return state + column((end - state[..., -1]) / change[..., -1]) * change


def predict(metric: Metric, span: Span, last: Step, segment: HermiteSegment | None, length: float) -> Prediction:
    """Predict the point ``length`` ahead of ``last``, along the ``segment`` that ends there or else the tangent.

    The guess is clipped to the range that is followed.
    """
    if segment is None:
        guess, direction = along_tangent(metric, last.state, last.tangent, length)
    else:
        u = place_ahead(metric, segment, last.tangent, length)
        guess, direction = segment.point(u), segment.derivative(u)
        if not is_cubic_valid(metric, direction, last.tangent):
            return predict(metric, span, last, None, length)
    end = span.passed(guess[-1])
    if end is None:
        return Prediction(guess, direction, False)
    guess = shortened(last.state, guess, end) if segment is None else segment.point(segment.where(end, 1.0, u))
    guess[-1] = end
    return Prediction(guess, direction, True)


# Acceptance


class Rejection(Reason):
    """Why no next point was found, or a solution was rejected."""

    NOTHING_AHEAD = "no solution was found ahead"
    OUTSIDE = "the corrected point lies outside of the range"
    ORIENTATION = "the orientation of the branch changes (bifurcation, or another branch)"
    FAR = "the solution found is far from the predicted one"
    DOUBTED = "part of the solution is not as predicted"
    SHARP = "the direction of the branch changes too much"


def is_short(options: StepOptions, length: Scalars) -> Marks:
    """Whether a step is short enough to cross a corner."""
    return length <= _CORNER_MAX_STEP * options.max_step


def max_distance(options: StepOptions, length: Scalars) -> Scalars:
    """Largest distance from its prediction at which the solution of a step of ``length`` may lie."""
    at_corner = max(_CORNER_MAX_CORRECTION, options.max_correction)
    return chosen(is_short(options, length), at_corner, options.max_correction) * length


def is_far(metric: Metric, options: StepOptions, state: Array, guess: Array, length: Scalars, kink: Marks) -> Marks:
    """Whether a solution is too far from its prediction; a larger distance is allowed at a ``kink``."""
    return metric.length(state - guess) > chosen(kink, _CORNER_MAX_CORRECTION, options.max_correction) * length


def is_kink(metric: Metric, first: tuple[Array, Array], second: tuple[Array, Array]) -> Marks:
    """Whether two points with different tangents lie on the two straight sides of one corner.

    Each point is a state and a tangent. The chord is then a sum of positive multiples of the tangents, which a chord
    to another branch would not be. With few unknowns it might be by chance, and the answer is no.
    """
    (state, before), (other, after) = first, second
    chord = (other - state) * metric.weights
    a, b = before * metric.weights, after * metric.weights
    a, b = a / column(norms(a)), b / column(norms(b))
    g, p, q = dots(a, b), dots(a, chord), dots(b, chord)
    along_first, along_second, square_of_sine = p - g * q, q - g * p, 1.0 - g * g
    rest = norms(column(square_of_sine) * chord - column(along_first) * a - column(along_second) * b)
    fits = (rest <= _CORNER_MISFIT * square_of_sine * norms(chord)) & (chord.shape[-1] >= _CORNER_MIN_DIMENSIONS)
    return (g >= _CORNER_MIN_COSINE) & (along_first >= 0.0) & (along_second >= 0.0) & fits


def cubic_distance(
    metric: Metric, found: tuple[Array, Array], expected: tuple[Array, Array], length: Scalars
) -> Scalars:
    """Largest distance, relative to the size of its row, between two cubics of some ``length`` at their middle.

    They share an end, the first for a positive ``length``. The state and tangent at their other ends are those
    ``found`` and those ``expected``.
    """
    (state, tangent), (guess, direction) = found, expected
    turned = tangent / column(metric.length(tangent)) - direction / column(metric.length(direction))
    by_state, by_slope = 0.5 * (state - guess), column(0.125 * length) * turned  # values of the Hermite basis at 1/2
    changes = np.array((by_state - by_slope, by_state, by_slope))
    both, of_state, of_slope = metric.judged(changes, metric.sizes(state))
    return larger(both, _CANCELLATION * (of_state + of_slope))


def rejection_of(
    metric: Metric, span: Span, options: StepOptions, last: Step, new: Step, guess: Array, length: float, angle: float
) -> Rejection | None:
    """Why ``new`` is rejected as the point after ``last``; None where it is accepted.

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


def turn_corner(corrector: Corrector, span: Span, last: Step, length: float) -> tuple[Step | None, NewtonResult]:
    """Find the first point beyond the corner ahead of ``last``, where steps fail; None where there is none.

    Beyond the corner the equations of the next piece hold. Their null direction is the tangent there, oriented so that
    the determinant keeps its sign (B. C. Eaves, Mathematical Programming Study 10 (1979) 1).
    """
    metric = corrector.metric
    unit = last.tangent / metric.length(last.tangent)
    there = corrector.tangent_at(last.state + _CORNER_PROBE * length * unit, unit)
    if there is None:
        return None, NewtonResult(last.state)
    direction = there[0] if there[1] == last.orientation else -there[0]
    guess = last.state + _CORNER_PLACE * length * unit + _CORNER_EXIT * length * direction
    new, result = corrector.correct(guess, direction, "regular", name="corner")
    if new is None or new.orientation != last.orientation or span.outside(new.parameter):
        return None, result
    return (new if metric.length(new.state - last.state) <= _CORNER_MAX_DISTANCE * length else None), result
