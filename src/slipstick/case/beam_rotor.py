"""``[structure] kind = "rotor"``: a shaft of beams with rigid discs on bearings, turning."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from slipstick.case.fe import MaterialTable, material_call
from slipstick.case.matrices import KeptTable, kept, kept_script
from slipstick.case.script_text import Call, Code, listed_text
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
    table, names = row.table, None
    if row.right("shaft"):
        count = 1 + sum(piece.elements for piece in table.shaft)
        names = [f"n{k}{way}" for k in range(count) for way in ("x", "y", "rx", "ry")]
    if not row.complete:
        return Described(dofs=names, made=True)
    before = len(gathering.faults)
    material = gathering.inside((), lambda: material_call(table.material).made())
    if material is not None:
        values = {"material": material}
        values |= {key: _each(gathering, key, calls) for key, calls in _parts(table, material).items()}
    if len(gathering.faults) > before:
        return Described(dofs=names, made=True)
    call = _call(table, {key: Code(key, value) for key, value in values.items()})
    structure = gathering.inside((), lambda: kept(table, call.made()))
    if structure is None:
        return Described(dofs=names, made=True)
    return Described(body=Body(structure=structure), dofs=structure.dofs, made=True)


def _parts(table: BeamRotorTable, material: Any) -> dict[str, list[Call]]:
    """Pieces of shaft, discs and bearings."""
    discs = [own.stated for own in table.discs]
    return {
        "shaft": [Call("ss.models.Shaft", named=own.stated) for own in table.shaft],
        "discs": [
            Call("ss.models.Disc.of", named={"material": material, **own})
            if "width" in own
            else Call("ss.models.Disc", named=own)
            for own in discs
        ],
        "bearings": [Call("ss.models.Bearing", named=own.stated) for own in table.bearings],
    }


def _call(table: BeamRotorTable, parts: dict[str, Code]) -> Call:
    """The rotor of its parts."""
    named = {**parts, **table.given("speed")}
    named |= {"rayleigh": tuple(table.rayleigh)} if table.given("rayleigh") else {}
    named |= table.given("engine_order", "shear", "loss_factor", "internal_damping")
    return Call("ss.models.beam_rotor", (named.pop("shaft"),), named)


def _each(gathering: Gathering, key: str, calls: list[Call]) -> list[Any]:
    """The objects of a list of tables; a fault of one names its place in the list."""
    made = []
    for i, call in enumerate(calls):
        own = Gathering()
        made.append(own.take(call.made))
        gathering.faults += [fault.below(key.removesuffix("s")).inside(key, i) for fault in own.faults]
    return made


def _script(table: BeamRotorTable, _folder: Path) -> list[str]:
    texts = {"material": material_call(table.material).written()}
    texts |= {
        key: listed_text([call.written() for call in calls])
        for key, calls in _parts(table, Code("material")).items()
        if calls
    }
    rotor = _call(table, {key: Code(key) for key in texts})
    return [*(f"{key} = {text}" for key, text in texts.items()), *kept_script(table, rotor)]


ROTOR = StructureKind(table=BeamRotorTable, build=_rotor, script=_script)
