"""The motion of a body's whole surface along a branch, from the forces on its dofs: how it looks while it vibrates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from slipstick.balance.balance import Balance
from slipstick.errors import InputError
from slipstick.results.truncation import moved
from slipstick.structure.skin import Recovered, Skin
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions
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


def deflection_of(
    branch: Solutions, *, small: float = LEFT_OUT, points: Sequence[int] | None = None, coarse: Coarse | None = None
) -> Deflection:
    """The motion of the surface at points of a branch, by default all; of a ``coarse`` one where that is given.

    Shapes that add less than ``small`` are left out.

    Raises
    ------
    InputError
        If the branch has no problem, or its structure no surface mesh.
    """
    if branch.problem is None:
        raise InputError(f"the problem of this branch is not known: {branch.without}")
    structure: Any = branch.problem.structure
    if structure.skin is None:
        raise InputError("the structure of this branch has no surface to be seen; a model with a mesh has one")
    points = range(len(branch)) if points is None else points
    skin, known = _seen(structure, coarse), None
    if skin.static is None:
        forces = force_fields(branch, points, _FORCES * small)
        known = structure.left_out(skin.rows, skin.modes, forces)
    basis, parts = skin.basis(None if known is None else known.static), []
    for balance, at in parts_of(branch, points):
        its: Any = balance.problem.structure
        parts.append(recovered_motion(balance, _seen(its, coarse).along(basis, its, known), branch.table, at))
    motion = np.concatenate(parts)
    n, k, L = motion.shape
    shapes, sizes, _ = np.linalg.svd(motion.transpose(1, 0, 2).reshape(k, n * L), full_matrices=False)
    kept = max(1, int(np.sum(sizes > small * sizes[0])) if sizes.size else 1)
    kept_shapes = shapes[:, :kept]
    return Deflection(skin=skin, fields=basis @ kept_shapes, coefficients=kept_shapes.T @ motion)


Coarse = tuple[IntArray, IntArray]
"""Some nodes of a surface (n,), by place, and triangles (t, 3) between them."""


def _seen(structure: Any, coarse: Coarse | None) -> Skin:
    skin: Skin = structure.skin
    return skin if coarse is None else skin.part(*coarse)


_FORCES = 0.1
"""Tolerance for the fields of forces, over that of the motion that they cause."""

_TOGETHER = 4_000_000
"""Entries of the forces of one batch of points, on dofs or at ports: 32 MB."""


def force_fields(branch: Solutions, points: Sequence[int], small: float) -> Array:
    """Orthonormal fields of forces on the dofs (n_dofs, k) that hold those of the points and the loads.

    Fields that add less than ``small`` of the largest force are left out.
    """
    largest, fields = 0.0, np.empty((0, 0))
    step = max(1, _TOGETHER // max(1, len(branch.problem.structure.dofs) * branch.harmonics.size))  # type: ignore[union-attr]
    for first in range(0, len(points), step):
        for balance, at in parts_of(branch, points[first : first + step]):
            vectors = balance.problem.load_columns.vectors
            force = np.concatenate(list(_forces(balance, branch.table, at)), axis=1)
            forces = np.column_stack([vectors, balance.directions @ force]).astype(float)
            sizes = np.linalg.norm(forces, axis=0)
            sizes[: vectors.shape[1]], largest = 0.0, max(largest, float(sizes[vectors.shape[1] :].max(initial=0.0)))
            scale = largest or 1.0
            forces[:, : vectors.shape[1]] *= scale / np.maximum(np.linalg.norm(vectors, axis=0), 1e-300)
            fields = np.zeros((len(forces), 0)) if not fields.size else fields
            for _ in range(2):  # to rounding
                forces -= fields @ (fields.T @ forces)
            new, sizes, _ = np.linalg.svd(forces, full_matrices=False)
            fields = np.hstack([fields, new[:, sizes > max(small, _ROUNDING) * scale]])
    return fields


_ROUNDING = 1e-13
"""Relative size below which a field of forces is rounding."""

_NEAR = 0.75
"""Share of the distance between contacts within which nodes show the values of a contact."""
_ALONE = 0.05
"""Share of the size of the body within which the nodes of a single contact, and the places of one contact, lie."""


def contact_places(problem: Problem) -> Array:
    """Place of each contact (n_elements, 3): the mean of the places of the dofs that its ports move with, else nan.

    A contact between distant dofs has none. Where the structure has no places of dofs, the place is that of the node
    which moves as the contact does.
    """
    structure: Any = problem.structure
    skin: Skin = structure.skin
    if skin.places is None:
        nodes = _alike_nodes(problem)
        return np.where((nodes >= 0)[:, None], skin.nodes[nodes], np.nan)
    balance, reach = Balance(problem), _ALONE * _size(skin)
    share = abs(balance.directions)  # of each dof in each port, (n_dofs, n_ports)
    of_elements = _elements_of_ports(balance)
    used = sparse.csr_array(share) @ of_elements
    total = np.asarray(used.sum(axis=0)).ravel()
    known = np.asarray(np.isfinite(skin.places).all(axis=1))
    places = np.where(known[:, None], skin.places, 0.0)
    mean = (used.T @ places) / np.where(total > 0.0, total, 1.0)[:, None]
    dof, element = used.nonzero()
    apart = np.linalg.norm(places[dof] - mean[element], axis=1) > reach
    unknown = np.unique(element[apart | ~known[dof]])
    mean[unknown], mean[total == 0.0] = np.nan, np.nan
    at = 0
    for pair in problem.contacts:
        if len(pair) > 1 and pair.place_of_motion(1) == 0:
            own = _gathered_places(pair, dict(zip(structure.dofs, skin.places, strict=True)))
            if len(own) == len(pair):
                mean[at : at + len(pair)] = own
        at += len(pair)
    return np.asarray(mean)


def _gathered_places(pair: ContactPair, known: Mapping[str, Array]) -> Array:
    """Places that the dofs of a patch of contacts have, each once: its motion is the mean over its contacts."""
    places = dict.fromkeys(tuple(known[dof].tolist()) for dof in pair.first_direction)
    return np.array([place for place in places if np.all(np.isfinite(place))])


def bolt_places(problem: Problem) -> Array:
    """Middle of each bolt, (n_elements, 3): between what it pulls at, as far as the places of its dofs are known.

    Bolts are contacts without sliding directions and without area, whose elongation has two ends; nan for others.
    """
    structure: Any = problem.structure
    known, out, at = structure.skin.places, np.full((len(problem.elements), 3), np.nan), 0
    for pair in problem.contacts:
        bolted = pair.area is None and pair.is_spring and known is not None
        for k in range(len(pair) if bolted else 0):
            cosines = pair.direction("normal", k) or {}
            ends = [
                [(structure.dofs.index(dof), abs(c)) for dof, c in cosines.items() if sign * c > 0] for sign in (1, -1)
            ]
            if all(ends):
                means = [np.average(known[[d for d, _ in end]], axis=0, weights=[c for _, c in end]) for end in ends]
                out[at + k] = np.mean(means, axis=0)
        at += len(pair)
    return out


def contact_nodes(problem: Problem) -> IntArray:
    """Nearest node of the surface mesh to each contact (n_elements,); -1 where none is close."""
    from scipy.spatial import KDTree

    structure: Any = problem.structure
    skin, places = structure.skin, contact_places(problem)
    nodes, known = np.full(len(places), -1), np.isfinite(places).all(axis=1)
    if known.any():
        distance, nearest = KDTree(skin.nodes).query(places[known])
        nodes[known] = np.where(distance <= _longest_edge(skin), nearest, -1)
    return nodes


def nearest_contacts(skin: Skin, places: Array) -> IntArray:
    """Contact that each node of the skin shows (n_nodes,), -1 for none, of contacts at ``places`` (n_elements, 3)."""
    from scipy.spatial import KDTree

    out, placed = np.full(len(skin.nodes), -1), np.flatnonzero(np.isfinite(places).all(axis=1))
    if not placed.size:
        return out
    at = places[placed]
    tree, different = KDTree(at), np.unique(at, axis=0)
    reach = _ALONE * _size(skin)
    if len(different) > 1:
        reach = _NEAR * float(np.median(KDTree(different).query(different, k=2)[0][:, 1]))
    distance, place = tree.query(skin.nodes)
    from_skin, nearest = KDTree(skin.nodes).query(at)
    near = distance <= reach
    near[nearest[from_skin <= _longest_edge(skin)]] = True  # however coarse the skin is
    out[near] = placed[place[near]]
    return out


def _size(skin: Skin) -> float:
    return float(np.linalg.norm(np.ptp(skin.nodes, axis=0)))


def _longest_edge(skin: Skin) -> float:
    """What lies on the skin is no further from a node of it."""
    corners = skin.nodes[skin.triangles]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(initial=0.0))


def _elements_of_ports(balance: Balance) -> Any:
    """Sparse (n_ports, n_elements), one where a port is of an element."""
    ports, elements = [], []
    for batch in balance.batches:
        numbers = np.arange(len(balance.problem.elements))[batch.elements]
        for port in batch.ports:
            ports.append(np.arange(balance.n_ports)[port.rows])
            elements.append(numbers[port.members])
    at = np.concatenate([*ports, []]).astype(int), np.concatenate([*elements, []]).astype(int)
    return sparse.csr_array((np.ones(len(at[0])), at), shape=(balance.n_ports, len(balance.problem.elements)))


_ALIKE = 0.3
"""What the motion of the node where a contact lies leaves of the square of its own, at most: contacts are patches."""


def _alike_nodes(problem: Problem) -> IntArray:
    """Node of the skin that moves as each contact does (n_elements,); -1 where there is none.

    The node is the one of whose motion in all modes, each over its frequency, that of the contact is a projection, as
    nearly as any.
    """
    balance = Balance(problem)
    of_nodes, of_dofs = _over_frequencies(problem.structure)
    square = np.linalg.pinv(of_nodes @ of_nodes.swapaxes(1, 2), rcond=1e-9)
    nodes = np.full(len(problem.elements), -1)
    motion, at = balance.directions.T @ of_dofs, _elements_of_ports(balance).tocsc()
    for element in range(len(nodes)):
        own = motion[at.indices[at.indptr[element] : at.indptr[element + 1]]]
        across = (of_nodes @ own.T).swapaxes(1, 2)
        whole = float(np.sum(own**2))
        left = whole - ((across @ square) * across).sum(axis=(1, 2))
        best = int(np.argmin(left))
        if whole > 0.0 and left[best] <= _ALIKE * whole:
            nodes[element] = best
    return nodes


def outward(problem: Problem, nodes: IntArray) -> tuple[Array, Array]:
    """Normals (n_triangles, 3) of a surface mesh, as long as twice the areas, and their sum (3,) at contact ``nodes``.

    A node on an edge belongs to several faces: of a contact with a normal port only the faces along it count. The sum
    is zero where normals have all directions.
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
        elements = np.arange(len(nodes))[batch.elements][port.members]
        motion = (balance.directions.T @ of_dofs)[np.arange(balance.n_ports)[port.rows]]
        for at, own in zip(elements, motion, strict=True):
            if nodes[at] >= 0:
                direction = np.linalg.lstsq(of_nodes[nodes[at]].T, own, rcond=1e-9)[0]
                out[at] = direction / (float(np.linalg.norm(direction)) or 1.0)
    return out


