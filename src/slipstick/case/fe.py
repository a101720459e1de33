"""``[structure] kind = "fe"``: a finite element model, with contacts on a surface or some of its dofs kept.

``kind = "blade"`` is the parametric blade of :mod:`slipstick.models`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PlainValidator

from slipstick.case.joint import JOINTS, Joints, build_joints, joint_call, joint_variable
from slipstick.case.preload import BOLTS, Bolts, bolts_call, cut_bolts, of_sections
from slipstick.case.response import ResponseTable, frequencies_met
from slipstick.case.rotor import ROTATION, AxisTable, RotationTable, rotation_faults, rotation_script, turning
from slipstick.case.script_text import Call, Code, here, literal
from slipstick.case.source import inside
from slipstick.case.structure import CACHE, Body, Tell, reduced, reducing_kind
from slipstick.case.table import (
    Frequency,
    NotNegative,
    Positive,
    RawTable,
    Table,
    at,
    is_number,
    is_whole,
    toml,
    unexpected,
    vector,
)
from slipstick.errors import IS_MISSING, Fault, InputError

if TYPE_CHECKING:
    from slipstick.fem.model import ImportedModel


MOST_CONTACTS = 20_000
"""Each keeps three dofs, of which the reduction is a full matrix."""
_REDUCED = (
    "surface", "contacts", "radius", "pressure", "base", "temperature", "initial_temperature", "displacement",
    "centrifugal", "films", "cold", "keep", "modes", "accuracy", "loss_factor", "damping_ratio", "force", "residuals",
    "stress", "stress_at", "up_to",
)  # fmt: skip
_DIRECTION = 'the name of a surface such as "TIP", or { direction = [0, 1, 0] } with angle and depth'


def _surface(value: object) -> Any:
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
    if is_whole(value) and 1 <= value <= MOST_CONTACTS:
        return value
    if (value if is_whole(value) else len(value) if isinstance(value, list) else 0) > MOST_CONTACTS:
        raise unexpected(f"at most {MOST_CONTACTS} contacts")
    if isinstance(value, list) and value and all(map(is_whole, value)):
        return value
    triples = isinstance(value, list) and value and all(isinstance(p, list) and len(p) == 3 for p in value)
    if triples and all(is_number(x) for p in value for x in p):
        return [[float(x) for x in p] for p in value]
    raise unexpected("a number of contacts such as 8, a list of node numbers, or a list of positions [x, y, z]")


def _shapes(value: object) -> dict[str, str]:
    """``"SURFACE"`` or ``{ name = "SURFACE" }``."""
    if isinstance(value, str) and value:
        return {"pressure": value}
    if not (isinstance(value, dict) and value and all(isinstance(s, str) and s for s in value.values())):
        raise unexpected('the name of a surface, or a table such as { pressure = "PRESSURE_SURF" }')
    return value


def _films(value: object) -> dict[str, float]:
    if not (isinstance(value, dict) and value and all(is_number(h) and h >= 0 for h in value.values())):
        raise unexpected("a table of surface = coefficient >= 0, such as { boundary = 200.0 }")
    return {name: float(h) for name, h in value.items()}


def _field(value: object) -> str | float | dict[str, float]:
    """A temperature, temperatures by node set, or a load step of the file."""
    if isinstance(value, str) and value:
        return value
    if is_number(value):
        return float(value)
    if not (isinstance(value, dict) and value and all(map(is_number, value.values()))):
        raise unexpected(_FIELD)
    return {name: float(number) for name, number in value.items()}


def _fields(value: object) -> dict[str, Any]:
    """Temperature fields by name."""
    expected = "temperature fields by name such as { hot = 120.0, uneven = { all = 20.0, FLANGE = 300.0 } }"
    if not (isinstance(value, dict) and value):
        raise unexpected(expected)
    made, faults = {}, list[Fault]()
    for name, field in value.items():
        try:
            made[name] = _field(field)
        except InputError as error:
            faults += [replace(fault, found=toml(field)).inside(name) for fault in error.faults]
    if faults:
        raise InputError(faults)
    return made


def _moved(value: object) -> dict[str, dict[str, Any]]:
    """Supports by name: node sets with a direction, or held dofs with their motion."""
    if not (
        isinstance(value, dict) and value and all(isinstance(part, dict | str) and part for part in value.values())
    ):
        raise unexpected(_MOVED)
    parts = [part for part in value.values() if isinstance(part, dict)]
    if not all(_is_motion(motion) for part in parts for motion in part.values()):
        raise unexpected(_MOVED)
    return value


def _is_motion(value: object) -> bool:
    triple = isinstance(value, list) and len(value) == 3 and all(map(is_number, value))
    return triple or is_number(value) or value in ("x", "y", "z")


def _property(value: object) -> Any:
    """A number, or rows of a temperature and a number."""
    if is_number(value):
        return float(value)
    rows = isinstance(value, list) and value and all(isinstance(row, list) and len(row) == 2 for row in value)
    if not (isinstance(value, list) and rows and all(is_number(x) for row in value for x in row)):
        raise unexpected("a number, or a table of temperatures and values such as [[20.0, 2.1e11], [600.0, 1.7e11]]")
    return [(float(at), float(of)) for at, of in value]


_FIELD = "a temperature, temperatures by node set such as { all = 20.0, FLANGE = 300.0 }, or a load step of the file"
_MOVED = (
    "supports by name: node sets with a direction, held dofs with their motion, or a load step of the file, such as "
    '{ jaw = { x1 = [1, 0, 0] }, pin = { n12x = 1.0 }, pull = "STEP-1" }'
)


def _elements(value: Any) -> Any:
    """A name, a number, or a list of them."""
    items = value if isinstance(value, list) else [value]
    if not (items and all((isinstance(item, str) and item) or (is_whole(item) and item >= 0) for item in items)):
        raise unexpected(_ELEMENTS)
    return value


_ELEMENTS = 'elements: "all", or a list of numbers and names of element sets or surfaces such as ["TIP", 17]'
Elements = Annotated[Any, PlainValidator(_elements)]
SurfaceName = Annotated[Any, PlainValidator(_surface)]
Contacts = Annotated[Any, PlainValidator(_contacts)]
Shapes = Annotated[dict[str, str], PlainValidator(_shapes)]
Films = Annotated[dict[str, float], PlainValidator(_films)]
Property = Annotated[Any, PlainValidator(_property)]
TemperatureField = Annotated[Any, PlainValidator(_field)]
TemperatureFields = Annotated[dict[str, Any], PlainValidator(_fields)]
Moved = Annotated[dict[str, Any], PlainValidator(_moved)]
ModeCount = Annotated[int, Field(ge=1, le=10_000)]


class MaterialTable(Table):
    """``material = { young = 2e11, poisson = 0.3, density = 7800 }``."""

    young: Property | None = Field(
        default=None, description="a number > 0, Young's modulus (force/length^2), or its table over temperature"
    )
    poisson: Property | None = Field(
        default=None, description="a number between -1 and 0.5, Poisson's ratio, or its table over temperature"
    )
    density: Positive | None = Field(default=None, description="a number > 0, mass/length^3")
    conductivity: NotNegative | None = Field(
        default=None, description="a number >= 0, thermal conductivity (power/(length temperature))"
    )
    expansion: Property | None = Field(
        default=None,
        description="a number, the coefficient of expansion (1/temperature), or its table over temperature",
    )
    reference: float | None = Field(
        default=None, description="a number, the temperature from which the expansion counts"
    )


def material_call(table: MaterialTable) -> Call:
    """The material of a table that must be complete."""
    from slipstick.fem.materials import REQUIRED

    missing = [
        Fault(("material", name), IS_MISSING, remedy="a material needs young, poisson and density")
        for name in REQUIRED
        if name not in table.stated
    ]
    if missing:
        raise InputError(missing)
    return Call("ss.Material", named=table.stated)


RelativeError = Annotated[float, Field(gt=0, lt=1)]
RELATIVE_ERROR = "a number between 0 and 1, the relative error of the receptance"


def accuracy_faults(raw: RawTable) -> list[Fault]:
    """An accuracy beside a number of modes, or without its range."""
    faults = []
    if "accuracy" in raw and "modes" in raw:
        faults.append(Fault("modes", "is given together with accuracy", remedy="keep one"))
    if "accuracy" in raw and "up_to" not in raw:
        remedy = 'give both, as in accuracy = 1e-6, up_to = "2 kHz"'
        faults.append(Fault("accuracy", "is given without up_to", remedy=remedy))
    return faults


class ReductionTable(Table):
    """Keys of every finite element kind."""

    radius: Positive | None = Field(
        default=None, description="a number > 0, the radius of the contact patches (length)"
    )
    modes: ModeCount | None = Field(default=None, description="a whole number >= 1, how many modes to keep")
    up_to: Frequency | None = Field(default=None, description='the highest frequency that matters, such as "2 kHz"')
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")
    force: bool = Field(default=False, description="true or false: take a reduction that is too coarse")

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """The number of modes is said in one way."""
        if "modes" in raw and "up_to" in raw and "accuracy" not in raw:
            return [Fault("modes", "is given together with up_to", remedy="keep one")]
        return []


class StressTable(ReductionTable):
    """Keys of kinds that have stresses at chosen elements too."""

    stress: Elements | None = Field(default=None, description=_ELEMENTS)
    stress_at: Literal["elements", "nodes"] = Field(
        default="elements", description='"elements" or "nodes": stress at centroids, or at nodes'
    )

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """The place of stresses needs elements."""
        faults = super().cross_check(raw)
        if "stress_at" in raw and "stress" not in raw:
            faults.append(Fault("stress_at", "is given without stress", remedy='give stress = "all", or elements'))
        return faults


class FeTable(StressTable):
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
    temperature: TemperatureFields = Field(
        default={},
        description="temperature fields by name such as { hot = 120.0, uneven = { all = 20.0, FLANGE = 300.0 } }",
    )
    initial_temperature: TemperatureField | None = Field(default=None, description=_FIELD)
    at_temperature: TemperatureField | None = Field(default=None, description=_FIELD)
    displacement: Moved = Field(default={}, description=_MOVED)
    centrifugal: AxisTable | None = Field(
        default=None, description="an axis of rotation such as { point = [0, 0, 0], direction = [0, 0, 1] }"
    )
    films: Films = Field(default={}, description="a table of surface = convection coefficient")
    cold: str | None = Field(default=None, description="the name of a node set or surface that stays cold")
    rotation: RotationTable | None = Field(default=None, description=ROTATION)
    keep: list[str] = Field(
        default=[],
        max_length=3 * MOST_CONTACTS,
        description='a list of dofs of the mesh such as ["n123y", "HEAD z"]',
    )
    accuracy: RelativeError | None = Field(default=None, description=RELATIVE_ERROR)
    damping_ratio: float = Field(default=0.0, description="a number, the ratio to critical damping")
    residuals: Literal["auto", "written", "solved"] = Field(
        default="auto", description='"written", "solved" or "auto": how what the modes leave out is applied'
    )
    joints: Joints = Field(default=[], alias="[[joint]]", description="the joints of the case")
    bolts: Bolts = Field(default=[], alias="[[bolt]]", description="the bolts of the case that are sections")

    @property
    def waits(self) -> bool:
        """Whether a joint or a bolt is at fault."""
        return self.joints is None or self.bolts is None

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Something is kept; the number of modes is said in one way."""
        faults = [*super().cross_check(raw), *rotation_faults(raw)]
        if "surface" not in raw and not raw.get("keep") and not raw.get(JOINTS) and not raw.get(BOLTS):
            remedy = 'give surface = "NAME" for contacts on a surface, or keep = ["n123y"]'
            faults.append(Fault(statement="nothing is kept", remedy=remedy))
        faults += [
            Fault(key, "is given without surface", remedy="give the surface the contacts lie on")
            for key in ("contacts", "radius", "films", "cold")
            if key in raw and "surface" not in raw
        ]
        if "initial_temperature" in raw and "temperature" not in raw:
            remedy = "give the fields that act too: temperature = { hot = 120.0 }"
            faults.append(Fault("initial_temperature", "is given without temperature", remedy=remedy))
        return faults + accuracy_faults(raw)


