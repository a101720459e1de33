"""A branch followed from both ends of its range: its segments, whether they cover the range, and that in words."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slipstick.errors import Outcome
from slipstick.solve.norm import norm
from slipstick.typing import Array

BROKEN_OFF = (Outcome.TURNED_BACK, Outcome.NO_FIRST_POINT, Outcome.STEP_TOO_SMALL, Outcome.SINGULAR)
"""Ends after which the other end of the range is tried."""

_SAME = 1e-6
_JUMP = 1e-6

_ENDED = {
    Outcome.TURNED_BACK: "turned back",
    Outcome.NO_FIRST_POINT: "found no first point",
    Outcome.STEP_TOO_SMALL: "found no way on",
    Outcome.SINGULAR: "met a singular Jacobian",
    Outcome.POINT_LIMIT: "had all points it was allowed",
    Outcome.OUTSIDE_TABLE: "left the range in which a contact state is known",
    Outcome.INTERRUPTED: "was interrupted",
    Outcome.TIME_LIMIT: "met the time limit",
    Outcome.FAILED: "failed",
}


@dataclass(kw_only=True)
class Segment:
    """One continuation from one end of the range; state lives here because the points come one by one.

    Attributes
    ----------
    number
        1, or 2 for the one from the other end.
    start, stop
        Where it begins and where it is to go.
    reach
        The value furthest from its start.
    last
        Its last value, and the unknowns there (N,); None without points.
    error
        The exception that ended it, if one did.
    met
        Whether it came upon the end of the one before: the same solution at the same value.
    """

    number: int
    start: float
    stop: float
    points: int = 0
    reach: float = field(init=False)
    last: tuple[float, Array] | None = None
    met: bool = False
    outcome: Outcome = Outcome.INTERRUPTED
    message: str = ""
    error: Exception | None = None

    def __post_init__(self) -> None:
        self.reach = self.start

    def add(self, value: float, x: Array) -> None:
        """Take note of a point."""
        if (value > self.reach) == (self.stop > self.start):
            self.reach = value
        self.points, self.last = self.points + 1, (value, x)

    def reaches(self, value: float, x: Array) -> bool:
        """Whether the last point is that solution."""
        if self.last is None or self.last[0] != value:
            return False
        return norm(self.last[1] - x) <= _SAME * max(norm(x), np.finfo(float).tiny)

    @property
    def text(self) -> str:
        """From where to where, and how it ended."""
        if not self.points:
            return f"from {self.start:.6g} no first point was found"
        if self.points == 1 and not self.outcome.ok:
            return f"at {self.start:.6g} one point alone, where it {_ENDED[self.outcome]}"
        how = "" if self.outcome.ok else f", where it {_ENDED[self.outcome]}"
        return f"from {self.start:.6g} to {self.reach:.6g}{how}"


def progress(segments: list[Segment]) -> float:
    """Share of the range that is done; it falls where the branch turns back."""
    first, now = segments[0], segments[-1]
    assert now.last is not None
    done = abs(now.last[0] - now.start) + (abs(first.reach - first.start) if now is not first else 0.0)
    return min(1.0, done / abs(first.stop - first.start))


def joined(segments: list[Segment], *, undamped: bool = False) -> tuple[Outcome, str]:
    """Outcome and message of a branch: completed where its segments cover the range.

    Where one broke off and the structure is ``undamped``, that is named as what may be behind it.
    """
    outcome, text = _joined(segments)
    if undamped and any(segment.outcome in BROKEN_OFF for segment in segments):
        text += "; the structure has next to no damping, and its motion may have no bound at resonance: give it some"
    return outcome, text


def _joined(segments: list[Segment]) -> tuple[Outcome, str]:
    first, second = segments[0], segments[-1]
    if first is second:
        return first.outcome, first.message or first.outcome.text
    forward = 1.0 if first.stop > first.start else -1.0
    gap = forward * (second.reach - first.reach) if second.points else forward * (first.stop - first.reach)
    told = f"{first.text}; from the other end, {second.text}"
    if second.outcome is Outcome.INTERRUPTED:
        return second.outcome, f"{second.outcome.text} ({told})"
    tolerance = _JUMP * abs(first.stop - first.start)
    if gap > tolerance:
        missing = f"between {first.reach:.6g} and {second.reach:.6g} nothing was found"
        return first.outcome, f"{first.message or first.outcome.text}; both ends were tried: {told}; {missing}"
    if not first.points:
        return Outcome.COMPLETED, f"completed from the other end of the range: {told}"
    return Outcome.COMPLETED, f"completed in two parts, which {_meeting(first, second, gap, tolerance)}: {told}"


def _meeting(first: Segment, second: Segment, gap: float, tolerance: float) -> str:
    if second.met:
        return f"meet at {second.reach:.6g}"
    if gap >= -tolerance:
        return f"end on the two sides of {second.reach:.6g}, where the motion jumps or has no bound"
    return f"are different solutions between {second.reach:.6g} and {first.reach:.6g}"
