"""Named parameters: what "tip.velocity", "*.mu", "load.x.phase" or "load" is, and how the inputs move with it.

"tip" is a contact, many contacts of one pair, or the block of contacts "tip 1", "tip 2", ...
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from math import atan2, cos, hypot, sin
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from slipstick.balance.base_motion import MOTION_UNITS
from slipstick.balance.contacts import PER_AREA, ContactPair, prescribed
from slipstick.balance.inputs import SURFACE, Inputs, Line, LoadPhase, Path, StructureValue
from slipstick.balance.loads import Load
from slipstick.contact.names import block_of
from slipstick.contact.rubbing import SECOND, RubbingMotion
from slipstick.errors import Fault, InputError
from slipstick.faults import suggestion, text
from slipstick.structure.dynamic import FACTOR_UNITS, SPEED

if TYPE_CHECKING:
    from slipstick.balance.layout import Batch
    from slipstick.balance.problem import Problem


FACTORS = {"load": "all loads", "friction": "all friction coefficients"}
"""Factors of a problem, and what each is a factor on."""

ALL = "*"
"""Stands for all contacts in names of parameters."""

PREFIX = "load."
QUANTITIES = {"amplitude": "force", "phase": "rad"}
"""Parameters of a load, with their units."""

RUBBING = "rubbing"
"""Stands for all contacts in names of components of the rubbing motion, where no contact is called so."""


class Parts(Protocol):
    """What has named parameters: a problem, or as much of one as is known."""

    @property
    def contacts(self) -> Sequence[ContactPair]:
        """Its contacts."""

    @property
    def loads(self) -> Sequence[Load]:
        """Its loads."""

    @property
    def structure(self) -> Any:
        """Its structure; None where a case does not give a right one."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """What a name stands for: a quantity of contacts, of a load, of the structure, or else a factor of the problem."""

    quantity: str
    members: tuple[tuple[int, int], ...] = ()
    """Contact pair and place in it of each contact."""
    load: LoadPart | None = None
    structure: bool = False
    """Whether it is a parameter of the structure."""

    def places(self, batch: Batch) -> list[int]:
        """Their places in a batch."""
        return [batch.members.index(member) for member in self.members if member in batch.members]


def parameter_target(problem: Parts, name: str) -> Target:
    """What a name stands for; raises InputError with a suggestion where nothing has it."""
    if text("parameter", name, 'a name such as "damper.mu"') in FACTORS:
        return Target(quantity=name)
    owner, _, quantity = name.rpartition(".")
    members = _members(problem, owner, quantity)
    if members:
        return Target(quantity=quantity, members=members)
    load = find_load(problem, name)
    if load is not None:
        return Target(quantity=load[1], load=load[0])
    if problem.structure is not None and name in problem.structure.every_value:
        return Target(quantity=name, structure=True)
    raise InputError(Fault(statement=f"there is no parameter '{name}'", remedy=_meant(problem, name)))


_OTHER_WORDS = {
    "speed": "velocity", "preload": "normal_load", "load": "normal_load", "normal_force": "normal_load",
    "clearance": "gap", "friction": "mu", "friction_coefficient": "mu", "stiffness": "kt",
    "tangential_stiffness": "kt", "normal_stiffness": "kn", "force": "amplitude", "magnitude": "amplitude",
    "angle": "phase",
}  # fmt: skip
"""What quantities are called elsewhere."""


def _meant(problem: Parts, name: str) -> str:
    """What an unknown name was meant to be: by its owner, by its last part, as a whole; else what there is."""
    if name in ("omega", "frequency"):
        return "a response follows the frequency where no parameter is given"
    known = [*known_parameters(problem)]
    owner, _, quantity = name.rpartition(".")
    quantity = _OTHER_WORDS.get(quantity, quantity)
    of_owner = [other.rpartition(".")[2] for other in known if owner and other.rpartition(".")[0] == owner]
    if of_owner:
        close = get_close_matches(quantity, of_owner, n=1, cutoff=0.5)
        return f"did you mean '{owner}.{close[0]}'?" if close else f"{owner} has {', '.join(of_owner)}"
    owners = [other for other in known if other.rpartition(".")[2] == quantity]
    owners = [other for other in owners if other.partition(".")[0] not in (ALL, RUBBING)] or owners
    if len(owners) > 1:
        owners = get_close_matches(f"{owner}.{quantity}", owners, n=1, cutoff=0.8) or owners
    if close := owners[:1] if len(owners) == 1 else get_close_matches(name, known, n=1, cutoff=0.8):
        return f"did you mean '{close[0]}'?"
    if len(problem.contacts) < 2:
        known = [other for other in known if other.partition(".")[0] not in (ALL, RUBBING)]
    return suggestion("", owners or known)


def changed(parts: Parts, target: Target, name: str, value: float) -> dict[str, Any]:
    """The parts that change with a parameter, by name; InputError where they cannot take the value."""
    if target.load is not None:
        if target.quantity == "amplitude" and value < 0:
            raise InputError(Fault(name, found=f"{value:g}", expected="an amplitude >= 0"))
        return {"loads": target.load.changed(tuple(parts.loads), target.quantity, value)}
    if target.structure:
        return {"structure": parts.structure.changed(**{target.quantity: value})}
    if not target.members:
        if target.quantity != "load" and value < 0:
            raise InputError(Fault(name, found=f"{value:g}", expected="a factor >= 0"))
        return {target.quantity: value}
    contacts, own = list(parts.contacts), target.quantity.removesuffix(PER_AREA)
    if own != target.quantity:
        if value < 0:
            raise InputError(Fault(name, found=f"{value:g}", expected="a stiffness per area >= 0"))
        factors = value / mean_per_area(contacts, target)
        sizes = [factors * float(contacts[p].values(own)[k]) for p, k in target.members]
    else:
        sizes = [value] * len(target.members)
    for (p, k), size in zip(target.members, sizes, strict=True):
        contacts[p] = contacts[p].with_value(own, size, k)
    return {"contacts": contacts}


def mean_per_area(contacts: Sequence[ContactPair], target: Target) -> float:
    """Mean stiffness per area of the contacts of a target such as "lap.kt_per_area"."""
    own = target.quantity.removesuffix(PER_AREA)
    each = [
        (contacts[p].values(own)[k], np.broadcast_to(contacts[p].area, len(contacts[p]))[k])  # type: ignore[arg-type]
        for p, k in target.members
    ]
    stiffness, area = np.sum(each, axis=0)
    return float(stiffness / area)


def _members(problem: Parts, owner: str, quantity: str) -> tuple[tuple[int, int], ...]:
    """Contact pair and place in it of each contact that ``owner`` stands for and that has the quantity."""
    named = {name for pair in problem.contacts for name in (pair.name, *pair.elements)}
    if owner == RUBBING and RUBBING not in named and RubbingMotion.is_component(quantity):
        owner = ALL
    in_block = owner not in named
    return tuple(
        (p, k)
        for p, pair in enumerate(problem.contacts)
        for k, element in enumerate(pair.elements)
        if (owner in (pair.name, element, ALL) or (in_block and block_of(pair.name) == owner)) and _has(pair, quantity)
    )


def known_parameters(problem: Parts) -> Iterator[str]:
    """Every name that can be followed, swept or changed."""
    for pair in problem.contacts:
        for owner in dict.fromkeys((pair.name, *pair.elements)):
            yield from (f"{owner}.{quantity}" for quantity in pair.quantities)
    named = {pair.name for pair in problem.contacts}
    blocks = [(block, pair) for pair in problem.contacts if (block := block_of(pair.name)) not in named]
    yield from dict.fromkeys(f"{block}.{quantity}" for block, pair in blocks for quantity in pair.quantities)
    yield from dict.fromkeys(f"{ALL}.{quantity}" for pair in problem.contacts for quantity in pair.quantities)
    yield from dict.fromkeys(f"{RUBBING}.{part}" for pair in problem.contacts for part in pair.rubbing.names)
    yield from load_names(problem)
    if problem.structure is not None:
        yield from problem.structure.every_value
    yield from FACTORS


def product_warnings(problem: Problem, names: Sequence[str]) -> Iterator[str]:
    """Of parameters that are looked at together: which of them a constant normal load makes one, ``mu N``."""
    targets = {name: parameter_target(problem, name) for name in names}
    told: set[tuple[str, ...]] = set()
    for p, pair in enumerate(problem.contacts):
        constant = pair.given.get("normal", (None,)) == (None,) and not any(
            name.startswith("normal_") and np.any(value) for name, value in pair.rubbing.components()
        )
        if not (pair.contact.coulomb and constant) or problem.contact_states:
            continue
        for k in range(len(pair)):
            same = tuple(
                name
                for name, target in targets.items()
                if name == "friction" or (target.quantity in _OF_LIMIT and (p, k) in target.members)
            )
            if len(same) > 1 and same not in told:
                told.add(same)
                yield (
                    f"contact '{pair.elements[k]}': its normal load is constant, so that {' and '.join(same)} act "
                    "through the friction limit mu N alone: their effects cannot be separated, keep one of them"
                )


_OF_LIMIT = ("mu", "normal_load", "gap", "kn")


def parameter_units(problem: Problem, name: str) -> str:
    """Dimension of a named parameter in words, such as "length/time"; "1" for factors."""
    target = parameter_target(problem, name)
    if target.load is not None:
        return target.load.units(target.quantity)
    if target.quantity.removeprefix(SECOND) == "velocity":
        return "length/time"
    if target.structure:
        return "rad/s" if target.quantity == SPEED or target.quantity.endswith(".omega") else FACTOR_UNITS
    if RubbingMotion.is_component(target.quantity):
        return "length"
    if target.quantity.endswith(PER_AREA):
        return "force/length^3"
    named = {problem.contacts[p].contact.unit(target.quantity) for p, _ in target.members}
    return next((units for units in sorted(named) if units != "1"), "1")


def _has(pair: object, quantity: str) -> bool:
    if quantity.endswith(PER_AREA):
        return pair.area is not None and quantity.removesuffix(PER_AREA) in pair.contact.stiffness_names.values()  # type: ignore[attr-defined]
    along = "second" if quantity.startswith(SECOND) else "tangential"
    moves = pair.rubbing.is_component(quantity) and (along == "tangential" or along in pair.contact.surface_ports)  # type: ignore[attr-defined]
    return quantity in pair.quantities or moves  # type: ignore[attr-defined]


def parameter_path(problem: Problem, name: str) -> Path:
    """How the inputs move with a named parameter."""
    target, base = problem.parameter_target(name), problem.inputs
    if target.load is not None:
        return load_path(problem, target.load, target.quantity)
    if target.structure:
        return StructureValue(base, target.quantity)
    if target.quantity == "load":
        return _factor(problem, base, "load", {})
    if not target.members:
        return _factor(problem, base, target.quantity, {b: x.law.factors for b, x in enumerate(problem.batches)})
    zero = base.scaled(0.0)
    for b, batch in enumerate(problem.batches):
        rows = [e for e, member in enumerate(batch.members) if member in target.members]
        if rows and target.quantity.endswith(PER_AREA):
            base, zero = _scaled(problem, b, rows, target, base, zero)
        elif rows:
            base, zero = _moved(problem, b, rows, target.quantity, base, zero)
    return Line(base, zero)


def _factor(problem: Problem, base: Inputs, name: str, parameters: Mapping[int, Mapping[str, str]]) -> Line:
    unit = problem.copied(**{name: 1.0}, told=None).inputs
    touched = {(b, by_name[name]) for b, by_name in parameters.items() if name in by_name}
    if name == "load":
        return Line(replace(base, P=np.zeros_like(base.P)), replace(base.scaled(0.0), P=unit.P))
    start, slope = base, base.scaled(0.0)
    for b, parameter in touched:
        value = unit.batches[b].values[parameter]
        start, slope = start.with_batch(b, **{parameter: 0.0 * value}), slope.with_batch(b, **{parameter: value})
    return Line(start, slope)


def _scaled(
    problem: Problem, b: int, rows: list[int], target: Target, base: Inputs, zero: Inputs
) -> tuple[Inputs, Inputs]:
    """Base and derivative for the stiffness per area of some elements of a batch, which keep their proportions."""
    parameter, size = target.quantity.removesuffix(PER_AREA), mean_per_area(problem.contacts, target)
    start = base.batches[b].values[parameter].copy()
    slope = np.zeros(len(start))
    slope[rows], start[rows] = start[rows] / size, 0.0
    return base.with_batch(b, **{parameter: start}), zero.with_batch(b, **{parameter: slope})


def _moved(
    problem: Problem, b: int, rows: list[int], quantity: str, base: Inputs, zero: Inputs
) -> tuple[Inputs, Inputs]:
    """Base and derivative for one quantity of some elements of a batch."""
    batch, contact_inputs = problem.batches[b], base.batches[b]
    meaning = batch.law.stands_for(quantity, contact_inputs.values)
    if meaning is not None:
        parameter, factor = meaning
        start, slope = contact_inputs.values[parameter].copy(), np.zeros(batch.count)
        start[rows] = 0.0
        slope[rows] = np.broadcast_to(factor, batch.count)[rows]
        return base.with_batch(b, **{parameter: start}), zero.with_batch(b, **{parameter: slope})
    surface = {name: getattr(contact_inputs, name) for name in SURFACE}
    arrays = {name: (array.copy(), np.zeros_like(array)) for name, array in surface.items()}
    for e in rows:
        pair, k = problem.contacts[batch.members[e][0]], batch.members[e][1]
        at = [
            prescribed(pair.with_value(quantity, value, k), problem.harmonics, problem.rubbing_order)
            for value in (0.0, 1.0)
        ]
        for name, (start, slope) in arrays.items():
            low, high = (moved[name][:, k] for moved in at)
            start[:, e], slope[:, e] = low, high - low
    return (
        base.with_batch(b, **{name: start for name, (start, _) in arrays.items()}),
        zero.with_batch(b, **{name: slope for name, (_, slope) in arrays.items()}),
    )


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
