"""The motion of a body's whole surface along a branch, from the forces on its dofs: how it looks while it vibrates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.batches import Batch, Port
from slipstick.errors import InputError
from slipstick.results.truncation import moved
from slipstick.structure.skin import Recovered, Skin
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.branch import Branch
    from slipstick.results.table import ResultTable

LEFT_OUT = 1e-4
"""What is left out of the motion of the skin, relative to the largest along the branch."""


@dataclass(frozen=True, kw_only=True)
class Deflection:
    """Motion of a skin at n points of a branch: ``fields @ coefficients``.

    ``fields`` (3 n_nodes, k) are orthonormal shapes, the largest first; ``coefficients`` (n, k, L) what each of them
    does, length.
    """

    skin: Skin
    fields: Array
    coefficients: Array

    def at(self, point: int) -> Array:
        """Displacement coefficients of all nodes at a point, (n_nodes, 3, L)."""
        fields: Array = (self.fields @ self.coefficients[point]).reshape(-1, 3, self.coefficients.shape[2])
        return fields


def deflection_of(branch: Branch, *, small: float = LEFT_OUT) -> Deflection:
    """The motion of the surface at every point of a branch; shapes that add less than ``small`` are left out.

    Raises
    ------
    InputError
        Where the problem is not known, or its structure has no skin.
    """
    if branch.problem is None:
        raise InputError(f"the problem of this branch is not known: {branch.without}")
    skin = getattr(branch.problem.structure, "skin", None)
    if skin is None:
        raise InputError("the structure of this branch has no surface to be seen; a model with a mesh has one")
    basis = skin.basis
    motion = np.concatenate([
        recovered_motion(balance, skin.along(basis, balance.problem.structure), data)
        for balance, data in parts_of(branch, range(len(branch)))
    ])  # fmt: skip
    n, k, L = motion.shape
    shapes, sizes, _ = np.linalg.svd(motion.transpose(1, 0, 2).reshape(k, n * L), full_matrices=False)
    kept = max(1, int(np.sum(sizes > small * sizes[0])) if sizes.size else 1)
    kept_shapes = shapes[:, :kept]
    return Deflection(skin=skin, fields=basis @ kept_shapes, coefficients=kept_shapes.T @ motion)


_ALIKE = 0.3
"""What the motion of the node where a contact lies leaves of the square of its own, at most: contacts are patches."""
_NEAR = 0.75
"""Nodes within this share of the distance between contacts show what is at a contact."""
_ALONE = 0.05
"""Of a single contact: within this share of the size of the body."""


def contact_nodes(problem: Problem) -> IntArray:
    """Node of the skin at which each contact lies (n_elements,); -1 where none moves as the contact does.

    Problems know directions of contacts, no positions: the node is the one of whose motion in all modes, each over its
    frequency, that of the contact is a projection, as nearly as any.
    """
    balance = Balance(problem)
    of_nodes, of_dofs = _over_frequencies(problem.structure)
    square = np.linalg.pinv(of_nodes @ of_nodes.swapaxes(1, 2), rcond=1e-9)
    nodes = np.full(len(problem.elements), -1)
    for batch in balance.batches:
        for element in range(batch.count):
            rows = np.concatenate([_rows(balance, batch, port, element) for port in batch.ports])
            motion = balance.directions[:, rows].T @ of_dofs
            across = np.einsum("kr,ndr->nkd", motion, of_nodes)
            whole = float(np.sum(motion**2))
            left = whole - np.einsum("nkd,nde,nke->n", across, square, across)
            best = int(np.argmin(left))
            if whole > 0.0 and left[best] <= _ALIKE * whole:
                nodes[np.arange(len(nodes))[batch.elements][element]] = best
    return nodes


def nearest_contacts(skin: Skin, nodes: IntArray) -> IntArray:
    """Contact that each node of the skin shows (n_nodes,), -1 for none, of contacts at ``nodes`` (n_elements,)."""
    from scipy.spatial import KDTree

    out, placed = np.full(len(skin.nodes), -1), np.flatnonzero(nodes >= 0)
    if not placed.size:
        return out
    at = skin.nodes[nodes[placed]]
    tree = KDTree(at)
    reach = _ALONE * float(np.linalg.norm(np.ptp(skin.nodes, axis=0)))
    if len(np.unique(at, axis=0)) > 1:
        apart = KDTree(np.unique(at, axis=0)).query(np.unique(at, axis=0), k=2)[0][:, 1]
        reach = _NEAR * float(np.median(apart))
    distance, place = tree.query(skin.nodes)
    near = distance <= reach
    out[near] = placed[place[near]]
    return out


def outward(problem: Problem, nodes: IntArray) -> tuple[Array, Array]:
    """Normals (n_triangles, 3) of a skin, twice as long as the areas, and their sum (3,) at the ``nodes`` of contacts.

    A node on an edge belongs to several faces: where a contact has a normal port, those that look along it count.
    The sum is zero where faces look in all directions.
    """
    structure: Any = problem.structure
    skin = structure.skin
    corners = skin.nodes[skin.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.zeros((len(skin.nodes), 3))
    along[nodes[nodes >= 0]] = _normal_directions(problem, nodes)[nodes >= 0]
    triangle, corner = np.nonzero(np.isin(skin.triangles, nodes[nodes >= 0]))
    direction, parts = along[skin.triangles[triangle, corner]], normals[triangle]
    across = np.abs(np.sum(parts * direction, axis=1)) < 0.7 * np.linalg.norm(parts, axis=1)
    parts[across & direction.any(axis=1)] = 0.0
    mean = parts.sum(axis=0)
    return normals, np.where(np.linalg.norm(mean) > 1e-6 * np.linalg.norm(parts, axis=1).sum(), mean, 0.0)


def _normal_directions(problem: Problem, nodes: IntArray) -> Array:
    """Unit directions (n_elements, 3) in which the nodes of contacts move at their normal ports; zeros without one."""
    balance, out = Balance(problem), np.zeros((len(nodes), 3))
    of_nodes, of_dofs = _over_frequencies(problem.structure)
    for batch in balance.batches:
        if "normal" not in batch.law.force_names:
            continue
        port = batch.ports[batch.law.force_names.index("normal")]
        for element, at in enumerate(np.arange(len(nodes))[batch.elements]):
            rows = _rows(balance, batch, port, element)
            if nodes[at] >= 0 and rows.size:
                motion = (balance.directions[:, rows].T @ of_dofs)[0]
                direction = np.linalg.lstsq(of_nodes[nodes[at]].T, motion, rcond=1e-9)[0]
                out[at] = direction / (float(np.linalg.norm(direction)) or 1.0)
    return out


def _rows(balance: Balance, batch: Batch, port: Port, element: int) -> IntArray:
    """Row of one element of a batch among all ports, none where it has not this port."""
    return np.arange(balance.n_ports)[port.rows][np.arange(batch.count)[port.members] == element]


def _over_frequencies(structure: Any) -> tuple[Array, Array]:
    """All modes, each over its frequency: at the nodes of the skin (n_nodes, 3, n_modes) and the dofs."""
    omega = np.maximum(structure.omega, 1e-300)
    of_nodes = (structure.skin.modes / omega).astype(float).reshape(len(structure.skin.nodes), 3, -1)
    return of_nodes, structure.mode_shapes / omega


def parts_of(branch: Branch, points: Sequence[int]) -> Iterator[tuple[Balance, ResultTable]]:
    """Points of one problem together: all of them, or one by one where a parameter was followed."""
    problem: Problem | None = branch.problem
    assert problem is not None
    if not branch.table.attrs.get("parameter"):
        yield Balance(problem), branch.table.at(points)
        return
    for point in points:
        yield Balance(branch.problem_at(point)), branch.table.at([point])


def recovered_motion(balance: Balance, recovered: Recovered, data: ResultTable) -> Array:
    """Coefficients (n, n_rows, L) of rows that are no dofs, under the forces of the points and the loads."""
    problem = balance.problem
    receptance = problem.load_columns.receptance(recovered, np.zeros((0, 0)), balance.directions)  # type: ignore[arg-type]
    omega = data["omega"].to_numpy()
    P = np.broadcast_to(-problem.inputs.P, (len(omega), *problem.inputs.P.shape))
    G = np.concatenate([_forces(balance, data), P], axis=1)
    out = moved(receptance, balance.orders, G[:, :, 1:], omega, [{}] * len(omega))
    out[:, :, 0] = -(G[:, :, 0] @ receptance.static.T)
    return out


def _forces(balance: Balance, data: ResultTable) -> Array:
    """Forces at the ports (n, n_ports, L)."""
    force = np.zeros((data.sizes["point"], balance.n_ports, balance.L))
    for batch in balance.batches:
        for name, port in zip(batch.law.force_names, batch.ports, strict=True):
            force[:, port.rows] = data[f"{name}_force"].to_numpy()[:, batch.elements][:, port.members]
    return force
