"""Load steps: what is tightened and loaded, one after the other; bolts."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slipstick.balance.contacts import ContactPair, DirectionLike
from slipstick.balance.loads import Load
from slipstick.balance.problem import Problem
from slipstick.contact.friction import FrictionContact
from slipstick.contact.names import standing_for
from slipstick.errors import Fault
from slipstick.faults import SMALLEST, Gathering, in_radians, number, several, suggestion, table, text, whole
from slipstick.structure.protocol import CENTRIFUGAL, DISPLACEMENT, TEMPERATURE, Structure
from slipstick.typing import Frequency

INCREMENTS = 10
"""Equal parts of a step where no number is given."""
_MOST_INCREMENTS = 100_000


def bolt(*, name: str, elongation: DirectionLike, stiffness: float, preload: float = 0.0) -> ContactPair:
    """A bolt between its head and its nut: a spring that pulls, and goes slack where it would push.

    It is a contact without friction along the elongation. Load steps tighten it by force or by shortening; after that
    it keeps its length, so that its force answers loads and vibration. Its force is the normal force of the contact.

    Parameters
    ----------
    name
        Its name in results and load steps.
    elongation
        Direction cosines by dof, positive where the bolt gets longer: ``{"head_z": 1.0, "nut_z": -1.0}``.
    stiffness
        Force over elongation, ``E A / L``, force/length, > 0. Of a bolt that is meshed on both sides of its cut: large
        beside that of the bolt, 100 times or so.
    preload
        Its force where head and nut have not moved, force, for problems without load steps.

    Raises
    ------
    InputError
        For values of another kind.

    Examples
    --------
    >>> screw = bolt(name="bolt 1", elongation={"head_z": 1.0, "nut_z": -1.0}, stiffness=4e8)
    >>> screw.contact.kn, len(screw)
    (400000000.0, 1)
    """
    gathering = Gathering()
    stiffness = gathering.take(number, "stiffness", stiffness, "a stiffness > 0", above=SMALLEST) or 1.0
    force = gathering.take(number, "preload", preload, "a force >= 0", above=0.0) or 0.0
    if elongation is None or (isinstance(elongation, Mapping | Sequence) and not elongation):
        remedy = 'give the dofs of head and nut: {"head_z": 1.0, "nut_z": -1.0}'
        gathering.faults.append(Fault("elongation", "has no direction", remedy=remedy))
    gathering.end(*(("bolt", name) if isinstance(name, str) else ()))
    return ContactPair(name=name, contact=FrictionContact(kn=stiffness, gap=-force / stiffness), normal=elongation)


@dataclass(frozen=True, init=False)
class LoadStep:
    """One step of loading: all of it grows evenly from the state before to the values given here.

    Parameters
    ----------
    name
        Written on results; by default "step 1", ...
    loads
        Static loads, ``ss.Load(..., harmonic=0, cos=...)``. A load stays as it is until a later step names its place
        again; ``cos=0`` takes it away.
    bolts
        Force of bolts by name, at the end of the step; they keep their length in the steps that follow.
    shortening
        Shortening of bolts by name, length, counted from the state without force at rest.
    temperature
        Name of a temperature field of the structure (``temperature`` of :func:`slipstick.reduced_body`), or factors on
        several, ``{"hot": 0.5}``. The body has this temperature until a later step gives another one; ``{}`` is that
        without thermal strain.
    displacement
        Motion of supports by name, length (``displacement`` of :func:`slipstick.reduced_body`), counted from the
        beginning. A support stays until a later step moves it.
    speed
        Of rotation, rad/s or "3000 rpm": centrifugal forces (``centrifugal`` of :func:`slipstick.reduced_body`), which
        stay until a later step gives another speed.
    increments
        Number of equal increments; they are cut where the iteration does not converge.

    Raises
    ------
    InputError
        For values of another kind, loads that are not static, a bolt that is tightened in two ways.

    Examples
    --------
    >>> step = LoadStep(name="tighten", bolts={"bolt 1": 12e3})
    >>> step.name, dict(step.bolts), step.increments
    ('tighten', {'bolt 1': 12000.0}, 10)
    """

    name: str
    loads: Sequence[Load]
    bolts: Mapping[str, float]
    shortening: Mapping[str, float]
    temperature: Mapping[str, float] | None
    displacement: Mapping[str, float]
    speed: float | None
    increments: int

    def __init__(
        self,
        *,
        name: str = "",
        loads: Load | Sequence[Load] = (),
        bolts: Mapping[str, float] | None = None,
        shortening: Mapping[str, float] | None = None,
        temperature: str | Mapping[str, float] | None = None,
        displacement: Mapping[str, float] | None = None,
        speed: Frequency | None = None,
        increments: int = INCREMENTS,
    ) -> None:
        gathering = Gathering()
        values: dict[str, Any] = {"name": gathering.take(text, "name", name)}
        values["loads"] = gathering.take(several, "loads", loads, Load, "an ss.Load") or ()
        for place, load in enumerate(values["loads"]):
            if load.harmonic:
                varying = f"a load of harmonic {load.harmonic} on '{load.target}'"
                gathering.faults.append(Fault(("loads", place), found=varying, expected="a static load: harmonic=0"))
        if isinstance(temperature, str):
            temperature = {temperature: 1.0}
        for key, given in (
            ("bolts", bolts), ("shortening", shortening), (TEMPERATURE, temperature), (DISPLACEMENT, displacement)
        ):  # fmt: skip
            named, expected, least = _BY_NAME[key]
            found: dict[str, Any] = gathering.take(table, key, {} if given is None else given, named) or {}
            values[key] = {
                bolt: gathering.take(number, (key, bolt), value, expected, above=least) for bolt, value in found.items()
            }
        if temperature is None:
            values[TEMPERATURE] = None
        for bolt in values["bolts"].keys() & values["shortening"].keys():
            gathering.faults.append(Fault(("shortening", bolt), "is given together with its force", remedy="keep one"))
        values["speed"] = gathering.optional(_speed, "speed", speed)
        values["increments"] = gathering.take(whole, "increments", increments, 1, _MOST_INCREMENTS)
        gathering.end(*(("load step", name) if isinstance(name, str) and name else ()))
        for key, value in values.items():
            object.__setattr__(self, key, value)

    @property
    def empty(self) -> bool:
        """Whether nothing changes in it."""
        fields = self.temperature is not None or self.speed is not None
        return not (self.loads or self.bolts or self.shortening or self.displacement or fields)

    def fields(self, structure: Structure) -> list[Load]:
        """Loads of its temperature, its speed and of the supports that move.

        Raises
        ------
        InputError
            For temperature fields, supports and centrifugal forces that the structure does not have.
        """
        gathering, loads = Gathering(), list[Load]()
        for kind, values in ((TEMPERATURE, self.temperature), (DISPLACEMENT, self.displacement)):
            known = [shape.removeprefix(f"{kind} ") for shape in structure.load_shapes if shape.startswith(f"{kind} ")]
            for name in (values or {}).keys() - set(known):
                what, remedy = f"the structure has no {kind} '{name}'", suggestion(name, known)
                remedy = remedy if known else f'give ss.reduced_body {kind}={{"{name}": ...}}'
                gathering.faults.append(Fault((kind, name), what, remedy=remedy))
            if values is not None:
                others = 0.0 if kind == TEMPERATURE else None  # of a temperature the one before ends
                given = {name: values.get(name, others) for name in known}
                loads += [
                    Load(shape=f"{kind} {name}", harmonic=0, cos=value)
                    for name, value in given.items()
                    if value is not None
                ]
        if self.speed is not None:
            if CENTRIFUGAL not in structure.load_shapes:
                remedy = 'give ss.reduced_body centrifugal={"direction": (0, 0, 1)}'
                gathering.faults.append(Fault("speed", "the structure has no centrifugal forces", remedy=remedy))
            loads.append(Load(shape=CENTRIFUGAL, harmonic=0, cos=self.speed**2))
        gathering.end()
        return loads


def _speed(name: str, value: Any) -> float:
    return number(name, in_radians(name, value), 'a speed >= 0 in rad/s, or a text such as "3000 rpm"', above=0.0)


_BY_NAME: Mapping[str, tuple[str, str, float]] = {
    "bolts": ('values by the names of bolts, {"bolt 1": 12e3}', "a force >= 0", 0.0),
    "shortening": ('values by the names of bolts, {"bolt 1": 12e3}', "a length", -float("inf")),
    TEMPERATURE: ('the name of a temperature field, or factors by name, {"hot": 0.5}', "a factor", -float("inf")),
    DISPLACEMENT: ('displacements by the names of supports, {"jaw": 1e-4}', "a length", -float("inf")),
}
"""What is expected of tables by name, of each value in them, and the least one."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """What a step leads to: forces or shortenings by number of the element, and all loads that act at its end."""

    name: str
    forces: Mapping[int, float]
    shortening: Mapping[int, float]
    loads: Mapping[tuple[Hashable, ...], Load]
    increments: int


def targets(problem: Problem, steps: Sequence[LoadStep]) -> list[Target]:
    """The ends of all steps; InputError for bolts that are not there.

    Static loads of the problem itself whose place no step names act from the first step on.
    """
    gathering, acting = Gathering(), dict[tuple[Hashable, ...], Load]()
    fields = [gathering.inside(("steps", k), step.fields, problem.structure) or [] for k, step in enumerate(steps)]
    named = {load.place for step, more in zip(steps, fields, strict=True) for load in (*step.loads, *more)}
    for load in static_loads(problem):
        if load.place not in named:
            acting[load.place] = added(acting.get(load.place), load)
    out = []
    for k, step in enumerate(steps):
        new = dict[tuple[Hashable, ...], Load]()
        for load in (*step.loads, *fields[k]):
            new[load.place] = added(new.get(load.place), load)
        acting = acting | new
        found: dict[str, dict[int, float]] = {"bolts": {}, "shortening": {}}
        for key in found:
            for name, value in getattr(step, key).items():
                elements = standing_for(name, problem.elements)
                faults = list(_bolt_faults(name, elements, problem))
                gathering.faults += [fault.inside("steps", k, key, name) for fault in faults]
                found[key] |= dict.fromkeys(elements, value)
        gathering.faults += [
            Fault(
                ("steps", k, "shortening", problem.elements[e]), "is given together with its force", remedy="keep one"
            )
            for e in sorted(found["bolts"].keys() & found["shortening"].keys())
        ]
        called = step.name or f"step {k + 1}"
        out.append(
            Target(
                name=called, forces=found["bolts"], shortening=found["shortening"], loads=acting,
                increments=step.increments,
            )
        )  # fmt: skip
    gathering.end()
    return out


def static_loads(problem: Problem) -> list[Load]:
    """Loads of harmonic 0, with the factor on all loads in them."""
    return [_times(load, problem.load) for load in problem.loads if not load.harmonic]


def of_problem(problem: Problem, load: Load) -> Load:
    """A static load without the factor on all loads, which the problem applies."""
    return _times(load, 1.0 / problem.load) if problem.load else load


def _times(load: Load, factor: float) -> Load:
    return load if factor == 1.0 else Load(**_acts_on(load), harmonic=0, cos=factor * load.cos)


def added(before: Load | None, load: Load) -> Load:
    """Two static loads on one place together."""
    return load if before is None else Load(**_acts_on(load), harmonic=0, cos=before.cos + load.cos)


def _acts_on(load: Load) -> dict[str, Any]:
    return {"dof": load.dof, "shape": load.shape, "base": load.base, "motion": load.motion}


def _bolt_faults(name: str, elements: Sequence[int], problem: Problem) -> Iterator[Fault]:
    if not elements:
        what = f"there is no bolt '{name}' among the contacts"
        yield Fault(statement=what, remedy=suggestion(name, problem.elements))
        return
    pairs = [pair for pair in problem.contacts for _ in range(len(pair))]
    for e in elements:
        if not (pairs[e].is_spring and isinstance(pairs[e].contact, FrictionContact)):
            remedy = "tighten what ss.bolt makes"
            yield Fault(statement=f"'{problem.elements[e]}' is no bolt: it slides or has no normal", remedy=remedy)
            return
