"""``[[contact]]``: one contact between dofs, or a block of them on a surface."""

from __future__ import annotations

import builtins
import keyword
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, PlainValidator

from slipstick.case.rotor import (
    WORDS,
    AxisTable,
    RotorTable,
    axis_arguments,
    motion_arguments,
    rotor_faults,
    rotor_motion,
)
from slipstick.case.script_text import KeysToWrite, call, listed_text, literal
from slipstick.case.table import (
    AlongSurface,
    Cosines,
    Directions,
    NotNegative,
    Periodic,
    PeriodicAlong,
    Positive,
    RawTable,
    Table,
    is_whole,
    unexpected,
    vector,
)
from slipstick.case.thermal import ContactThermalTable, NumberOrTable, ThermalTable, background_of, cold_value
from slipstick.case.validation import ReadTable
from slipstick.case.velocity_friction import Friction, is_over_velocity, velocity_arguments
from slipstick.errors import IS_MISSING, Fault, InputError, Where
from slipstick.faults import Gathering

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.contact.law import Law
    from slipstick.contact.rubbing import RubbingMotion
    from slipstick.models.reduced_body import ReducedBody
    from slipstick.models.reduced_sector import ReducedSector

PLANAR = "planar"
AUTO = "auto"
_IN_PLANE = (PLANAR, AUTO)
_NEUTRAL = {"kt": 1.0, "mu": 0.0, "kn": 1.0, "normal_load": 1.0}
"""In place of what is at fault, where a contact is only looked at and not computed with."""


class RubbingTable(Table):
    """``rubbing = { velocity = 10.0, cos = { "1" = 2.0 } }``; along two directions ``{ velocity = [3.0, 0.0] }``."""

    velocity: AlongSurface = Field(default=0.0, description="a finite number, length/time")
    velocity_per_omega: AlongSurface = Field(
        default=0.0, description="a finite number, length: added for each rad/s of omega"
    )
    cos: PeriodicAlong = Field(default={}, description='a table such as { "1" = 2.0 }')
    sin: PeriodicAlong = Field(default={}, description='a table such as { "1" = 2.0 }')
    normal_cos: Periodic = Field(default={}, description='a table such as { "2" = 3.7e-4 }')
    normal_sin: Periodic = Field(default={}, description='a table such as { "2" = 3.7e-4 }')

    @property
    def parts(self) -> dict[str, Any]:
        """Amplitudes by order of each periodic part, by name."""
        return {"cos": self.cos, "sin": self.sin, "normal_cos": self.normal_cos, "normal_sin": self.normal_sin}


def _law_name(value: object) -> str:
    if isinstance(value, str) and value in _LAWS:
        return value
    close = get_close_matches(str(value).lower(), _LAWS, n=1)
    expected = '"stator", "iwan", "dahl" or "bouc_wen"; left out for friction contacts'
    raise InputError(Fault(expected=expected, remedy=f"did you mean '{close[0]}'?" if close else ""))