def _fe(table: FeTable, folder: Path, tell: Tell) -> Body:
    """The finite element model of ``kind = "fe"``.

    Raises
    ------
    InputError
        For files, materials, sets, surfaces and dofs that are not there, and models that are not held.
    """
    model = turning(_heated(imported_model(table, folder, tell), table), table.rotation, folder, tell)
    bolts = None
    if table.bolts:
        bolts = cut_bolts(table.bolts, model)
        model = bolts.model
        for note in bolts.notes:
            tell(f"structure: {note}")
    if table.surface is not None:
        tell(f"structure: contacts on the surface{', influence matrix' if table.films or table.cold else ''} ...")
    joints = build_joints(table.joints or [], model, folder)
    for joint in joints:
        mu = [f"contacts '{joint.name}': {joint.friction}"] * bool(joint.friction)
        for note in (joint.notes[0], *mu, *(() if joint.mapped is None else joint.notes[-2:])):
            tell(f"structure: {note}")
    tell(f"structure: reducing {model.n_dofs} dofs, or reading it from {CACHE} ...")
    kept = None if bolts is None else Code("", list(dict.fromkeys([*table.keep, *bolts.keep])))
    body = _body(table, Code("model", model), [Code(pair.name, pair) for pair in joints], kept)
    # judged once range and harmonics are known
    made = reduced(tell, body.but(force=True), folder, force=table.force)
    return replace(made, joints=tuple(joints), bolts=bolts)


