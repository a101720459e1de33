"""``[structure] kind = "rotor"``: a shaft of beams with rigid discs on bearings, turning."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from slipstick.case.fe import MaterialTable, material_of, material_text
from slipstick.case.matrices import KeptTable, kept, kept_script
from slipstick.case.script_text import KeysToWrite, call, listed_text, literal, quantity_text
from slipstick.case.structure import Body, Described, StructureKind, Tell
from slipstick.case.table import Frequency, NotNegative, Positive, RawTable, Table
from slipstick.case.validation import ReadTable
from slipstick.errors import IS_MISSING, Fault
from slipstick.faults import Gathering

_SIZES = ("width", "outer", "inner")
_INERTIA = ("mass", "polar", "diametral")


class ShaftTable(Table):
    """One of ``shaft = [{ length = 1.5, outer = 0.05, elements = 6 }]``."""

    length: Positive = Field(description="a number > 0")
    outer: Positive = Field(description="a number > 0, the outer diameter")
    inner: NotNegative = Field(default=0.0, description="a number >= 0, the inner diameter")
    elements: int = Field(default=1, ge=1, le=10_000, description="a whole number >= 1")


class RigidDiscTable(Table):
    """One of ``discs``: by its inertia, or by its sizes and the material of the shaft."""

    node: int = Field(ge=0, description="a whole number >= 0, the node of the shaft, counted from 0")
    mass: NotNegative | None = Field(default=None, description="a number >= 0")
    polar: NotNegative | None = Field(default=None, description="a number >= 0, moment of inertia about its axis")
    diametral: NotNegative | None = Field(default=None, description="a number >= 0, moment of inertia about a diameter")
    width: Positive | None = Field(default=None, description="a number > 0")
    outer: Positive | None = Field(default=None, description="a number > 0, the outer diameter")
    inner: NotNegative | None = Field(default=None, description="a number >= 0, the inner diameter")


class BearingTable(Table):
    """One of ``bearings``: stiffness and damping between a node and ground."""

    node: int = Field(ge=0, description="a whole number >= 0, the node of the shaft, counted from 0")
    kxx: float = Field(description="a finite number, force/length")
    kyy: float | None = Field(default=None, description="a finite number, force/length; by default kxx")
    kxy: float = Field(default=0.0, description="a finite number: force along x by a displacement along y")
    kyx: float = Field(default=0.0, description="a finite number: force along y by a displacement along x")
    cxx: float = Field(default=0.0, description="a finite number, force time/length")
    cyy: float | None = Field(default=None, description="a finite number, force time/length; by default cxx")
    cxy: float = Field(default=0.0, description="a finite number: force along x by a velocity along y")
    cyx: float = Field(default=0.0, description="a finite number: force along y by a velocity along x")


class BeamRotorTable(KeptTable):
    """``[structure] kind = "rotor"``."""

    kind: Literal["rotor"]
    material: MaterialTable = Field(
        description="a table such as { young = 211e9, poisson = 0.3, density = 7810.0 }, of the shaft"
    )
    shaft: list[ShaftTable] = Field(
        min_length=1, description="a list of tables such as { length = 1.5, outer = 0.05, elements = 6 }"
    )
    discs: list[RigidDiscTable] = Field(
        default=[], description="a list of tables such as { node = 2, mass = 32.6, polar = 0.33, diametral = 0.18 }"
    )
    bearings: list[BearingTable] = Field(
        default=[], description="a list of tables such as { node = 0, kxx = 1e6, cxx = 400.0 }"
    )
    speed: Frequency | None = Field(default=None, description='a speed of rotation such as "3000 rpm"')
    engine_order: int | None = Field(
        default=None, ge=1, le=10_000, description="a whole number >= 1: omega over the speed"
    )
    shear: bool = Field(default=True, description="true or false: shear deforms the shaft")
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")
    rayleigh: list[NotNegative] = Field(
        default=[0.0, 0.0], min_length=2, max_length=2, description="two numbers >= 0 such as [8.05, 1e-5]"
    )
    internal_damping: NotNegative = Field(
        default=0.0, description="a number >= 0, a time: damping of the turning shaft"
    )

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Each disc is said in one way."""
        faults, discs = super().cross_check(raw), raw.get("discs")
        for i, disc in enumerate(discs if isinstance(discs, list) else ()):
            if not isinstance(disc, Mapping):
                continue
            sizes, inertia = ([key for key in keys if key in disc] for keys in (_SIZES, _INERTIA))
            if sizes and inertia:
                faults.append(Fault(("discs", i, sizes[0]), f"is given together with {inertia[0]}", remedy="keep one"))
            elif not sizes and not inertia:
                remedy = "give mass, polar and diametral, or width, outer and inner"
                faults.append(Fault(("discs", i, "mass"), IS_MISSING, remedy=remedy))
            else:
                keys = _SIZES if sizes else _INERTIA
                faults += [
                    Fault(("discs", i, key), IS_MISSING, remedy=f"a disc has {', '.join(keys)}")
                    for key in keys
                    if key not in disc
                ]
        if "speed" not in raw and "engine_order" not in raw:
            faults.append(Fault("speed", IS_MISSING, remedy="give speed, or engine_order"))
        return faults


