"""Jacobians of solid elements and of faces, for many at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slipstick.errors import InputError
from slipstick.fem.elements import FACES, Element
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import Array, IntArray


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


def solid_gradients(mesh: Mesh, element: Element, start: int, block: IntArray) -> tuple[Array, Array]:
    """Gradients (n_elements, n_points, n_nodes, 3) in space and weights (n_elements, n_points) at the stiffness rule.

    ``start`` is the index of the first element of ``block`` in the mesh, for the message.

    Raises
    ------
    InputError
        If a Jacobian determinant is not positive; the sentence names the first element.
    """
    _, reference = element.at_rule
    determinant, inverse = determinant_and_inverse(tangents(mesh.nodes[block], reference))
    require_positive(mesh, element, start, determinant)
    return np.matmul(reference, inverse), determinant * element.rule.weights


def require_positive(mesh: Mesh, element: Element, start: int, determinant: Array) -> None:
    """Refuse elements that are inside out or too distorted."""
    bad = np.flatnonzero(~(determinant.min(axis=1) > 0.0))
    if not len(bad):
        return
    inverted = bool((determinant[bad[0]] < 0.0).all())
    cause = "is inside out (node order reversed)" if inverted else "is too distorted or flat"
    label = mesh.element_label(element.name, start + int(bad[0]))
    raise InputError(
        f"{element.name} element {label} {cause}: its Jacobian determinant falls to {determinant[bad[0]].min():.3g}; "
        f"{'reorder its nodes' if inverted else 'repair the mesh'} ({len(bad)} such elements in this group)"
    )


def face_geometry(mesh: Mesh, surface: Surface) -> Iterator[tuple[IntArray, Array, Array, Array]]:
    """For each face type: nodes (m, n), shape values (q, n), area weights (m, q), outward unit normals (m, q, 3)."""
    for kind, faces in surface.faces.items():
        if len(faces):
            element = FACES[kind]
            values, gradients = element.at_rule
            across = tangents(mesh.nodes[faces], gradients)
            normal = _cross(across[..., 0], across[..., 1])
            size = np.linalg.norm(normal, axis=-1)
            yield faces, values, size * element.rule.weights, normal / size[..., None]


def volume(mesh: Mesh) -> float:
    """Volume of the mesh."""
    total = 0.0
    for element, block in mesh.items():
        _, gradients = element.at_rule
        determinant, _ = determinant_and_inverse(tangents(mesh.nodes[block], gradients))
        total += float((determinant * element.rule.weights).sum())
    return total


def quality(mesh: Mesh) -> dict[str, Array]:
    """Scaled Jacobian of each element, by type: smallest over largest determinant at corners and quadrature points.

    1 is a parallelepiped, 0 or less is unusable. Pyramids are measured at quadrature points alone.
    """
    result = {}
    for element, block in mesh.items():
        gradients = element.at_rule[1]
        if not element.basis.rational:
            gradients = np.concatenate([gradients, element.at_nodes[1][: element.n_corners]])
        determinant, _ = determinant_and_inverse(tangents(mesh.nodes[block], gradients))
        result[element.name] = determinant.min(axis=1) / np.abs(determinant).max(axis=1)
    return result
