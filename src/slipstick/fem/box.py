"""Structured boxes in every element type: small meshes for beams, fins, tests and first trials."""

from __future__ import annotations

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.fem.boundary import surface_where
from slipstick.fem.elements import ALIKE, ELEMENTS, LINEAR
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import quadratic
from slipstick.typing import Array, IntArray

_SPLITS: dict[str, tuple[tuple[int, ...], ...]] = {
    "hex8": ((0, 1, 2, 3, 4, 5, 6, 7),),
    "wedge6": ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
    "tet4": ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)),
}
_CELL_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(
    size: tuple[float, float, float],
    divisions: tuple[int, int, int],
    kind: str = "hex20",
    *,
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Mesh:
    """Box [at, at + size] cut into cells; surfaces "x0", "x1", "y0", ... are its six sides.

    ``kind`` is any element type: a cell is one hexahedron, two wedges, six tetrahedra or six pyramids about its middle.

    >>> box((1.0, 1.0, 1.0), (2, 2, 2), "tet10").n_elements
    48
    """
    if kind not in ELEMENTS:
        raise InputError(Fault("box", f"element type '{kind}' is not known", remedy=f"known are {', '.join(ELEMENTS)}"))
    if min(divisions) < 1 or not min(size) > 0.0:
        raise InputError(Fault("box", f"size {size} and divisions {divisions} must be positive"))
    alike = ALIKE.get(kind, kind)
    linear = LINEAR.get(alike, alike)
    axes = [np.linspace(0.0, s, n + 1) for s, n in zip(size, divisions, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = _cells(divisions)
    if linear == "pyramid5":
        middles = nodes[cells].mean(axis=1)
        apex = len(nodes) + np.arange(len(cells))
        block = np.concatenate([np.column_stack([cells[:, face], apex]) for face in _inward(_CELL_FACES)])
        nodes = np.vstack([nodes, middles])
    else:
        block = np.concatenate([cells[:, list(corners)] for corners in _SPLITS[linear]])
    mesh = Mesh(nodes=nodes, blocks={linear: block})
    mesh = quadratic(mesh) if alike != linear else mesh
    return _with_sides(Mesh(nodes=mesh.nodes, blocks={kind: mesh.blocks[alike]}), size, np.array(at, dtype=float))


def _cells(divisions: tuple[int, int, int]) -> IntArray:
    shape = tuple(n + 1 for n in divisions)
    i, j, k = (g.ravel() for g in np.meshgrid(*[np.arange(n) for n in divisions], indexing="ij"))
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    return np.stack([np.ravel_multi_index((i + a, j + b, k + c), shape) for a, b, c in corners], axis=1).astype(
        np.int64
    )


def _inward(faces: tuple[tuple[int, ...], ...]) -> list[list[int]]:
    return [list(reversed(face)) for face in faces]


def _with_sides(mesh: Mesh, size: tuple[float, float, float], at: Array) -> Mesh:
    tolerance = 1e-9 * max(size)
    surfaces = {
        f"{'xyz'[axis]}{end}": surface_where(mesh, np.abs(mesh.nodes[:, axis] - end * size[axis]) < tolerance)
        for axis in range(3)
        for end in (0, 1)
    }
    nodes = mesh.nodes + at if at.any() else mesh.nodes
    return Mesh(nodes=nodes, blocks=mesh.blocks, surfaces=surfaces)