class ContactTable(Table):
    """``[[contact]]``."""

    on_surface: ClassVar[bool] = False
    """Whether it is a block of contacts on a surface."""

    name: str = Field(min_length=1, description='a name for the contact, such as "damper"')
    tangential: Directions = Field(
        description='the dof that slides, such as "x" or { x = 1.0, x2 = -1.0 }, or both directions '
        'of the surface such as ["x", "y"]'
    )
    normal: Cosines | None = Field(default=None, description='the dof across the contact, such as "z" or { z = 1.0 }')
    kt: NumberOrTable = Field(description="a number >= 0, the tangential contact stiffness (force/length)")
    mu: Friction = Field(
        description="a number >= 0, the friction coefficient; over the sliding velocity { velocity_table = [[0, 0.4], "
        "[2, 0.3]] } or { mu_s = 0.4, mu_d = 0.3, v_s = 0.5 }"
    )
    kn: NumberOrTable | None = Field(
        default=None, description="a number >= 0, the normal contact stiffness (force/length)"
    )
    gap: float | None = Field(default=None, description="a finite number, the gap (> 0) or interference (< 0)")
    normal_load: NotNegative | None = Field(default=None, description="a number >= 0, the static normal load (force)")
    rubbing: RubbingTable | None = Field(default=None, description="a table such as { velocity = 10.0 }")
    thermal: ContactThermalTable | None = Field(
        default=None, description="a table such as { background = 25.0, resistance = 8.0 }"
    )

    @property
    def planar(self) -> bool:
        """Whether its surface slides in both directions, or may."""
        return isinstance(self.tangential, tuple)

    @property
    def chosen_by_motion(self) -> bool:
        """Whether it slides one way where its motion is nearly straight."""
        return False

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """The normal load is said in one way."""
        faults = []
        if "gap" in raw and "normal_load" in raw:
            faults.append(Fault("gap", "is given together with normal_load", remedy="keep one (normal_load = -kn gap)"))
        elif "gap" not in raw and "normal_load" not in raw:
            remedy = "give normal_load = 800.0, or normal, kn and gap"
            faults.append(Fault(statement="the normal load is missing", remedy=remedy))
        if "kn" not in raw and (_moves_along_normal(raw) or ("gap" in raw and "normal_load" not in raw)):
            remedy = "give the normal contact stiffness, needed with normal, gap, normal_cos, normal_sin and profile"
            faults.append(Fault("kn", IS_MISSING, remedy=remedy))
        elif raw.get("kn") == 0 and raw.get("normal_load"):
            faults.append(Fault("kn", found="0, which cannot carry a normal load", expected="kn > 0"))
        if is_over_velocity(raw.get("mu")):
            if isinstance(raw.get("tangential"), list) or raw.get("friction") in _IN_PLANE:
                remedy = "give one direction, or mu as a number"
                faults.append(Fault("mu", "depends on the velocity, and the contact slides in a plane", remedy=remedy))
            if raw.get("kt") == 0:
                faults.append(Fault("kt", found="0", expected="a tangential contact stiffness > 0"))
        return faults + list(_vector_faults(raw))


class StopTable(ContactTable):
    """``[[contact]]`` without friction and without a tangential direction."""

    tangential: Cosines | None = Field(default=None, exclude=True, description="the dof that slides")
    normal: Cosines = Field(description='the dof across the contact, such as "z" or { z = 1.0 }')
    kt: NumberOrTable = Field(default=0.0, description="0: there is no friction")
    mu: Friction = Field(default=0.0, description="0: there is no friction")


