"""Nodes tied to faces: each follows the point of the face where it lies, by the shape functions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slipstick.errors import Where
from slipstick.fem.elements import FACES
from slipstick.fem.equations import NodalEquation
from slipstick.fem.mesh import Mesh, Surface
from slipstick.structure.constraints import Dependent
from slipstick.typing import Array, IntArray

_NEAREST_MARKS = 32
"""Nodes and middles of faces nearest to a point, whose faces are searched for its nearest place."""

_NEWTON_STEPS = 20
"""Gauss-Newton iterations for the nearest place of a face, at most."""

SMALL = 1e-9
"""Shape functions below it are what rounding leaves of a node that lies on another one."""


@dataclass(frozen=True, kw_only=True)
class Projection:
    """The nearest places of points on a surface, or among some nodes.

    ``nodes`` (n, 8) and ``weights`` (n, 8) of the face, padded by zeros; ``places`` (n, 3); ``distances`` (n,);
    ``normals`` (n, 3) of the surface there, outward unit vectors, None among nodes.
    """

    nodes: IntArray
    weights: Array
    places: Array
    distances: Array
    normals: Array | None = None


def project(mesh: Mesh, surface: Surface, points: Array) -> Projection:
    """The nearest place of a surface for each point (n, 3)."""
    n = len(points)
    nodes, weights = np.zeros((n, 8), dtype=np.int64), np.zeros((n, 8))
    places, distances, normals = np.zeros((n, 3)), np.full(n, np.inf), np.zeros((n, 3))
    for kind, faces in surface.faces.items():
        if not len(faces) or not n:
            continue
        who, which = _candidates(mesh, faces, points)
        values, feet, across = _nearest(kind, mesh.nodes[faces[which]], points[who])
        gaps = np.linalg.norm(feet - points[who], axis=1)
        order = np.lexsort((gaps, who))
        best = order[np.unique(who[order], return_index=True)[1]]
        best = best[gaps[best] < distances[who[best]]]
        at, width = who[best], faces.shape[1]
        nodes[at], weights[at] = 0, 0.0
        nodes[at, :width], weights[at, :width] = faces[which[best]], values[best]
        places[at], distances[at], normals[at] = feet[best], gaps[best], across[best]
    return Projection(nodes=nodes, weights=weights, places=places, distances=distances, normals=normals)


def _candidates(mesh: Mesh, faces: IntArray, points: Array) -> tuple[IntArray, IntArray]:
    """Pairs of point and face that may be nearest: those with a node or a middle near the point."""
    from scipy.spatial import cKDTree

    corners = mesh.nodes[faces]
    marks = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    count = min(_NEAREST_MARKS, marks.shape[0] * marks.shape[1])
    _, near = cKDTree(marks.reshape(-1, 3)).query(points, k=count)
    face = np.asarray(near).reshape(len(points), -1) // marks.shape[1]
    pairs = np.unique(np.stack([np.repeat(np.arange(len(points)), face.shape[1]), face.ravel()], axis=1), axis=0)
    return pairs[:, 0], pairs[:, 1]


def _nearest(kind: str, corners: Array, points: Array) -> tuple[Array, Array, Array]:
    """Shape functions, place and unit normal at the nearest point of each face (m, n, 3), by Gauss-Newton inside it."""
    basis = FACES[kind].basis
    local = np.full((len(points), 2), 1.0 / 3.0 if kind.startswith("tri") else 0.0)
    for _ in range(_NEWTON_STEPS):
        values, gradients = basis(local)
        gap = points - np.einsum("mn,mna->ma", values, corners)
        across = np.einsum("mna,mnd->mad", corners, gradients)
        normal = np.einsum("mad,mae->mde", across, across)
        step = _solved(normal, np.einsum("mad,ma->md", across, gap)[..., None])[..., 0]
        moved = _inside(kind, local + step)
        if np.abs(moved - local).max(initial=0.0) < 1e-14:
            break
        local = moved
    values, gradients = basis(local)
    across = np.einsum("mna,mnd->mad", corners, gradients)
    normal = np.cross(across[..., 0], across[..., 1])
    size = np.linalg.norm(normal, axis=1)
    return values, np.einsum("mn,mna->ma", values, corners), normal / np.where(size > 0.0, size, 1.0)[:, None]


def _solved(matrices: Array, columns: Array) -> Array:
    """Solutions of 2 x 2 systems; the shortest ones where a face has no area."""
    try:
        return np.asarray(np.linalg.solve(matrices, columns), dtype=float)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(matrices) @ columns)


def _inside(kind: str, local: Array) -> Array:
    if kind.startswith("quad"):
        return np.clip(local, -1.0, 1.0)
    x, y = local.T
    over = np.maximum(x + y - 1.0, 0.0) / 2.0
    x, y = np.clip(x - over, 0.0, 1.0), np.clip(y - over, 0.0, 1.0)
    return np.stack([np.minimum(x, 1.0 - y), y], axis=1)


def face_size(mesh: Mesh, surface: Surface) -> float:
    """Mean length of the edges of its faces."""
    lengths = [
        np.linalg.norm(mesh.nodes[faces[:, a]] - mesh.nodes[faces[:, b]], axis=1)
        for kind, faces in surface.faces.items()
        for a, b in FACES[kind].edges
    ]
    return float(np.concatenate(lengths).mean()) if lengths else 0.0


def tie_equations(mesh: Mesh, nodes: IntArray, onto: Projection, where: str | Where) -> Iterator[NodalEquation]:
    """Each node (index) moves as the place of its projection does."""
    for node, masters, weights in zip(nodes.tolist(), onto.nodes.tolist(), onto.weights.tolist(), strict=True):
        parts = [(int(mesh.labels[m]), w) for m, w in zip(masters, weights, strict=True) if abs(w) > SMALL]
        for axis in range(3):
            terms = ((int(mesh.labels[node]), axis, 1.0), *((label, axis, -w) for label, w in parts))
            yield NodalEquation(terms=terms, where=where, dependent=Dependent.YIELDING)


def nearest(places: Array, points: Array) -> Projection:
    """The nearest of some places (n_places, 3) for each point (n, 3), as a projection; ``nodes`` are their indices."""
    from scipy.spatial import cKDTree

    distances, which = cKDTree(places).query(points)
    padded, weights = np.zeros((len(points), 8), dtype=np.int64), np.zeros((len(points), 8))
    padded[:, 0], weights[:, 0] = which, 1.0
    return Projection(nodes=padded, weights=weights, places=places[which], distances=np.asarray(distances))
