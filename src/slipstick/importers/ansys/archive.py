"""Meshes from Ansys archives (.cdb, CDWRITE): nodes, solid elements, components, linear materials, supports.

Nodes, elements and components come from ``mapdl-archive``. Bricks may be degenerate: Ansys writes a wedge as a brick
with K = L and O = P, a pyramid with M = N = O = P, a tetrahedron with both.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.equations import NodalEquation
from slipstick.fem.frames import in_global, supports
from slipstick.fem.mesh import Mesh, node_indices
from slipstick.fem.unit_systems import NOT_STATED
from slipstick.importers.ansys.commands import classify_commands
from slipstick.importers.ansys.cyclic import read_cyclic
from slipstick.importers.ansys.equations import read_equations
from slipstick.importers.ansys.lumps import LUMP_TYPES, Lumps
from slipstick.importers.ansys.materials import read_materials
from slipstick.importers.extras import require
from slipstick.importers.findings import Coupling, Findings
from slipstick.importers.mesh_checks import unit_notes
from slipstick.importers.mesh_model import MeshModel, stated_each, with_surfaces
from slipstick.importers.midsides import Edges, middle_equations, placed, whole_row, with_middles
from slipstick.importers.text_numbers import fortran_real, read_bytes, reading, whole_number
from slipstick.typing import Array, IntArray

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
_QUADRATIC = {95, 186}
_MESH200_SOLID = {8, 9, 10, 11}
_FAMILIES = {
    "SOLID": (45, 64, 65, 73, 92, 95, 185, 186, 187, 285),
    "COMBIN": (14, 37, 39, 40),
    "MASS": (21,),
    "MATRIX": (27, 50),
    "SURF": (151, 152, 153, 154, 156),
    "TARGE": (169, 170),
    "CONTA": (171, 172, 173, 174, 175, 176, 177, 178),
    "PRETS": (179,),
    "LINK": (180,),
    "SHELL": (181, 281),
    "MPC": (184,),
    "BEAM": (188, 189),
    "SOLSH": (190,),
    "MESH": (200,),
    "COMBI": (214,),
}
_KINDS = {number: f"{family}{number}" for family, numbers in _FAMILIES.items() for number in numbers}
_WITHOUT_STIFFNESS = {151, 152, 153, 154, 156, 169, 170, 200}
"""Load elements, the targets of contacts, and elements for meshing only."""
_SAME = {"SOLID92", "SOLID187", "MESH200", "SOLID186", "SOLID186 with KEYOPT(2) = 1"}
"""Integrated as here; the full SOLID186 with 14 points, exact to the same degree as our 27."""
_REDUCED = {("SOLID186", "hex20"): "hex20r", ("SOLID95 with KEYOPT(11) = 1", "hex20"): "hex20r"}
_UNITS = {"SI": "SI (m, kg, s)", "MKS": "m, kg, s", "CGS": "cm, g, s", "BIN": "inch, lbf, s", "BFT": "foot, slug, s"}
_UNITS |= {"MPA": "mm, tonne, s", "UMKS": "micrometre, kg, s"}


def read_archive(path: Path) -> MeshModel:
    """Mesh of a .cdb file with its node and element components; materials by element set "material <number>".

    Raises
    ------
    InputError
        If the extra is not installed, the file is damaged or has no solid element. What couples or holds otherwise is
        in the model's ``couplings``.
    """
    reader = require("mapdl_archive", "mapdl-archive")
    text = read_bytes(path).decode("latin-1")
    _check_counts(text, path)
    archive = _parse(reader, path)
    made: Edges = {}
    grids = np.asarray(archive.nnum, dtype=np.int64)
    parts = _elements(archive, made, grids, path)
    labels, nodes = placed(made, grids, np.asarray(archive.nodes, dtype=float).reshape(-1, 3), path.name)
    blocks = {k: node_indices(labels, part, f"{path.name}: an element") for k, part in parts.blocks.items()}
    groups = {name: np.asarray(part, dtype=np.int64) for name, part in archive.node_components.items()}
    mesh = Mesh(
        nodes=nodes,
        blocks=blocks,
        node_sets={n: node_indices(labels, part, f"{path.name}: component {n}") for n, part in groups.items()},
        element_sets={**parts.sets, **_element_components(archive, parts.numbers)},
        node_labels=labels,
        element_labels=parts.numbers,
    )
    findings = Findings(source=path.name)
    supported = classify_commands(findings, text)
    read = read_materials(findings, text)
    symmetry = read_cyclic(findings, text, groups)
    findings.refuse_incomplete()
    used = {name: int(name.split()[1]) for name in parts.sets}
    materials = {name: read.materials[number] for name, number in used.items() if number in read.materials}
    axes = _turned_nodes(text, path)
    lumps = Lumps(findings, archive, text, dict(zip(labels.tolist(), nodes, strict=True)), axes)
    added = tuple(lumps)
    tied = read_equations(findings, text)
    _refuse_missing(tied, set(labels.tolist()))
    turning = lumps.turning() | {node for equation in tied for node, axis in equation.pairs if axis > 2}
    held, along = supports({(n, c) for n, c in supported if c < 3 or n in turning}, axes, Place(path.name, "D"))
    return MeshModel(
        mesh=with_surfaces(mesh, groups),
        materials=materials if len(materials) == len(parts.sets) else {},
        held=np.array(sorted(held), dtype=np.int64).reshape(-1, 2),
        units=_units(text),
        notes=(*_left_out(parts.skipped, path), *findings.notes, *_straight(made, path), *unit_notes(mesh, materials)),
        warnings=findings.warnings,
        couplings=(*findings.couplings, *_elements_that_matter(parts.skipped, path)),
        constraints=tuple(stated_each([*in_global(tied, axes), *along, *middle_equations(made, path.name)])),
        lumped=added,
        material_faults=tuple(fault for number in used.values() for fault in read.faults.get(number, ())),
        variants=parts.variants,
        axes=axes,
        symmetry=lambda _mesh: symmetry,
    )


def _straight(made: Edges, path: Path) -> Iterator[str]:
    if made:
        yield f"{path.name}: {len(made)} edges have no middle node: they stay straight, as in Ansys"


def _left_out(skipped: dict[int, int], path: Path) -> Iterator[str]:
    for kind, count in skipped.items():
        if kind in _WITHOUT_STIFFNESS:
            yield f"{path.name}: {count} elements of type {_KINDS[kind]} are no solids and were left out"


def _elements_that_matter(skipped: dict[int, int], path: Path) -> Iterator[Coupling]:
    for kind, count in skipped.items():
        if kind not in _WITHOUT_STIFFNESS:
            name = _KINDS.get(kind, str(kind))
            what = "add stiffness, mass or constraints and are not read"
            yield Coupling(where=Place(path.name, f"{count} elements of type {name}"), what=what)


def _refuse_missing(tied: Sequence[NodalEquation], labels: set[int]) -> None:
    """Nodes of CE and CP that the file does not have."""
    lost = {e.where: node for e in reversed(tied) for node, _ in e.pairs if node not in labels}
    if lost:
        raise InputError(
            [Fault(where, f"names node {node}, which the file does not have") for where, node in lost.items()]
        )


def _turned_nodes(text: str, path: Path) -> dict[int, Array]:
    """Axes (rows) of the nodes with rotation angles in an NBLOCK: the fourth to sixth real of their lines."""
    turned: dict[int, Array] = {}
    for block in re.finditer(
        r"^NBLOCK[^\r\n]*\r?\n\((\d+)i(\d+),\s*\d+[eEgG](\d+)[^\r\n]*\r?\n((?:[ \t]*\d[^\r\n]*\r?\n)*)",
        text,
        re.MULTILINE | re.IGNORECASE,
    ):
        integers, width, real = (int(block.group(i)) for i in (1, 2, 3))
        start = integers * width + 3 * real
        for line in block.group(4).splitlines():
            words = [line[at : at + real] for at in range(start, len(line.rstrip()), real)]
            with reading(Place(path.name, "NBLOCK, a line")):
                angles = [fortran_real(word) if word.strip() else 0.0 for word in words]
                if any(angles):
                    turned[whole_number(line[:width])] = _axes_of([*angles, 0.0, 0.0][:3])
    return turned


def _axes_of(angles: Sequence[float]) -> Array:
    """Axes (rows) of a node: turned by its angles (degrees) about z, then about the new x, then about the new y."""
    (a, b, c), (u, v, w) = np.cos(np.radians(angles)), np.sin(np.radians(angles))
    return np.array(
        [
            [a * c - u * v * w, u * c + a * v * w, -w * b],
            [-u * b, a * b, v],
            [a * w + u * v * c, u * w - a * v * c, b * c],
        ]
    )


def _parse(reader: Any, path: Path) -> Any:
    try:
        archive = reader.Archive(str(path), parse_vtk=False)
        sound = len(archive.nodes) and len(archive.nnum) == len(archive.nodes) and archive.n_elem
    except Exception:
        sound = False
    if not sound:
        raise InputError(
            Fault(Place(path.name), "has no readable node and element block", remedy="write it with CDWRITE,DB")
        )
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
                Fault(
                    Place(path.name),
                    f"its {block.group(1).upper()} claims {numbers[-1] if numbers else 0} entries, "
                    f"the file has {lines} lines there",
                    remedy="it is damaged or truncated: write it again",
                )
            )
    for block in re.finditer(
        r"^CMBLOCK,([^,\r\n]*),[^,\r\n]*,\s*(\d+)[^\r\n]*\r?\n\([^\r\n]*\r?\n([-\s\d]*)", text, re.MULTILINE
    ):
        count = len(block.group(3).split())
        if count != int(block.group(2)):
            raise InputError(
                Fault(
                    Place(path.name),
                    f"component {block.group(1).strip()} claims {block.group(2)} numbers, the file has {count}",
                )
            )


@dataclass(kw_only=True)
class _Parts:
    """Node labels, numbers and sets "material <number>" by element type; how many of others; types unlike ours."""

    blocks: dict[str, IntArray]
    numbers: dict[str, IntArray]
    sets: dict[str, dict[str, IntArray]]
    skipped: dict[int, int]
    variants: dict[str, dict[str, int]]


def _elements(archive: Any, made: Edges, labels: IntArray, path: Path) -> _Parts:
    solid = dict(_solid_types(archive))
    parts: dict[str, list[tuple[IntArray, int, int]]] = {}
    skipped: dict[int, int] = {}
    variants: dict[str, dict[str, int]] = {}
    types = {int(number): int(kind) for number, kind in np.asarray(archive.ekey)}
    first = int(labels.max(initial=0)) + 1
    for row in archive.elem:
        row = np.asarray(row, dtype=np.int64)
        kind = types.get(int(row[1]), 0)
        if int(row[1]) not in solid:
            if kind not in LUMP_TYPES:
                skipped[kind] = skipped.get(kind, 0) + 1
            continue
        row_nodes = np.asarray(whole_row(row[_HEAD:].tolist(), kind in _QUADRATIC), dtype=np.int64)
        name, nodes = _shape(row_nodes, int(row[8]), path)
        nodes = with_middles(name, nodes, int(row[8]), made, first, path.name)
        full = solid[int(row[1])]
        name = _REDUCED.get((full, name), name)
        parts.setdefault(name, []).append((nodes, int(row[8]), int(row[0])))
        if full not in _SAME or name == "pyramid13":
            variants.setdefault(name, {})[full] = variants.get(name, {}).get(full, 0) + 1
    if not parts:
        raise InputError(Fault(Place(path.name), f"has no solid element (types {sorted(_SOLID)} or MESH200 solids)"))
    material = {kind: np.array([number for _, _, number in part]) for kind, part in parts.items()}
    every = np.unique(np.concatenate(list(material.values()))).tolist()
    return _Parts(
        blocks={k: np.array([n for n, _, _ in p]) for k, p in parts.items()},
        numbers={kind: np.array([number for _, number, _ in part]) for kind, part in parts.items()},
        sets={f"material {m}": {kind: np.flatnonzero(part == m) for kind, part in material.items()} for m in every},
        skipped=skipped,
        variants=variants,
    )


def _solid_types(archive: Any) -> Iterator[tuple[int, str]]:
    """Number of each solid element type, and its name with the options that change its integration.

    Layered solids (KEYOPT(3) = 1 of 185 and 186) are not read.
    """
    for number, kind in np.asarray(archive.ekey).tolist():
        options = dict(tuple(pair[:2]) for pair in archive.key_option.get(number, []))
        layered = kind in (185, 186) and options.get(3) == 1
        if (kind in _SOLID and not layered) or (kind == 200 and options.get(1) in _MESH200_SOLID):
            key = {45: 1, 95: 11, 185: 2, 186: 2}.get(kind, 0)
            yield number, f"{_KINDS[kind]}" + (f" with KEYOPT({key}) = {options[key]}" if options.get(key) else "")


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
        raise InputError(
            Fault(Place(path.name), f"element {number} has {len(nodes)} nodes", expected="a solid with 4, 8, 10 or 20")
        )
    return name, nodes


def _element_components(archive: Any, numbers: dict[str, IntArray]) -> dict[str, dict[str, IntArray]]:
    return {
        name: {kind: np.flatnonzero(np.isin(part, members)) for kind, part in numbers.items()}
        for name, members in archive.element_components.items()
    }


def _units(text: str) -> str:
    match = re.search(r"^/UNITS,\s*(\w+)", text, re.MULTILINE | re.IGNORECASE)
    return _UNITS.get(match.group(1).upper(), match.group(1)) if match else NOT_STATED
