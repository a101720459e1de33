"""A sector of a structure with cyclic symmetry: its two faces paired, and what a phase between sectors makes of it.

The high face of a sector is the low face of the next one: in coordinates that turn with the sector, with ``R`` the
rotation by ``2 pi / N`` that takes the low face to the high one and the phase ``phi`` (THEORY.md (24.2))::

    u_high = e^{-i phi} R u_low,      q = (T0 + e^{-i phi} T1) p,      K(phi) = K0 + K1 e^{-i phi} + K1' e^{i phi},
    K0 = T0' K T0 + T1' K T1,         K1 = T0' K T1

with q the degrees of freedom of the sector alone and p those without its high face. Faces that are meshed differently
meet as tied surfaces do: with W the shape functions of the coarser face at the nodes of the finer one,
``u_high = e^{-i phi} R W u_low``, or ``u_low = e^{i phi} R' W u_high`` where the low face is the finer one.

A node on the axis is its own neighbour, ``u = e^{-i phi} R u``: it moves along the axis with the phase 0, across it
with the phase of one nodal diameter, and not at all with others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse import csr_array, eye_array

from slipstick.errors import Fault, InputError, Where
from slipstick.faults import shown
from slipstick.fem.axis import Axis
from slipstick.fem.boundary import surface_where
from slipstick.fem.equations import NodalEquation
from slipstick.fem.mesh import Mesh, Surface, node_indices
from slipstick.fem.ties import SMALL, Projection, face_size, nearest, project
from slipstick.structure.constraints import Dependent
from slipstick.typing import Array, BoolArray, ComplexArray, IntArray

ON_FACE = 1e-3
"""Default tolerance of the distance of paired nodes, over the distance of neighbouring nodes of the face."""

_FACE_DISTANCE = 0.05
"""Default tolerance of a node's distance from a face meshed differently, over the mean edge of the coarser face."""

_HELD_WEIGHT = 0.05
"""Weight of free nodes at a node that is held, up to which faces that are meshed differently count as held alike."""

_NEGLIGIBLE = 1e-9
"""Weights and direction cosines below it are rounding of their computation."""


@dataclass(frozen=True, kw_only=True)
class CyclicSymmetry:
    """The ring that a model is a sector of.

    Attributes
    ----------
    sectors
        Number of sectors of the ring.
    axis
        Of the ring.
    low, high
        Faces towards the sector before and the next one: names of node sets or surfaces, or node labels (n,).
    alone
        The model of the sector without anything on its faces, where the model that says this has joined them for equal
        motion of all sectors; None where they are free in it.

    Examples
    --------
    >>> import slipstick as ss
    >>> symmetry = ss.models.bladed_sector("coarse").symmetry
    >>> symmetry.sectors, symmetry.low, symmetry.high, symmetry.axis.direction.tolist()
    (24, 'low', 'high', [0.0, 0.0, 1.0])
    """

    sectors: int
    axis: Axis
    low: Any
    high: Any
    alone: Any = None


