"""Options of a continuation."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

from slipstick.errors import InputError
from slipstick.solve.continuation.stepsize import StepOptions
from slipstick.solve.newton import NewtonOptions


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
