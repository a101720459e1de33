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
    rotor_faults,
    rotor_motion,
)
from slipstick.case.script_text import Call, Code, listed_text, made
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
from slipstick.case.validation import ReadTable, close_key
from slipstick.case.velocity_friction import Friction, is_over_velocity, velocity_arguments
from slipstick.errors import IS_MISSING, Fault, InputError, Where
from slipstick.faults import Gathering

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.contact.law import Law
    from slipstick.models.reduced_body import ReducedBody
    from slipstick.models.reduced_sector import ReducedSector

PLANAR = "planar"
AUTO = "auto"
_IN_PLANE = (PLANAR, AUTO)
_NEUTRAL = {"kt": 1.0, "mu": 0.0, "kn": 1.0, "normal_load": 1.0}
"""Values in place of faulty ones, in a contact that is checked but never computed with."""


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
    *names, last = (f'"{name}"' for name in _LAWS)
    expected = f"{', '.join(names)} or {last}; left out for friction contacts"
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

    parameters: ClassVar[tuple[str, ...]] = ("kt", "mu", "kn", "gap", "normal_load")
    """Of its law."""

    @property
    def planar(self) -> bool:
        """Whether its surface slides in both directions, or may."""
        return isinstance(self.tangential, tuple)

    @property
    def over_velocity(self) -> bool:
        """Whether its friction depends on the sliding velocity."""
        return not self.planar and is_over_velocity(self.mu)

    @property
    def neutral(self) -> Mapping[str, Any]:
        """Parameters of its law where its own are at fault."""
        if isinstance(self.mu, dict) and self.over_velocity:
            return {**_NEUTRAL, "mu": None, **velocity_arguments(self.mu)}
        return _NEUTRAL

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
    parameters: ClassVar[tuple[str, ...]] = ("kn", "gap", "normal_load")


class LawTable(Table):
    """``[[contact]]`` with ``law``: one of another kind than a friction contact."""

    name: str = Field(min_length=1, description='a name for the contact, such as "joint"')
    law: Annotated[str, PlainValidator(_law_name)] = Field(description='the name of a law such as "iwan"')
    rubbing: RubbingTable | None = Field(default=None, description="a table such as { velocity = 10.0 }")
    chosen_by: ClassVar[str] = "law"
    of_all: ClassVar[tuple[str, ...]] = ("name", "rubbing")
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
    known = {field.alias or name for name, field in SurfaceContactTable.model_fields.items()}
    for key in set(raw) - known:
        if close_key(key, ["law"]):
            return _law_table({**raw, "law": raw[key]})
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
    pair: ContactPair = _pair(row.table, _law(row, thermal, gathering), _rubbing(row, gathering)).made()
    return pair


def _pair(table: Any, law: Any, rubbing: Any) -> Call:
    """A contact between dofs; a direction along a single dof is the name of that dof."""
    named = {"name": table.name, "contact": law}
    if table.given("ports"):
        named["ports"] = {port: _direction(cosines) for port, cosines in table.ports.model_dump().items()}
    for side, given in table.given("tangential", "normal").items():
        named[side] = tuple(map(_direction, given)) if isinstance(given, tuple) else _direction(given)
    return Call("ss.ContactPair", named=named if rubbing is None else {**named, "rubbing": rubbing})


def _direction(cosines: Mapping[str, float]) -> str | Mapping[str, float]:
    (dof, cosine), *others = cosines.items()
    return dof if cosine == 1.0 and not others else cosines


def _on_surface(
    row: ReadTable, thermal: ReadTable | None, body: ReducedBody | ReducedSector | None, gathering: Gathering
) -> list[CaseContact]:
    """Contacts "NAME 1", "NAME 2", ... of one block; faulty keys are left out, so that the others are checked too.

    Raises
    ------
    InputError
        If the structure has no contact points, a point is not there or given twice, or the rubbing direction is normal
        to the surface.
    """
    between = bool(row.get("between"))
    if between and (body is None or body.between is None):
        remedy = 'give [structure] kind = "disc" with a file or a size, and between'
        raise InputError(Fault("between", "the structure has no contact points towards neighbours", remedy=remedy))
    if body is None or (body.points is None and not between):
        remedy = 'give [structure] kind = "blade", or kind = "fe" with surface'
        raise InputError(Fault("points", "the structure has no contact surface", remedy=remedy))
    call = _surface(row.table, Code("body", body), _law(row, thermal, gathering), _rubbing(row, gathering))
    if not row.complete:
        usual = {} if row.right("direction", "axis") else {"direction": _any_direction(body)}
        call = call._replace(named={**call.named, **usual, "shared": False})
    pairs = call.made()
    if between:
        return [CaseContact(row=row, pair=pair) for pair in pairs]
    if not row.right("points"):
        return []
    assert body.points is not None
    return [
        CaseContact(row=row, pair=pair, point=point)
        for point, pair in zip(body.points.chosen(row.table.points), pairs, strict=True)
    ]


