"""Gmsh mesh files (.msh) of the formats 2.2 and 4.1, as text or binary: nodes, elements, physical groups.

Formats and element types: Gmsh reference manual, chapter "File formats".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from slipstick.fem.elements import ELEMENTS
from slipstick.fem.mesh import node_indices
from slipstick.importers.findings import refused
from slipstick.importers.grouped import Cells
from slipstick.importers.text_numbers import read_bytes
from slipstick.typing import AnyArray, Array, IntArray

_POINT, _LINE, _TRIANGLE, _QUADRILATERAL = "vertex", "line", "triangle", "quad"
_TYPES = {
    15: (_POINT, 1),
    1: (_LINE, 2),
    8: ("line3", 3),
    26: ("line4", 4),
    27: ("line5", 5),
    28: ("line6", 6),
    2: (_TRIANGLE, 3),
    9: ("triangle6", 6),
    3: (_QUADRILATERAL, 4),
    16: ("quad8", 8),
    10: ("quad9", 9),
    4: ("tet4", 4),
    11: ("tet10", 10),
    5: ("hex8", 8),
    17: ("hex20", 20),
    12: ("hexahedron27", 27),
    6: ("wedge6", 6),
    18: ("wedge15", 15),
    13: ("wedge18", 18),
    7: ("pyramid5", 5),
    19: ("pyramid13", 13),
    14: ("pyramid14", 14),
}
"""Name and number of nodes of each element type; those of higher order are refused."""

_EDGES = {
    "tet10": "01 12 02 03 23 13",
    "hex20": "01 03 04 12 15 23 26 37 45 47 56 67",
    "wedge15": "01 02 03 12 14 25 34 35 45",
    "pyramid13": "01 03 04 12 14 23 24 34",
}
"""The edges in the order of their middles, by corners."""

_LIKE = {"hexahedron27": "hex20", "wedge18": "wedge15", "pyramid14": "pyramid13"}
_DIMENSIONS = 4
_Order = Literal["<", ">"]


@dataclass(kw_only=True)
class GmshFile:
    """The content of the file: labels and positions of nodes, cells with their physical groups by name.

    ``unnamed``: groups without a name, as (dimension, number).
    """

    labels: IntArray
    points: Array
    cells: list[Cells]
    unnamed: list[tuple[int, int]]


def read_gmsh(path: Path) -> GmshFile:
    """Nodes, elements and physical groups of a file.

    Raises
    ------
    InputError
        If the file is damaged, of another version, or has elements of higher than second order.
    """
    data = read_bytes(path).removeprefix(b"\xef\xbb\xbf")
    try:
        return _read(data, path)
    except _Ends as error:
        raise refused(
            path.name, f"is damaged or truncated: {error}", expected="a mesh file of Gmsh, format 4.1 or 2.2"
        ) from None


class _Ends(Exception):
    """The file says something else than a mesh, or ends too early."""


class _Numbers:
    """Numbers of a section one after the other, from text or bytes; lengths are checked before memory is taken."""

    def __init__(self, section: str, data: bytes, order: _Order | None) -> None:
        self._section, self._at, self._order = section, 0, order
        self._data = data
        self._words: Array = np.empty(0)
        if order is None:
            words = data.split()
            try:
                self._words = np.array(words, dtype="S").astype(float) if words else np.empty(0)
            except ValueError:
                odd = next(word for word in words if not _is_number(word))
                shown = odd[:20].decode("ascii", "replace")
                raise _Ends(f"${section} holds '{shown}', which is no number") from None

    def _take(self, count: int, kind: str) -> AnyArray:
        if self._order is None:
            end, size = self._at + count, len(self._words)
        else:
            end, size = self._at + count * np.dtype(kind).itemsize, len(self._data)
        if count < 0 or end > size:
            raise _Ends(f"${self._section} ends before all that it announces")
        begin, self._at = self._at, end
        if self._order is None:
            return self._words[begin:end]
        return np.frombuffer(self._data[begin:end], dtype=np.dtype(kind).newbyteorder(self._order))

    def ints(self, count: int) -> IntArray:
        """Whole numbers of 4 bytes."""
        return self._whole(self._take(count, "i4"))

    def sizes(self, count: int) -> IntArray:
        """Whole numbers of 8 bytes."""
        return self._whole(self._take(count, "u8"))

    def reals(self, count: int) -> Array:
        """Floating-point numbers."""
        return self._take(count, "f8").astype(float)

    def _whole(self, numbers: AnyArray) -> IntArray:
        whole = numbers.astype(np.int64)
        if np.any(whole != numbers) or np.any(whole < -(2**31)):
            raise _Ends(f"${self._section} holds other numbers than whole ones where those are expected")
        return whole

    @property
    def used(self) -> int:
        """Bytes read so far."""
        return self._at


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


@dataclass(kw_only=True)
class _Sections:
    """The sections of the file: text by name, or the rest of the file from where a binary section begins."""

    version: str
    order: _Order | None
    begins: dict[str, bytes] = field(default_factory=dict)

    def numbers(self, name: str) -> _Numbers:
        if name not in self.begins:
            raise _Ends(f"${name} is missing")
        return _Numbers(name, self.begins[name], self.order)


def _read(data: bytes, path: Path) -> GmshFile:
    sections = _sections(data, path)
    names = _names(sections)
    if sections.version.startswith("2"):
        labels, points, cells = _version_2(sections, path)
    else:
        labels, points, cells = _version_4(sections, path)
    if not len(labels) or not cells:
        raise _Ends("it has no nodes or no elements")
    order, counts = np.unique(labels, return_counts=True)
    if len(order) != len(labels):
        raise refused(path.name, f"node {order[counts > 1][0]} is given twice")
    unnamed = sorted({key for part in cells for key in part.groups} - names.keys())
    indexed = [_indexed(part, labels, names, path) for part in cells]
    return GmshFile(labels=labels, points=points, cells=indexed, unnamed=unnamed)


def _sections(data: bytes, path: Path) -> _Sections:
    head, at = _line(data, 0)
    if head != b"$MeshFormat":
        raise _Ends("it does not begin with $MeshFormat")
    words = _line(data, at)[0].split()
    at = _line(data, at)[1]
    version = words[0].decode("ascii", "replace") if words else ""
    if len(words) < 3 or not version.startswith(("2", "4.1")):
        raise refused(
            path.name,
            found=f"format '{version}' of Gmsh",
            expected="4.1 or 2.2 (in Gmsh: option Mesh.MshFileVersion, or File, Export)",
        )
    order: _Order | None = None
    if words[1] != b"0":
        order = next((o for o in get_args(_Order) if data[at : at + 4] == np.array(1, dtype=f"{o}i4").tobytes()), None)
        if order is None or words[2] != b"8":
            raise _Ends("the binary header does not fit")
        at += 4
    sections = _Sections(version=version, order=order)
    while True:
        start = data.find(b"$", at)
        if start < 0:
            return sections
        name_line, begin = _line(data, start)
        name = name_line[1:].decode("ascii", "replace").strip()
        end = data.find(f"$End{name}".encode(), begin)
        if name.startswith("End"):
            at = begin
        elif order is not None and name in ("Nodes", "Elements", "Entities"):
            sections.begins[name] = data[begin:]  # bytes of numbers may look like the end of a section
            at = begin + _length(sections, name, path)
        elif end < 0:
            raise _Ends(f"${name} has no end")
        else:
            sections.begins.setdefault(name, data[begin:end])
            at = end


def _length(sections: _Sections, name: str, path: Path) -> int:
    """Bytes of a binary section, by reading it."""
    if sections.version.startswith("2"):
        if name == "Nodes":
            return _nodes_2(sections)[2]
        return _elements_2(sections, path)[1] if name == "Elements" else 0
    numbers = sections.numbers(name)
    if name == "Nodes":
        _nodes_4(numbers)
    elif name == "Elements":
        list(_elements_4(numbers, path))
    else:
        _entities(numbers)
    return numbers.used


def _line(data: bytes, at: int) -> tuple[bytes, int]:
    """The line that begins there, without its end, and where the next one does."""
    end = data.find(b"\n", at)
    end = len(data) if end < 0 else end
    return data[at:end].strip(), end + 1


def _names(sections: _Sections) -> dict[tuple[int, int], str]:
    names = {}
    for line in sections.begins.get("PhysicalNames", b"").decode("utf-8", "replace").splitlines()[1:]:
        words = line.split(maxsplit=2)
        if len(words) == 3 and words[0].isdigit() and words[1].lstrip("-").isdigit():
            names[int(words[0]), int(words[1])] = words[2].strip().strip('"')
    return names


def _type(number: int, path: Path) -> tuple[str, int]:
    if number not in _TYPES:
        raise refused(
            path.name, f"has elements of Gmsh type {number}, which are not read", remedy="mesh with order 1 or 2"
        )
    return _TYPES[number]


# ---- format 2.2 ------------------------------------------------------------------------------------------------------


def _version_2(sections: _Sections, path: Path) -> tuple[IntArray, Array, list[Cells]]:
    """An element of several groups stands there once for each of them."""
    labels, points, _ = _nodes_2(sections)
    elements, _ = _elements_2(sections, path)
    cells = []
    for kind, rows in elements.items():
        places: dict[tuple[int, ...], int] = {}
        nodes: list[tuple[int, ...]] = []
        groups: dict[tuple[int, int], dict[int, None]] = {}
        for entity, physical, nodes_of in rows:
            group = groups.setdefault((_dimension(kind), physical), {})
            index = places.get((entity, *nodes_of))
            if index is None or index in group:  # twice in one group is twice in the mesh, and refused there
                index = places[entity, *nodes_of] = len(nodes)
                nodes.append(nodes_of)
            group[index] = None
        chosen = {key: np.array([*members], dtype=np.int64) for key, members in groups.items() if key[1]}
        cells.append(Cells(kind=kind, nodes=np.array(nodes, dtype=np.int64), groups=chosen))
    return labels, points, cells


def _counted(sections: _Sections, name: str) -> tuple[_Numbers, int, int]:
    """The numbers of a section after its count, which is text in both forms; the count, and the bytes before."""
    if sections.order is None:
        numbers = sections.numbers(name)
        return numbers, int(numbers.sizes(1)[0]), 0
    if name not in sections.begins:
        raise _Ends(f"${name} is missing")
    line, begin = _line(sections.begins[name], 0)
    if not line.isdigit():
        raise _Ends(f"${name} does not begin with a count")
    return _Numbers(name, sections.begins[name][begin:], sections.order), int(line), begin


def _nodes_2(sections: _Sections) -> tuple[IntArray, Array, int]:
    numbers, count, before = _counted(sections, "Nodes")
    if sections.order is None:
        table = numbers.reals(4 * count).reshape(-1, 4)
        return table[:, 0].astype(np.int64), table[:, 1:], 0
    record = np.dtype([("label", "i4"), ("place", "f8", 3)]).newbyteorder(sections.order)
    raw = sections.begins["Nodes"][before : before + count * record.itemsize]
    if len(raw) < count * record.itemsize:
        raise _Ends("$Nodes ends before all that it announces")
    nodes = np.frombuffer(raw, dtype=record)
    return nodes["label"].astype(np.int64), nodes["place"].astype(float), before + len(raw)


_Row = tuple[int, int, tuple[int, ...]]


def _elements_2(sections: _Sections, path: Path) -> tuple[dict[str, list[_Row]], int]:
    """Elements by type as (entity, physical group, nodes)."""
    numbers, count, before = _counted(sections, "Elements")
    elements: dict[str, list[_Row]] = {}
    left = count
    while left > 0:
        if sections.order is None:
            _, number, tags = numbers.ints(3).tolist()
            repeated = 1
        else:
            number, repeated, tags = numbers.ints(3).tolist()
        kind, size = _type(number, path)
        ahead = 0 if sections.order is None else 1
        width = ahead + tags + size
        if tags < 2 or repeated < 1:
            raise _Ends("$Elements holds an element without its group and entity")
        for row in numbers.ints(repeated * width).reshape(-1, width).tolist():
            elements.setdefault(kind, []).append((row[ahead + 1], row[ahead], tuple(row[ahead + tags :])))
        left -= repeated
    return elements, before + (numbers.used if sections.order is not None else 0)


# ---- format 4.1 ------------------------------------------------------------------------------------------------------


def _version_4(sections: _Sections, path: Path) -> tuple[IntArray, Array, list[Cells]]:
    physical = _entities(sections.numbers("Entities")) if "Entities" in sections.begins else {}
    labels, points = _nodes_4(sections.numbers("Nodes"))
    cells = []
    for dimension, entity, kind, nodes in _elements_4(sections.numbers("Elements"), path):
        every = np.arange(len(nodes))
        groups = {(dimension, number): every for number in physical.get((dimension, entity), ())}
        cells.append(Cells(kind=kind, nodes=nodes, groups=groups))
    return labels, points, cells


def _entities(numbers: _Numbers) -> dict[tuple[int, int], list[int]]:
    """Physical groups of each point, curve, surface and volume, by dimension and number."""
    groups = {}
    for dimension, count in enumerate(numbers.sizes(_DIMENSIONS).tolist()):
        for _ in range(count):
            tag = int(numbers.ints(1)[0])
            numbers.reals(6 if dimension else 3)
            # a group in which the entity is turned over has a negative number
            groups[dimension, tag] = np.abs(numbers.ints(int(numbers.sizes(1)[0]))).tolist()
            if dimension:
                numbers.ints(int(numbers.sizes(1)[0]))
    return groups


def _nodes_4(numbers: _Numbers) -> tuple[IntArray, Array]:
    blocks = int(numbers.sizes(4)[0])
    labels, points = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    for _ in range(blocks):
        dimension, _, parametric = numbers.ints(3).tolist()
        count = int(numbers.sizes(1)[0])
        labels.append(numbers.sizes(count))
        width = 3 + (dimension if parametric else 0)
        points.append(numbers.reals(count * width).reshape(-1, width)[:, :3])
    return np.concatenate(labels), np.concatenate(points)


def _elements_4(numbers: _Numbers, path: Path) -> Iterator[tuple[int, int, str, IntArray]]:
    for _ in range(int(numbers.sizes(4)[0])):
        dimension, entity, number = numbers.ints(3).tolist()
        count = int(numbers.sizes(1)[0])
        kind, size = _type(number, path)
        yield dimension, entity, kind, numbers.sizes(count * (1 + size)).reshape(-1, 1 + size)[:, 1:]


# ---- both ------------------------------------------------------------------------------------------------------------


def _dimension(kind: str) -> int:
    if kind == _POINT:
        return 0
    return 1 if kind.startswith(_LINE) else 2 if kind.startswith((_TRIANGLE, _QUADRILATERAL)) else 3


def _indexed(part: Cells, labels: IntArray, names: dict[tuple[int, int], str], path: Path) -> Cells:
    """Nodes by index, in our order; groups by name."""
    nodes = node_indices(labels, part.nodes, f"{path.name}: an element") if len(part.nodes) else part.nodes
    like = _LIKE.get(part.kind, part.kind)
    if like in _EDGES:
        nodes = nodes[:, _our_order(like)]
    return Cells(
        kind=part.kind, nodes=nodes, groups={names[key]: chosen for key, chosen in part.groups.items() if key in names}
    )


def _our_order(kind: str) -> list[int]:
    """The permutation of their nodes to our order.

    >>> _our_order("tet10")
    [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
    """
    corners = ELEMENTS[kind].n_corners
    theirs = {frozenset(map(int, edge)): corners + i for i, edge in enumerate(_EDGES[kind].split())}
    return [*range(corners), *(theirs[frozenset(edge)] for edge in ELEMENTS[kind].edges)]
