"""Meshes as Gmsh writes them: .msh of the formats 2.2 and 4.1, as text and binary, and its .inp.

A group is ``(dimension, name): [(element type number, nodes by label)]``; it stands for one entity of the geometry.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

Groups = Mapping[tuple[int, str], Any]
INP_TYPES = {1: "T3D2", 2: "CPS3", 3: "CPS4", 4: "C3D4", 5: "C3D8", 11: "C3D10", 9: "CPS6"}


def write_msh(
    path: Path, points: Any, groups: Groups, *, version: str = "4.1", binary: bool = False, more: Any = ()
) -> Path:
    """A .msh; ``more`` are entities without a group, as ``(dimension, rows)``."""
    entities = [(dimension, name, rows) for (dimension, name), rows in groups.items()]
    entities += [(dimension, "", rows) for dimension, rows in more]
    names = [(d, i, name) for i, (d, name, _) in enumerate(entities, 1) if name]
    parts = [f"$MeshFormat\n{version} {int(binary)} 8\n".encode()]
    parts += [struct.pack("<i", 1) + b"\n"] if binary else []
    parts += [b"$EndMeshFormat\n", f"$PhysicalNames\n{len(names)}\n".encode()]
    parts += [f'{d} {i} "{name}"\n'.encode() for d, i, name in names]
    parts += [b"$EndPhysicalNames\n"]
    write = (_binary if binary else _text)[version]
    return _written(path, b"".join([*parts, *write(points, entities)]))


def _written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def _lines(rows: Any) -> bytes:
    return "".join(" ".join(map(str, row)) + "\n" for row in rows).encode()


def _text_22(points: Any, entities: Any) -> list[bytes]:
    nodes = [(i, *map(float, p)) for i, p in enumerate(points, 1)]
    elements = [
        (kind, 2, i if name else 0, i, *nodes) for i, (_, name, rows) in enumerate(entities, 1) for kind, nodes in rows
    ]
    return [
        b"$Nodes\n", _lines([(len(nodes),), *nodes]), b"$EndNodes\n",
        b"$Elements\n", _lines([(len(elements),), *((n, *e) for n, e in enumerate(elements, 1))]), b"$EndElements\n",
    ]  # fmt: skip


def _binary_22(points: Any, entities: Any) -> list[bytes]:
    nodes = b"".join(struct.pack("<i3d", i, *map(float, p)) for i, p in enumerate(points, 1))
    elements, count = b"", 0
    for i, (_, name, rows) in enumerate(entities, 1):
        for kind, own in rows:
            count += 1
            ints = (kind, 1, 2, count, i if name else 0, i, *map(int, own))
            elements += struct.pack(f"<{len(ints)}i", *ints)
    return [
        b"$Nodes\n%d\n" % len(points), nodes, b"\n$EndNodes\n$Elements\n%d\n" % count, elements, b"\n$EndElements\n",
    ]  # fmt: skip


def _blocks(entities: Any) -> list[tuple[int, int, int, Any]]:
    """Runs of one type in each entity."""
    found = []
    for i, (dimension, _, rows) in enumerate(entities, 1):
        for kind in dict.fromkeys(kind for kind, _ in rows):
            found.append((dimension, i, kind, [own for k, own in rows if k == kind]))
    return found


def _text_41(points: Any, entities: Any) -> list[bytes]:
    counts = [sum(d == wanted for d, _, _ in entities) for wanted in range(4)]
    told = [tuple(counts)]
    for wanted in range(4):
        for i, (d, name, _) in enumerate(entities, 1):
            if d == wanted:
                place = (0.0,) * (6 if d else 3)
                told.append((i, *place, *((1, i) if name else (0,)), *((0,) if d else ())))
    n = len(points)
    nodes = [(1, n, 1, n), (3, 1, 0, n), *((i,) for i in range(1, n + 1)), *(tuple(map(float, p)) for p in points)]
    blocks, label = _blocks(entities), 0
    total = sum(len(rows) for *_, rows in blocks)
    elements: list[Any] = [(len(blocks), total, 1, total)]
    for d, i, kind, rows in blocks:
        elements.append((d, i, kind, len(rows)))
        for own in rows:
            label += 1
            elements.append((label, *own))
    return [
        b"$Entities\n", _lines(told), b"$EndEntities\n", b"$Nodes\n", _lines(nodes), b"$EndNodes\n",
        b"$Elements\n", _lines(elements), b"$EndElements\n",
    ]  # fmt: skip


def _binary_41(points: Any, entities: Any) -> list[bytes]:
    pack = struct.pack
    told = pack("<4Q", *(sum(d == wanted for d, _, _ in entities) for wanted in range(4)))
    for wanted in range(4):
        for i, (d, name, _) in enumerate(entities, 1):
            if d == wanted:
                told += pack("<i", i) + pack("<6d" if d else "<3d", *(0.0,) * (6 if d else 3))
                told += pack("<Qi", 1, i) if name else pack("<Q", 0)
                told += pack("<Q", 0) if d else b""
    n = len(points)
    nodes = pack("<4Q3iQ", 1, n, 1, n, 3, 1, 0, n) + pack(f"<{n}Q", *range(1, n + 1))
    nodes += b"".join(pack("<3d", *map(float, p)) for p in points)
    blocks, label = _blocks(entities), 0
    total = sum(len(rows) for *_, rows in blocks)
    elements = pack("<4Q", len(blocks), total, 1, total)
    for d, i, kind, rows in blocks:
        elements += pack("<3iQ", d, i, kind, len(rows))
        for own in rows:
            label += 1
            elements += pack(f"<{1 + len(own)}Q", label, *map(int, own))
    return [
        b"$Entities\n", told, b"\n$EndEntities\n$Nodes\n", nodes, b"\n$EndNodes\n$Elements\n", elements,
        b"\n$EndElements\n",
    ]  # fmt: skip


_text = {"2.2": _text_22, "4.1": _text_41}
_binary = {"2.2": _binary_22, "4.1": _binary_41}


def write_inp(path: Path, points: Any, groups: Groups) -> Path:
    """What Gmsh exports as .inp: faces and lines are elements of plane and truss types, their groups element sets."""
    lines = ["*Heading", f" {path.name}", "*NODE"]
    lines += [f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(points, 1)]
    lines.append("******* E L E M E N T S *************")
    label, sets = 0, {}
    for i, ((dimension, name), rows) in enumerate(groups.items(), 1):
        for kind in dict.fromkeys(kind for kind, _ in rows):
            head = ("Point", "Line", "Surface", "Volume")[dimension]
            lines.append(f"*ELEMENT, type={INP_TYPES[kind]}, ELSET={head}{i}")
            for own in (own for k, own in rows if k == kind):
                label += 1
                lines.append(", ".join(map(str, (label, *own))))
                sets.setdefault(name.replace(" ", "_"), []).append(label)
    for name, members in sets.items():
        lines.append(f"*ELSET,ELSET={name}")
        lines += [", ".join(map(str, members[at : at + 10])) + ", " for at in range(0, len(members), 10)]
    path.write_text("\n".join(lines) + "\n")
    return path


def beam(length: float = 4.0, cells: tuple[int, int, int] = (4, 1, 1)) -> tuple[Any, dict[tuple[int, str], Any]]:
    """Points and groups of a bar along x: body, root (x = 0), tip face (x = length), an edge of the root."""
    from slipstick.fem.box import box

    mesh = box((length, 1.0, 1.0), cells, "hex8")
    rows = {
        name: (mesh.surfaces[side].faces["quad4"] + 1).tolist() for name, side in (("root", "x0"), ("tip face", "x1"))
    }
    root = mesh.surfaces["x0"].nodes
    edge = [int(n) + 1 for n in root if mesh.nodes[n, 1] == 0.0]
    return mesh.nodes, {
        (1, "edge"): [(1, edge[:2])],
        (2, "root"): [(3, own) for own in rows["root"]],
        (2, "tip face"): [(3, own[::-1]) for own in rows["tip face"]],
        (3, "body"): [(5, own) for own in (mesh.blocks["hex8"] + 1).tolist()],
    }
