"""Degrees of freedom of an imported model in the mesh that came with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import InputError
from slipstick.fem.mesh import Mesh
from slipstick.typing import IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from slipstick.fem.imported import ImportedModel


def mesh_of(imported: ImportedModel, what: str) -> Mesh:
    """The mesh, which ``what`` needs; InputError where there is none."""
    if imported.mesh is None:
        raise InputError(f"{imported.source}: {what} need the mesh; import it too, or name contact nodes")
    return imported.mesh


def rows_in_mesh(imported: ImportedModel, mesh: Mesh, nodes: IntArray, components: IntArray, what: str) -> IntArray:
    """Index of each degree of freedom in the node-major list of the mesh; -1 for rotations of nodes in no element."""
    order = np.argsort(mesh.labels)
    place = order[np.searchsorted(mesh.labels, nodes, sorter=order).clip(max=len(order) - 1)]
    strange = mesh.labels[place] != nodes
    turns = components > 2
    if np.any(turns & ~strange & np.isin(place, mesh.used_nodes)) or np.any(turns & strange):
        raise InputError(f"{imported.source}: {what} need solid elements; the model has rotations")
    if np.any(strange):
        raise InputError(
            f"{imported.source}: node {nodes[strange][0]} of the matrices is not in the mesh; give the mesh they came "
            "from"
        )
    return np.where(turns, -1, 3 * place + components)


def motion_in_mesh(imported: ImportedModel, mesh: Mesh, free: IntArray, what: str) -> csr_array | None:
    """Motion of all nodes, where some depend on others or free degrees of freedom are rotations."""
    from scipy.sparse import csr_array, vstack

    if imported.dependence is None and np.all(free >= 0):
        return None
    own = np.flatnonzero(free >= 0)
    parts = [csr_array((np.ones(len(own)), (range(len(own)), own)), shape=(len(own), len(free)))]
    rows = [free[own]]
    if imported.dependence is not None:
        among = rows_in_mesh(imported, mesh, imported.dependent[:, 0], imported.dependent[:, 1], what)
        parts.append(imported.dependence[among >= 0])
        rows.append(among[among >= 0])
    every = np.concatenate(rows)
    moved = csr_array((np.ones(len(every)), (every, range(len(every)))), shape=(3 * mesh.n_nodes, len(every)))
    return csr_array(moved @ vstack(parts))