def rotation(axis: Axis, angle: float) -> Array:
    """Matrix (3, 3) that turns vectors by an angle (rad) about the axis."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(angle * np.asarray(axis.direction)).as_matrix())


def turned(axis: Axis, turn: Array, positions: Array) -> Array:
    """Positions (n, 3) turned about the axis by a rotation matrix."""
    origin = np.asarray(axis.point)
    return np.asarray((positions - origin) @ turn.T + origin)


def facing(symmetry: CyclicSymmetry, points: Array, onto: Callable[[Array], Projection]) -> tuple[Projection, Array]:
    """Nearest places of points (n, 3) of one face on the other one, turned by a sector, and that rotation (3, 3).

    Whichever way round that is nearer. ``onto`` finds the nearest places of the other face.
    """
    tries = []
    for sign in (1.0, -1.0):
        turn = rotation(symmetry.axis, sign * 2.0 * np.pi / symmetry.sectors)
        tries.append((onto(turned(symmetry.axis, turn.T, points)), turn))
    return min(tries, key=lambda one: float(one[0].distances.sum()))


@dataclass(frozen=True, kw_only=True)
class Pairing:
    """Pairs of nodes of the two faces.

    Attributes
    ----------
    low, high
        Node labels of the faces (n_low,) and (n_high,), those that are on both left out of the face that follows.
    weights
        Sparse: the motion of high of a sector by that of low of the next one, (n_high, n_low), the identity where nodes
        meet; or that of low by high, (n_low, n_high), where not ``forward``.
    forward
        Whether high follows low.
    on_axis
        Labels of nodes that are on both faces.
    turn
        Rotation (3, 3) from the low face to the high one.
    distance, edge
        The largest distance of two paired nodes, or of a node from the other face; distance of neighbouring nodes, or
        mean edge where the faces are meshed differently: lengths.
    between
        How many nodes lie between those of the other face.
    """

    low: IntArray
    high: IntArray
    weights: csr_array
    forward: bool = True
    on_axis: IntArray
    turn: Array
    distance: float
    edge: float
    between: int = 0

    @property
    def leading(self) -> tuple[str, IntArray]:
        """Name and node labels of the face that the other one follows."""
        return ("low", self.low) if self.forward else ("high", self.high)

    @property
    def following(self) -> tuple[str, IntArray]:
        """Name and node labels of the face that follows."""
        return ("high", self.high) if self.forward else ("low", self.low)


def paired(
    symmetry: CyclicSymmetry,
    low: IntArray,
    high: IntArray,
    at: tuple[Array, Array],
    tolerance: float | None = None,
    mesh: Mesh | None = None,
) -> Pairing:
    """Pair two faces, node labels (n,) at positions ``at`` (n, 3) each, by rotation about the axis.

    Whichever way the high face lies from the low one, that is where the next sector is. Where the nodes do not meet one
    by one, those of the finer face follow the faces of the other one, which the mesh knows.

    Raises
    ------
    InputError
        With the node that is farthest from its place on the other face, or faces of different numbers of nodes.
    """
    if len(low) == 0 or len(high) == 0:
        name = "low" if len(low) == 0 else "high"
        raise InputError(Fault(name, "has no nodes", remedy="give the nodes of a face of the sector"))
    found, turn = facing(symmetry, at[1], partial(nearest, at[0]))
    distances, place, edge = found.distances, found.nodes[:, 0], _spacing(at[0])
    back = nearest(at[1], turned(symmetry.axis, turn, at[0])).distances
    allowed = ON_FACE * edge if tolerance is None else tolerance
    worst, far = int(np.argmax(distances)), int(np.argmax(back))
    alike = len(low) == len(high) and len(np.unique(place)) == len(place)
    if alike and distances[worst] <= allowed and back[far] <= allowed:
        mates = low[place]
        own = high == mates
        weights = csr_array(eye_array(int(np.sum(~own))))
        return Pairing(
            low=mates[~own], high=high[~own], weights=weights, on_axis=high[own], turn=turn,
            distance=float(distances[worst]), edge=edge,
        )  # fmt: skip
    met = None if mesh is None else _by_shapes(symmetry, turn, low, high, mesh, tolerance)
    if met is not None:
        return met
    if distances[worst] > allowed:
        raise InputError(_unpaired(symmetry, high[worst], float(distances[worst]), allowed, at))
    numbers = f"{len(low)} nodes of low and {len(high)} of high"
    where = f"node {low[far]} of low is {back[far]:.3g} from its place on high"
    remedy = "give both whole" if mesh is not None else "give both whole; faces meshed differently need the mesh"
    raise InputError(Fault("high", found=f"{numbers}; {where}", expected="faces with the same nodes", remedy=remedy))


def _by_shapes(
    symmetry: CyclicSymmetry, turn: Array, low: IntArray, high: IntArray, mesh: Mesh, tolerance: float | None
) -> Pairing | None:
    """Nodes of the finer face by the shape functions of the other one; None where they are not known or lie apart."""
    faces = [surface_where(mesh, np.isin(mesh.labels, labels)) for labels in (low, high)]
    if not all(face.n_faces for face in faces):
        return None
    edge = max(face_size(mesh, face) for face in faces)
    ends = [node_indices(mesh.labels, labels, name) for labels, name in ((low, "low"), (high, "high"))]
    on_low = project(mesh, faces[0], turned(symmetry.axis, turn.T, mesh.nodes[ends[1]]))
    on_high = project(mesh, faces[1], turned(symmetry.axis, turn, mesh.nodes[ends[0]]))
    distance = max(float(found.distances.max()) for found in (on_low, on_high))
    if distance > (_FACE_DISTANCE * edge if tolerance is None else tolerance):
        return None
    forward = len(high) >= len(low)
    onto, leading, following = (on_low, low, high) if forward else (on_high, high, low)
    own = np.isin(following, leading)
    between = int(np.sum(np.abs(onto.weights[~own]).max(axis=1) < 1.0 - ON_FACE))
    if not between:  # nodes that meet one by one: they are held to the distance of paired nodes
        return None
    follow, corner = np.nonzero(np.abs(onto.weights[~own]) > SMALL)
    nodes, values = onto.nodes[~own][follow, corner], onto.weights[~own][follow, corner]
    order = np.argsort(leading)
    column = order[np.searchsorted(leading, mesh.labels[nodes], sorter=order)]
    return Pairing(
        low=low if forward else low[~own], high=high[~own] if forward else high, forward=forward,
        weights=csr_array((values, (follow, column)), shape=(int(np.sum(~own)), len(leading))),
        on_axis=following[own], turn=turn, distance=distance, edge=edge, between=between,
    )  # fmt: skip


def cyclic_equations(
    mesh: Mesh,
    symmetry: CyclicSymmetry,
    dependent: IntArray,
    independent: Surface | IntArray,
    *,
    tolerance: float,
    where: str | Where,
) -> Iterator[NodalEquation]:
    """The two sides of a sector move alike, seen in polar coordinates: the family of 0 nodal diameters.

    ``independent`` is a surface, or node indices that the dependent ones must meet one by one.

    Raises
    ------
    InputError
        If a node has no place on the other side within the tolerance, whichever way the sector is turned.
    """
    tied, turn = sides(mesh, symmetry, dependent, independent)
    distance = float(tied.distances.max(initial=0.0))
    if distance > tolerance:
        label = mesh.labels[dependent[int(np.argmax(tied.distances))]]
        statement = f"node {label} of one side is {distance:.3g} away from the other side turned by a sector"
        expected = f"at most {tolerance:.3g}: check the number of sectors and the axis"
        raise InputError(Fault(where, statement, expected=expected))
    for node, masters, weights in zip(dependent.tolist(), tied.nodes.tolist(), tied.weights.tolist(), strict=True):
        parts = [(m, w) for m, w in zip(masters, weights, strict=True) if abs(w) > SMALL]
        which = Dependent.ANY if any(m == node for m, _ in parts) else Dependent.YIELDING  # of a node on the axis
        for axis in range(3):
            terms = [(int(mesh.labels[node]), axis, 1.0)]
            terms += [
                (int(mesh.labels[m]), other, -w * float(turn[axis, other])) for m, w in parts for other in range(3)
            ]
            yield NodalEquation(terms=tuple(terms), where=where, dependent=which)


def sides(
    mesh: Mesh, symmetry: CyclicSymmetry, dependent: IntArray, independent: Surface | IntArray
) -> tuple[Projection, Array]:
    """Nearest places of the nodes of one side on the other one, see ``facing``; its ``nodes`` are those of the mesh."""
    points = mesh.nodes[dependent]
    if isinstance(independent, Surface):
        return facing(symmetry, points, partial(project, mesh, independent))
    found, turn = facing(symmetry, points, partial(nearest, mesh.nodes[independent]))
    return replace(found, nodes=np.asarray(independent)[found.nodes]), turn


def _unpaired(symmetry: CyclicSymmetry, label: int, distance: float, allowed: float, at: tuple[Array, Array]) -> Fault:
    angles = [symmetry.axis.angle(part) for part in at]
    between = np.angle(np.mean(np.exp(1j * angles[1])) / np.mean(np.exp(1j * angles[0])))
    is_at = (
        f"node {label} of high is {distance:.4g} from the nearest node of low turned by 360/{symmetry.sectors} degrees"
    )
    remedy = f"check sectors, axis and faces: seen from this axis they lie {abs(np.rad2deg(between)):.5g} degrees apart"
    return Fault("high", found=is_at, expected=f"at most {allowed:.3g} (tolerance)", remedy=remedy)


def _spacing(places: Array) -> float:
    """Median distance of points to their next one."""
    from scipy.spatial import cKDTree

    if len(places) < 2:
        return max(float(np.abs(places).max(initial=0.0)), 1e-300)
    return float(np.median(cKDTree(places).query(places, k=2)[0][:, 1]))


@dataclass(frozen=True, kw_only=True)
class Joined:
    """The degrees of freedom of a sector by those without its high face.

    Attributes
    ----------
    T0, T1
        Sparse real (n, n_p): ``q = (T0 + e^{-i phi} T1) p``, with ``e^{i phi}`` where not ``forward``.
    rows
        Which of the n each p is, (n_p,).
    axial
        Places among p of x, y, z of the nodes on the axis, (n_axis, 3); -1 where they are held.
    axis, sectors
        Of the ring.
    turn
        Rotation (3, 3) from the face that leads to the one that follows.
    forward
        Whether the high face follows the low one.
    """

    T0: csr_array
    T1: csr_array
    rows: IntArray
    axial: IntArray
    axis: Axis
    sectors: int
    turn: Array
    forward: bool = True

    @property
    def n(self) -> int:
        """Number of p."""
        return len(self.rows)

    def coupled(self, A: Any) -> tuple[csr_array, csr_array]:
        """A matrix of the sector alone (n, n), symmetric: within the sector and from the next one, (n_p, n_p)."""
        high = np.flatnonzero(np.diff(self.T1.indptr))
        A, turn = csr_array(A), self.T1[high]
        inside = A[self.rows][:, self.rows] + turn.T @ A[high][:, high] @ turn
        return csr_array(inside), csr_array(A[self.rows][:, high] @ turn)

    def phase(self, k: int) -> complex:
        """``e^{-i phi}`` for ``phi = 2 pi k / N``, or ``e^{i phi}``, by which the face follows; real where it is."""
        k = (k if self.forward else -k) % self.sectors
        if k == 0 or 2 * k == self.sectors:
            return 1.0 if k == 0 else -1.0
        return complex(np.exp(-2j * np.pi * k / self.sectors))

    def motion(self, k: int) -> Any:
        """Sparse (n, n_k): all degrees of freedom of the sector from those that a phase leaves, real where it is."""
        whole = csr_array(self.T0 + self.phase(k) * self.T1)
        left = self.left(k)
        return whole if left is None else csr_array(whole @ left)

    def left(self, k: int) -> Any:
        """Sparse (n_p, n_k): what nodes on the axis may do with this phase; None where there are none."""
        if not len(self.axial):
            return None
        free = np.ones(self.n, dtype=bool)
        free[self.axial[self.axial >= 0]] = False
        kept = np.flatnonzero(free)
        rows, columns, values = [kept], [np.arange(len(kept))], [np.ones(len(kept), dtype=complex)]
        count, vectors = len(kept), _alone(self.turn, self.phase(k))
        for places in self.axial:
            for vector in vectors.T:
                if np.any(np.abs(vector[places < 0]) > _NEGLIGIBLE):
                    continue
                rows.append(places[places >= 0])
                columns.append(np.full(int(np.sum(places >= 0)), count))
                values.append(vector[places >= 0])
                count += 1
        entries = np.concatenate(values)
        entries = entries.real if not np.any(np.abs(entries.imag) > 0.0) else entries
        return csr_array((entries, (np.concatenate(rows), np.concatenate(columns))), shape=(self.n, count))


def _alone(turn: Array, phase: complex) -> ComplexArray:
    """Unit vectors u (3, m) with ``u = phase * turn u``."""
    left, size, right = np.linalg.svd(np.eye(3) - phase * turn)
    del left
    found: ComplexArray = right[size < 1e-9].conj().T
    return found


def joined(
    nodes: IntArray, components: IntArray, pairing: Pairing, symmetry: CyclicSymmetry, dependent: IntArray
) -> Joined:
    """The two faces of a sector joined.

    Parameters
    ----------
    nodes, components
        Node label and direction (0..5; 6 a scalar) of each degree of freedom, (n,).
    dependent
        Labels of nodes with degrees of freedom that depend on others; a face may have none of them.

    Raises
    ------
    InputError
        For nodes that are held on one face alone, depend on others, or have scalars.
    """
    faults = [*_mixed(pairing, dependent)]
    if faults:
        raise InputError(faults[:20])
    n = len(nodes)
    place = _places(nodes, components)
    of_leading, of_following = (_rows_of(place, labels) for _, labels in (pairing.leading, pairing.following))
    turn = pairing.turn if pairing.forward else pairing.turn.T
    faults = [*_held(pairing, turn, of_leading, of_following)]
    if faults:
        raise InputError(faults[:20])
    taken = np.zeros(n, dtype=bool)
    taken[of_following[of_following >= 0]] = True
    rows = np.flatnonzero(~taken)
    column = np.full(n, -1, dtype=np.int64)
    column[rows] = np.arange(len(rows))
    weights = pairing.weights.tocoo()
    i, j, v = [], [], []
    for first in (0, 3):
        for a in range(3):
            for b in range(3):
                if abs(turn[a, b]) < 1e-15:
                    continue
                to, source = of_following[weights.row, first + a], of_leading[weights.col, first + b]
                both = (to >= 0) & (source >= 0)
                i.append(to[both])
                j.append(column[source[both]])
                v.append(weights.data[both] * turn[a, b])
    T0 = csr_array((np.ones(len(rows)), (rows, np.arange(len(rows)))), shape=(n, len(rows)))
    T1 = csr_array((np.concatenate(v), (np.concatenate(i), np.concatenate(j))), shape=(n, len(rows)))
    at_axis = _rows_of(place, pairing.on_axis)[:, :3]
    axial = np.where(at_axis >= 0, column[at_axis], -1)
    return Joined(
        T0=T0, T1=T1, rows=rows, axial=axial[(axial >= 0).any(axis=1)], axis=symmetry.axis, sectors=symmetry.sectors,
        turn=turn, forward=pairing.forward,
    )  # fmt: skip


def _places(nodes: IntArray, components: IntArray) -> dict[tuple[int, int], int]:
    return {pair: row for row, pair in enumerate(zip(nodes.tolist(), components.tolist(), strict=True))}


def _rows_of(place: dict[tuple[int, int], int], labels: IntArray) -> IntArray:
    """Rows (n, 6) of the displacements and rotations of nodes, -1 where there is none."""
    found = [[place.get((label, component), -1) for component in range(6)] for label in labels.tolist()]
    return np.array(found, dtype=np.int64).reshape(-1, 6)


def _mixed(pairing: Pairing, dependent: IntArray) -> Iterator[Fault]:
    for name, labels in (("low", pairing.low), ("high", pairing.high), ("low", pairing.on_axis)):
        for label in labels[np.isin(labels, dependent)]:
            statement = f"node {label} of the face depends on others by an equation of the model"
            yield Fault(name, statement, remedy="end ties and rigid parts before the faces")


def _held(pairing: Pairing, turn: Array, of_leading: IntArray, of_following: IntArray) -> Iterator[Fault]:
    """Nodes that are held on one face and not, or otherwise, on the other."""
    (lead, leading), (name, following) = pairing.leading, pairing.following
    weights, R = abs(pairing.weights), np.abs(turn) > _NEGLIGIBLE
    for first in (0, 3):
        still = weights @ (of_leading[:, first : first + 3] >= 0) <= (_HELD_WEIGHT if pairing.between else _NEGLIGIBLE)
        held = of_following[:, first : first + 3] < 0
        for at in np.flatnonzero(still.any(axis=1) | held.any(axis=1)):
            if np.any(R[np.ix_(held[at], ~still[at])]) or np.any(R[np.ix_(~held[at], still[at])]):
                other = leading[weights[[at]].indices[np.argmax(weights[[at]].data)]]
                statement = f"node {following[at]} is held otherwise than node {other} of {lead}"
                yield Fault(name, statement, remedy="hold both faces alike, seen in directions that turn with them")


def face_nodes(given: Any, sets: Any, known: IntArray, name: str) -> IntArray:
    """Labels of the nodes of a face: names of node sets, or labels; those without degrees of freedom are left out.

    Raises
    ------
    InputError
        For what is neither, or is not in the model.
    """
    expected = "a node set or surface by name, several, or node labels"
    if isinstance(given, str):
        given = [given]
    if isinstance(given, Sequence) and given and all(isinstance(part, str) for part in given):
        labels = np.unique(np.concatenate([sets(part) for part in given]))
    else:
        try:
            labels = np.unique(np.asarray(given))
        except (TypeError, ValueError):  # ragged, or of things that cannot be compared
            labels = np.zeros(0)
        if labels.dtype.kind not in "iu" or not labels.size:
            raise InputError(Fault(name, found=shown(given), expected=expected))
    present: BoolArray = np.isin(labels, known)
    return np.asarray(labels[present], dtype=np.int64)
