"""Options of a continuation, and the length of its next step from how the last one went."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, pi

from slipstick.errors import InputError
from slipstick.solve.continuation.metric import Scalars, chosen, larger, smaller
from slipstick.solve.newton import NewtonOptions

_GROWTH, _SHRINKAGE = 2.0, 0.5
"""Largest and smallest ratio of a step to the one before: one point alone is no reason for more."""
_NO_CHANGE = 1e-12
"""Least contraction and angle, which may be zero: they ask for the largest growth."""


@dataclass(frozen=True, kw_only=True)
class StepOptions:
    """Step control; lengths are scaled arclengths (1 is the whole parameter range).

    Parameters
    ----------
    first_step, max_step, min_step
        First, largest and smallest step.
    target_iterations
        Newton corrections a point that leave the step as it is.
    contraction
        Aimed-at ratio of the second to the first Newton correction.
    aimed_angle, max_angle
        Angle between neighbouring tangents aimed at, and above which a step is rejected (radians).
    max_correction
        Largest distance from prediction to solution, in units of the step: beyond, the step is rejected.
    kink_step
        Below this length a large angle is believed to be a kink of the branch and accepted; the branch is followed
        through because a neighbouring branch would not be that near.

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


def next_step(
    step: Scalars, *, contraction: Scalars, iterations: Scalars, angle: Scalars, order: Scalars, options: StepOptions
) -> Scalars:
    """Length of the step after one of length ``step`` that went well; all are floats, or (k,) of k branches.

    Newton's first contraction is proportional to the error of the predictor, so to ``step ** order``; the angle
    between tangents is proportional to ``step``. The step grows at most twofold, and shrinks at most to a half.

    >>> options = StepOptions()
    >>> next_step(0.001, contraction=1e-6, iterations=1, angle=1e-3, order=4, options=options)
    0.002
    """
    by_contraction = (options.contraction / larger(_NO_CHANGE, contraction)) ** (1.0 / order)
    by_angle = options.aimed_angle / larger(_NO_CHANGE, angle)
    few = iterations <= options.target_iterations
    by_iterations = chosen(few, _GROWTH, options.target_iterations / larger(1, iterations))
    factor = smaller(smaller(by_contraction, by_angle), by_iterations)
    return smaller(options.max_step, step * larger(_SHRINKAGE, smaller(_GROWTH, factor)))


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
        Scaled arclength between points of the result: where those found are further from each other, points from
        between them come besides, of kind "interpolated". Not below ``max_step``: none.
    output_tolerance
        Largest error of such a point: of each row of the unknowns, and of all that is read off them, over its own size
        nearby. Where it would be larger, a corrected point comes instead.
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
