"""The skin of a body as triangles, to be looked at: its boundary, coarser where there would be too many nodes."""

from __future__ import annotations

import numpy as np

from slipstick.fem.boundary import boundary
from slipstick.fem.elements import FACES
from slipstick.fem.mesh import Mesh
from slipstick.typing import IntArray

SKIN_NODES = 1500
"""So many show the shape of a body; the modes at them are stored with it."""


def skin_of(mesh: Mesh, most: int = SKIN_NODES) -> tuple[IntArray, IntArray]:
    """Nodes (n,) of the mesh and triangles (t, 3) of places among them, outward; the corners of faces alone.

    With more than ``most`` nodes those in one cell of a grid become one of them.
    """
    triangles = _triangles(mesh)
    nodes = np.unique(triangles)
    if len(nodes) > most:
        triangles = _merged(mesh, nodes, triangles, most)
        nodes = np.unique(triangles)
    return nodes, np.searchsorted(nodes, triangles)


def _triangles(mesh: Mesh) -> IntArray:
    parts = [np.empty((0, 3), dtype=np.int64)]
    for kind, faces in boundary(mesh).faces.items():
        corners = faces[:, : FACES[kind].n_corners]
        parts += [corners[:, [0, i, i + 1]] for i in range(1, corners.shape[1] - 1)]
    return np.concatenate(parts)


def _merged(mesh: Mesh, nodes: IntArray, triangles: IntArray, most: int) -> IntArray:
    """Triangles between the first nodes of the cells of a grid; what collapses is left out."""
    places = mesh.nodes[nodes]
    low, extent = places.min(axis=0), float(np.ptp(places, axis=0).max())
    cells = 4096
    while True:
        grid = np.floor((places - low) / (extent / cells)).astype(np.int64)
        _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
        if len(first) <= most or cells == 1:
            break
        cells = max(1, int(0.85 * cells))
    leader = np.zeros(mesh.n_nodes, dtype=np.int64)
    leader[nodes] = nodes[first][inverse.ravel()]
    moved = leader[triangles]
    whole = (moved[:, 0] != moved[:, 1]) & (moved[:, 1] != moved[:, 2]) & (moved[:, 0] != moved[:, 2])
    moved = moved[whole]
    _, once = np.unique(np.sort(moved, axis=1), axis=0, return_index=True)
    return moved[np.sort(once)]