def _rotor(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    from slipstick.models.rotor import Bearing, Disc, Shaft, beam_rotor

    table, names = row.table, None
    if row.right("shaft"):
        count = 1 + sum(piece.elements for piece in table.shaft)
        names = [f"n{k}{way}" for k in range(count) for way in ("x", "y", "rx", "ry")]
    if not row.complete:
        return Described(dofs=names, made=True)
    material = gathering.inside((), material_of, table.material)
    shaft = _each(gathering, "shaft", table.shaft, lambda own: Shaft(**own.stated))
    if material is None or shaft is None:
        return Described(dofs=names, made=True)

    def disc(own: RigidDiscTable) -> Disc:
        given = own.stated
        return Disc.of(material=material, **given) if "width" in given else Disc(**given)

    discs, bearings = (
        _each(gathering, "discs", table.discs, disc),
        _each(gathering, "bearings", table.bearings, lambda own: Bearing(**own.stated)),
    )
    if discs is None or bearings is None:
        return Described(dofs=names, made=True)
    structure = gathering.inside(
        (), lambda: kept(row, beam_rotor(
            shaft, material=material, discs=discs, bearings=bearings, speed=table.speed,
            engine_order=table.engine_order, shear=table.shear, loss_factor=table.loss_factor,
            rayleigh=tuple(table.rayleigh), internal_damping=table.internal_damping,
        )),
    )  # fmt: skip
    if structure is None:
        return Described(dofs=names, made=True)
    return Described(body=Body(structure=structure), dofs=structure.dofs, made=True)


def _each(gathering: Gathering, key: str, tables: list[Any], make: Any) -> list[Any] | None:
    """What a list of tables makes; None where one is at fault, which is told at its place in the list."""
    before, made = len(gathering.faults), []
    for i, own in enumerate(tables):
        own_gathering = Gathering()
        made.append(own_gathering.take(make, own))
        one = key.removesuffix("s")
        gathering.faults += [fault.below(one).inside(key, i) for fault in own_gathering.faults]
    return made if len(gathering.faults) == before else None


def _script(keys: KeysToWrite, _folder: Path) -> list[str]:
    material = keys.take("material").model_dump(exclude_none=True)
    lines = [f"material = {material_text(material)}"]
    arguments = {"material": "material"}
    shaft = [call("ss.models.Shaft", **_written(own.stated)) for own in keys.take("shaft")]
    lines.append(f"shaft = {listed_text(shaft)}")
    made = {
        "discs": [
            call("ss.models.Disc.of", material="material", **_written(own.stated))
            if own.width is not None
            else call("ss.models.Disc", **_written(own.stated))
            for own in keys.take("discs") or ()
        ],
        "bearings": [call("ss.models.Bearing", **_written(own.stated)) for own in keys.take("bearings") or ()],
    }
    for name, texts in made.items():
        if texts:
            lines.append(f"{name} = {listed_text(texts)}")
            arguments[name] = name
    if keys.take("speed") is not None:
        arguments["speed"] = quantity_text(keys.raw["speed"])
    rayleigh = keys.take("rayleigh")
    arguments |= {} if rayleigh is None else {"rayleigh": literal(tuple(rayleigh))}
    arguments |= keys.rest("engine_order", "shear", "loss_factor", "internal_damping")
    return [*lines, *kept_script(keys, call("ss.models.beam_rotor", "shaft", **arguments))]


def _written(values: Mapping[str, Any]) -> dict[str, str]:
    return {name: literal(value) for name, value in values.items()}


ROTOR = StructureKind(table=BeamRotorTable, build=_rotor, script=_script)
