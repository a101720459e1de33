"""``[structure] kind = "blade"``: a table of the case file becomes a call of :mod:`slipstick.models`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slipstick.case.body import Body, Tell
from slipstick.case.fe_tables import BladeTable
from slipstick.case.reducing import CACHE, material_of, reduced, reduction_folder
from slipstick.errors import InputError


def blade_body(table: BladeTable, folder: Path, tell: Tell) -> Body:
    """The parametric blade of ``kind = "blade"``.

    Raises
    ------
    InputError
        For an unknown size, dimensions that make no blade, too many contacts.
    """
    from slipstick.models.blade import reduced_blade
    from slipstick.models.blade_mesh import blade_shape

    dimensions = {name: getattr(table, name) for name in ("height", "chord", "thickness", "twist")}
    try:
        shape = blade_shape(table.size, **{name: value for name, value in dimensions.items() if value is not None})
    except InputError as error:
        raise InputError([fault.below("blade") for fault in error.faults]) from None
    given: dict[str, Any] = {} if table.material is None else {"material": material_of(table.material)}
    given |= {} if table.modes is None else {"modes": table.modes}
    cache = reduction_folder(folder)
    tell(f"structure: {table.size} blade, from {CACHE} or by mesh, matrices and influence matrix ...")
    return reduced(
        tell,
        lambda hear: reduced_blade(
            shape,
            **given,
            contacts=table.contacts,
            radius=table.radius,
            film=table.film,
            up_to=table.up_to,
            loss_factor=table.loss_factor,
            cache=cache,
            listener=hear,
        ),
        force=table.force,
    )