def _surface(table: Any, body: Code, law: Any, rubbing: Any) -> Call:
    direction = list(table.direction) if isinstance(table.direction, tuple) else table.direction
    named = {"contact": law, "direction": direction}
    named |= {} if table.points == "all" else {"points": table.points}
    if table.normal is not None:
        named["normal"] = table.normal if table.given("axis") and table.normal in WORDS else True
    named |= table.given("axis")
    if "axis" in named and table.rotor is not None:
        rubbing = rotor_motion(table.rotor)
    named |= {} if table.normal_load_total is None else {"shared": True}
    named |= {"between": True} if table.between else {}
    return Call("ss.surface_contacts", (body, table.name), named if rubbing is None else {**named, "rubbing": rubbing})


def _any_direction(body: Any) -> Any:
    """One that is normal to the surface nowhere."""
    import numpy as np

    points = body.points or body.between.high
    return np.linalg.svd(points.normals)[2][-1] + 0.1 * np.ones(3)


def _law(row: ReadTable, thermal: ReadTable | None, gathering: Gathering) -> Law:
    """The law of a contact, cold; a neutral one where it is at fault, and all faults that are its own."""
    table, own = row.table, Gathering()
    call = _law_call(table, background_of(table, None if thermal is None else thermal.table), own)
    law: Law | None = None
    if row.complete and not own.faults:
        law = own.take(call.made)
    elif not isinstance(table, LawTable):
        law = own.take(call._replace(named={**table.neutral, **call.named, "gap": None}).made)
    gathering.faults += [fault.inside(*row.where) for fault in own.faults if row.complete or fault.where]
    return law or call._replace(named=table.neutral).made()


def _law_call(table: Any, background: float | None, gathering: Gathering) -> Call:
    """The law of a contact at the background temperature."""
    values = table.given(*table.parameters)
    if isinstance(table, LawTable):
        return Call(f"ss.models.{table.makes}", named=values)
    if table.on_surface and table.normal_load_total is not None:
        values["normal_load"] = table.normal_load_total
    if table.over_velocity:
        del values["mu"]
        return Call("ss.models.StribeckContact", named={**values, **velocity_arguments(table.mu)})
    cold = {key: gathering.inside((key,), cold_value, value, background) for key, value in values.items()}
    law = "ss.PlanarFrictionContact" if table.planar else "ss.FrictionContact"
    return Call(law, named={key: value for key, value in cold.items() if value is not None})


def _rubbing(row: ReadTable, gathering: Gathering) -> Any:
    """The rubbing motion of a contact; None where it has none, or it is at fault."""
    return gathering.inside(row.where, lambda: made(_rubbing_call(row.table)))


def _rubbing_call(table: Any) -> Any:
    if table.rubbing is None:
        return None
    motion = Call("ss.RubbingMotion", named=table.rubbing.stated)
    if not table.planar:
        return motion
    parted = motion.made().parted()
    return Code(f"ss.{parted!r}", parted)


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


def contacts_script(tables: Sequence[Any], thermal: ThermalTable | None, others: Sequence[str] = ()) -> ContactScript:
    """All contacts as Python writes them, equal laws once, then ``others`` as they are."""
    laws: dict[str, str] = {}
    variables: dict[str, str] = {}
    pairs, blocks, lines, chosen = [], [], [], []
    for table in tables:
        law = _law_call(table, background_of(table, thermal), Gathering()).written()
        if law not in laws:
            laws[law] = "friction" if not laws else f"friction_{len(laws) + 1}"
            lines.append(f"{laws[law]} = {law}")
        if table.on_surface:
            variable = variables[table.name] = _variable(table.name, [*variables.values()])
            call = _surface(table, Code("body"), Code(laws[law]), _rubbing_call(table))
            blocks.append(f"{variable} = {call.written()}")
            pairs.append(f"*{variable}")
            chosen += [variable] if table.chosen_by_motion else []
        else:
            pairs.append(_pair(table, Code(laws[law]), _rubbing_call(table)).written())
    pairs += others
    return ContactScript(lines=[*lines, *blocks, f"contacts = {listed_text(pairs)}"], blocks=variables, chosen=chosen)


def _variable(name: str, taken: list[str]) -> str:
    """A variable that is called like a contact."""
    plain = re.sub(r"\W", "_", name)
    reserved = plain in _TAKEN or re.fullmatch(r"(curve|friction|contacts|joint)_\d+", plain)
    free = plain.isidentifier() and not keyword.iskeyword(plain) and plain not in taken and not reserved
    return plain if free else f"contacts_{len(taken) + 1}"
