"""The state from which a branch is followed on, here or in another process: segments so far, and checkpoints."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from slipstick.analysis.curve.segments import Segment
from slipstick.analysis.curve.state_continuation import StateContinuation
from slipstick.analysis.road.checkpoint import Checkpoint, undamaged, vector
from slipstick.analysis.road.work import NO_WORK, Work
from slipstick.errors import Outcome
from slipstick.solve.continuation import RestartPoint, Step


def curve_checkpoint(plain: Mapping[str, Any], size: int) -> Checkpoint:
    """That of a curve of ``size`` unknowns, from a journal; raises InputError where it is none.

    Its ``own`` are outcome and message of every part before (``ended``), texts of the ``jumps`` of contact states, the
    work of the parts before (``done``) and of the runs before the present one in this part (``earlier``), and the
    ``state`` of a point without restart point.
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
    """A branch under way: its segments, jumps of contact states and work.

    Attributes
    ----------
    restart, earlier
        Where the segment that is followed next is taken up; empty for one that begins.
    """

    segments: list[Segment]
    jumps: list[str] = field(default_factory=list)
    done: Work = NO_WORK
    restart: tuple[RestartPoint, ...] = ()
    earlier: Work = NO_WORK

    @classmethod
    def taken_up(cls, start: float, stop: float, checkpoints: Sequence[Checkpoint]) -> ResumeState:
        """As it was at the last of the ``checkpoints`` of all points, which must be of an accepted one."""
        state = cls(segments=[Segment(number=1, start=start, stop=stop)])
        if not checkpoints:
            return state
        last = checkpoints[-1]
        assert last.restart_point is not None
        if last.part > 1:
            state.segments.append(Segment(number=2, start=stop, stop=start))
        restart: deque[RestartPoint] = deque(maxlen=2)
        for point in checkpoints:
            own, stands = point.own, point.restart_point
            state.segments[point.part - 1].add(point.value, (stands.state if stands else own["state"])[:-1])
            if stands and (point.part, own["earlier"].runs) == (last.part, last.own["earlier"].runs):
                restart.append(stands)
        for segment, (outcome, message) in zip(state.segments, last.own["ended"], strict=False):
            segment.outcome, segment.message = Outcome[outcome], message
        state.restart, state.earlier = tuple(restart), last.own["earlier"]
        state.jumps, state.done = list(last.own["jumps"]), last.own["done"]
        return state

    def checkpoint(self, step: Step, run: StateContinuation, seconds: float) -> Checkpoint:
        """Where it stands at a step of the run under way."""
        stands = run.restart_point
        restart_point = stands if stands is not None and stands.state is step.state else None
        ended = tuple((segment.outcome.name, segment.message) for segment in self.segments[:-1])
        own = {"ended": ended, "jumps": tuple(self.jumps), "done": self.done, "earlier": run.earlier}
        return Checkpoint(
            value=step.parameter, seconds=seconds, part=self.segments[-1].number, restart_point=restart_point,
            goes_on=restart_point is not None, own=own if restart_point else {**own, "state": step.state},
        )  # fmt: skip
