"""Motions that elements with reduced integration do not resist, and where a mesh leaves them free."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slipstick.fem.boundary import all_faces
from slipstick.fem.elements import ELEMENTS, FACES, REDUCED
from slipstick.fem.mesh import Mesh
from slipstick.typing import BoolArray, IntArray

_OPPOSITE = ((0, 1), (2, 4), (3, 5))
"""Opposite faces of a hexahedron."""


def hourglass_warnings(mesh: Mesh, source: str) -> Iterator[str]:
    """A sentence where elements with reduced integration have neighbours along one direction at most.

    Alone, hex20r has six motions without strain at its points besides the rigid ones. A second element across, in two
    directions, stops them all; a row of single elements keeps some, without any stiffness where it is straight and
    with so little elsewhere that modes of a cantilever come out 80 % too low.
    """
    for kind in REDUCED:
        if len(mesh.blocks.get(kind, ())):
            lone = np.flatnonzero(_directions_with_neighbours(mesh, kind) < 2)
            if len(lone):
                yield (
                    f"{source}: {len(lone)} {kind} elements, as {mesh.element_label(kind, int(lone[0]))}, have "
                    "neighbours along one direction at most: 2 x 2 x 2 points leave such rows motions with little or "
                    "no stiffness (hourglass modes), and natural frequencies may be 80 % too low; put two elements "
                    "across, or use full integration (C3D20; KEYOPT(2) = 1)"
                )


def _directions_with_neighbours(mesh: Mesh, kind: str) -> IntArray:
    """Along how many of its three directions each element shares a face with another, (n_elements,)."""
    every = np.concatenate([_corners(faces, shape) for shape, faces in all_faces(mesh).items()])
    known, counts = np.unique(every, axis=0, return_counts=True)
    shared = {tuple(face) for face in known[counts > 1].tolist()}
    block = mesh.blocks[kind]

    def has_neighbour(face: int) -> BoolArray:
        shape, local = ELEMENTS[kind].faces[face]
        return np.array([tuple(row) in shared for row in _corners(block[:, list(local)], shape).tolist()])

    return np.sum([has_neighbour(a) | has_neighbour(b) for a, b in _OPPOSITE], axis=0)


def _corners(faces: IntArray, shape: str) -> IntArray:
    """Sorted corners of faces, (n, 4); a triangle's first one twice."""
    corners = np.sort(faces[:, : FACES[shape].n_corners], axis=1)
    return np.column_stack([corners[:, 0], corners]) if corners.shape[1] == 3 else corners
