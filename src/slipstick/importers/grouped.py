"""A mesh from cells and named groups of them: solids, and faces, lines and points that only name places."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slipstick.fem.elements import ELEMENTS
from slipstick.fem.mesh import Mesh, Surface
from slipstick.importers.deck import Deck, matching_surface
from slipstick.importers.findings import refused
from slipstick.importers.mesh_checks import unit_notes
from slipstick.typing import Array, IntArray

_SOLIDS = {
    **{kind: kind for kind in ("tet4", "tet10", "hex8", "hex20", "wedge6", "wedge15", "pyramid5", "pyramid13")},
    "hexahedron27": "hex20",
    "wedge18": "wedge15",
    "pyramid14": "pyramid13",
}
KINDS = frozenset(_SOLIDS)
"""Names of solids."""

MARK = "node of a set"
"""The kind of cells that are no cells: nodes of a set."""

_CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Cells of one type: nodes (n, k) by index, and which of them each group holds.

    Solids are called as ours or "hexahedron27", "wedge18", "pyramid14", whose further nodes are left out; others
    "triangle...", "quad...", "line...", "vertex".
    """

    kind: str
    nodes: IntArray
    groups: Mapping[Any, IntArray] = field(default_factory=dict)


def grouped_model(name: str, points: Array, cells: Sequence[Cells], labels: IntArray | None = None) -> Deck:
    """The mesh of the solids; groups of faces are surfaces, of lines and points node sets, of solids element sets.

    Faces inside the body belong to no surface: a group of such faces alone is a node set.

    Raises
    ------
    InputError
        If there is no solid element.
    """
    blocks: dict[str, list[IntArray]] = {}
    volumes: dict[str, dict[str, list[IntArray]]] = {}
    faces: dict[str, list[IntArray]] = {}
    nodes: dict[str, list[IntArray]] = {}
    variants: dict[str, dict[str, int]] = {}
    others: dict[str, int] = {}
    for part in cells:
        if part.kind in _SOLIDS:
            kind = _SOLIDS[part.kind]
            start = sum(map(len, blocks.get(kind, ())))
            blocks.setdefault(kind, []).append(part.nodes[:, : ELEMENTS[kind].n_nodes])
            if part.kind != kind:
                counts = variants.setdefault(kind, {})
                counts[part.kind] = counts.get(part.kind, 0) + len(part.nodes)
            for group, chosen in part.groups.items():
                volumes.setdefault(group, {}).setdefault(kind, []).append(start + chosen)
        else:
            if part.kind != MARK:
                others[part.kind] = others.get(part.kind, 0) + len(part.nodes)
            for group, chosen in part.groups.items():
                if part.kind in _CORNERS:
                    faces.setdefault(group, []).append(part.nodes[chosen, : _CORNERS[part.kind]])
                nodes.setdefault(group, []).append(part.nodes[chosen].ravel())
    if not blocks:
        flat = f"; it has {_counted(others)}" if others else ""
        raise refused(
            name, f"has no solid element{flat}", remedy="mesh the volume, and export it with its physical groups"
        )
    mesh = Mesh(
        nodes=points,
        blocks={kind: np.concatenate(parts) for kind, parts in blocks.items()},
        element_sets={n: {k: np.concatenate(p) for k, p in parts.items()} for n, parts in volumes.items()},
        node_labels=labels,
    )
    mesh, notes = with_named_places(name, mesh, faces, nodes)
    left = [f"{name}: {_counted(others)} are no solids: they add no stiffness and no mass"] if others else []
    told = [*_read(name, mesh), *notes, *left, *unit_notes(mesh, {})]
    return Deck(source=name, mesh=mesh, variants=variants, extra=told)


def with_named_places(
    name: str, mesh: Mesh, faces: Mapping[str, Sequence[IntArray]], nodes: Mapping[str, Sequence[IntArray]]
) -> tuple[Mesh, list[str]]:
    """The mesh with surfaces and node sets of groups that are no solids, and what does not lie on its boundary.

    ``faces`` are corners by group, each (n, 3) or (n, 4); ``nodes`` all nodes of each group. A group with a face on the
    boundary is a surface, another one a node set. Nodes of no solid are left out.
    """
    surfaces, sets, notes = dict(mesh.surfaces), dict(mesh.node_sets), []
    solid = mesh.used_nodes
    for group, parts in nodes.items():
        corners = faces.get(group, ())
        surface = matching_surface(mesh, corners) if len(corners) else Surface(faces={})
        wanted = len({tuple(sorted(face)) for part in corners for face in part.tolist()})
        inside = wanted - surface.n_faces
        held = np.intersect1d(np.concatenate(parts), solid)
        if surface.n_faces:
            surfaces.setdefault(group, surface)
            if inside:
                what = "do not lie on the boundary: they are not in the surface"
                notes.append(f"{name}: {inside} of {wanted} faces of {group} {what}")
        elif len(held):
            sets.setdefault(group, held)
            if wanted:
                what = f"lies on the boundary: it is a set of {len(held)} nodes, no surface"
                notes.append(f"{name}: no face of {group} {what}")
        else:
            notes.append(f"{name}: {group} has no node of a solid element and is left out")
    return replace(mesh, node_sets=sets, surfaces=surfaces), notes


def _read(name: str, mesh: Mesh) -> Iterator[str]:
    kinds: dict[str, Collection[str]] = {
        "element sets": mesh.element_sets,
        "surfaces": mesh.surfaces,
        "node sets": mesh.node_sets,
    }
    told = [f"{kind} {', '.join(sorted(names))}" for kind, names in kinds.items() if names]
    yield f"{name}: groups read: {'; '.join(told) or 'none, since the file names none'}"


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in counts.items())
