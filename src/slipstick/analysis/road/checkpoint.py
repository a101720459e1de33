"""Checkpoints: the state of a run at a point, from which it resumes bit for bit, here or in another process."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipstick.errors import InputError
from slipstick.solve.continuation import RestartPoint
from slipstick.typing import Array

_STORED = {"context": "given"}
"""Names in a journal of the fields of a restart point, where they differ."""
_PREFIXES = ("place_", "before_")


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """The state of a run at a point.

    Attributes
    ----------
    value
        Value of the followed quantity.
    seconds
        Computing time so far.
    part
        Number of the part of the branch.
    restart_point
        State of the continuation, at a point that it accepted.
    before
        The restart point before, where the points before do not determine it.
    goes_on
        Whether the run can resume after this point; otherwise it resumes after an earlier one.
    own
        Entries of the analysis by name: numbers, texts, lists of them, and vectors.
    """

    value: float
    seconds: float
    part: int = 1
    restart_point: RestartPoint | None = None
    before: RestartPoint | None = None
    goes_on: bool = True
    own: Mapping[str, Any]

    def plain(self) -> dict[str, Any]:
        """Entries of a journal by name: numbers, texts, lists of them, and arrays."""
        values = {"value": self.value, "seconds": self.seconds, "part": self.part, "goes_on": self.goes_on}
        if self.before is not None:
            values |= _flat(self.before, "before_")
        if self.restart_point is not None:
            flat = _flat(self.restart_point, "place_")
            values |= {name: flat.pop(f"place_{name}") for name in ("state", "tangent")} | flat
        return {**values, **self.own}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], value: str = "value", size: int | None = None) -> Checkpoint:
        """Checkpoint from the entries that ``plain`` made; the analysis has to check ``own``.

        ``value`` names the followed value, ``size`` is the length of states. Raises ValueError, KeyError or TypeError
        for other entries, see ``undamaged``.
        """
        entries = {f"place_{name}": plain[name] for name in ("state", "tangent") if name in plain} | dict(plain)
        restart_point = _restart_point(entries, "place_", size) if "place_points" in plain else None
        known = {"value", "seconds", "part", "goes_on"} | ({"state", "tangent"} if restart_point else set())
        return cls(
            value=float(plain[value]), seconds=float(plain["seconds"]), part=int(plain.get("part", 1)),
            restart_point=restart_point, goes_on=bool(plain.get("goes_on", True)),
            before=_restart_point(plain, "before_", size) if "before_points" in plain else None,
            own={k: v for k, v in plain.items() if k not in known and not k.startswith(_PREFIXES)},
        )  # fmt: skip


@contextmanager
def undamaged() -> Iterator[None]:
    """Context for reading a checkpoint: raises InputError where it is damaged or of another problem."""
    try:
        yield
    except (KeyError, TypeError, ValueError, OverflowError):
        raise InputError("a checkpoint in the journal is damaged, or of another problem") from None


def vector(value: Any, size: int | None = None) -> Array:
    """An array (size,) of finite numbers; raises ValueError for anything else."""
    array = np.asarray(value, dtype=float)
    if array.ndim != 1 or (size is not None and array.size != size) or not np.all(np.isfinite(array)):
        raise ValueError
    return array


def resumable(checkpoints: Iterable[Checkpoint]) -> int:
    """Number of points of a stopped run up to the last one after which it can resume."""
    return max((number for number, point in enumerate(checkpoints, 1) if point.goes_on), default=0)


def _flat(point: RestartPoint, prefix: str) -> dict[str, Any]:
    values = {prefix + _STORED.get(name, name): value for name, value in point._asdict().items()}
    return values | {f"{prefix}{name}": np.array(getattr(point, name), dtype=float) for name in ("measure", "values")}


def _restart_point(plain: Mapping[str, Any], prefix: str, size: int | None) -> RestartPoint:
    values = {name.removeprefix(prefix): value for name, value in plain.items() if name.startswith(prefix)}
    typical, length, present, largest, *of_varying = vector(values["measure"]).tolist()
    (varying,) = of_varying or [present]  # earlier journals have no size of what varies
    return RestartPoint(
        state=vector(values["state"], size), tangent=vector(values["tangent"], size), kind=str(values["kind"]),
        orientation=int(values["orientation"]), arclength=float(values["arclength"]),
        step_length=float(values["step_length"]), measure=(typical, length, present, largest, varying),
        context=None if values["given"] is None else vector(values["given"]),
        values=tuple(np.asarray(values["values"], dtype=float).tolist()),
        **{name: int(values[name]) for name in ("points", "rejected", "evaluations", "solves")},
    )  # fmt: skip