def _heated(model: ImportedModel, table: FeTable) -> ImportedModel:
    """The model at the temperature whose stiffness it has."""
    from slipstick.fem.expansion import at_temperature

    if table.at_temperature is None:
        return model
    with at("at_temperature"):
        return at_temperature(model, table.at_temperature)


def _body(table: FeTable, model: Code, joints: Sequence[Code], kept: Code | None) -> Call:
    pairs = {"pairs": Code(f"[{', '.join(joint.text for joint in joints)}]", [joint.value for joint in joints])}
    keep = {} if kept is None else {"keep": kept}
    return Call("ss.reduced_body", (model,), {**table.given(*_REDUCED), **keep, **(pairs if joints else {})})


def imported_model(table: Any, folder: Path, tell: Tell) -> ImportedModel:
    """A model made by the import, or a mesh assembled here."""
    from slipstick.fem.materials import REQUIRED
    from slipstick.importers.formats import holds
    from slipstick.importers.import_model import read_model
    from slipstick.importers.roles import ImportOptions

    with at("file"):
        path = inside(folder, table.file)
    alone = "give conductivity, expansion and reference alone"
    tell(f"structure: reading {table.file} ...")
    if holds(path, "mesh"):
        material = None if table.material is None else material_call(table.material).made()
        return read_model(
            path, ImportOptions(material=material, fixed=table.fixed, quadratic=table.quadratic), quiet=True
        )
    faults = [
        Fault(("material", name), f"{path.name} holds matrices with a material already", remedy=alone)
        for name in REQUIRED
        if table.material is not None and getattr(table.material, name) is not None
    ]
    if table.quadratic:
        remedy = "give --quadratic to 'slipstick import'"
        faults.append(Fault("quadratic", f"{path.name} holds matrices already", remedy=remedy))
    if faults:
        raise InputError(faults)
    more = {} if table.material is None else table.material.given("conductivity", "expansion", "reference")
    return read_model(path, ImportOptions(fixed=table.fixed, **more), quiet=True)


