"""Boundary of a mesh: the faces that belong to one element alone, surfaces, and a surface mesh for pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, number, numbers, wrong
from slipstick.fem.elements import FACES
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import Array, BoolArray, IntArray

SKIN_NODES = 1500
"""Nodes of the surface mesh, at most: enough for the shape of a body, and the modes at them are stored."""


def all_faces(mesh: Mesh) -> dict[str, IntArray]:
    """Every face of every element, by face type, outward; a face between two elements appears twice."""
    parts: dict[str, list[IntArray]] = {}
    for element, block in mesh.items():
        for kind, local in element.faces:
            parts.setdefault(kind, []).append(block[:, list(local)])
    return {kind: np.concatenate(faces) for kind, faces in parts.items()}


def face_counts(mesh: Mesh) -> dict[str, tuple[IntArray, IntArray]]:
    """Faces by type with how many elements share each (same corners): 1 on the boundary, 2 inside, more is a fault."""
    result = {}
    for kind, faces in all_faces(mesh).items():
        corners = np.sort(faces[:, : FACES[kind].n_corners], axis=1)
        _, inverse, counts = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
        result[kind] = (faces, counts[inverse.ravel()])
    return result


def boundary(mesh: Mesh) -> Surface:
    """The boundary, outward.

    Raises
    ------
    InputError
        If a face is shared by more than two elements.
    """
    faces = {}
    for kind, (every, counts) in face_counts(mesh).items():
        if counts.max() > 2:
            labels = mesh.labels[every[np.argmax(counts)]]
            what = f"the face of nodes {labels.tolist()} belongs to {counts.max()} elements"
            raise InputError(Fault(statement=what, remedy="at most two can share a face"))
        faces[kind] = every[counts == 1]
    return Surface(faces=faces)


def surface_where(mesh: Mesh, marked: BoolArray) -> Surface:
    """Boundary faces all of whose nodes are marked; ``marked`` is (n_nodes,)."""
    return Surface(faces={kind: faces[marked[faces].all(axis=1)] for kind, faces in boundary(mesh).faces.items()})


def surface_towards(mesh: Mesh, direction: ArrayLike, *, angle: float = 30.0, depth: float = 0.1) -> Surface:
    """Boundary faces whose normal has a direction and that lie at that end of the body, such as the tip of a blade.

    ``angle`` (degrees) is the largest between a face's normal and the direction (3,); ``depth`` how far from the
    extreme point a face's corners may lie, over the extent of the body in that direction.

    Raises
    ------
    InputError
        If the direction is zero or no face qualifies.
    """
    expected = "a vector (3,) that is not zero"
    wanted = numbers("direction", direction, expected)
    if wanted.shape != (3,) or np.linalg.norm(wanted) < SMALLEST:
        raise wrong("direction", direction, expected)
    angle, depth = number("angle", angle, "degrees"), number("depth", depth)
    wanted = wanted / np.linalg.norm(wanted)
    height = mesh.nodes @ wanted
    low, high = height[mesh.used_nodes].min(), height[mesh.used_nodes].max()
    chosen = {}
    for kind, faces in boundary(mesh).faces.items():
        corners = mesh.nodes[faces[:, : FACES[kind].n_corners]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
        towards = normal @ wanted >= np.cos(np.deg2rad(angle)) * np.linalg.norm(normal, axis=1)
        near = (corners @ wanted).min(axis=1) >= high - depth * (high - low) - 1e-12 * abs(high)
        chosen[kind] = faces[towards & near]
    surface = Surface(faces={kind: faces for kind, faces in chosen.items() if len(faces)})
    if not surface.n_faces:
        what = f"no boundary face looks towards {wanted.round(3).tolist()} within {angle} degrees there"
        raise InputError(Fault(statement=what))
    return surface


def skin_of(
    mesh: Mesh, most: int = SKIN_NODES, fine: IntArray | None = None, most_fine: int = 0
) -> tuple[IntArray, IntArray]:
    """The surface mesh for pictures: nodes (n,) of the mesh, and triangles (t, 3) of places among them, outward.

    The corners of faces alone. With more than ``most`` nodes those in one cell of a grid become one of them; where that
    leaves fewer than ``most_fine`` of the nodes ``fine`` of the mesh, these have a finer grid of their own, with the
    nodes between corners where the corners are not as many.
    """
    triangles = _triangles(mesh)
    if fine is not None and np.isin(fine, triangles).sum() < min(most_fine, len(fine)):
        triangles = _triangles(mesh, fine)
    nodes = np.unique(triangles)
    places, triangles = mesh.nodes[nodes], np.searchsorted(nodes, triangles)
    sides = _sides(places, triangles)
    leader = _leaders(places, sides, most)
    on = np.zeros(len(nodes), dtype=bool) if fine is None else np.isin(nodes, fine)
    if len(np.unique(leader[on])) < min(most_fine, int(on.sum())):
        for part, limit in ((on, most_fine), (~on, most)):
            leader[part] = np.flatnonzero(part)[_leaders(places[part], sides[part], limit)]
    kept, triangles = _merged(triangles, leader)
    return nodes[kept], triangles


def thinned(places: Array, triangles: IntArray, most: int) -> tuple[IntArray, IntArray]:
    """Indices of at most ``most`` of the nodes (n, 3) of a surface, and triangles between them, as of ``skin_of``."""
    return _merged(triangles, _leaders(places, _sides(places, triangles), most))


def _triangles(mesh: Mesh, split: IntArray | None = None) -> IntArray:
    """Triangles of all faces: between corners, or between all nodes of faces whose nodes are in ``split``."""
    parts = [np.empty((0, 3), dtype=np.int64)]
    for kind, faces in boundary(mesh).faces.items():
        n = FACES[kind].n_corners
        whole = np.zeros(len(faces), dtype=bool) if split is None else np.isin(faces, split).all(axis=1)
        whole &= faces.shape[1] == 2 * n
        corners, around = faces[~whole, :n], faces[whole]
        parts += [corners[:, [0, i, i + 1]] for i in range(1, n - 1)]
        if whole.any():
            parts += [around[:, [n + (k - 1) % n, k, n + k]] for k in range(n)]  # node n + k follows corner k
            parts += [around[:, [n, n + i, n + i + 1]] for i in range(1, n - 1)]
    return np.concatenate(parts)


def _sides(places: Array, triangles: IntArray) -> IntArray:
    """The direction of six nearest to the normal at each node (n,), which separates both sides of a thin body."""
    corners, normals = places[triangles], np.zeros_like(places)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], across)
    along = np.abs(normals).argmax(axis=1)
    return np.asarray(2 * along + (normals[np.arange(len(normals)), along] < 0.0))


def _leaders(places: Array, sides: IntArray, most: int) -> IntArray:
    """Which node stands for each (n,): itself, or with more than ``most`` the first in its cell of a grid that looks
    the same way."""
    if len(places) <= most:
        return np.arange(len(places))
    low, extent = places.min(axis=0), float(np.ptp(places, axis=0).max())
    cells = 4096
    while True:
        grid = np.floor((places - low) / (extent / cells)).astype(np.int64)
        cell = grid if cells == 1 else np.column_stack([grid, sides])
        _, first, inverse = np.unique(cell, axis=0, return_index=True, return_inverse=True)
        if len(first) <= most or cells == 1:
            break
        cells = max(1, int(0.85 * cells))
    return np.asarray(first[inverse.ravel()], dtype=np.int64)


def _merged(triangles: IntArray, leader: IntArray) -> tuple[IntArray, IntArray]:
    """Nodes that represent others, and the triangles between them without those that collapse."""
    moved = leader[triangles]
    if not np.array_equal(leader, np.arange(len(leader))):
        whole = (moved[:, 0] != moved[:, 1]) & (moved[:, 1] != moved[:, 2]) & (moved[:, 0] != moved[:, 2])
        moved = moved[whole]
        _, once = np.unique(np.sort(moved, axis=1), axis=0, return_index=True)
        moved = moved[np.sort(once)]
    kept = np.unique(moved)
    return kept, np.searchsorted(kept, moved)
