"""Where a continuation stands: what it can be taken up from, in another process too, with the same points to come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class RestartPoint:
    """An accepted point and what the points after it depend on; with the place before it, that is everything.

    Attributes
    ----------
    state, tangent
        ``(x, parameter)`` and its derivative along the branch, (N + 1,).
    kind, orientation, arclength
        Those of the ``Step``.
    step_length
        Scaled length of the next step.
    measure
        The metric in which the point was found, see ``Metric.measure``.
    given
        The context the point was solved with: what the point before handed on.
    values
        Event functions at the point, whose signs are compared with those of the next one.
    points, rejected, evaluations, solves
        Work counters.
    """

    state: Array
    tangent: Array
    kind: str
    orientation: int
    arclength: float
    step_length: float
    measure: tuple[float, float, float, float]
    given: Any
    values: tuple[float, ...]
    points: int
    rejected: int
    evaluations: int
    solves: int
