"""A beam in pure bending."""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import spsolve

from slipstick.fem.assembly import assemble
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh


def bending(mesh: Mesh) -> float:
    """Energy of a beam along x whose ends turn by a unit each, over that of beam theory; nu = 0.3."""
    x, y, z = (mesh.nodes - [0.0, *(mesh.nodes.max(axis=0)[1:] / 2.0)]).T
    long, high = np.ptp(x), np.ptp(z)
    left, right = np.isclose(x, 0.0), np.isclose(x, long)
    u = np.zeros((mesh.n_nodes, 3))
    u[:, 0] = np.where(left, -z, np.where(right, z, 0.0))
    held = np.zeros((mesh.n_nodes, 3), dtype=bool)
    held[left | right, 0] = True
    for end in (left, right):
        held[np.flatnonzero(end)[np.argmin((y + z)[end])], 1:] = True
    held[np.flatnonzero(left)[np.argmax((y - z)[left])], 2] = True
    K = assemble(mesh, Material(young=1.0, poisson=0.3, density=1.0)).stiffness
    free = ~held.ravel()
    flat = u.ravel()
    flat[free] = spsolve(K[free][:, free].tocsc(), -(K[free][:, ~free] @ flat[~free]))
    inertia = high**4 / 12.0
    return float(flat @ K @ flat) / 2.0 / (0.5 * inertia * (2.0 / long) ** 2 * long)
