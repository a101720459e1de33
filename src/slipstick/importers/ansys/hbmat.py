"""Assembled matrices that Ansys' HBMAT writes: Harwell-Boeing files with their mapping."""

from __future__ import annotations

from pathlib import Path

from slipstick.importers.dof_map import read_dof_map
from slipstick.importers.plain.harwell_boeing import read_harwell_boeing
from slipstick.importers.raw_model import RawModel


def read_hbmat(files: dict[str, Path], mapping: Path | None) -> RawModel:
    """HBMAT matrices by name; the mapping is ``mapping`` or the .mapping file beside the first one.

    Raises
    ------
    InputError
        If a file is damaged. A missing map is refused when the model is built.
    """
    matrices = {name: read_harwell_boeing(path) for name, path in files.items()}
    map_file = mapping or next(filter(None, (_mapping_beside(path) for path in files.values())), None)
    if map_file is None:
        return RawModel(matrices=matrices)
    dof_map, nodes = read_dof_map(map_file)
    return RawModel(matrices=matrices, dof_map=dof_map, nodes=nodes)


def _mapping_beside(path: Path) -> Path | None:
    names = (path.with_suffix(suffix) for suffix in (".mapping", ".MAPPING", ".map"))
    return next((name for name in names if name.is_file()), None)
