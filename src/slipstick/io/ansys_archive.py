"""Meshes from Ansys archives (.cdb, CDWRITE): nodes, solid elements, components, linear materials, supports.

Nodes, elements and components come from ``mapdl-archive``. Bricks may be degenerate: Ansys writes a wedge as a brick
with K = L and O = P, a pyramid with M = N = O = P, a tetrahedron with both.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.io.extras import require
from slipstick.io.mesh_model import MeshModel, likely_units, node_indices, unit_notes, with_surfaces
from slipstick.io.text_numbers import fortran_real, read_bytes

IntArray = NDArray[np.int64]

_HEAD = 10
"""Numbers of an EBLOCK row before its nodes: material, type, ..., element number, one more."""
_SHAPES = {
    8: {
        "hex8": range(8),
        "wedge6": (0, 1, 2, 4, 5, 6),
        "pyramid5": range(5),
        "tet4": (0, 1, 2, 4),
    },
    20: {
        "hex20": range(20),
        "wedge15": (0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18),
        "pyramid13": (0, 1, 2, 3, 4, 8, 9, 10, 11, 16, 17, 18, 19),
        "tet10": (0, 1, 2, 4, 8, 9, 11, 16, 17, 18),
    },
}
_TETRAHEDRA = {4: "tet4", 10: "tet10"}
_SOLID = {45, 64, 65, 73, 95, 185, 186, 190, 92, 187, 285}
_MESH200_SOLID = {8, 9, 10, 11}
_UNITS = {"SI": "SI (m, kg, s)", "MKS": "m, kg, s", "CGS": "cm, g, s", "BIN": "inch, lbf, s", "BFT": "foot, slug, s"}
_UNITS |= {"MPA": "mm, tonne, s", "UMKS": "micrometre, kg, s"}
_PROPERTIES = {"EX": "young", "NUXY": "poisson", "PRXY": "poisson", "DENS": "density", "KXX": "conductivity"}


def read_archive(path: Path) -> MeshModel:
    """Mesh of a .cdb file with its node and element components; materials by element set "material <number>".

    Raises
    ------
    InputError
        If the extra is not installed, the file is damaged or has no solid element.
    """
    reader = require("mapdl_archive", "mapdl-archive")
    text = read_bytes(path).decode("latin-1")
    _check_counts(text, path)
    archive = _parse(reader, path)
    nodes = np.asarray(archive.nodes, dtype=float).reshape(-1, 3)
    labels = np.asarray(archive.nnum, dtype=np.int64)
    blocks, numbers, sets, skipped = _elements(archive, labels, path)
    groups = {name: np.asarray(part, dtype=np.int64) for name, part in archive.node_components.items()}
    mesh = Mesh(
        nodes=nodes,
        blocks=blocks,
        node_sets={n: node_indices(labels, part, f"{path.name}: component {n}") for n, part in groups.items()},
        element_sets={**sets, **_element_components(archive, numbers)},
        node_labels=labels,
        element_labels=numbers,
    )
    found = _materials(text)
    materials = {name: found[int(name.split()[1])] for name in sets if int(name.split()[1]) in found}
    materials = materials if len(materials) == len(sets) else {}
    notes = [f"{count} elements of type {kind} are no solids: left out" for kind, count in skipped.items()]
    return MeshModel(
        mesh=with_surfaces(mesh, groups),
        materials=materials,
        held=_held(text),
        units=_units(text) or likely_units(materials),
        notes=(*notes, *unit_notes(mesh, materials)),
    )


def _parse(reader: Any, path: Path) -> Any:
    try:
        archive = reader.Archive(str(path), parse_vtk=False)
        whole = len(archive.nodes) and len(archive.nnum) == len(archive.nodes) and archive.n_elem
    except Exception:
        whole = False
    if not whole:
        raise InputError(f"{path.name}: has no readable node and element block; write it with CDWRITE,DB")
    return archive


def _check_counts(text: str, path: Path) -> None:
    """The compiled reader believes the counts of the blocks: they must fit the file, and blocks must end."""
    for block in re.finditer(r"^([NE]BLOCK),([^\r\n]*)\r?\n\(([^)\r\n]*)\)\r?\n", text, re.MULTILINE | re.IGNORECASE):
        words = [word.strip() for word in block.group(2).split("!")[0].split(",")]
        numbers = [int(word) for word in words[2:] if word.isdigit()]
        body = text[block.end() :]
        if block.group(1).upper() == "EBLOCK":
            end = re.search(r"^\s*-1\s*$", body, re.MULTILINE)
        else:
            end = re.search(r"^(?:N,R5\.\d,LOC,\s*-1|\s*-1\s*,?)", body, re.MULTILINE)
        lines = body[: end.start()].count("\n") if end else 0
        if end is None or (numbers and numbers[-1] > lines):
            raise InputError(
                f"{path.name}: its {block.group(1).upper()} claims {numbers[-1] if numbers else 0} entries, "
                f"the file has {lines} lines there; it is damaged or truncated"
            )


def _elements(archive: Any, labels: IntArray, path: Path) -> tuple[dict, dict, dict, dict]:
    """Blocks, element numbers and sets "material <number>" by element type, and how many elements were left out."""
    solid = dict(_solid_types(archive))
    parts: dict[str, list[tuple[IntArray, int, int]]] = {}
    skipped: dict[int, int] = {}
    types = {int(number): int(kind) for number, kind in np.asarray(archive.ekey)}
    for row in archive.elem:
        row = np.asarray(row, dtype=np.int64)
        if not solid.get(int(row[1]), False):
            kind = types.get(int(row[1]), 0)
            skipped[kind] = skipped.get(kind, 0) + 1
            continue
        name, nodes = _shape(row[_HEAD:], int(row[8]), path)
        parts.setdefault(name, []).append((nodes, int(row[8]), int(row[0])))
    if not parts:
        raise InputError(f"{path.name}: has no solid element (types {sorted(_SOLID)} or MESH200 solids)")
    what = f"{path.name}: an element"
    blocks = {k: node_indices(labels, np.array([n for n, _, _ in p]), what) for k, p in parts.items()}
    numbers = {kind: np.array([number for _, number, _ in part]) for kind, part in parts.items()}
    material = {kind: np.array([number for _, _, number in part]) for kind, part in parts.items()}
    sets = {
        f"material {number}": {kind: np.flatnonzero(part == number) for kind, part in material.items()}
        for number in np.unique(np.concatenate(list(material.values()))).tolist()
    }
    return blocks, numbers, sets, skipped


def _solid_types(archive: Any) -> Iterator[tuple[int, bool]]:
    for number, kind in np.asarray(archive.ekey).tolist():
        options = dict(tuple(pair[:2]) for pair in archive.key_option.get(number, []))
        yield number, kind in _SOLID or (kind == 200 and options.get(1) in _MESH200_SOLID)


def _shape(nodes: IntArray, number: int, path: Path) -> tuple[str, IntArray]:
    """Element type and its nodes from a row of an EBLOCK, degenerate bricks recognised."""
    if len(nodes) in _TETRAHEDRA:
        name = _TETRAHEDRA[len(nodes)]
    elif len(nodes) in _SHAPES:
        k, l, m, n, o, p = nodes[2:8].tolist()  # noqa: E741 - the names of Ansys' element pictures
        flat, point = k == l, m == n == o == p
        wedge = flat and o == p and not point
        family = "tet" if flat and point else "pyramid" if point else "wedge" if wedge else "hex"
        name, local = next((s, list(at)) for s, at in _SHAPES[len(nodes)].items() if s.startswith(family))
        nodes = nodes[local]
    else:
        raise InputError(f"{path.name}: element {number} has {len(nodes)} nodes; expected a solid with 4, 8, 10 or 20")
    if (nodes <= 0).any():
        raise InputError(
            f"{path.name}: element {number} lacks middle nodes; make its order whole (EMID) and export again"
        )
    return name, nodes


def _element_components(archive: Any, numbers: dict[str, IntArray]) -> dict[str, dict[str, IntArray]]:
    return {
        name: {kind: np.flatnonzero(np.isin(part, members)) for kind, part in numbers.items()}
        for name, members in archive.element_components.items()
    }


def _units(text: str) -> str:
    found = re.search(r"^/UNITS,\s*(\w+)", text, re.MULTILINE | re.IGNORECASE)
    return _UNITS.get(found.group(1).upper(), found.group(1)) if found else ""


def _materials(text: str) -> dict[int, Material]:
    """Materials with constant EX and NUXY or PRXY (first temperature where there are several), by number."""
    values: dict[int, dict[str, float]] = {}
    pattern = r"^MPDATA,(?:[^,\n]*,)?\s*\d+\s*,\s*(\w+)\s*,\s*(\d+)\s*,\s*1\s*,\s*([^,\s]+)"
    short = r"^MP,\s*(\w+)\s*,\s*(\d+)\s*,\s*([^,\s]+)"
    for expression in (pattern, short):
        for match in re.finditer(expression, text, re.MULTILINE | re.IGNORECASE):
            name = _PROPERTIES.get(match.group(1).upper())
            if name:
                values.setdefault(int(match.group(2)), {})[name] = fortran_real(match.group(3))
    return {number: Material(**known) for number, known in values.items() if {"young", "poisson"} <= set(known)}


def _held(text: str) -> IntArray:
    """Zero displacements given by D commands, as CDWRITE writes them: D, node, UX, value."""
    axes = {"UX": (0,), "UY": (1,), "UZ": (2,), "ALL": (0, 1, 2)}
    pairs = {
        (int(match.group(1)), axis)
        for match in re.finditer(r"^D,\s*(\d+)\s*,\s*(\w+)", text, re.MULTILINE | re.IGNORECASE)
        for axis in axes.get(match.group(2).upper(), ())
    }
    return np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)