def import_call(table: Any) -> Call:
    """The model of a file as Python reads it."""
    known = {} if table.material is None else table.material.stated
    material = {"material": material_call(table.material)} if "young" in known else known
    return Call("ss.import_model", (here(table.file),), {**material, **table.given("fixed", "quadratic")})


def _fe_script(table: FeTable, _folder: Path) -> list[str]:
    tables = table.joints or []
    names = [Code(joint_variable(number)) for number, _ in enumerate(tables)]
    kept = Code(f"[{', '.join([*map(literal, table.keep), '*bolts.keep'])}]") if table.bolts else None
    body = _body(table, Code("model"), names, kept).but(cache=here(CACHE))
    model = [f"model = {import_call(table).written()}"]
    if table.at_temperature is not None:
        model.append(f"model = {Call('ss.models.at_temperature', (Code('model'), table.at_temperature)).written()}")
    model += rotation_script(table.rotation)
    if table.bolts:
        model += [f"bolts = {bolts_call(table.bolts, Code('model')).written()}", "model = bolts.model"]
    model += [
        f"{name.text} = {joint_call(joint, Code('model')).written()}" for name, joint in zip(names, tables, strict=True)
    ]
    return [*model, f"body = {body.written()}", "structure = body.structure"]


FE = reducing_kind(FeTable, _fe, _fe_script)