def _over_frequencies(structure: Any) -> tuple[Array, Array]:
    """All modes, each over its frequency: at the nodes of the skin (n_nodes, 3, n_modes) and the dofs."""
    omega = np.maximum(structure.omega, 1e-300)
    of_nodes = (structure.skin.modes / omega).astype(float).reshape(len(structure.skin.nodes), 3, -1)
    return of_nodes, structure.mode_shapes / omega


def parts_of(branch: Solutions, points: Sequence[int]) -> Iterator[tuple[Balance, Sequence[int]]]:
    """Points of one problem together: all of them, or one by one where a parameter was followed."""
    problem: Problem | None = branch.problem
    assert problem is not None
    if not branch.table.attrs.get("parameter"):
        yield Balance(problem), points
        return
    for point in points:
        yield Balance(branch.problem_at(point)), [point]


def recovered_motion(balance: Balance, recovered: Recovered, data: ResultTable, points: Sequence[int]) -> Array:
    """Coefficients (n, n_rows, L) of rows that are no dofs, under the forces of the points and the loads."""
    problem = balance.problem
    receptance = problem.load_columns.receptance(recovered, np.zeros((0, 0)), balance.directions)  # type: ignore[arg-type]
    out = np.empty((len(points), receptance.static.shape[0], balance.L))
    step = max(1, _TOGETHER // max(1, receptance.static.shape[1] * balance.L))
    for first in range(0, len(points), step):
        at = slice(first, first + step)
        omega = data["omega"].to_numpy()[np.asarray(points[at], dtype=int)]
        P = np.broadcast_to(-problem.inputs.P, (len(omega), *problem.inputs.P.shape))
        G = np.concatenate([_forces(balance, data, points[at]), P], axis=1)
        out[at] = moved(receptance, balance.orders, G[:, :, 1:], omega, [{}] * len(omega))
        out[at, :, 0] = -(G[:, :, 0] @ receptance.static.T)
    return out


def _forces(balance: Balance, data: ResultTable, points: Sequence[int]) -> Array:
    """Forces at the ports (n, n_ports, L)."""
    at, force = np.asarray(points, dtype=int), np.zeros((len(points), balance.n_ports, balance.L))
    for batch in balance.batches:
        for name, port in zip(batch.law.force_names, batch.ports, strict=True):
            port.add(data[f"{name}_force"].to_numpy()[at][:, batch.elements][:, port.members], force, 1)
    return force
