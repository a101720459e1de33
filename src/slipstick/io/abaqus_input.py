"""Meshes from Abaqus and CalculiX input files (.inp): nodes, solid elements, sets, surfaces, materials, supports."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface
from slipstick.io.mesh_model import MeshModel, likely_units, node_indices, unit_notes, with_surfaces
from slipstick.io.text_numbers import fortran_real, read_bytes

IntArray = NDArray[np.int64]

_TYPES = {8: "hex8", 20: "hex20", 4: "tet4", 10: "tet10", 6: "wedge6", 15: "wedge15"}
_ELASTIC = {"young", "poisson"}
_REFUSED = {"INCLUDE": "merge the included files into one", "TRANSFORM": "use global directions"}


@dataclass(frozen=True, kw_only=True)
class _Block:
    """A keyword, its parameters in capitals and its data lines as words."""

    keyword: str
    parameters: dict[str, str]
    rows: list[list[str]]
    line: int


@dataclass(kw_only=True)
class _Content:
    """What has been read so far; labels as in the file, names in capitals (they are not case sensitive)."""

    path: Path
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    sections: dict[str, str] = field(default_factory=dict)
    held: set[tuple[int, int]] = field(default_factory=set)
    skipped: dict[str, int] = field(default_factory=dict)
    material: str = ""


def read_input(path: Path) -> MeshModel:
    """Mesh of an input file.

    Raises
    ------
    InputError
        For damaged lines (with their number), includes, transformations, instances that are moved, no solid element.
    """
    content = _Content(path=path)
    handlers = {
        "NODE": _node,
        "ELEMENT": _element,
        "NSET": _nset,
        "ELSET": _elset,
        "SURFACE": _surface,
        "MATERIAL": _material,
        "ELASTIC": _property,
        "DENSITY": _property,
        "CONDUCTIVITY": _property,
        "SOLIDSECTION": _section,
        "BOUNDARY": _boundary,
        "INSTANCE": _instance,
    }
    for block in _blocks(read_bytes(path).decode("latin-1")):
        if block.keyword in _REFUSED:
            raise InputError(f"{path.name}, line {block.line}: *{block.keyword} is not read; {_REFUSED[block.keyword]}")
        try:
            handlers.get(block.keyword, _ignored)(content, block)
        except InputError:
            raise
        except (ValueError, IndexError, KeyError) as error:
            raise InputError(f"{path.name}, line {block.line}: *{block.keyword} cannot be read ({error})") from None
    return _model(content)


def _blocks(text: str) -> Iterator[_Block]:
    block: _Block | None = None
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            if block:
                yield block
            head, *parameters = (part.strip().upper() for part in line[1:].split(","))
            pairs = (part.split("=", 1) for part in parameters if part)
            named = {pair[0].replace(" ", ""): pair[-1].strip() for pair in pairs}
            block = _Block(keyword=head.replace(" ", ""), parameters=named, rows=[], line=number)
        elif block:
            block.rows.append([word.strip() for word in line.rstrip().rstrip(",").split(",")])
    if block:
        yield block


def _ignored(content: _Content, block: _Block) -> None:
    """Everything else has no part in the mesh."""


def _instance(content: _Content, block: _Block) -> None:
    if any(fortran_real(word) for row in block.rows for word in row if word):
        raise InputError(f"{content.path.name}, line {block.line}: an instance is moved; export a flat input file")


def _node(content: _Content, block: _Block) -> None:
    labels = []
    for row in block.rows:
        x, y, z = ([fortran_real(word) if word else 0.0 for word in row[1:4]] + [0.0] * 3)[:3]
        labels.append(int(row[0]))
        content.nodes[labels[-1]] = (x, y, z)
    if "NSET" in block.parameters:
        content.node_sets.setdefault(block.parameters["NSET"], []).extend(labels)


def _element(content: _Content, block: _Block) -> None:
    name = block.parameters["TYPE"]
    found = re.match(r"^D?C3D(\d+)", name)
    kind = _TYPES.get(int(found.group(1))) if found else None
    words = [int(word) for row in block.rows for word in row if word]
    if kind is None:
        content.skipped[name] = content.skipped.get(name, 0) + len(block.rows)
        return
    width = 1 + ELEMENTS[kind].n_nodes
    if len(words) % width:
        raise ValueError(f"{len(words)} numbers for elements of {width - 1} nodes")
    table = content.elements.setdefault(kind, {})
    labels = words[::width]
    for at, label in enumerate(labels):
        table[label] = words[at * width + 1 : (at + 1) * width]
    if "ELSET" in block.parameters:
        content.element_sets.setdefault(block.parameters["ELSET"], []).extend(labels)


def _nset(content: _Content, block: _Block) -> None:
    content.node_sets.setdefault(block.parameters["NSET"], []).extend(_members(block, content.node_sets))


def _elset(content: _Content, block: _Block) -> None:
    content.element_sets.setdefault(block.parameters["ELSET"], []).extend(_members(block, content.element_sets))


def _members(block: _Block, sets: dict[str, list[int]]) -> list[int]:
    if "GENERATE" in block.parameters:
        members: list[int] = []
        for row in block.rows:
            first, last, step = int(row[0]), int(row[1]), int(row[2]) if len(row) > 2 else 1
            if step <= 0 or (last - first) // step > 50_000_000:
                raise ValueError(f"range {first}, {last}, {step}")
            members += range(first, last + 1, step)
        return members
    words = [word for row in block.rows for word in row if word]
    return [label for word in words for label in ([int(word)] if word.isdigit() else sets[word.upper()])]


def _surface(content: _Content, block: _Block) -> None:
    name = block.parameters["NAME"]
    if block.parameters.get("TYPE", "ELEMENT") == "NODE":
        words = [row[0] for row in block.rows]
        content.node_sets[name] = [
            n for w in words for n in ([int(w)] if w.isdigit() else content.node_sets[w.upper()])
        ]
    else:
        content.surfaces[name] = [(row[0].upper(), row[1].upper()) for row in block.rows if len(row) > 1]


def _material(content: _Content, block: _Block) -> None:
    content.material = block.parameters["NAME"]
    content.materials[content.material] = {}


def _property(content: _Content, block: _Block) -> None:
    values = [fortran_real(word) for word in block.rows[0] if word]
    table = content.materials[content.material]
    if block.keyword == "ELASTIC":
        if block.parameters.get("TYPE", "ISOTROPIC") not in ("ISO", "ISOTROPIC"):
            raise InputError(f"{content.path.name}, line {block.line}: only isotropic elasticity is known")
        table["young"], table["poisson"] = values[:2]
    else:
        table[block.keyword.lower()] = values[0]


def _section(content: _Content, block: _Block) -> None:
    content.sections[block.parameters["ELSET"]] = block.parameters["MATERIAL"]


def _boundary(content: _Content, block: _Block) -> None:
    for row in block.rows:
        nodes = [int(row[0])] if row[0].isdigit() else content.node_sets[row[0].upper().split(".")[-1]]
        first, last = _directions(row)
        content.held |= {(node, axis) for node in nodes for axis in range(first - 1, min(last, 3))}


def _directions(row: list[str]) -> tuple[int, int]:
    named = {"ENCASTRE": (1, 6), "PINNED": (1, 3), "XSYMM": (1, 1), "YSYMM": (2, 2), "ZSYMM": (3, 3)}
    if row[1].upper() in named:
        return named[row[1].upper()]
    first = int(row[1])
    return first, int(row[2]) if len(row) > 2 and row[2] else first


def _model(content: _Content) -> MeshModel:
    name = content.path.name
    if not content.nodes or not content.elements:
        raise InputError(
            f"{name}: has no solid element (C3D4, C3D6, C3D8, C3D10, C3D15, C3D20); give the file with the mesh"
        )
    labels = np.array(list(content.nodes), dtype=np.int64)
    numbers = {kind: np.array(list(table), dtype=np.int64) for kind, table in content.elements.items()}
    blocks = {
        kind: node_indices(labels, np.array(list(table.values()), dtype=np.int64), f"{name}: an element")
        for kind, table in content.elements.items()
    }
    mesh = Mesh(
        nodes=np.array(list(content.nodes.values()), dtype=float),
        blocks=blocks,
        node_sets={
            s: node_indices(labels, np.unique(n), f"{name}: node set {s}") for s, n in content.node_sets.items()
        },
        element_sets={s: _positions(numbers, members) for s, members in content.element_sets.items()},
        node_labels=labels,
        element_labels=numbers,
    )
    mesh = replace(mesh, surfaces={s: _faces(mesh, content, parts) for s, parts in content.surfaces.items()})
    mesh = with_surfaces(mesh, [s for s in mesh.node_sets if s not in mesh.surfaces])
    materials = {
        s: Material(**known)
        for s, m in content.sections.items()
        if set(known := content.materials.get(m, {})) >= _ELASTIC
    }
    skipped = [
        f"{count} elements of type {kind} are no solids and were left out" for kind, count in content.skipped.items()
    ]
    held = np.array(sorted(content.held), dtype=np.int64).reshape(-1, 2)
    return MeshModel(
        mesh=mesh,
        materials=materials,
        held=held,
        units=likely_units(materials),
        notes=(*skipped, *unit_notes(mesh, materials)),
    )


def _positions(numbers: dict[str, IntArray], members: list[int]) -> dict[str, IntArray]:
    return {kind: np.flatnonzero(np.isin(part, members)) for kind, part in numbers.items()}


def _faces(mesh: Mesh, content: _Content, parts: list[tuple[str, str]]) -> Surface:
    """Faces "element or set, S<number>"."""
    faces: dict[str, list[IntArray]] = {}
    for who, face in parts:
        members = [int(who)] if who.isdigit() else content.element_sets[who]
        for kind, chosen in _positions(dict(mesh.element_labels or {}), members).items():
            number = int(face.lstrip("S")) - 1
            if len(chosen) and 0 <= number < len(ELEMENTS[kind].faces):
                shape, local = ELEMENTS[kind].faces[number]
                faces.setdefault(shape, []).append(mesh.blocks[kind][chosen][:, list(local)])
    return Surface(faces={shape: np.concatenate(part) for shape, part in faces.items()})
