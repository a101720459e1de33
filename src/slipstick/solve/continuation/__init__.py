"""Branches of ``residual(x, parameter) = 0`` followed by arclength: a System in, an iterator of Steps out."""

from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.follow import Continuation, continuation
from slipstick.solve.continuation.metric import ArclengthScaling
from slipstick.solve.continuation.options import ContinuationOptions
from slipstick.solve.continuation.step import RestartPoint, Step

__all__ = [
    "ArclengthScaling",
    "BranchEvent",
    "Continuation",
    "ContinuationOptions",
    "RestartPoint",
    "Step",
    "continuation",
]
