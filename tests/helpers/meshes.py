"""How good a mesh is, and where its surfaces look."""

from __future__ import annotations

import numpy as np

from slipstick.fem.geometry import determinant_and_inverse, face_geometry, tangents
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import Array


def quality(mesh: Mesh) -> dict[str, Array]:
    """Scaled Jacobian of each element, by type: smallest over largest determinant at corners and quadrature points.

    1 is a parallelepiped, 0 or less is unusable. Pyramids are measured at quadrature points alone.
    """
    result = {}
    for element, block in mesh.items():
        gradients = element.at_rule[1]
        if not element.basis.rational:
            gradients = np.concatenate([gradients, element.basis(element.basis.nodes)[1][: element.n_corners]])
        determinant, _ = determinant_and_inverse(tangents(mesh.nodes[block], gradients))
        result[element.name] = determinant.min(axis=1) / np.abs(determinant).max(axis=1)
    return result


def nodal_normals(mesh: Mesh, surface: Surface) -> Array:
    """Outward unit normals (n_nodes, 3), averaged over the faces at each node by area; zero off the surface."""
    normals = np.zeros((mesh.n_nodes, 3))
    for faces, values, weights, unit in face_geometry(mesh, surface):
        np.add.at(normals, faces, np.einsum("mq,mqa,qn->mna", weights, unit, values**2))
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(size > 0.0, size, 1.0)
