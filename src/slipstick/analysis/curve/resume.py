"""The state from which a branch is followed on, here or in another process: segments so far, and checkpoints."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from slipstick.analysis.curve.segments import Segment
from slipstick.analysis.curve.state_continuation import NO_WORK, StateContinuation, Work
from slipstick.errors import InputError, Outcome
from slipstick.solve.continuation import RestartPoint, Step
from slipstick.typing import Array

_STORED = {"context": "given"}
"""Names that fields of a restart point have in a journal, where they differ."""


class Checkpoint(NamedTuple):
    """Where a run stood when it found a point.

    Attributes
    ----------
    state, tangent
        Unknowns with the followed quantity (N + 1,) and their derivative along the branch.
    part
        Number of the part.
    restart_point
        Of an accepted point: what the continuation goes on from. None of a located one, from which nothing goes on.
    ended
        Outcome and message of every part before this one.
    jumps
        Texts of the jumps of contact states so far.
    done, earlier
        Work of the parts before, and of the runs before the present one in this part.
    seconds
        Time taken so far.
    """

    state: Array
    tangent: Array
    part: int
    restart_point: RestartPoint | None
    ended: tuple[tuple[str, str], ...]
    jumps: tuple[str, ...]
    done: Work
    earlier: Work
    seconds: float

    @property
    def value(self) -> float:
        """Of what is followed."""
        return float(self.state[-1])

    def plain(self) -> dict[str, Any]:
        """As numbers, texts and lists of them, and arrays."""
        values = self._asdict()
        del values["restart_point"]
        if self.restart_point is not None:
            values |= {
                f"place_{_STORED.get(name, name)}": value
                for name, value in self.restart_point._asdict().items()
                if name not in values
            }
            values |= {
                "place_measure": np.array(self.restart_point.measure),
                "place_values": np.array(self.restart_point.values),
            }
        return values

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], size: int) -> Checkpoint:
        """What ``plain`` made, of a balance of ``size`` unknowns; raises InputError where it is none."""
        try:
            values = {name: plain[name] for name in cls._fields if name != "restart_point"}
            state, tangent = _vector(values["state"], size + 1), _vector(values["tangent"], size + 1)
            restart_point = _restart_point(plain, state, tangent) if "place_points" in plain else None
            if values["part"] not in (1, 2):
                raise ValueError
            return cls(
                state=state, tangent=tangent, restart_point=restart_point, part=int(values["part"]),
                seconds=float(values["seconds"]),
                ended=tuple((Outcome[name].name, str(message)) for name, message in values["ended"]),
                jumps=tuple(map(str, values["jumps"])), done=Work._make(map(int, values["done"])),
                earlier=Work._make(map(int, values["earlier"])),
            )  # fmt: skip
        except (KeyError, TypeError, ValueError, OverflowError):
            raise InputError("a checkpoint in the journal is damaged, or of another problem") from None


def _vector(value: Any, size: int | None = None) -> Array:
    vector = np.asarray(value, dtype=float)
    if vector.ndim != 1 or (size is not None and vector.size != size) or not np.all(np.isfinite(vector)):
        raise ValueError
    return vector


def _restart_point(plain: Mapping[str, Any], state: Array, tangent: Array) -> RestartPoint:
    values = {name.removeprefix("place_"): value for name, value in plain.items() if name.startswith("place_")}
    typical, size, present, largest = _vector(values["measure"], 4).tolist()
    return RestartPoint(
        state=state, tangent=tangent, kind=str(values["kind"]), orientation=int(values["orientation"]),
        arclength=float(values["arclength"]), step_length=float(values["step_length"]),
        measure=(typical, size, present, largest),
        context=None if values["given"] is None else _vector(values["given"]),
        values=tuple(_vector(values["values"]).tolist()),
        **{name: int(values[name]) for name in ("points", "rejected", "evaluations", "solves")},
    )  # fmt: skip


@dataclass(kw_only=True)
class ResumeState:
    """A branch under way: its segments, jumps of contact states and work.

    Attributes
    ----------
    restart, earlier
        Where the segment that is followed next is taken up; empty for one that begins.
    seconds
        Time taken before it was taken up.
    """

    segments: list[Segment]
    jumps: list[str] = field(default_factory=list)
    done: Work = NO_WORK
    restart: tuple[RestartPoint, ...] = ()
    earlier: Work = NO_WORK
    seconds: float = 0.0

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
            state.segments[point.part - 1].add(point.value, point.state[:-1])
            if point.restart_point and (point.part, point.earlier.runs) == (last.part, last.earlier.runs):
                restart.append(point.restart_point)
        for segment, (outcome, message) in zip(state.segments, last.ended, strict=False):
            segment.outcome, segment.message = Outcome[outcome], message
        state.restart, state.earlier = tuple(restart), last.earlier
        state.jumps, state.done, state.seconds = list(last.jumps), last.done, last.seconds
        return state

    @property
    def points(self) -> int:
        """Points found so far, in all segments."""
        return sum(segment.points for segment in self.segments)

    def checkpoint(self, step: Step, run: StateContinuation, seconds: float) -> Checkpoint:
        """Where it stands at a step of the run under way."""
        stands = run.restart_point
        restart_point = stands if stands is not None and stands.state is step.state else None
        return Checkpoint(
            state=step.state, tangent=step.tangent, part=self.segments[-1].number, restart_point=restart_point,
            ended=tuple((segment.outcome.name, segment.message) for segment in self.segments[:-1]),
            jumps=tuple(self.jumps), done=self.done, earlier=run.earlier, seconds=seconds,
        )  # fmt: skip


def resumable(checkpoints: Iterable[Checkpoint]) -> int:
    """How many of the points of an ended run it is taken up after: up to the last accepted one."""
    return max((number for number, point in enumerate(checkpoints, 1) if point.restart_point is not None), default=0)
