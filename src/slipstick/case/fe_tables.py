"""Tables of a case file for finite element models: ``[structure]`` of kind "fe" and "blade", contacts on a surface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator

from slipstick.case.rotation import RotationTable, rotation_faults
from slipstick.case.rotor import WORDS, AxisTable, RotorTable, rotor_faults, vector
from slipstick.case.sentences import toml, unexpected
from slipstick.case.tables import ContactTable, Cosines, Frequency, NotNegative, StopTable, Table, is_number
from slipstick.errors import Fault, InputError

MOST_CONTACTS = 1000
"""Each keeps three dofs, of which the reduction is a full matrix."""

_ROTATION = 'a table such as { speed = "3000 rpm", axis = { point = [0, 0, 0], direction = [0, 0, 1] } }'
_DIRECTION = 'the name of a surface such as "TIP", or { direction = [0, 1, 0] } with angle and depth'


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _surface(value: Any) -> Any:
    """A name, or ``{ direction, angle, depth }``."""
    if isinstance(value, str) and value:
        return value
    if not isinstance(value, dict) or "direction" not in value or set(value) - {"direction", "angle", "depth"}:
        raise unexpected(f"{_DIRECTION}")
    for name in ("angle", "depth"):
        if name in value and not (is_number(value[name]) and value[name] > 0):
            raise InputError(Fault(name, found=toml(value[name]), expected="a number > 0"))
    return {**value, "direction": vector(value["direction"])}


def _contacts(value: Any) -> Any:
    """A number, node labels, or positions."""
    if _whole(value) and 1 <= value <= MOST_CONTACTS:
        return value
    if (value if _whole(value) else len(value) if isinstance(value, list) else 0) > MOST_CONTACTS:
        raise unexpected(f"at most {MOST_CONTACTS} contacts")
    if isinstance(value, list) and value and all(map(_whole, value)):
        return value
    triples = isinstance(value, list) and value and all(isinstance(p, list) and len(p) == 3 for p in value)
    if triples and all(is_number(x) for p in value for x in p):
        return [[float(x) for x in p] for p in value]
    raise unexpected("a number of contacts such as 8, a list of node numbers, or a list of positions [x, y, z]")


def _shapes(value: Any) -> dict[str, str]:
    """``"SURFACE"`` or ``{ name = "SURFACE" }``."""
    if isinstance(value, str) and value:
        return {"pressure": value}
    if not (isinstance(value, dict) and value and all(isinstance(s, str) and s for s in value.values())):
        raise unexpected('the name of a surface, or a table such as { pressure = "PRESSURE_SURF" }')
    return value


def _films(value: Any) -> dict[str, float]:
    if not (isinstance(value, dict) and value and all(is_number(h) and h >= 0 for h in value.values())):
        raise unexpected("a table of surface = coefficient >= 0, such as { boundary = 200.0 }")
    return {name: float(h) for name, h in value.items()}


def _points(value: Any) -> Any:
    if value == "all" or (isinstance(value, list) and value and all(_whole(p) and p >= 1 for p in value)):
        return value
    raise unexpected('"all", or a list of contact points such as [1, 3], counted from 1')


def _from_surface(value: Any) -> str:
    if value not in ("surface", *WORDS):
        raise unexpected(
            '"surface": contacts on a surface take their normals from it; or with an axis "radial", "axial"'
        )
    return str(value)


def _along(value: Any) -> Any:
    """A vector, or a word."""
    if isinstance(value, str) and value in WORDS:
        return value
    try:
        return vector(value)
    except InputError:
        raise unexpected('three numbers such as [0, 1, 0], not all 0, or with an axis "circumferential"') from None


SurfaceName = Annotated[Any, PlainValidator(_surface)]
Contacts = Annotated[Any, PlainValidator(_contacts)]
Shapes = Annotated[dict[str, str], PlainValidator(_shapes)]
Films = Annotated[dict[str, float], PlainValidator(_films)]
Positive = Annotated[float, Field(gt=0)]
ModeCount = Annotated[int, Field(ge=1, le=10_000)]


class MaterialTable(Table):
    """``material = { young = 2e11, poisson = 0.3, density = 7800 }``."""

    young: Positive | None = Field(default=None, description="a number > 0, Young's modulus (force/length^2)")
    poisson: Annotated[float, Field(gt=-1, lt=0.5)] | None = Field(
        default=None, description="a number between -1 and 0.5, Poisson's ratio"
    )
    density: Positive | None = Field(default=None, description="a number > 0, mass/length^3")
    conductivity: NotNegative | None = Field(
        default=None, description="a number >= 0, thermal conductivity (power/(length temperature))"
    )


class ReductionTable(Table):
    """What both finite element kinds take."""

    radius: Positive | None = Field(
        default=None, description="a number > 0, the radius of the contact patches (length)"
    )
    modes: ModeCount | None = Field(default=None, description="a whole number >= 1, how many modes to keep")
    up_to: Frequency | None = Field(default=None, description='the highest frequency that matters, such as "2 kHz"')
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")
    force: bool = Field(default=False, description="true or false: take a reduction that is too coarse")

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """The number of modes is said in one way."""
        if "modes" in raw and "up_to" in raw and "accuracy" not in raw:
            return [Fault("modes", "is given together with up_to", remedy="keep one")]
        return []


class ModelTable(Table):
    """``[structure] kind = "matrices"`` of an imported model."""

    kind: Literal["matrices"]
    file: str = Field(description="the name of a model.h5 made by 'slipstick import', such as a superelement")
    rotation: RotationTable | None = Field(default=None, description=_ROTATION)
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """The rotation is said in one way."""
        return rotation_faults(raw)


class FeTable(ReductionTable):
    """``[structure] kind = "fe"``."""

    kind: Literal["fe"]
    file: str = Field(
        description="the name of a model.h5 made by 'slipstick import', or a mesh (.cdb, .inp, .msh, .bdf)"
    )
    material: MaterialTable | None = Field(
        default=None, description="a table such as { young = 2e11, poisson = 0.3, density = 7800.0 }"
    )
    quadratic: bool = Field(default=False, description="true or false: nodes in the middle of the edges of a mesh")
    fixed: list[str] = Field(default=[], description='a list of node sets or surfaces such as ["ROOT"]')
    surface: SurfaceName | None = Field(default=None, description=_DIRECTION)
    contacts: Contacts | None = Field(
        default=None, description="a number of contacts, a list of node numbers, or a list of positions"
    )
    pressure: Shapes = Field(default={}, description='a surface, or a table such as { pressure = "PRESSURE_SURF" }')
    base: list[Literal["x", "y", "z"]] = Field(
        default=[], description='a list of the directions in which the support may move, such as ["x"]'
    )
    films: Films = Field(default={}, description="a table of surface = convection coefficient")
    cold: str | None = Field(default=None, description="the name of a node set or surface that stays cold")
    rotation: RotationTable | None = Field(default=None, description=_ROTATION)
    keep: list[str] = Field(
        default=[], max_length=3 * MOST_CONTACTS, description='a list of dofs of the full model such as ["n123y"]'
    )
    accuracy: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        default=None, description="a number between 0 and 1, the relative error of the receptance"
    )
    damping_ratio: float = Field(default=0.0, description="a number, the ratio to critical damping")

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """Something is kept; the number of modes is said in one way."""
        faults = [*super().cross_check(raw), *rotation_faults(raw)]
        if "surface" not in raw and not raw.get("keep"):
            remedy = 'give surface = "NAME" for contacts on a surface, or keep = ["n123y"]'
            faults.append(Fault(statement="nothing is kept", remedy=remedy))
        faults += [
            Fault(key, "is given without surface", remedy="give the surface the contacts lie on")
            for key in ("contacts", "radius", "films", "cold")
            if key in raw and "surface" not in raw
        ]
        if "accuracy" in raw and "modes" in raw:
            faults.append(Fault("modes", "is given together with accuracy", remedy="keep one"))
        if "accuracy" in raw and "up_to" not in raw:
            remedy = 'give both, as in accuracy = 1e-6, up_to = "2 kHz"'
            faults.append(Fault("accuracy", "is given without up_to", remedy=remedy))
        return faults


class BladeTable(ReductionTable):
    """``[structure] kind = "blade"``: a parametric turbine blade with contacts on its shroud, SI units."""

    kind: Literal["blade"]
    size: str = Field(default="small", description='"small", "medium" or "large"')
    height: Positive | None = Field(default=None, description="a number > 0, the height of the whole blade, m")
    chord: Positive | None = Field(default=None, description="a number > 0, the chord at the bottom, m")
    thickness: Positive | None = Field(default=None, description="a number > 0, thickness over chord")
    twist: float | None = Field(default=None, description="a finite number, degrees from bottom to top")
    material: MaterialTable | None = Field(
        default=None, description="a table such as { young = 2e11, poisson = 0.3, density = 7800.0 }"
    )
    contacts: Annotated[int, Field(ge=1, le=MOST_CONTACTS)] = Field(
        default=8, description="a whole number >= 1 of contacts"
    )
    film: NotNegative = Field(default=200.0, description="a number >= 0, the convection coefficient, W/(m2 K)")


class SurfaceContactTable(ContactTable):
    """``[[contact]]`` with ``points``: one block for contacts on a surface."""

    points: Annotated[Any, PlainValidator(_points)] = Field(
        default="all", description='"all", or a list of contact points such as [1, 3]'
    )
    direction: Annotated[Any, PlainValidator(_along)] = Field(
        description='the rubbing direction such as [0, 1, 0], projected on the surface; with an axis "circumferential"'
    )
    tangential: Cosines | None = Field(default=None, exclude=True, description="the dof that slides")  # type: ignore[assignment]
    normal: Annotated[Any, PlainValidator(_from_surface)] = Field(
        default=None, description='"surface", for a normal load that varies with the motion; with an axis "radial"'
    )
    axis: AxisTable | None = Field(default=None, description="a table such as { direction = [0, 0, 1] }")
    rotor: RotorTable | None = Field(default=None, description="a table such as { engine_order = 2 }")
    normal_load_total: NotNegative | None = Field(
        default=None, description="a number >= 0, the normal load of all points, shared by area"
    )

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
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


def contact_table(raw: Mapping[str, Any]) -> type[Table]:
    """Which table a ``[[contact]]`` block is."""
    on_surface = "points" in raw or (
        "tangential" not in raw and {"direction", "normal_load_total", "axis", "rotor"} & set(raw)
    )
    if on_surface:
        return SurfaceContactTable
    stop = "normal" in raw and "tangential" not in raw and not raw.get("kt") and not raw.get("mu")
    return StopTable if stop else ContactTable
