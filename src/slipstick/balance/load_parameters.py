"""Amplitude and phase of a load as named parameters: "load.x.amplitude", "load.x.2.phase"."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import atan2, cos, hypot, sin
from typing import TYPE_CHECKING, Protocol

from slipstick.balance.base_motion import MOTION_UNITS
from slipstick.balance.inputs import Inputs
from slipstick.balance.loads import Load
from slipstick.balance.paths import Line, LoadPhase, Path
from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem

PREFIX = "load."
QUANTITIES = {"amplitude": "force", "phase": "rad"}
"""With their units."""


class Loaded(Protocol):
    """What has loads: a problem, or as much of one as is known."""

    @property
    def loads(self) -> Sequence[Load]:
        """Its loads."""


@dataclass(frozen=True, kw_only=True)
class LoadPart:
    """All loads on one target at one harmonic together: ``amplitude cos(m tau + phase)``."""

    first: Load
    target: str
    """Its name in names of parameters."""
    places: tuple[int, ...]
    """Their places among the loads of the problem."""
    cos: float
    sin: float

    @property
    def quantities(self) -> tuple[str, ...]:
        """A static load has no phase."""
        return tuple(QUANTITIES) if self.first.harmonic else ("amplitude",)

    def value(self, quantity: str) -> float:
        """Amplitude (>= 0, force or motion of a support), or phase (rad, -pi to pi)."""
        return hypot(self.cos, self.sin) if quantity == "amplitude" else atan2(-self.sin, self.cos)

    def units(self, quantity: str) -> str:
        """Units of one of them; those of a load shape are its own."""
        if quantity == "amplitude" and self.first.motion is not None:
            return MOTION_UNITS[self.first.motion]
        return "1" if quantity == "amplitude" and self.first.dof is None else QUANTITIES[quantity]

    def unit(self) -> tuple[float, float]:
        """Cosine and sine for the amplitude 1; a load of amplitude 0 has the phase 0."""
        size = self.value("amplitude")
        return (self.cos / size, self.sin / size) if size else (1.0, 0.0)

    def changed(self, loads: tuple[Load, ...], quantity: str, value: float) -> tuple[Load, ...]:
        """All loads with one in place of these, of another amplitude or phase."""
        if quantity == "amplitude":
            c, s = (value * part for part in self.unit())
        else:
            size = self.value("amplitude")
            c, s = size * cos(value), -size * sin(value)
        new = replace(self.first, cos=c, sin=s)
        kept = (new if i == self.places[0] else load for i, load in enumerate(loads) if i not in self.places[1:])
        return tuple(kept)


def load_parts(problem: Loaded) -> list[LoadPart]:
    """The loads of a problem by target and harmonic."""
    parts: dict[tuple[Hashable, ...], LoadPart] = {}
    names = _names(problem)
    for i, load in enumerate(problem.loads):
        key = (*load.place, load.harmonic)
        old = parts.get(key) or LoadPart(first=load, target=names[load.place], places=(), cos=0.0, sin=0.0)
        parts[key] = replace(old, places=(*old.places, i), cos=old.cos + load.cos, sin=old.sin + load.sin)
    return list(parts.values())


def _names(problem: Loaded) -> dict[tuple[Hashable, ...], str]:
    """Name of each target; several motions of supports that are called the same are numbered: "base 1", "base 2"."""
    names = {load.place: load.target for load in problem.loads}
    bases = [load.place for load in problem.loads if load.base is not None]
    for name in {names[place] for place in bases}:
        same = [place for place in dict.fromkeys(bases) if names[place] == name]
        if len(same) > 1:
            names |= {place: f"{name} {i}" for i, place in enumerate(same, 1)}
    return names


def load_names(problem: Loaded) -> Iterator[str]:
    """Every name of a load's amplitude or phase, the short ones where a target has one harmonic."""
    parts = load_parts(problem)
    targets = [part.target for part in parts]
    for part, target in zip(parts, targets, strict=True):
        where = target if targets.count(target) == 1 else f"{target}.{part.first.harmonic}"
        yield from (f"{PREFIX}{where}.{quantity}" for quantity in part.quantities)


def find_load(problem: Loaded, name: str) -> tuple[LoadPart, str] | None:
    """The loads and the quantity a name stands for; None where there is none.

    Raises
    ------
    InputError
        If it could be one of several.
    """
    where, _, quantity = name.removeprefix(PREFIX).rpartition(".")
    if not name.startswith(PREFIX):
        return None
    parts = [part for part in load_parts(problem) if quantity in part.quantities]
    meant = [part for part in parts if part.target == where]
    meant = meant or [part for part in parts if f"{part.target}.{part.first.harmonic}" == where]
    if len(meant) > 1:
        names = ", ".join(f"'{PREFIX}{where}.{part.first.harmonic}.{quantity}'" for part in meant)
        raise InputError(Fault(statement=f"'{name}' could be one of {names}", remedy="say which"))
    return (meant[0], quantity) if meant else None


def load_path(problem: Problem, part: LoadPart, quantity: str) -> Path:
    """How the inputs move with the amplitude or the phase of some loads."""
    order = part.first.harmonic * problem.load_order
    row, column = problem.load_columns.row(part.first), problem.harmonics.index(order)
    base = problem.inputs
    if quantity == "phase":
        return LoadPhase(base, problem.load * part.value("amplitude"), row, column)
    empty, unit = base.P.copy(), 0.0 * base.P
    places = slice(column, column + 2 if order else column + 1)
    empty[row, places], unit[row, places] = 0.0, [problem.load * u for u in part.unit()][: 2 if order else 1]
    zero: Inputs = base.scaled(0.0)
    return Line(replace(base, P=empty), replace(zero, P=unit))
