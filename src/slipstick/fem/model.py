"""A constrained elastic model: sparse matrices of the free degrees of freedom and their names."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, issparse

from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.assembly import SolidMatrices, assemble
from slipstick.fem.materials import Materials
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import linear_warnings
from slipstick.typing import IntArray, Sparse


@dataclass(frozen=True, kw_only=True)
class ElasticModel:
    """Stiffness and mass without the constrained degrees of freedom.

    Attributes
    ----------
    mesh
        The mesh.
    K, M
        Sparse symmetric (n_free, n_free).
    free
        Index (n_free,) of each kept degree of freedom in the node-major list ``3 node + axis``; -1 for rotations of
        reference nodes, which are in no element.
    basis
        Motion of all nodes from that of the free degrees of freedom, sparse (3 n_nodes, n_free); None where each is
        one of the list.
    conduction
        Conduction matrix of all nodes, (n_nodes, n_nodes); None where no conductivity is known.
    """

    mesh: Mesh
    K: csr_array
    M: csr_array
    free: IntArray
    conduction: csr_array | None
    basis: csr_array | None = None

    @cached_property
    def dofs(self) -> tuple[str, ...]:
        """Names "n<label><axis>", as in "n123y", with the node labels of the mesh."""
        labels = self.mesh.labels[self.free // 3].tolist()
        return tuple(f"n{label}{'xyz'[axis]}" for label, axis in zip(labels, (self.free % 3).tolist(), strict=True))

    @cached_property
    def _position(self) -> IntArray:
        position = np.full(3 * self.mesh.n_nodes, -1, dtype=np.int64)
        position[self.free[self.free >= 0]] = np.flatnonzero(self.free >= 0)
        return position

    def restrict(self, full: Sparse) -> csr_array:
        """Forces on the free degrees of freedom by those on all (3 n_nodes,), or columns of them, dense or sparse."""
        if self.basis is not None:
            return (self.basis.T @ full).tocsr() if issparse(full) else self.basis.T @ full
        return full.tocsr()[self.free] if issparse(full) else full[self.free]

    def rows_of(self, nodes: IntArray) -> csr_array:
        """Sparse (n_free, 3 n): the columns take x, y, z of each node out of a motion; zero where it is held."""
        if self.basis is not None:
            return csr_array(self.basis[(3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()].T)
        at = self._position[(3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()]
        free = np.flatnonzero(at >= 0)
        return csr_array((np.ones(len(free)), (at[free], free)), shape=(len(self.free), at.size))

    def indices(self, nodes: IntArray) -> IntArray:
        """Positions (n, 3) of the x, y, z degrees of freedom of nodes among the free ones.

        Raises
        ------
        InputError
            If one of them is constrained.
        """
        position = self._position[3 * np.asarray(nodes)[:, None] + np.arange(3)]
        if position.min() < 0:
            label = self.mesh.labels[np.asarray(nodes)[(position < 0).any(axis=1)][0]]
            raise InputError(f"node {label} is fixed; it can carry no contact, load or output")
        return position


def elastic_model(
    mesh: Mesh, materials: Materials, fixed: str | Sequence[str] | IntArray, matrices: SolidMatrices | None = None
) -> ElasticModel:
    """Assemble a mesh and take out the fixed nodes: a node set or surface by name, several, or node indices.

    Linear tetrahedra are far too stiff: SlipstickWarning.

    Raises
    ------
    InputError
        If a set is unknown, empty or holds every node, or the material has no density.
    """
    nodes = _fixed_nodes(mesh, fixed)
    for sentence in linear_warnings(mesh, "mesh", ("tet4",)):
        warnings.warn(sentence, SlipstickWarning, stacklevel=2)
    whole = matrices or assemble(mesh, materials)
    kept = np.zeros(mesh.n_nodes, dtype=bool)
    kept[mesh.used_nodes] = True
    kept[nodes] = False
    free = np.flatnonzero(np.repeat(kept, 3))
    if not len(free):
        raise InputError("every node is fixed; fix fewer")
    M = _principal(whole.mass, free)
    if not M.diagonal().min() > 0.0:
        raise InputError("the mass matrix is zero somewhere; give every material a density > 0")
    return ElasticModel(mesh=mesh, K=_principal(whole.stiffness, free), M=M, free=free, conduction=whole.conduction)


def _principal(A: csr_array, kept: IntArray) -> csr_array:
    """Rows and columns that are kept; one range of them is cut out much faster."""
    if kept[-1] - kept[0] + 1 == len(kept):
        part = slice(int(kept[0]), int(kept[-1]) + 1)
        return A[part, part]
    return A[kept][:, kept]


def _fixed_nodes(mesh: Mesh, fixed: str | Sequence[str] | IntArray) -> IntArray:
    if isinstance(fixed, str):
        fixed = [fixed]
    if not isinstance(fixed, np.ndarray):
        fixed = np.concatenate([mesh.node_set(name) for name in fixed]) if len(fixed) else np.empty(0, dtype=np.int64)
    if not len(fixed):
        raise InputError("no node is fixed; the structure would float: name a node set or surface to fix")
    return np.unique(fixed)
