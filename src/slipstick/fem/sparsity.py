"""The pattern of nodal couplings: found once, filled by any matrix of the mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.fem.mesh import Mesh
from slipstick.typing import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """Compressed rows of the node-to-node couplings.

    ``indptr`` (n_nodes + 1,), ``indices`` (n_couplings,), and for each element type ``slots`` (n_elements, n, n): where
    in ``indices`` the coupling of local node i with local node j lies.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    slots: Mapping[str, NDArray[np.int32]]

    @property
    def n_couplings(self) -> int:
        """Number of coupled (ordered) node pairs."""
        return len(self.indices)

    def scalar_matrix(self, values: Array) -> csr_array:
        """Matrix with one unknown a node from values (n_couplings,)."""
        from scipy.sparse import csr_array

        n = len(self.indptr) - 1
        return csr_array((values, self.indices.copy(), self.indptr.copy()), shape=(n, n))

    def vector_matrix(self, blocks: Array) -> csr_array:
        """Matrix with three unknowns a node (node-major, x y z) from blocks (n_couplings, 3, 3)."""
        from scipy.sparse import bsr_array

        n = len(self.indptr) - 1
        return bsr_array((blocks, self.indices, self.indptr), shape=(3 * n, 3 * n)).tocsr()

    def repeated_matrix(self, values: Array) -> csr_array:
        """Matrix with three unknowns a node, the same scalar coupling in x, y and z and none across."""
        from scipy.sparse import csr_array

        n, widths = len(self.indptr) - 1, np.diff(self.indptr)
        order = np.repeat(np.arange(n), widths)
        place = 3 * self.indptr[order] + (np.arange(self.n_couplings) - self.indptr[order])
        indices, data = np.empty(3 * self.n_couplings, dtype=np.int32), np.empty(3 * self.n_couplings)
        for axis in range(3):
            where = place + axis * widths[order]
            indices[where], data[where] = 3 * self.indices + axis, values
        indptr = np.concatenate([[0], np.cumsum(np.repeat(widths, 3))]).astype(np.int32)
        return csr_array((data, indices, indptr), shape=(3 * n, 3 * n))


def pattern_of(mesh: Mesh) -> Pattern:
    """The couplings of a mesh: nodes are coupled when they share an element."""
    n = np.int64(mesh.n_nodes)
    keys = [(block[:, :, None] * n + block[:, None, :]).ravel() for _, block in mesh.items()]
    unique, inverse = np.unique(np.concatenate(keys), return_inverse=True)
    slots: dict[str, NDArray[np.int32]] = {}
    start = 0
    for element, block in mesh.items():
        size = len(block) * element.n_nodes**2
        slots[element.name] = (
            inverse[start : start + size].astype(np.int32).reshape(len(block), element.n_nodes, element.n_nodes)
        )
        start += size
    counts = np.bincount(unique // n, minlength=mesh.n_nodes)
    indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return Pattern(indptr=indptr, indices=(unique % n).astype(np.int32), slots=slots)
