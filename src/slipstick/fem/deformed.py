"""Elastic solids in a deformed state: what changes of their stiffness and of their nodal forces (total Lagrangian).

With F = 1 + du/dx, the strain is ``E = (F'F - 1) / 2`` and the stress ``S = lambda tr(E) 1 + 2 mu E``. Nodal forces are
``int F S g_i`` with g_i the gradients of the shape functions, and the stiffness is their derivative:

    K[a i, b j] = int lambda f_ia f_jb + mu ((F F')_ab g_i . g_j + f_ja f_ib) + delta_ab g_i . S . g_j,    f = F g.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slipstick.fem.assembly import Pattern, add_values, chunks
from slipstick.fem.elements import Element
from slipstick.fem.geometry import solid_gradients
from slipstick.fem.materials import Materials, element_values
from slipstick.fem.mesh import Mesh
from slipstick.typing import Array

Blocks = dict[tuple[int, int], Array]


@dataclass(frozen=True, kw_only=True)
class Deformed:
    """What a displacement changes.

    Attributes
    ----------
    stiffness
        Beyond that without displacement, of every coupling, (n_couplings, 3, 3).
    force
        Nodal forces beyond ``K0 u``, (n_nodes, 3).
    strain
        The largest strain, without sign.
    """

    stiffness: Array
    force: Array
    strain: float


def deformed(mesh: Mesh, materials: Materials, pattern: Pattern, displacement: Array) -> Deformed:
    """What a displacement (n_nodes, 3) changes of a mesh."""
    lame = element_values(mesh, materials, lambda m: m.lame)
    shear = element_values(mesh, materials, lambda m: m.shear_modulus)
    blocks, force, largest = np.zeros((3, 3, pattern.n_couplings)), np.zeros((mesh.n_nodes, 3)), 0.0
    for element, part in chunks(mesh, 36):
        lam, mu = lame[element.name][part, None], shear[element.name][part, None]
        slots = pattern.slots[element.name][part].ravel()
        changes, forces, strain = _elements(mesh, element, part, displacement, lam, mu)
        for (a, b), values in changes.items():
            add_values(blocks[a, b], slots, values)
            if a != b:
                add_values(blocks[b, a], slots, values.transpose(0, 2, 1))
        nodes = mesh.blocks[element.name][part].ravel()
        for axis in range(3):
            force[:, axis] += np.bincount(nodes, forces[..., axis].ravel(), minlength=mesh.n_nodes)
        largest = max(largest, strain)
    return Deformed(stiffness=np.ascontiguousarray(blocks.transpose(2, 0, 1)), force=force, strain=largest)


def _elements(
    mesh: Mesh, element: Element, part: slice, displacement: Array, lam: Array, mu: Array
) -> tuple[Blocks, Array, float]:
    """Changes of the stiffness (n_elements, n, n) for axes a <= b, of the forces (n_elements, n, 3), largest strain."""
    nodes = mesh.blocks[element.name][part]
    gradients, weights = solid_gradients(mesh, element, part.start, nodes)
    slope = np.matmul(displacement[nodes].transpose(0, 2, 1)[:, None], gradients)  # du_a/dx_b, (e, q, 3, 3)
    linear = (slope + _transposed(slope)) / 2.0
    strain = linear + np.matmul(_transposed(slope), slope) / 2.0
    F, lam, mu = np.eye(3) + slope, weights * lam, weights * mu
    stress = _stress(strain, lam, mu)
    excess = np.matmul(F, stress) - _stress(linear, lam, mu)
    forces = np.matmul(gradients, _transposed(excess)).sum(axis=1)
    moved, still = (_elastic(gradients, deformation, lam, mu) for deformation in (F, np.eye(3) + 0.0 * slope))
    tension = _tension(gradients, stress)
    changes = {(a, b): moved[a, b] - still[a, b] + (tension if a == b else 0.0) for a, b in moved}
    return changes, forces, float(np.abs(strain).max())


def _transposed(matrices: Array) -> Array:
    return matrices.transpose(0, 1, 3, 2)


def _stress(strain: Array, lam: Array, mu: Array) -> Array:
    volume = np.trace(strain, axis1=2, axis2=3)
    return 2.0 * mu[..., None, None] * strain + (lam * volume)[..., None, None] * np.eye(3)


def _tension(gradients: Array, stress: Array) -> Array:
    """``g_i . S . g_j`` summed over the points; the stress holds their weights."""
    pulled = np.matmul(gradients, stress)
    total = sum(np.matmul(pulled[..., c].transpose(0, 2, 1), gradients[..., c]) for c in range(3))
    return (total + total.transpose(0, 2, 1)) / 2.0


def _elastic(gradients: Array, F: Array, lam: Array, mu: Array) -> Blocks:
    """Blocks of the elastic stiffness at a deformation F, for axes a <= b; moduli hold the weights of the points."""
    g, f = (values.transpose(3, 0, 2, 1) for values in (gradients, np.matmul(gradients, _transposed(F))))
    squared = np.matmul(F, _transposed(F))
    blocks = {}
    for a in range(3):
        for b in range(a, 3):
            scale = (mu * squared[:, :, a, b])[:, None, :]
            values = sum(np.matmul(g[c] * scale, g[c].transpose(0, 2, 1)) for c in range(3))
            values = values + np.matmul(f[a] * lam[:, None, :], f[b].transpose(0, 2, 1))
            values += np.matmul(f[b] * mu[:, None, :], f[a].transpose(0, 2, 1))
            blocks[a, b] = (values + values.transpose(0, 2, 1)) / 2.0 if a == b else values
    return blocks
