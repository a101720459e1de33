"""Jacobians of solid elements and of faces, for many at once; elements that are distorted, or resist too little."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.fem.boundary import all_faces
from slipstick.fem.elements import ELEMENTS, FACES, Element, Rule
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import Array, BoolArray, IntArray

_LONE = {
    "hex20r": (
        2,
        "neighbours along one direction at most: with 2 x 2 x 2 points such rows have hourglass modes of little or no "
        "stiffness; natural frequencies may be 80 % too low; put two elements across, or use full "
        "integration (C3D20; KEYOPT(2) = 1)",
    ),
    "hex8r": (
        3,
        "no neighbour along one direction or more: with one across, only the hourglass stiffness resists bending; put "
        "four elements across, or make them quadratic",
    ),
}
"""Directions along which an element needs neighbours, and what happens where it has none."""

_OPPOSITE = ((0, 1), (2, 4), (3, 5))
"""Opposite faces of a hexahedron."""


def tangents(coordinates: Array, gradients: Array) -> Array:
    """Derivatives dx_a/dxi_d of the position, (n_elements, n_points, 3, dimension).

    ``coordinates`` (n_elements, n_nodes, 3), ``gradients`` (n_points, n_nodes, dimension) of the shape functions.
    """
    n_elements, n_nodes, _ = coordinates.shape
    n_points, _, dimension = gradients.shape
    flat = gradients.transpose(1, 0, 2).reshape(n_nodes, n_points * dimension)
    product = coordinates.transpose(0, 2, 1).reshape(-1, n_nodes) @ flat
    return product.reshape(n_elements, 3, n_points, dimension).transpose(0, 2, 1, 3)


def determinant_and_inverse(jacobian: Array) -> tuple[Array, Array]:
    """Determinant (...) and inverse (..., 3, 3) of 3 x 3 matrices, by cofactors: three cross products."""
    a, b, c = jacobian[..., 0], jacobian[..., 1], jacobian[..., 2]
    rows = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=-2)
    determinant = np.einsum("...i,...i->...", a, rows[..., 0, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        return determinant, rows / determinant[..., None, None]


def _cross(a: Array, b: Array) -> Array:
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def solid_gradients(
    mesh: Mesh, element: Element, start: int, block: IntArray, *, mean: bool = True
) -> tuple[Array, Array]:
    """Gradients (n_elements, n_points, n_nodes, 3) in space and weights (n_elements, n_points) at the stiffness rule.

    Of an element of mean strain the mean gradients, at one point, unless ``mean`` is false. ``start`` is the index of
    the first element of ``block`` in the mesh, for the message.

    Raises
    ------
    InputError
        If a Jacobian determinant is not positive; the sentence names the first element.
    """
    _, reference = element.at_rule
    determinant, inverse = determinant_and_inverse(tangents(mesh.nodes[block], reference))
    require_positive(mesh, element, start, determinant)
    gradients, weights = np.matmul(reference, inverse), determinant * element.rule.weights
    if not (element.mean_strain and mean):
        return gradients, weights
    volumes = weights.sum(axis=1, keepdims=True)
    return np.einsum("eq,eqnd->end", weights / volumes, gradients)[:, None], volumes


def require_positive(mesh: Mesh, element: Element, start: int, determinant: Array) -> None:
    """Refuse elements that are inside out or too distorted."""
    bad = np.flatnonzero(~(determinant.min(axis=1) > 0.0))
    if not len(bad):
        return
    inverted = bool((determinant[bad[0]] < 0.0).all())
    cause = "is inside out (node order reversed)" if inverted else "is too distorted or flat"
    label = mesh.element_label(element.name, start + int(bad[0]))
    what = f"{cause}: its Jacobian determinant falls to {determinant[bad[0]].min():.3g}"
    remedy = f"{'reorder its nodes' if inverted else 'repair the mesh'} ({len(bad)} such elements in this group)"
    raise InputError(Fault(f"{element.name} element {label}", what, remedy=remedy))


def face_geometry(
    mesh: Mesh, surface: Surface, rule: Callable[[str], Rule] = lambda kind: FACES[kind].rule
) -> Iterator[tuple[IntArray, Array, Array, Array]]:
    """For each face type: nodes (m, n), shape values (q, n), area weights (m, q), outward unit normals (m, q, 3)."""
    for kind, faces in surface.faces.items():
        if len(faces):
            points = rule(kind)
            values, gradients = FACES[kind].basis(points.points)
            across = tangents(mesh.nodes[faces], gradients)
            normal = _cross(across[..., 0], across[..., 1])
            size = np.linalg.norm(normal, axis=-1)
            yield faces, values, size * points.weights, normal / size[..., None]


def nodal_normals(mesh: Mesh, surface: Surface) -> Array:
    """Outward unit normals (n_nodes, 3), averaged over the faces at each node by area; zero off the surface."""
    normals = np.zeros((mesh.n_nodes, 3))
    for faces, values, weights, unit in face_geometry(mesh, surface):
        np.add.at(normals, faces, np.einsum("mq,mqa,qn->mna", weights, unit, values**2))
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(size > 0.0, size, 1.0)


def volume(mesh: Mesh) -> float:
    """Volume of the mesh."""
    total = 0.0
    for element, block in mesh.items():
        _, gradients = element.at_rule
        determinant, _ = determinant_and_inverse(tangents(mesh.nodes[block], gradients))
        total += float((determinant * element.rule.weights).sum())
    return total


def hourglass_warnings(mesh: Mesh, source: str) -> Iterator[str]:
    """A sentence where elements with reduced integration have too few neighbours.

    Alone, hex20r has six motions without strain at its points besides the rigid ones. A second element across, in two
    directions, stops them all; a row of single elements keeps some, without any stiffness where it is straight and
    with so little elsewhere that modes of a cantilever come out 80 % too low. A layer of single hex8r bends against
    its hourglass stiffness alone.
    """
    for kind, (directions, what) in _LONE.items():
        if len(mesh.blocks.get(kind, ())):
            lone = np.flatnonzero(_directions_with_neighbours(mesh, kind) < directions)
            if len(lone):
                yield (
                    f"{source}: {len(lone)} {kind} elements, as {mesh.element_label(kind, int(lone[0]))}, have {what}"
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
