"""``[structure] kind = "blade"``: the parametric blade of :mod:`slipstick.models`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from slipstick.case.fe import MOST_CONTACTS, MaterialTable, StressTable, material_of, material_text
from slipstick.case.script_text import KeysToWrite, call, here, literal, quantity_text
from slipstick.case.structure import CACHE, Body, Tell, reduced, reducing_kind, reduction_folder
from slipstick.case.table import NotNegative, Positive
from slipstick.errors import InputError

_DIMENSIONS = ("height", "chord", "thickness", "twist")


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
    from slipstick.models.blade import reduced_blade
    from slipstick.models.blade_mesh import blade_shape

    dimensions = {name: getattr(table, name) for name in _DIMENSIONS}
    try:
        shape = blade_shape(table.size, **{name: value for name, value in dimensions.items() if value is not None})
    except InputError as error:
        raise InputError([fault.below("blade") for fault in error.faults]) from None
    options: dict[str, Any] = {} if table.material is None else {"material": material_of(table.material)}
    options |= {} if table.modes is None else {"modes": table.modes}
    cache = reduction_folder(folder)
    tell(f"structure: {table.size} blade, from {CACHE} or by mesh, matrices and influence matrix ...")
    return reduced(
        tell,
        lambda hear: reduced_blade(
            shape,
            **options,
            contacts=table.contacts,
            radius=table.radius,
            film=table.film,
            up_to=table.up_to,
            stress=table.stress,
            stress_at=table.stress_at,
            loss_factor=table.loss_factor,
            cache=cache,
            listener=hear,
        ),
        force=table.force,
    )


def _blade_script(keys: KeysToWrite, _folder: Path) -> list[str]:
    size, _ = keys.take("size"), keys.take("force")
    dimensions = keys.rest(*_DIMENSIONS)
    shape = call("blade_shape", literal(size), **dimensions) if dimensions else literal(size)
    material = keys.take("material")
    arguments = {} if material is None else {"material": material_text(material.model_dump(exclude_none=True))}
    arguments |= keys.rest("contacts", "radius", "film", "modes", "loss_factor", "stress", "stress_at")
    if keys.take("up_to") is not None:
        arguments["up_to"] = quantity_text(keys.raw["up_to"])
    body = call("ss.reduced_blade", shape, **arguments, cache=here(CACHE))
    return [f"body = {body}", "structure = body.structure"]


BLADE = reducing_kind(BladeTable, _blade, _blade_script)
