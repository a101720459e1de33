"""Is a model held? Rows without stiffness, and parts which can move as rigid bodies."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from slipstick.fem.equations import COMPONENTS
from slipstick.fem.model import ImportedModel
from slipstick.typing import Array, IntArray, Sparse

RIGID = 1e-10
"""A motion whose stiffness is below this fraction of the largest diagonal entry of K is taken for a rigid body's."""


def name_rows(nodes: IntArray, components: IntArray, limit: int = 8) -> str:
    """Names of degrees of freedom in one short text.

    >>> name_rows(np.array([4, 4, 9]), np.array([0, 2, 5]))
    'n4x, n4z, n9rz'
    """
    pairs = list(zip(nodes.tolist(), components.tolist(), strict=True))
    names = ", ".join(f"n{node}{COMPONENTS[component]}" for node, component in pairs[:limit])
    return names + (f" and {len(pairs) - limit} more" if len(pairs) > limit else "")


def empty_rows(matrix: csr_array) -> NDArray[np.bool_]:
    """Rows which hold nothing but zeros, (n,)."""
    return np.bincount(matrix.nonzero()[0], minlength=matrix.shape[0]) == 0


def floating_parts(model: ImportedModel) -> Iterator[tuple[IntArray, int]]:
    """Unconnected parts that are not held: node labels and the number of rigid body motions of each.

    A part is a set of rows connected by K. Rotations need coordinates: without them only translations are tried.
    """
    from scipy.sparse.csgraph import connected_components

    count, part = connected_components(model.K, directed=False)
    order = np.argsort(part, kind="stable")
    for rows in np.split(order, np.searchsorted(part[order], np.arange(1, count))):
        free = _rigid_motions(model, rows)
        if free:
            yield np.unique(model.dof_nodes[rows]), free


def _rigid_motions(model: ImportedModel, rows: IntArray) -> int:
    return _without_stiffness(model.K[rows][:, rows], _motions(model, rows))


def _without_stiffness(block: Sparse, motions: Array, small: float = RIGID) -> int:
    """How many independent ones of these motions, columns, meet no stiffness."""
    basis, values, _ = np.linalg.svd(motions, full_matrices=False)
    basis = basis[:, values > 1e-8 * max(values.max(initial=0.0), 1e-300)]
    if not basis.shape[1]:
        return 0
    largest = np.abs(block.diagonal()).max(initial=0.0)
    return int(np.sum(np.abs(np.linalg.eigvalsh(basis.T @ (block @ basis))) <= small * largest))


def _motions(model: ImportedModel, rows: IntArray) -> Array:
    """Rigid translations and (with coordinates) rotations as columns on these rows."""
    nodes, components = model.dof_nodes[rows], model.dof_components[rows]
    columns = [(components == axis).astype(float) for axis in range(3)]
    if np.isin(nodes, model.node_ids).all():
        arm = model.positions(nodes)
        arm = (arm - arm.mean(axis=0)) / max(np.ptp(arm, axis=0).max(), 1e-300)
        size = max(np.ptp(model.positions(nodes), axis=0).max(), 1e-300)
        for axis, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
            turn = np.where(components == b, arm[:, a], 0.0) - np.where(components == a, arm[:, b], 0.0)
            columns.append(turn + (components == 3 + axis) / size)
    return np.stack(columns, axis=1)


_DENSE = 2000
"""Rows up to which all motions without stiffness are counted."""
_FREE = 1e-9
"""A motion is free where its stiffness, by rows scaled to 1, is below this."""


def misplaced_parts(model: ImportedModel) -> Iterator[tuple[IntArray, int, int]]:
    """Unconnected parts that can move in more ways than as rigid bodies: node labels, how many, how many of them rigid.

    Then positions, directions of displacements or the order of rows do not fit the matrices. Only parts whose points
    have positions are tried, up to 2000 rows.
    """
    from scipy.sparse.csgraph import connected_components

    count, part = connected_components(model.K, directed=False)
    placed = np.isin(model.dof_nodes, model.node_ids)
    for rows in (np.flatnonzero(part == i) for i in range(count if model.n_dofs <= _DENSE else 0)):
        if not placed[rows].all():
            continue
        size = np.sqrt(model.K.diagonal()[rows].clip(min=1e-300))
        block = (diags_array(1.0 / size) @ model.K[rows][:, rows] @ diags_array(1.0 / size)).toarray()
        free = int(np.sum(np.abs(np.linalg.eigvalsh(block)) <= _FREE))
        rigid = _without_stiffness(block, _motions(model, rows) * size[:, None], _FREE)
        if free > rigid:
            yield np.unique(model.dof_nodes[rows]), free, rigid
