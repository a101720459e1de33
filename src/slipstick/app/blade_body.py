"""The parametric blade of a case file, ``[structure] kind = "blade"``."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.body import Body, ContactPoints, FullModel, Tell
from slipstick.app.fe_tables import BladeTable
from slipstick.app.reducing import CACHE, cache_folder, material_of, reduced
from slipstick.app.sentences import shown, suggestion
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.models.blade import BladeModel, RubbingBlade
    from slipstick.structure.reduction import Reduction


def blade_body(table: BladeTable, folder: Path, tell: Tell) -> Body:
    """The parametric blade of ``kind = "blade"``.

    Raises
    ------
    InputError
        For an unknown size, dimensions that make no blade, too many contacts.
    """
    from slipstick.models.blade import rubbing_blade

    setup = _blade_model(table)
    cache = cache_folder(folder)
    tell(f"structure: {table.size} blade, from {CACHE} or by mesh, matrices and influence matrix ...")
    began = time.perf_counter()
    blade: RubbingBlade = reduced(
        tell, lambda hear: rubbing_blade(setup, loss_factor=table.loss_factor, cache=cache, listener=hear)
    )
    return Body(
        structure=blade.structure,
        force=table.force,
        points=ContactPoints(
            positions=blade.positions, normals=blade.normals, areas=blade.areas, influence=blade.influence
        ),
        full=FullModel(
            n_dofs=blade.n_dofs,
            solver=blade.solver,
            modes=len(blade.structure.omega),
            reused=blade.reused,
            seconds=time.perf_counter() - began,
            note="parametric blade, SI units",
            comparison=partial(_blade_again, setup, blade),
        ),
    )


def _blade_model(table: BladeTable) -> BladeModel:
    from dataclasses import replace

    from slipstick.models.blade import BLADE_STEEL, BladeModel
    from slipstick.models.blade_mesh import ELEMENT_SIZES, blade_shape

    if table.size not in ELEMENT_SIZES:
        raise InputError(f"size: found {shown(table.size)}; {suggestion(table.size, ELEMENT_SIZES)}")
    dimensions = {name: getattr(table, name) for name in ("height", "chord", "thickness", "twist")}
    shape = replace(blade_shape(table.size), **{name: value for name, value in dimensions.items() if value is not None})
    material = BLADE_STEEL if table.material is None else material_of(table.material)
    more = {} if table.modes is None else {"modes": table.modes}
    return BladeModel(
        shape=shape, material=material, contacts=table.contacts, radius=table.radius, film=table.film, **more
    )


def _blade_again(setup: BladeModel, blade: RubbingBlade) -> tuple[Reduction, Any, Any]:
    """The full blade once more, for comparison with the reduction, which may come from disk."""
    import numpy as np

    from slipstick.models.blade import finite_element_blade
    from slipstick.structure.reduction import Reduction

    whole = finite_element_blade(setup)
    reduction = Reduction(
        structure=blade.structure,
        directions=whole.request["keep"],
        n_full=blade.n_dofs,
        solver=blade.solver,
        residuals=np.empty(0),
        complete=None,
        error_estimate=None,
    )
    return reduction, whole.model.K, whole.model.M
