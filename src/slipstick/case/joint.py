"""``[[joint]]``: contacts between two surfaces of a finite element model whose meshes need not match."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, PlainValidator

from slipstick.case.script_text import Call, Code, here
from slipstick.case.source import inside
from slipstick.case.table import NotNegative, Positive, RawTable, Table, right_tables
from slipstick.errors import Fault, InputError, SlipstickWarning

if TYPE_CHECKING:
    from slipstick.fem.model import ImportedModel
    from slipstick.models.surface_pair import SurfacePair

JOINTS = "[[joint]]"
"""Key of the joints in the table of the structure, which keeps their motions; no file has it there."""

FIELD = "joints"
"""Field of the structure's table that holds them."""


class JointTable(Table):
    """``[[joint]]``."""

    name: str = Field(min_length=1, description='a name for the joint, such as "flange"')
    surfaces: Annotated[list[str], Field(min_length=2, max_length=2)] = Field(
        description='the two surfaces, such as ["ROOT", "GROOVE"]'
    )
    kt: NotNegative = Field(description="a number >= 0, the tangential contact stiffness per area (force/length^3)")
    kn: Positive = Field(description="a number > 0, the normal contact stiffness per area (force/length^3)")
    mu: NotNegative | None = Field(
        default=None, description="a number >= 0, the friction coefficient; without it that of the model's file"
    )
    gap: float | None = Field(default=None, description="a finite number, added to the gap of the geometry (length)")
    normal_load: NotNegative | None = Field(
        default=None, description="a number >= 0, the pressure of an interference fit (force/length^2)"
    )
    points: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="a whole number >= 1 of patches that stand for all points of integration"
    )
    patches: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="a whole number >= 1 of patches that move as one in the vibration, after load steps"
    )
    exponent: NotNegative | None = Field(
        default=None, description="a number >= 0, the power of the pressure with which kt grows, such as 0.33"
    )
    touching: bool = Field(default=False, description="true or false: gaps and overlaps of the geometry are closed")
    method: Literal["faces", "nodes"] = Field(
        default="faces", description='"faces" or "nodes": points of integration, or nodes of the first surface'
    )
    within: Positive | None = Field(
        default=None, description="a number > 0, the largest distance of places that face each other (length)"
    )
    pressure: str | None = Field(
        default=None, description="the name of a file with the pressures of another code: .csv, .dat, .rpt, .vtu"
    )
    columns: dict[str, str] | None = Field(
        default=None, description='names of columns by what they are, such as { pressure = "CPRESS", node = "Node" }'
    )

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """The normal load is said in one way."""
        faults = []
        if "gap" in raw and "normal_load" in raw:
            faults.append(Fault("gap", "is given together with normal_load", remedy="keep one (normal_load = -kn gap)"))
        both = next((name for name in ("gap", "normal_load") if name in raw and "pressure" in raw), None)
        if both is not None:
            faults.append(Fault(both, "is given together with pressure", remedy="keep one: the file has the pressures"))
        patches, points = raw.get("patches"), raw.get("points")
        if isinstance(patches, int) and isinstance(points, int) and patches > points > 0:
            faults.append(Fault("patches", found=str(patches), expected=f"at most {points}, the number of points"))
        if "exponent" in raw and "patches" not in raw:
            faults.append(Fault("exponent", "belongs to patches", remedy="give patches too"))
        if "columns" in raw and "pressure" not in raw:
            faults.append(Fault("columns", "belongs to a file of pressures", remedy="give pressure too"))
        return faults

    @property
    def gathering(self) -> dict[str, float]:
        """How its contacts are gathered after the load steps; empty where they are not."""
        return self.given("patches", "exponent") if self.patches is not None else {}


Joints = Annotated[list[JointTable] | None, PlainValidator(right_tables(JointTable))]


def joint_tables(raw: RawTable) -> list[JointTable]:
    """The joints of a case that is right."""
    return [JointTable.model_validate(one) for one in raw.get("joint", [])]


def joint_call(table: JointTable, model: Code, folder: Path | None = None) -> Call:
    """The contacts of a joint; files lie in a folder where it is made."""
    loaded = table.given("gap", "normal_load") or {"gap": 0.0}
    contact = Call("ss.PlanarFrictionContact", named={**table.given("kt", "kn", "mu"), **loaded})
    named = {"contact": contact, **table.given("name", "points", "method", "within")}
    if table.pressure is not None:
        file = here(table.pressure, None if folder is None else inside(folder, table.pressure))
        named |= {"pressure": file, **table.given("columns")}
    return Call(
        "ss.surface_pair", (model, *table.surfaces), {**named, **({"gap": "touching"} if table.touching else {})}
    )


def build_joints(tables: Sequence[JointTable], model: ImportedModel, folder: Path) -> list[SurfacePair]:
    """All joints of a model, silent: the reduced model keeps their warnings.

    Raises
    ------
    InputError
        As ``ss.surface_pair``, each fault at its joint.
    """
    found, faults = [], list[Fault]()
    for table in tables:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SlipstickWarning)
                found.append(_joint(table, Code("model", model), folder).made())
        except InputError as error:
            faults += [_in_joint(fault, table.name) for fault in error.faults]
    if faults:
        raise InputError(faults)
    return found


def _joint(table: JointTable, model: Code, folder: Path) -> Call:
    try:
        return joint_call(table, model, folder)
    except InputError as error:
        raise InputError([fault.inside("pressure") for fault in error.faults]) from None


def _in_joint(fault: Fault, name: str) -> Fault:
    """A fault of a call at the key of the file: the two surfaces are one key."""
    where = tuple("surfaces" if part in ("first", "second") else part for part in fault.where if part != "contact")
    return replace(fault, where=(FIELD, name, *where))


def joint_variable(number: int) -> str:
    """The variable of a joint in a script, counted from 0."""
    return f"joint_{number + 1}"
