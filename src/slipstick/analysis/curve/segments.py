"""Segments of a branch: one from each end of its range, their joint outcome, and the state to resume."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slipstick.analysis.curve.state_continuation import StateContinuation
from slipstick.analysis.road.checkpoint import Checkpoint, undamaged, vector
from slipstick.analysis.road.run import NO_WORK, Work
from slipstick.errors import Outcome
from slipstick.solve.continuation import RestartPoint, Step
from slipstick.solve.norm import norm
from slipstick.typing import Array

BROKEN_OFF = (Outcome.TURNED_BACK, Outcome.NO_FIRST_POINT, Outcome.STEP_TOO_SMALL, Outcome.SINGULAR)
"""Outcomes after which the branch is followed from the other end of the range."""

_SAME_MOTION = 1e-6
"""Relative difference up to which two motions are the same."""
_GAP = 1e-6
"""Gap between two segments, over the range, up to which they cover it."""
_GAP_OF_VALUE = 1e-3
"""The same over the value there, in a range without zero: 1e-6 of a very wide range may be many resonances."""

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
    """The continuation from one end of the range, and its state so far.

    Attributes
    ----------
    number
        1, or 2 for the one from the other end.
    start, stop
        First and last value of the followed quantity, in its direction.
    reach
        The value farthest from its start.
    last
        The last value, and the unknowns (N,) there; None without points.
    error
        The exception that ended it, if any.
    met
        Whether it arrived at the end of the first segment: the same solution at the same value.
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
        """Record a point."""
        if (value > self.reach) == (self.stop > self.start):
            self.reach = value
        self.points, self.last = self.points + 1, (value, x)

    def reaches(self, value: float, x: Array) -> bool:
        """Whether the last point is the solution ``x`` at ``value``."""
        if self.last is None or self.last[0] != value:
            return False
        return norm(self.last[1] - x) <= _SAME_MOTION * max(norm(x), np.finfo(float).tiny)

    @property
    def text(self) -> str:
        """Its range and its end, in words."""
        if not self.points:
            return f"from {self.start:.6g} no first point was found"
        if self.points == 1 and not self.outcome.ok:
            return f"at {self.start:.6g} one point alone, where it {_ENDED[self.outcome]}"
        how = "" if self.outcome.ok else f", where it {_ENDED[self.outcome]}"
        return f"from {self.start:.6g} to {self.reach:.6g}{how}"


def progress(segments: list[Segment]) -> float:
    """Covered share of the range, 0 to 1; it falls where the branch turns back."""
    first, now = segments[0], segments[-1]
    assert now.last is not None
    done = abs(now.last[0] - now.start) + (abs(first.reach - first.start) if now is not first else 0.0)
    return min(1.0, done / abs(first.stop - first.start))


def joined(segments: list[Segment], *, undamped: bool = False) -> tuple[Outcome, str]:
    """Outcome and message of a branch: completed where its segments cover the range.

    The message names missing damping as a possible cause where a segment broke off and the structure is ``undamped``.
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
    both = f"{first.text}; from the other end, {second.text}"
    if second.outcome is Outcome.INTERRUPTED:
        return second.outcome, f"{second.outcome.text} ({both})"
    tolerance = _GAP * abs(first.stop - first.start)
    if first.start * first.stop > 0.0:
        tolerance = min(tolerance, _GAP_OF_VALUE * abs(first.reach))
    if gap > tolerance:
        missing = f"between {first.reach:.6g} and {second.reach:.6g} nothing was found"
        return first.outcome, f"{first.message or first.outcome.text}; both ends were tried: {both}; {missing}"
    if not first.points:
        return Outcome.COMPLETED, f"completed from the other end of the range: {both}"
    return Outcome.COMPLETED, f"completed in two parts, which {_meeting(first, second, gap, tolerance)}: {both}"


def _meeting(first: Segment, second: Segment, gap: float, tolerance: float) -> str:
    if second.met:
        return f"meet at {second.reach:.6g}"
    if gap >= -tolerance:
        return f"end on the two sides of {second.reach:.6g}, where the motion jumps or has no bound"
    return f"are different solutions between {second.reach:.6g} and {first.reach:.6g}"


def curve_checkpoint(plain: Mapping[str, Any], size: int) -> Checkpoint:
    """Checkpoint of a curve of ``size`` unknowns, from its journal; raises InputError where that is damaged.

    Its ``own`` entries are: outcome and message of earlier parts (``ended``), texts of the ``jumps`` of contact states,
    work of earlier parts (``done``) and of earlier continuations in this part (``earlier``), and the ``state`` of a
    point without restart point.
    """
    with undamaged():
        state = vector(plain["state"], size + 1)
        point = Checkpoint.from_plain({"value": state[-1], **plain}, size=size + 1)
        if point.part not in (1, 2):
            raise ValueError
        own = {
            "ended": tuple((Outcome[name].name, str(message)) for name, message in plain["ended"]),
            "jumps": tuple(map(str, plain["jumps"])),
            "done": Work._make(map(int, plain["done"])), "earlier": Work._make(map(int, plain["earlier"])),
        }  # fmt: skip
        located = point.restart_point is None
        return replace(point, goes_on=not located, own={**own, "state": state} if located else own)


@dataclass(kw_only=True)
class ResumeState:
    """State of a branch under way: segments, jumps of contact states and work.

    Attributes
    ----------
    restart, earlier
        Last restart points and earlier work of the segment that resumes; empty for a new one.
    """

    segments: list[Segment]
    jumps: list[str] = field(default_factory=list)
    done: Work = NO_WORK
    restart: tuple[RestartPoint, ...] = ()
    earlier: Work = NO_WORK

    @classmethod
    def taken_up(cls, start: float, stop: float, checkpoints: Sequence[Checkpoint]) -> ResumeState:
        """State at the last of the ``checkpoints`` of all points, which must belong to an accepted point."""
        state = cls(segments=[Segment(number=1, start=start, stop=stop)])
        if not checkpoints:
            return state
        last = checkpoints[-1]
        assert last.restart_point is not None
        if last.part > 1:
            state.segments.append(Segment(number=2, start=stop, stop=start))
        restart: deque[RestartPoint] = deque(maxlen=2)
        for point in checkpoints:
            own, accepted = point.own, point.restart_point
            state.segments[point.part - 1].add(point.value, (accepted.state if accepted else own["state"])[:-1])
            if accepted and (point.part, own["earlier"].runs) == (last.part, last.own["earlier"].runs):
                restart.append(accepted)
        for segment, (outcome, message) in zip(state.segments, last.own["ended"], strict=False):
            segment.outcome, segment.message = Outcome[outcome], message
        state.restart, state.earlier = tuple(restart), last.own["earlier"]
        state.jumps, state.done = list(last.own["jumps"]), last.own["done"]
        return state

    def checkpoint(self, step: Step, run: StateContinuation, seconds: float) -> Checkpoint:
        """Checkpoint at a step of the continuation under way."""
        accepted = run.restart_point
        restart_point = accepted if accepted is not None and accepted.state is step.state else None
        ended = tuple((segment.outcome.name, segment.message) for segment in self.segments[:-1])
        own = {"ended": ended, "jumps": tuple(self.jumps), "done": self.done, "earlier": run.earlier}
        return Checkpoint(
            value=step.parameter, seconds=seconds, part=self.segments[-1].number, restart_point=restart_point,
            goes_on=restart_point is not None, own=own if restart_point else {**own, "state": step.state},
        )  # fmt: skip
