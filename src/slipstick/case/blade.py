"""``[structure] kind = "blade"``: the parametric blade of :mod:`slipstick.models`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from slipstick.case.fe import MOST_CONTACTS, MaterialTable, StressTable, material_call
from slipstick.case.script_text import Call, Code, here
from slipstick.case.structure import CACHE, Body, Tell, reduced, reducing_kind
from slipstick.case.table import NotNegative, Positive
from slipstick.errors import InputError

_DIMENSIONS = ("height", "chord", "thickness", "twist")
_REDUCED = ("contacts", "radius", "film", "modes", "loss_factor", "stress", "stress_at", "up_to")


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
    body = _body(table, shape)
    tell(f"structure: {table.size} blade, from {CACHE} or by mesh, matrices and influence matrix ...")
    return reduced(tell, body, folder, force=table.force)


def _body(table: BladeTable, shape: Any) -> Call:
    material = {} if table.material is None else {"material": material_call(table.material)}
    return Call("ss.reduced_blade", (shape,), {**material, **table.given(*_REDUCED)})


def _blade_script(table: BladeTable, _folder: Path) -> list[str]:
    dimensions = table.given(*_DIMENSIONS)
    shape = Code(Call("blade_shape", (table.size,), dimensions).written()) if dimensions else table.size
    body = _body(table, shape).but(cache=here(CACHE))
    return [f"body = {body.written()}", "structure = body.structure"]


BLADE = reducing_kind(BladeTable, _blade, _blade_script)
