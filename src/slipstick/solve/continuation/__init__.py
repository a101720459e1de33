"""Branches of ``residual(x, parameter) = 0`` followed by arclength: a System in, an iterator of Steps out."""

from slipstick.solve.continuation.corrector import LatestSteps, RestartPoint, Step
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.follow import Continuation, continuation
from slipstick.solve.continuation.metric import ArclengthScaling
from slipstick.solve.continuation.step_control import ContinuationOptions

__all__ = [
    "ArclengthScaling",
    "BranchEvent",
    "Continuation",
    "ContinuationOptions",
    "LatestSteps",
    "RestartPoint",
    "Step",
    "continuation",
]
