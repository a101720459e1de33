"""What is said of surfaces that touch and of sections of bolts, and the faces that make them, alike for all codes."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.mesh import Mesh, Surface
from slipstick.importers.deck import matching_surface
from slipstick.typing import IntArray

APART = (
    "is kept as model.contact_pairs: nothing joins its surfaces until contacts are put there ([[joint]] of a case, "
    "ss.surface_pair)"
)
WHOLE = "is kept as model.pretension_sections: the bolt is whole there, its load and shortening have no effect"


def corners_of(mesh: Mesh, chosen: dict[str, IntArray]) -> list[IntArray]:
    """Corners of all faces of some elements (positions by kind), one array a face of the element."""
    return [
        mesh.blocks[kind][at][:, list(local[: FACES[shape].n_corners])]
        for kind, at in chosen.items()
        if len(at)
        for shape, local in ELEMENTS[kind].faces
    ]


def outer_faces(mesh: Mesh, chosen: dict[str, IntArray]) -> Surface:
    """Faces of some elements (positions by kind) that lie on the boundary."""
    corners = corners_of(mesh, chosen)
    return matching_surface(mesh, corners) if corners else Surface(faces={})


def section_faces(mesh: Mesh, nodes: Collection[int], beside: Collection[int]) -> Surface:
    """Faces all of whose nodes are among some (indices), of elements that have no label among those ``beside``."""
    marked = np.zeros(mesh.n_nodes, dtype=bool)
    marked[np.fromiter(nodes, dtype=np.int64, count=len(nodes))] = True
    faces: dict[str, list[IntArray]] = {}
    for kind, block in mesh.blocks.items():
        labels = (mesh.element_labels or {}).get(kind, np.arange(1, len(block) + 1))
        own = block[~np.isin(labels, list(beside))]
        for shape, local in ELEMENTS[kind].faces:
            part = own[:, list(local)]
            part = part[marked[part].all(axis=1)]
            if len(part):
                faces.setdefault(shape, []).append(part)
    return Surface(faces={shape: np.concatenate(parts) for shape, parts in faces.items()})


def element_positions(mesh: Mesh, labels: Collection[int]) -> dict[str, IntArray]:
    """Positions in their blocks of the elements of some labels."""
    wanted = list(labels)
    return {kind: np.flatnonzero(np.isin(part, wanted)) for kind, part in (mesh.element_labels or {}).items()}
