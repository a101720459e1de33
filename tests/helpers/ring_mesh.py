"""The whole ring of a sector mesh: rotated, copied, merged, with nothing of the code for sectors."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from slipstick.fem.mesh import Mesh
from slipstick.fem.model import FiniteElementModel, elastic_model
from slipstick.models.blade import BLADE_STEEL
from slipstick.typing import Array, IntArray


def ring_of(mesh: Mesh, sectors: int, merged: IntArray) -> tuple[Mesh, IntArray]:
    """The ring of a sector about z, and the number of each node (indices) in each sector, (sectors, n_nodes).

    Nodes at the same place are one where both are copies of ``merged`` ones.
    """
    places = np.concatenate([turn(s, sectors).apply(mesh.nodes) for s in range(sectors)])
    may = np.zeros(mesh.n_nodes, dtype=bool)
    may[merged] = True
    may = np.tile(may, sectors)
    first = np.arange(len(places))
    at = np.flatnonzero(may)
    for a, b in sorted(cKDTree(places[at]).query_pairs(1e-9)):
        first[at[b]] = min(first[at[a]], first[at[b]])
    kept, number = np.unique(first, return_inverse=True)
    number = number.reshape(sectors, mesh.n_nodes)
    blocks = {kind: np.concatenate([number[s][block] for s in range(sectors)]) for kind, block in mesh.blocks.items()}
    return Mesh(nodes=places[kept], blocks=blocks), number


def turn(s: int, sectors: int) -> Rotation:
    """From sector 0 to sector s."""
    return Rotation.from_rotvec([0.0, 0.0, 2.0 * np.pi * s / sectors])


def ring_model(mesh: Mesh, sectors: int, merged: IntArray, fixed: IntArray) -> tuple[FiniteElementModel, IntArray]:
    """Matrices of the ring with copies of some nodes fixed; and the numbers of nodes."""
    ring, number = ring_of(mesh, sectors, merged)
    return elastic_model(ring, BLADE_STEEL, np.unique(number[:, fixed])), number


def in_sector(ring: FiniteElementModel, number: IntArray, columns: Array, s: int) -> csr_array:
    """Directions (n_free, n) of the ring for columns (3 n_nodes, n) on the nodes of a sector, in its coordinates."""
    n = number.shape[1]
    turned = turn(s, len(number)).as_matrix()
    moved = np.einsum("ab,nbc->nac", turned, np.asarray(columns).reshape(n, 3, -1)).reshape(3 * n, -1)
    rows = (3 * number[s][:, None] + np.arange(3)).ravel()
    place = csr_array((np.ones(3 * n), (rows, np.arange(3 * n))), shape=(3 * ring.mesh.n_nodes, 3 * n))
    return ring.restrict(csr_array(place @ csr_array(moved)))
