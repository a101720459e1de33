"""``[[load]]``: a force on a dof or a shape, or the motion of a support."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, PlainValidator

from slipstick.balance.loads import UNBALANCE, place_faults, way_faults
from slipstick.case.script_text import Call
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

    @property
    def call(self) -> Call:
        """The load."""
        return Call("ss.Load", named=self.stated)


def build_load(row: ReadTable) -> tuple[Load | None, list[Fault]]:
    """The load of a table; of a table with faults a load without force, or None where its place is unknown."""
    acts = row.table.given("dof", "shape", "base", "motion", "harmonic")
    load = row.table.call if row.complete else Call("ss.Load", named=acts)
    try:
        return load.made(), []
    except InputError as error:
        on = next((name for name in acts.values() if isinstance(name, str)), "")
        return None, [fault.below("load", on).inside(*row.where) for fault in error.faults] if row.complete else []
