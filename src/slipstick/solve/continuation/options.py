"""Options of a continuation."""

from __future__ import annotations

from dataclasses import dataclass, field

from slipstick.solve.continuation.stepsize import StepOptions
from slipstick.solve.newton.options import NewtonOptions


def _corrector_options() -> NewtonOptions:
    return NewtonOptions(max_iterations=12, min_damping=0.1, non_monotone=1)


@dataclass(frozen=True, kw_only=True)
class ContinuationOptions(StepOptions):
    """Options of a continuation: those of the step control and these.

    Parameters
    ----------
    max_points
        Largest number of points, located ones not counted.
    newton
        Options of the corrector.
    locate_turning_points
        Whether turning points of the parameter are located and yielded.
    event_tolerance
        Scaled arclength to which events are located: relative to the parameter range, or better.
    """

    max_points: int = 5000
    newton: NewtonOptions = field(default_factory=_corrector_options)
    locate_turning_points: bool = True
    event_tolerance: float = 1e-10
