"""What a computation tells its listeners."""

from slipstick.analysis.road.events import (
    CaseDone,
    Event,
    EventFunction,
    Listener,
    PointFound,
    Searching,
    StageProgress,
    Started,
    Stopped,
    StrategyTried,
    Working,
)

__all__ = [
    "CaseDone", "Event", "EventFunction", "Listener", "PointFound", "Searching", "StageProgress", "Started", "Stopped",
    "StrategyTried", "Working",
]  # fmt: skip
