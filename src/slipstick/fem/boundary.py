"""Boundary of a mesh: the faces that belong to one element alone, and surfaces picked out of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import InputError
from slipstick.faults import SMALLEST, number, numbers, wrong
from slipstick.fem.elements import FACES
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import BoolArray, IntArray


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
            raise InputError(
                f"the face of nodes {labels.tolist()} belongs to {counts.max()} elements; at most two can share a face"
            )
        faces[kind] = every[counts == 1]
    return Surface(faces=faces)


def surface_where(mesh: Mesh, marked: BoolArray) -> Surface:
    """Boundary faces all of whose nodes are marked; ``marked`` is (n_nodes,)."""
    return Surface(faces={kind: faces[marked[faces].all(axis=1)] for kind, faces in boundary(mesh).faces.items()})


def surface_from_nodes(mesh: Mesh, nodes: IntArray) -> Surface:
    """Boundary faces whose *corner* nodes are all in ``nodes``: what a node component of another program means.

    Raises
    ------
    InputError
        If no boundary face lies in the set.
    """
    marked = np.zeros(mesh.n_nodes, dtype=bool)
    marked[nodes] = True
    chosen = {
        kind: faces[marked[faces[:, : FACES[kind].n_corners]].all(axis=1)]
        for kind, faces in boundary(mesh).faces.items()
    }
    surface = Surface(faces={kind: faces for kind, faces in chosen.items() if len(faces)})
    if not surface.n_faces:
        raise InputError(
            f"no face of the boundary lies in this set of {len(nodes)} nodes; give the nodes of whole faces"
        )
    return surface


def surface_towards(mesh: Mesh, direction: ArrayLike, *, angle: float = 30.0, depth: float = 0.1) -> Surface:
    """Boundary faces that look in a direction and lie at that end of the body, such as the tip of a blade.

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
        raise InputError(f"no boundary face looks towards {wanted.round(3).tolist()} within {angle} degrees there")
    return surface
