"""Meshes by file type: Ansys .cdb, Abaqus and CalculiX .inp, Gmsh .msh and whatever else meshio reads."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import InputError
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.mesh import Mesh
from slipstick.importers.abaqus.mesh import read_input
from slipstick.importers.ansys.archive import read_archive
from slipstick.importers.extras import require
from slipstick.importers.mesh_checks import unit_notes
from slipstick.importers.mesh_model import MeshModel, matching_surface
from slipstick.importers.nastran.mesh import read_bulk_mesh
from slipstick.importers.text_numbers import read_bytes
from slipstick.typing import IntArray

BULK_SUFFIXES = (".bdf", ".nas", ".dat", ".blk")
MESH_SUFFIXES = (".cdb", ".inp", ".msh", ".vtu", ".vtk", ".med", ".unv", ".xdmf", ".exo", ".e")
_SOLIDS = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "hexahedron27": "hex20",
    "wedge": "wedge6",
    "wedge15": "wedge15",
    "wedge18": "wedge15",
    "pyramid": "pyramid5",
    "pyramid13": "pyramid13",
    "pyramid14": "pyramid13",
}
_FAMILIES = ("tetra", "hexahedron", "wedge", "pyramid", "polyhedron")
_NODES_LEFT_OUT = {"hexahedron27", "wedge18", "pyramid14"}
_CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}


def read_mesh(path: Path, constraints: int | None = None) -> MeshModel:
    """A mesh with its named groups; materials and supports where the format has them.

    ``constraints`` is the Nastran SPC set in force; not needed where the file has one, or its case control says which.

    Raises
    ------
    InputError
        If the type is not known, the file is damaged or has no solid element.
    """
    suffix = path.suffix.lower()
    if suffix == ".cdb":
        return read_archive(path)
    if suffix == ".inp":
        return read_input(path)
    if suffix in BULK_SUFFIXES:
        return read_bulk_mesh(path, constraints)
    if suffix not in MESH_SUFFIXES:
        known = ", ".join((*MESH_SUFFIXES, *BULK_SUFFIXES))
        raise InputError(f"{path.name}: mesh files of type '{suffix}' are not known; known are {known}")
    return _from_meshio(path)


def _from_meshio(path: Path) -> MeshModel:
    meshio = require("meshio", "meshio")
    _check_counts(path)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            data = meshio.read(path)
    except (Exception, SystemExit):
        raise InputError(f"{path.name}: is damaged or not a mesh that meshio reads") from None
    mesh = _mesh(data, path)
    variants: dict[str, dict[str, int]] = {}
    for block in data.cells:
        if block.type in _NODES_LEFT_OUT:
            counts = variants.setdefault(_SOLIDS[block.type], {})
            counts[block.type] = counts.get(block.type, 0) + len(block.data)
    return MeshModel(mesh=mesh, notes=(*_left_out(data, path), *unit_notes(mesh, {})), variants=variants)


def _left_out(data: Any, path: Path) -> Iterator[str]:
    """Cells that are no solids, and groups kept in another way than Gmsh's."""
    counts: dict[str, int] = {}
    for block in data.cells:
        if block.type not in _SOLIDS:
            counts[block.type] = counts.get(block.type, 0) + len(block.data)
    if counts:
        parts = ", ".join(f"{count} {name}" for name, count in counts.items())
        yield f"{path.name}: cells that are no solids were left out: {parts}"
    groups = [name for name in (*data.point_sets, *data.cell_sets) if not str(name).startswith("gmsh:")]
    if groups:
        yield f"{path.name}: groups that are not read: {', '.join(map(str, groups))}; physical groups of Gmsh are"


def _check_counts(path: Path) -> None:
    """Counts in a Gmsh file must fit its length: the reader allocates by them."""
    content = read_bytes(path)
    if path.suffix.lower() != ".msh":
        return
    for section in (b"$Nodes", b"$Elements"):
        at = content.find(section)
        line = content[at : at + 400].splitlines()[1:2] if at >= 0 else []
        counts = [int(word) for word in (line[0].split() if line else []) if word.isdigit()]
        if not line or max(counts, default=0) > max(len(content), 2**31):
            raise InputError(f"{path.name}: is damaged, truncated or no Gmsh file ({section.decode()} does not fit)")


def _mesh(data: Any, path: Path) -> Mesh:
    blocks: dict[str, list[IntArray]] = {}
    groups: dict[str, dict[str, list[IntArray]]] = {}
    skins: dict[str, list[IntArray]] = {}
    offset: dict[str, int] = {}
    names = {(int(v[0]), int(v[1])): name for name, v in data.field_data.items() if len(v) == 2}
    tags = data.cell_data.get("gmsh:physical", [np.zeros(len(block.data), dtype=int) for block in data.cells])
    for block, tag in zip(data.cells, tags, strict=True):
        if block.type.startswith(_FAMILIES) and block.type not in _SOLIDS:
            raise InputError(f"{path.name}: {len(block.data)} solids are of type {block.type}; mesh with order 1 or 2")
        cells = np.asarray(block.data, dtype=np.int64)
        if block.type in _SOLIDS:
            kind = _SOLIDS[block.type]
            start = offset.get(kind, 0)
            blocks.setdefault(kind, []).append(cells[:, : ELEMENTS[kind].n_nodes])
            offset[kind] = start + len(cells)
            for number in np.unique(tag).tolist():
                if (number, 3) in names:
                    chosen = start + np.flatnonzero(tag == number)
                    groups.setdefault(names[number, 3], {}).setdefault(kind, []).append(chosen)
        elif block.type in _CORNERS:
            for number in np.unique(tag).tolist():
                if (number, 2) in names:
                    skins.setdefault(names[number, 2], []).append(cells[tag == number, : _CORNERS[block.type]])
    if not blocks:
        raise InputError(f"{path.name}: has no solid element; mesh the volume, and export all physical groups")
    points = np.asarray(data.points, dtype=float)
    mesh = Mesh(
        nodes=points,
        blocks={kind: np.concatenate(parts) for kind, parts in blocks.items()},
        element_sets={n: {k: np.concatenate(p) for k, p in parts.items()} for n, parts in groups.items()},
    )
    surfaces = {name: matching_surface(mesh, corners) for name, corners in skins.items()}
    return Mesh(
        nodes=points,
        blocks=mesh.blocks,
        element_sets=mesh.element_sets,
        surfaces={name: surface for name, surface in surfaces.items() if surface.n_faces},
    )
