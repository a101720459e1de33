"""``[[load]]``: a force on a dof or a shape, or the motion of a support."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, PlainValidator

from slipstick.balance.loads import UNBALANCE, place_faults, way_faults
from slipstick.case.script_text import KeysToWrite, call, quantity_text
from slipstick.case.table import Harmonic, RawTable, Table, cosines
from slipstick.case.validation import ReadTable
from slipstick.errors import Fault, InputError
from slipstick.quantities import read_angle

if TYPE_CHECKING:
    from slipstick.balance.loads import Load


def _base(value: object) -> str | dict[str, float]:
    """``"x"`` as it is, or ``{x1 = 1.0, x2 = 1.0}``."""
    directions = cosines(value)
    return value if isinstance(value, str) else directions


class LoadTable(Table):
    """``[[load]]``."""

    dof: str | None = Field(default=None, description="the name of a dof")
    shape: str | None = Field(default=None, description="the name of a load shape of the structure")
    base: Annotated[str | dict[str, float], PlainValidator(_base)] | None = Field(
        default=None,
        description='dofs with their motion for a unit motion of the support, { x1 = 1.0, x2 = 1.0 }, or a name: "x"',
    )
    motion: Literal["displacement", "acceleration", "unbalance"] | None = Field(
        default=None, description='"displacement" or "acceleration" of the support, or "unbalance" on a dof'
    )
    harmonic: Harmonic = Field(default=1, description="a whole number >= 0 (0 is a static load)")
    cos: float = Field(default=0.0, description="a finite number, the cosine part")
    sin: float = Field(default=0.0, description="a finite number, the sine part")
    amplitude: float | None = Field(default=None, description="a finite number: amplitude * cos(harmonic tau + phase)")
    phase: Annotated[float, PlainValidator(read_angle)] | None = Field(
        default=None, description='a number in rad, or text such as "90 deg"'
    )

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Where and how much, each said once."""
        turning = raw.get("motion") == UNBALANCE and "base" not in raw
        faults = [*place_faults(raw), *way_faults({name for name in raw if not (turning and name == "motion")})]
        if not {"amplitude", "cos", "sin"} & set(raw):
            faults.append(Fault(statement="no force is given", remedy="give cos, sin, or amplitude with phase"))
        return faults


def build_load(row: ReadTable) -> tuple[Load | None, list[Fault]]:
    """The load of a ``[[load]]`` table: amplitude cos(m tau + phase) becomes its cosine and sine parts.

    A table with faults makes a load by what is right in it; None where it cannot be told what that acts on.
    """
    from slipstick.balance.loads import Load

    table: LoadTable = row.table
    where = {key: value for key in ("dof", "shape", "base", "motion") if (value := row.get(key)) is not None}
    cos, sin = table.cos, table.sin
    if table.amplitude is not None:
        phase = table.phase or 0.0
        cos, sin = table.amplitude * math.cos(phase), -table.amplitude * math.sin(phase)
    try:
        return Load(**where, harmonic=table.harmonic, cos=cos, sin=sin), []
    except InputError as error:
        on = next((name for name in where.values() if isinstance(name, str)), "")
        return None, [fault.below("load", on).inside(*row.where) for fault in error.faults] if row.complete else []


def load_script(raw: RawTable, number: int) -> str:
    """The same load as Python writes it."""
    keys = KeysToWrite(raw, LoadTable)
    phase = keys.take("phase")
    arguments = keys.rest("dof", "shape", "base", "motion", "harmonic", "cos", "sin", "amplitude")
    if phase is not None:
        arguments["phase"] = quantity_text(raw["phase"])
    keys.end(f"[[load]] number {number}")
    return call("ss.Load", **arguments)
