"""Stresses along a branch for other programs: XDMF for ParaView, CSV, MATLAB."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.faults import path as path_of
from slipstick.faults import wrong
from slipstick.io.xdmf import write_stress_shape
from slipstick.results.saved_table import write_table
from slipstick.results.stress import PLACE, chosen_places, strains_of, stress_of
from slipstick.typing import Points

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions

_ENDINGS = (".xdmf", ".csv", ".mat")


def write_stress(branch: Solutions, path: str | Path, points: Points = None, at: Any = None) -> Path:
    """See ``Branch.save_stress``."""
    target = path_of("stress", path, "the path of a file such as stress.xdmf, stress.csv or stress.mat")
    if target.suffix.lower() not in _ENDINGS:
        raise wrong("stress", str(target), "a name that ends with .xdmf, .csv or .mat")
    found = stress_of(branch, points, at)
    if target.suffix.lower() == ".mat":
        return write_table(found, target)
    if target.suffix.lower() == ".csv":
        return write_table(_in_each_line(found), target, f"point,{PLACE}")
    places = strains_of(branch).places
    kept, order = np.unique(chosen_places(places, at), return_index=True)
    if at is not None:
        places, found = places.part(kept), found.isel({PLACE: order})
    return write_stress_shape(places, found, found[branch.followed].to_numpy(), target)


def _in_each_line(found: Any) -> Any:
    """With what is known of each point or of each place, frequency and position, given for both together."""
    sizes = {dim: found.sizes[dim] for dim in ("point", PLACE)}
    known = found.set_coords([name for name in found.data_vars if PLACE not in found[name].dims])
    each = {
        name: value.variable.set_dims({**sizes, **dict(value.sizes)}).transpose("point", PLACE, ...)
        for name, value in sorted(known.coords.items(), key=lambda item: item[1].dims != (PLACE,))
        if name not in known.dims and {*value.dims} & {*sizes}
    }
    columns = {**each, **{name: value.variable for name, value in known.data_vars.items()}}
    labels = {dim: known[dim].variable for dim in known.dims if dim in known.coords}
    return type(found)(columns, coords={**labels, "axis": ["x", "y", "z"]}, attrs=found.attrs)