_KINDS = ("fe", "blade")
_SAID = ("modes", "accuracy", "up_to")
_HARMONICS = 5.0
"""Harmonics that friction makes of an excited one; those beyond count less than 1/25."""
_STEPS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0)
"""A range moved a little has the same reduction, which need not be made again."""


def _is_reduced(structure: RawTable) -> bool:
    sector = structure.get("kind") == "disc" and bool({"file", "size"} & set(structure))
    return sector or structure.get("kind") in _KINDS


def reaching(raw: RawTable) -> Any:
    """The ``[structure]`` of a case; one to be reduced says ``up_to`` where it leaves the number of modes open.

    That is the end of ``[response]`` with the harmonics that matter, rounded up. Nothing is added beside faults, which
    are told elsewhere.
    """
    structure, response = raw["structure"], raw.get("response")
    if isinstance(structure, Mapping):
        if {JOINTS, BOLTS} & set(structure):  # in a file these keys are as unknown as "joint" is there
            structure = {key.strip("[]") if key in (JOINTS, BOLTS) else key: value for key, value in structure.items()}
        if structure.get("kind") == "fe" and raw.get("joint"):
            structure = {**structure, JOINTS: raw["joint"]}
        if structure.get("kind") == "fe" and (sections := of_sections(raw.get("bolt"))):
            structure = {**structure, BOLTS: sections}
    if not isinstance(structure, Mapping) or not _is_reduced(structure) or set(_SAID) & set(structure):
        return structure
    if not isinstance(response, Mapping) or ResponseTable.cross_check(response):
        return structure
    try:
        highest = max(frequencies_met(ResponseTable.model_validate(response)))
        orders = [int(load.get("harmonic", 1)) for load in raw.get("load", [])]
    except (AttributeError, TypeError, ValueError):  # ValidationError is one
        return structure
    return {**structure, "up_to": _rounded_up(_HARMONICS * max([1, *orders]) * highest)}


def _rounded_up(value: float) -> float:
    power = 10.0 ** floor(log10(value))
    return next((step * power for step in _STEPS if step * power >= value), 10.0 * power)


_DIMENSIONS = ("height", "chord", "thickness", "twist")
_BLADE_REDUCED = ("contacts", "radius", "film", "modes", "loss_factor", "stress", "stress_at", "up_to")


class BladeTable(StressTable):
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


def _blade(table: BladeTable, folder: Path, tell: Tell) -> Body:
    """The parametric blade of ``kind = "blade"``.

    Raises
    ------
    InputError
        For an unknown size, dimensions that make no blade, too many contacts.
    """
    from slipstick.models.blade_mesh import blade_shape

    try:
        shape = blade_shape(table.size, **table.given(*_DIMENSIONS))
    except InputError as error:
        raise InputError([fault.below("blade") for fault in error.faults]) from None
    body = _blade_body(table, shape)
    tell(f"structure: {table.size} blade, from {CACHE} or by mesh, matrices and influence matrix ...")
    return reduced(tell, body, folder, force=table.force)


def _blade_body(table: BladeTable, shape: Any) -> Call:
    material = {} if table.material is None else {"material": material_call(table.material)}
    return Call("ss.reduced_blade", (shape,), {**material, **table.given(*_BLADE_REDUCED)})


def _blade_script(table: BladeTable, _folder: Path) -> list[str]:
    dimensions = table.given(*_DIMENSIONS)
    shape = Code(Call("blade_shape", (table.size,), dimensions).written()) if dimensions else table.size
    body = _blade_body(table, shape).but(cache=here(CACHE))
    return [f"body = {body.written()}", "structure = body.structure"]


BLADE = reducing_kind(BladeTable, _blade, _blade_script)
