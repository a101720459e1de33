"""Models of other finite element codes in Python: what ``slipstick import`` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import Gathering, listed
from slipstick.faults import path as path_of
from slipstick.fem.materials import Material
from slipstick.fem.mesh import user_names
from slipstick.fem.model import ImportedModel
from slipstick.importers.matrix_model import support_notes
from slipstick.importers.read_model import read_model
from slipstick.importers.roles import ImportOptions
from slipstick.io.model_file import save_model


def import_model(
    files: Sequence[str | Path] | str | Path,
    *,
    output: str | Path | None = None,
    mass: str | Path | None = None,
    damping: str | Path | None = None,
    dof_map: str | Path | None = None,
    nodes: str | Path | None = None,
    names: Mapping[str, str] | None = None,
    constraints: int | None = None,
    material: Material | None = None,
    conductivity: float | None = None,
    fixed: str | Sequence[str] = (),
    quadratic: bool = False,
    units: str | None = None,
    scale: Mapping[str, float] | None = None,
    to: str | None = None,
) -> ImportedModel:
    """A finite element model from the files of another code, or from a model file of slipstick.

    Ansys .full, HBMAT (.matrix, .hb with .mapping), .cdb; Nastran .op4 with bulk data, DMIG in .pch; CalculiX .sti with
    .mas and .dof; Abaqus .mtx; MatrixMarket .mtx and .npz with a map file; meshes .inp, .msh, .bdf;
    model.h5.

    Parameters
    ----------
    files
        One file, or several that belong together.
    output
        Where the model is kept as one HDF5 file, which a case file may name; a file there is replaced once the new one
        is whole.
    mass, damping, dof_map, nodes, names, constraints, material, conductivity, fixed, quadratic, units, scale, to
        What the files do not say: see :class:`ImportOptions`.

    Returns
    -------
    ImportedModel
        Its ``notes`` say what was left out.

    Raises
    ------
    InputError
        One sentence for each fault of the files.

    Warns
    -----
    SlipstickWarning
        What is approximated or suspicious, as in the model's ``warnings``.
    """
    gathering = Gathering()
    wanted: dict[str, Any] = {
        "mass": mass, "damping": damping, "dof_map": dof_map, "nodes": nodes, "names": {} if names is None else names,
        "constraints": constraints, "material": material, "conductivity": conductivity, "fixed": fixed,
        "quadratic": quadratic, "units": units, "scale": scale, "to": to,
    }  # fmt: skip
    options = gathering.take(ImportOptions, **wanted)
    place = None if output is None else gathering.take(path_of, "output", output)
    sources = gathering.take(_files, files)
    gathering.end()
    model = read_model(sources or (), options, quiet=True)
    if place is not None:
        save_model(model, place)
    model.announce()
    return model


def _files(files: object) -> tuple[Path, ...]:
    expected = "a file, or a list of files"
    if isinstance(files, str | PathLike):
        return (path_of("files", files, expected),)
    gathering = Gathering()
    paths = [gathering.take(path_of, "files", item, expected) for item in listed("files", files, expected)]
    gathering.end()
    return tuple(path for path in paths if path is not None)


def summary(model: ImportedModel) -> tuple[str, ...]:
    """What came in, its units, the notes of the import, and parts that are not held."""
    nodes = len(set(model.dof_nodes.tolist()))
    known = "with coordinates" if len(model.node_ids) else "without coordinates"
    sets = f"; sets: {', '.join(user_names(model.node_sets))}" if model.node_sets else ""
    tied = f", {len(model.dependent)} that depend on others" if len(model.dependent) else ""
    held = f"{len(model.constrained)} constrained{tied}"
    head = f"{model.source}: {model.n_dofs} dofs on {nodes} nodes, {known}, {held}{sets}"
    return (head, f"units: {model.units_told}; {_sizes(model)}", *model.notes, *support_notes(model))


def _sizes(model: ImportedModel) -> str:
    """Numbers by which a wrong system of units shows."""
    try:
        along = model.translation("x")
        mass = f"the mass that moves along x is {along @ (model.M @ along):.4g}"
    except InputError:
        mass = "its equations do not let it move along x as a whole"
    if not len(model.node_ids):
        return mass
    return f"{mass}, the largest dimension {np.ptp(model.coordinates, axis=0).max():.4g}"