class LawTable(Table):
    """``[[contact]]`` with ``law``: one of another kind than a friction contact."""

    name: str = Field(min_length=1, description='a name for the contact, such as "joint"')
    law: Annotated[str, PlainValidator(_law_name)] = Field(
        description='"stator", "iwan", "dahl" or "bouc_wen"; left out for friction contacts'
    )
    rubbing: RubbingTable | None = Field(default=None, description="a table such as { velocity = 10.0 }")
    makes: ClassVar[str]
    neutral: ClassVar[Mapping[str, float]]
    parameters: ClassVar[tuple[str, ...]]
    normal: ClassVar[None] = None
    thermal: ClassVar[None] = None
    on_surface: ClassVar[bool] = False
    planar: ClassVar[bool] = False
    chosen_by_motion: ClassVar[bool] = False

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Its surface slides one way."""
        return [replace(fault, remedy="give one number") for fault in _vector_faults(raw)]


class StatorPortsTable(Table):
    """``ports = { x = "n2x", y = "n2y" }``."""

    x: Cosines = Field(description='the dof of the rotor along x, such as "n2x" or { n2x = 1.0, s2x = -1.0 }')
    y: Cosines = Field(description='the dof of the rotor along y, such as "n2y"')


class StatorTable(LawTable):
    """``[[contact]] law = "stator"``: a rotor in a circular stator."""

    ports: StatorPortsTable = Field(description='a table such as { x = "n2x", y = "n2y" }')
    kn: NotNegative = Field(description="a number >= 0, the radial contact stiffness (force/length)")
    gap: Positive = Field(description="a number > 0, the clearance all round")
    mu: NotNegative = Field(default=0.0, description="a number >= 0, the friction coefficient")
    cn: NotNegative = Field(default=0.0, description="a number >= 0, radial damping in contact (force time/length)")
    slip_velocity: NotNegative = Field(default=0.0, description="a number > 0 where there is friction, length/time")
    makes: ClassVar[str] = "StatorContact"
    neutral: ClassVar[Mapping[str, float]] = {"kn": 0.0, "gap": 1.0}
    parameters: ClassVar[tuple[str, ...]] = ("kn", "gap", "mu", "cn", "slip_velocity")
    tangential: ClassVar[None] = None
    kt: ClassVar[None] = None


class HysteresisTable(LawTable):
    """A law with memory along one direction, that does not know a normal load."""

    tangential: Cosines = Field(description='the dof that slides, such as "x" or { x = 1.0, x2 = -1.0 }')
    kt: Positive = Field(description="a number > 0, the stiffness before it yields (force/length)")
    mu: ClassVar[None] = None
    kn: ClassVar[None] = None


class IwanTable(HysteresisTable):
    """``[[contact]] law = "iwan"``: springs side by side, each with a slider of its own limit."""

    limit: Positive = Field(description="a number > 0, the force while all slide")
    chi: Annotated[float, Field(gt=-1)] = Field(default=0.0, description="a number > -1, exponent of the distribution")
    beta: NotNegative = Field(
        default=0.0, description="a number >= 0, stiffness of the last spring over that of all the others"
    )
    sliders: Annotated[int, Field(ge=1)] = Field(default=100, description="a whole number >= 1, bins of equal width")
    makes: ClassVar[str] = "IwanContact"
    neutral: ClassVar[Mapping[str, float]] = {"kt": 1.0, "limit": 1.0}
    parameters: ClassVar[tuple[str, ...]] = ("kt", "limit", "chi", "beta", "sliders")


class DahlTable(HysteresisTable):
    """``[[contact]] law = "dahl"``: the force creeps towards its limit."""

    limit: Positive = Field(description="a number > 0, the force that it tends to")
    makes: ClassVar[str] = "DahlContact"
    neutral: ClassVar[Mapping[str, float]] = {"kt": 1.0, "limit": 1.0}
    parameters: ClassVar[tuple[str, ...]] = ("kt", "limit")


class BoucWenTable(HysteresisTable):
    """``[[contact]] law = "bouc_wen"``."""

    beta: Positive = Field(description="a number > 0, of the loop's shape (1/length^n)")
    gamma: float = Field(default=0.0, description="a number above -beta, at most beta (1/length^n)")
    n: Annotated[float, Field(ge=1, le=20)] = Field(
        default=1.0, description="a number from 1 to 20, sharpness of the yield"
    )
    alpha: Annotated[float, Field(ge=0, le=1)] = Field(
        default=0.0, description="a number from 0 to 1, stiffness after yield over kt"
    )
    makes: ClassVar[str] = "BoucWenContact"
    neutral: ClassVar[Mapping[str, float]] = {"kt": 1.0, "beta": 1.0}
    parameters: ClassVar[tuple[str, ...]] = ("kt", "beta", "gamma", "n", "alpha")

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """A force without bound allows no constant sliding."""
        faults, rubbing = super().cross_check(raw), raw.get("rubbing")
        slides = isinstance(rubbing, Mapping) and (rubbing.get("velocity") or rubbing.get("velocity_per_omega"))
        if slides and raw.get("alpha"):
            unbounded = "the opposing surface slides, and the stiffness after yield has no bound"
            faults.append(Fault("alpha", unbounded, remedy="give alpha = 0, or no rubbing velocity"))
        return faults


_LAWS: Mapping[str, type[LawTable]] = {
    "stator": StatorTable, "iwan": IwanTable, "dahl": DahlTable, "bouc_wen": BoucWenTable
}  # fmt: skip


def _law_table(raw: RawTable) -> type[LawTable]:
    """The table of its law; of one that there is not, the most similar in name, else in keys."""
    law = raw.get("law", "stator")
    if close := get_close_matches(str(law).lower(), _LAWS, n=1):
        return _LAWS[close[0]]
    return max(_LAWS.values(), key=lambda table: len(set(raw) & set(table.model_fields)))


def _vector_faults(raw: RawTable) -> Iterator[Fault]:
    """Vectors of rubbing motion where the surface slides in one direction alone."""
    rubbing = raw.get("rubbing")
    if isinstance(raw.get("tangential"), list) or raw.get("friction") in _IN_PLANE or not isinstance(rubbing, Mapping):
        return
    for key, value in rubbing.items():
        values = value.values() if isinstance(value, Mapping) else (value,)
        if any(isinstance(one, list) for one in values):
            remedy = 'give tangential = ["x", "y"], or friction = "planar" on a surface'
            yield Fault(("rubbing", key), "is a vector, but the contact slides in one direction", remedy=remedy)


def _moves_along_normal(contact: RawTable) -> bool:
    """Whether a contact, or its opposing surface, is said to move along the normal."""
    rubbing = contact.get("rubbing")
    across = ("normal_cos", "normal_sin")
    rotor = contact.get("rotor")
    along_casing = isinstance(rotor, Mapping) and bool(rotor.get("profile"))
    return "normal" in contact or along_casing or (isinstance(rubbing, Mapping) and any(rubbing.get(k) for k in across))


def _points(value: object) -> Any:
    if value == "all" or (isinstance(value, list) and value and all(is_whole(p) and p >= 1 for p in value)):
        return value
    raise unexpected('"all", or a list of contact points such as [1, 3], counted from 1')


def _from_surface(value: object) -> str:
    if value not in ("surface", *WORDS):
        raise unexpected(
            '"surface": contacts on a surface take their normals from it; or with an axis "radial", "axial"'
        )
    return str(value)


def _along(value: object) -> Any:
    """A vector, or a word."""
    if isinstance(value, str) and value in WORDS:
        return value
    try:
        return vector(value)
    except InputError:
        raise unexpected('three numbers such as [0, 1, 0], not all 0, or with an axis "circumferential"') from None


class SurfaceContactTable(ContactTable):
    """``[[contact]]`` with ``points``: one block for contacts on a surface."""

    points: Annotated[Any, PlainValidator(_points)] = Field(
        default="all", description='"all", or a list of contact points such as [1, 3]'
    )
    direction: Annotated[Any, PlainValidator(_along)] = Field(
        description='the rubbing direction such as [0, 1, 0], projected on the surface; with an axis "circumferential"'
    )
    tangential: Cosines | None = Field(default=None, exclude=True, description="the dof that slides")
    normal: Annotated[Any, PlainValidator(_from_surface)] = Field(
        default=None, description='"surface", for a normal load that varies with the motion; with an axis "radial"'
    )
    axis: AxisTable | None = Field(default=None, description="a table such as { direction = [0, 0, 1] }")
    rotor: RotorTable | None = Field(default=None, description="a table such as { engine_order = 2 }")
    friction: Literal["planar", "auto"] | None = Field(
        default=None,
        description='"planar": the surface slides along direction and across it; "auto": it does where its motion is '
        "not nearly straight",
    )
    between: bool = Field(default=False, description="true or false: towards the next sector of a disc")
    normal_load_total: NotNegative | None = Field(
        default=None, description="a number >= 0, the normal load of all points, shared by area"
    )

    on_surface: ClassVar[bool] = True

    @property
    def planar(self) -> bool:
        """Whether its surface slides in both directions, or may."""
        return self.friction in _IN_PLANE

    @property
    def chosen_by_motion(self) -> bool:
        """Whether it slides one way where its motion is nearly straight."""
        return self.friction == AUTO

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """The normal load and the direction are said in one way."""
        faults = rotor_faults(raw)
        if "tangential" in raw:
            remedy = "contacts on a surface slide along direction"
            faults.append(Fault("tangential", "is given together with points", remedy=remedy))
        if "normal_load_total" in raw:
            faults += [
                Fault(key, "is given together with normal_load_total", remedy="keep one")
                for key in ("normal_load", "gap")
                if key in raw
            ]
            raw = {**raw, "normal_load": raw["normal_load_total"]}
            raw = {key: value for key, value in raw.items() if key != "gap"}
        return faults + super().cross_check(raw)


def contact_table(raw: RawTable) -> type[ContactTable | LawTable]:
    """Which table a ``[[contact]]`` block is."""
    if {"law", "ports"} & set(raw):
        return _law_table(raw)
    on_surface = "points" in raw or (
        "tangential" not in raw and {"direction", "normal_load_total", "axis", "rotor", "between"} & set(raw)
    )
    if on_surface:
        return SurfaceContactTable
    stop = "normal" in raw and "tangential" not in raw and not raw.get("kt") and not raw.get("mu")
    return StopTable if stop else ContactTable


@dataclass(frozen=True, kw_only=True)
class CaseContact:
    """One contact of a case.

    Parameters
    ----------
    row
        The block it comes from.
    pair
        The contact; where its block has faults only its name, its directions and its rubbing motion count.
    point
        The point of a surface it lies on, from 0.
    """

    row: ReadTable
    pair: ContactPair
    point: int | None = None

    @property
    def name(self) -> str:
        """Its own name."""
        return self.pair.name


def build_contacts(
    rows: Sequence[ReadTable], thermal: ReadTable | None, body: ReducedBody | ReducedSector | None, known: bool
) -> tuple[list[CaseContact], list[Fault]]:
    """Single contacts and those on a surface, the latter where it is ``known`` whether there is one."""
    gathering, placed = Gathering(), list[CaseContact]()
    for row in rows:
        if not row.right("name"):
            continue
        if not row.table.on_surface:
            placed += [CaseContact(row=row, pair=_single(row, thermal, gathering))]
        elif known:
            new = gathering.inside(row.where, _on_surface, row, thermal, body, gathering) or []
            taken = {c.point for c in placed}
            twice = [c.point for c in new if c.point is not None and c.point in taken]
            statements = (f"point {point + 1} has a contact already" for point in twice)
            gathering.faults += [Fault((*row.where, "points"), statement) for statement in statements]
            placed += new
    return placed, gathering.faults


def _single(row: ReadTable, thermal: ReadTable | None, gathering: Gathering) -> ContactPair:
    from slipstick.balance.contacts import ContactPair

    law, rubbing = _law(row, thermal, gathering), _rubbing(row, gathering)
    if isinstance(row.table, StatorTable):
        ports = {} if row.get("ports") is None else row.table.ports.model_dump()
        return ContactPair(name=row.table.name, contact=law, rubbing=rubbing, ports=ports)
    directions = {side: row.get(side) for side in ("tangential", "normal")}
    return ContactPair(name=row.table.name, contact=law, rubbing=rubbing, **directions)


def _on_surface(
    row: ReadTable, thermal: ReadTable | None, body: ReducedBody | ReducedSector | None, gathering: Gathering
) -> list[CaseContact]:
    """Contacts "NAME 1", "NAME 2", ... of one block; with what is at fault left out, to see whether the rest is right.

    Raises
    ------
    InputError
        If the structure has no contact points, a point is not there or given twice, or the rubbing direction is normal
        to the surface.
    """
    from slipstick.models.surface_contacts import surface_contacts

    between = bool(row.get("between"))
    if between and (body is None or body.between is None):
        remedy = 'give [structure] kind = "disc" with a file or a size, and between'
        raise InputError(Fault("between", "the structure has no contact points towards neighbours", remedy=remedy))
    if body is None or (body.points is None and not between):
        remedy = 'give [structure] kind = "blade", or kind = "fe" with surface'
        raise InputError(Fault("points", "the structure has no contact surface", remedy=remedy))
    table, axis = row.table, axis_arguments(row.get("axis"))
    points = table.points if row.right("points") else "all"
    direction = table.direction if row.right("direction") and row.right("axis") else _any_direction(body)
    pairs = surface_contacts(
        body,
        table.name,
        contact=_law(row, thermal, gathering),
        direction=direction,
        points=points,
        normal=table.normal if axis is not None and table.normal in WORDS else table.normal is not None,
        shared=row.complete and table.normal_load_total is not None,
        rubbing=_rubbing(row, gathering) if axis is None or row.get("rotor") is None else rotor_motion(table.rotor),
        axis=axis,
        between=between,
    )
    if between:
        return [CaseContact(row=row, pair=pair) for pair in pairs]
    if not row.right("points"):
        return []
    assert body.points is not None
    return [
        CaseContact(row=row, pair=pair, point=point)
        for point, pair in zip(body.points.chosen(points), pairs, strict=True)
    ]


def _any_direction(body: Any) -> Any:
    """One that is normal to the surface nowhere."""
    import numpy as np

    points = body.points or body.between.high
    return np.linalg.svd(points.normals)[2][-1] + 0.1 * np.ones(3)


def _law(row: ReadTable, thermal: ReadTable | None, gathering: Gathering) -> Law:
    """The parameters of a contact, cold; neutral ones where these are at fault, and all faults that are its own."""
    from slipstick import models
    from slipstick.contact.friction import FrictionContact
    from slipstick.contact.planar import PlanarFrictionContact
    from slipstick.contact.velocity_friction import StribeckContact

    if isinstance(row.table, LawTable):
        made: Any = getattr(models, row.table.makes)
        known = {key: value for key in row.table.parameters if (value := row.get(key)) is not None}
        whole = gathering.inside(row.where, lambda: made(**known)) if row.complete else None
        return whole or made(**row.table.neutral)
    law: Any = PlanarFrictionContact if row.table.planar else FrictionContact
    neutral: dict[str, Any] = _NEUTRAL
    mu = row.get("mu")
    if is_over_velocity(mu):
        mu = None
        if not row.table.planar:
            law, neutral = StribeckContact, {**_NEUTRAL, "mu": None, **velocity_arguments(row.get("mu"))}
    background, arguments = background_of(row.table, None if thermal is None else thermal.table), dict[str, Any]()
    for key, value in (("kt", row.get("kt")), ("mu", mu), ("kn", row.get("kn"))):
        cold = None if value is None else gathering.inside((*row.where, key), cold_value, value, background)
        if cold is not None:
            arguments[key] = cold
    total = row.get("normal_load_total") if row.table.on_surface else None
    loads = {"gap": row.get("gap"), "normal_load": row.get("normal_load") if total is None else total}
    arguments |= {key: value for key, value in loads.items() if value is not None}
    if row.complete and "gap" in arguments:
        arguments = {**neutral, **arguments, "normal_load": None}
    else:
        arguments = {**neutral, **arguments, "gap": None}
    try:
        return law(**arguments)
    except InputError as error:
        told = [fault for fault in error.faults if row.complete or fault.where]
        gathering.faults += [fault.inside(*row.where) for fault in told]
        return law(**neutral)


def _rubbing(row: ReadTable, gathering: Gathering) -> RubbingMotion:
    """The rubbing motion of a contact."""
    from slipstick.contact.rubbing import RubbingMotion

    rub = row.table.rubbing
    arguments = {} if rub is None else rub.stated
    motion = gathering.inside(row.where, lambda: RubbingMotion(**arguments)) or RubbingMotion()
    return motion.parted() if row.table.planar else motion


def in_block(fault: Fault, placed: Sequence[CaseContact]) -> Fault:
    """A fault of a contact on a surface at the block that the contact comes from."""
    if fault.where[:1] != ("contact",):
        return fault
    rows: dict[str | int, Where] = {c.name: c.row.where for c in placed}
    return replace(fault, where=(*rows.get(fault.where[1], fault.where[:2]), *fault.where[2:]))


_TAKEN = {*dir(builtins), "C", "K", "M", "Path", "at", "body", "contacts", "curve", "friction", "heated", "i"} | {
    *("loads", "model", "names", "np", "own", "p", "pair", "points", "resistance", "ss", "structure", "thermal")
}
"""Names that a script uses itself."""


@dataclass(frozen=True, kw_only=True)
class ContactScript:
    """Lines that make ``contacts``, and the variable of each block on a surface by its name.

    ``chosen`` are those of blocks whose law is chosen by their motion.
    """

    lines: list[str]
    blocks: dict[str, str]
    chosen: list[str]


def contacts_script(rows: Sequence[RawTable], thermal: ThermalTable | None) -> ContactScript:
    """All contacts as Python writes them; equal laws are one."""
    laws: dict[str, str] = {}
    variables: dict[str, str] = {}
    pairs, blocks, lines, chosen = [], [], [], []
    for i, raw in enumerate(rows):
        keys = KeysToWrite(raw, contact_table(raw))
        law = _law_text(keys, thermal)
        if law not in laws:
            laws[law] = "friction" if not laws else f"friction_{len(laws) + 1}"
            lines.append(f"{laws[law]} = {law}")
        if keys.table.on_surface:
            name = keys.table.name
            variables[name] = _variable(name, [*variables.values()])
            blocks.append(f"{variables[name]} = {_surface_text(keys, laws[law])}")
            pairs.append(f"*{variables[name]}")
            chosen += [variables[name]] if keys.table.friction == AUTO else []
        else:
            pairs.append(_pair_text(keys, laws[law]))
        keys.take("thermal")
        keys.end(f"[[contact]] number {i + 1}")
    return ContactScript(lines=[*lines, *blocks, f"contacts = {listed_text(pairs)}"], blocks=variables, chosen=chosen)


def _law_text(keys: KeysToWrite, thermal: ThermalTable | None) -> str:
    if isinstance(keys.table, LawTable):
        keys.take("law")
        return call(f"ss.models.{keys.table.makes}", **keys.rest(*keys.table.parameters))
    background = background_of(keys.table, thermal)
    values = {name: keys.take(name) for name in ("kt", "mu", "kn", "gap", "normal_load")}
    total = keys.take("normal_load_total")
    values["normal_load"] = values["normal_load"] if total is None else total
    if is_over_velocity(values["mu"]):
        arguments = {name: value for name, value in values.items() if value is not None}
        arguments |= velocity_arguments(arguments.pop("mu"))
        return call("ss.models.StribeckContact", **{name: literal(value) for name, value in arguments.items()})
    cold = {name: cold_value(value, background) for name, value in values.items() if value is not None}
    law = "ss.PlanarFrictionContact" if keys.table.planar else "ss.FrictionContact"
    return call(law, **{name: literal(value) for name, value in cold.items()})


def _pair_text(keys: KeysToWrite, law: str) -> str:
    arguments = {"name": literal(keys.take("name")), "contact": law}
    ports = keys.take("ports")
    if ports is not None:
        written = ", ".join(f'"{port}": {_direction_text(direction)}' for port, direction in ports.model_dump().items())
        arguments["ports"] = f"{{{written}}}"
    for port in ("tangential", "normal"):
        direction = keys.take(port)
        if isinstance(direction, tuple):
            arguments[port] = f"({', '.join(map(_direction_text, direction))})"
        elif direction is not None:
            arguments[port] = _direction_text(direction)
    return call("ss.ContactPair", **arguments, **_rubbing_text(keys))


def _direction_text(direction: Mapping[str, float]) -> str:
    alone = len(direction) == 1 and next(iter(direction.values())) == 1.0
    return literal(next(iter(direction)) if alone else direction)


def _surface_text(keys: KeysToWrite, law: str) -> str:
    direction = keys.take("direction")
    arguments = {"contact": law, "direction": literal(direction if isinstance(direction, str) else list(direction))}
    points, _, normal = keys.take("points"), keys.take("tangential"), keys.take("normal")
    keys.take("friction")
    arguments |= {} if points in (None, "all") else {"points": literal(points)}
    arguments |= {} if normal is None else {"normal": literal(normal) if normal in WORDS else "True"}
    axis, rotor = axis_arguments(keys.take("axis")), keys.take("rotor")
    arguments |= {} if axis is None else {"axis": literal(axis)}
    if rotor is not None:
        motion_keys = {key: literal(value) for key, value in motion_arguments(rotor).items()}
        motion = call("ss.casing_motion", motion_keys.pop("profile"), radius="radius", angles="angles", **motion_keys)
        arguments["rubbing"] = f"lambda radius, angles: {motion}"
    arguments |= {} if keys.table.normal_load_total is None else {"shared": "True"}
    arguments |= {"between": "True"} if keys.take("between") else {}
    return call("ss.surface_contacts", "body", literal(keys.take("name")), **arguments, **_rubbing_text(keys))


def _rubbing_text(keys: KeysToWrite) -> dict[str, str]:
    rub = keys.take("rubbing")
    if rub is None:
        return {}
    if keys.table.planar:
        from slipstick.contact.rubbing import RubbingMotion

        return {"rubbing": f"ss.{RubbingMotion(**rub.stated).parted()!r}"}
    return {"rubbing": call("ss.RubbingMotion", **{key: literal(value) for key, value in rub.stated.items()})}


def _variable(name: str, taken: list[str]) -> str:
    """A variable that is called like a contact."""
    plain = re.sub(r"\W", "_", name)
    reserved = plain in _TAKEN or re.fullmatch(r"(curve|friction|contacts)_\d+", plain)
    free = plain.isidentifier() and not keyword.iskeyword(plain) and plain not in taken and not reserved
    return plain if free else f"contacts_{len(taken) + 1}"
