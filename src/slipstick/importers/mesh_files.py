"""Meshes by file type: Ansys .cdb, Abaqus and CalculiX .inp, Gmsh .msh and whatever else meshio reads."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np

from slipstick.importers.deck import Deck
from slipstick.importers.extras import require
from slipstick.importers.findings import made_of, refused
from slipstick.importers.formats import FORMATS, format_of
from slipstick.importers.grouped import KINDS, MARK, Cells, grouped_model
from slipstick.importers.text_numbers import read_bytes

_MESHIO = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "wedge": "wedge6",
    "pyramid": "pyramid5",
}
"""Our names of the solids of meshio, where they differ."""

_FAMILIES = ("tetra", "hexahedron", "wedge", "pyramid", "polyhedron")
_DIMENSIONS = ("points", "curves", "surfaces", "volumes")
_GMSH, _INPUT, _FLUENT = "Gmsh", "Abaqus or CalculiX", "Ansys Fluent"


def read_mesh(path: Path, constraints: int | None = None) -> Deck:
    """A mesh with its named groups; materials and supports where the format has them.

    ``constraints`` is the Nastran SPC set in force; not needed where the file has one, or its case control says which.

    Raises
    ------
    InputError
        If the type is not known, the file is damaged or has no solid element.
    """
    known = format_of(path)
    if known is None or known.holds != "mesh":
        suffixes = ", ".join(suffix for known in FORMATS if known.holds == "mesh" for suffix in known.suffixes)
        what = f"mesh files of type '{path.suffix.lower()}' are not known"
        raise refused(path.name, what, remedy=f"known are {suffixes}")
    with made_of(path.name):
        return known.reader(path, constraints) if known.supports else known.reader(path)


def read_by_content(path: Path) -> Deck:
    """Several programs use these suffixes: CalculiX GraphiX writes input files as .msh."""
    suffix = path.suffix.lower()
    begin = read_bytes(path)[:4096]
    if begin.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise refused(path.name, "is text in UTF-16", remedy="save it as plain text (ASCII or UTF-8)")
    kind = _program(begin)
    if kind is None and b"\0" in begin:
        raise refused(path.name, "is no mesh: found a binary file", expected=f"text of {_INPUT}, or Gmsh's .msh")
    if kind is None:
        kind = _GMSH if suffix == ".msh" else _INPUT
    if kind == _FLUENT:
        raise refused(
            path.name, f"is a mesh of {kind}, which is not read", remedy="export it for Abaqus (.inp) or Gmsh"
        )
    usual = _INPUT if suffix == ".inp" else _GMSH
    model = _from_input(path) if kind == _INPUT else _from_gmsh(path)
    if kind != usual:
        model.extra.insert(0, f"{path.name}: is a file of {kind}, and read as that")
    return model


def _program(begin: bytes) -> str | None:
    """Whose file it is, by its first line that says something."""
    for line in begin.removeprefix(b"\xef\xbb\xbf").splitlines():
        if line.startswith(b"$MeshFormat"):
            return _GMSH
        if line.startswith(b"*"):
            return _INPUT
        if line.lstrip().startswith(b"("):
            return _FLUENT
        if line.strip():
            return None
    return None


def _from_input(path: Path) -> Deck:
    from slipstick.importers.abaqus.mesh import read_input

    return read_input(path)


def _from_gmsh(path: Path) -> Deck:
    from slipstick.importers.gmsh.mesh_file import read_gmsh

    file = read_gmsh(path)
    model = grouped_model(path.name, file.points, file.cells, file.labels)
    groups = ", ".join(f"{number} of {_DIMENSIONS[dimension]}" for dimension, number in file.unnamed)
    what = f"{path.name}: physical groups without a name are not read: {groups}; name them in Gmsh to use them"
    model.extra += [what] if file.unnamed else []
    return model


def read_by_meshio(path: Path) -> Deck:
    """A mesh of another format that meshio reads."""
    meshio = require("meshio", "meshio")
    read_bytes(path)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            data = meshio.read(path)
    except (Exception, SystemExit) as error:
        said = " ".join(str(error).split())[:100]
        raise refused(path.name, f"is damaged or not a mesh that meshio reads ({said})") from None
    cells = []
    for index, block in enumerate(data.cells):
        if block.type.startswith(_FAMILIES) and block.type not in _MESHIO and block.type not in KINDS:
            raise refused(
                path.name, f"{len(block.data)} solids are of type {block.type}", remedy="mesh with order 1 or 2"
            )
        groups = {
            str(name): np.asarray(sets[index], dtype=np.int64)
            for name, sets in data.cell_sets.items()
            if sets[index] is not None and len(sets[index])
        }
        nodes = np.asarray(block.data, dtype=np.int64)
        cells.append(Cells(kind=_MESHIO.get(block.type, block.type), nodes=nodes, groups=groups))
    for name, chosen in data.point_sets.items():
        nodes = np.asarray(chosen, dtype=np.int64).reshape(-1, 1)
        cells.append(Cells(kind=MARK, nodes=nodes, groups={str(name): np.arange(len(nodes))}))
    return grouped_model(path.name, np.asarray(data.points, dtype=float), cells)
