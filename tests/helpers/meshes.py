"""How good a mesh is."""

from __future__ import annotations

import numpy as np

from slipstick.fem.geometry import determinant_and_inverse, tangents
from slipstick.fem.mesh import Mesh
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
