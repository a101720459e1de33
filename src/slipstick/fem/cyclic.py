"""A sector of a structure with cyclic symmetry: its two faces paired, and what a phase between sectors makes of it.

The high face of a sector is the low face of the next one: in coordinates that turn with the sector, with ``R`` the
rotation by ``2 pi / N`` that takes the low face to the high one and the phase ``phi`` (THEORY.md (24.2))::

    u_high = e^{-i phi} R u_low,      q = (T0 + e^{-i phi} T1) p,      K(phi) = K0 + K1 e^{-i phi} + K1' e^{i phi},
    K0 = T0' K T0 + T1' K T1,         K1 = T0' K T1

with q the degrees of freedom of the sector alone and p those without its high face. A node on the axis is its own
neighbour, ``u = e^{-i phi} R u``: it moves along the axis with the phase 0, across it with the phase of one nodal
diameter, and not at all with others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from slipstick.errors import Fault, InputError
from slipstick.faults import shown
from slipstick.fem.axis import Axis
from slipstick.typing import Array, BoolArray, ComplexArray, IntArray

ON_FACE = 1e-3
"""Distance of paired nodes that is taken without being told, over the distance of neighbouring nodes of the face."""

_SAME = 1e-9


@dataclass(frozen=True, kw_only=True)
class CyclicSymmetry:
    """What a model says of the ring it is a sector of.

    Attributes
    ----------
    sectors
        How many make the ring.
    axis
        Of the ring.
    low, high
        Faces towards the sector before and the next one: names of node sets or surfaces, or node labels (n,).
    alone
        The model of the sector without anything on its faces, where the model that says this has joined them for equal
        motion of all sectors; None where they are free in it.
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


@dataclass(frozen=True, kw_only=True)
class Pairing:
    """Nodes of the two faces, one by one.

    Attributes
    ----------
    low, high
        Node labels (n,): ``high[i]`` of a sector is ``low[i]`` of the next one.
    on_axis
        Labels of nodes that are on both faces.
    turn
        Rotation (3, 3) from the low face to the high one.
    distance
        The largest distance of two paired nodes, length.
    """

    low: IntArray
    high: IntArray
    on_axis: IntArray
    turn: Array
    distance: float


def paired(
    symmetry: CyclicSymmetry, low: IntArray, high: IntArray, at: tuple[Array, Array], tolerance: float | None = None
) -> Pairing:
    """Pair two faces, node labels (n,) at positions ``at`` (n, 3) each, by rotation about the axis.

    Whichever way the high face lies from the low one, that is where the next sector is.

    Raises
    ------
    InputError
        With the node that is farthest from its place on the other face, or faces of different numbers of nodes.
    """
    from scipy.spatial import cKDTree

    if len(low) == 0 or len(high) == 0:
        name = "low" if len(low) == 0 else "high"
        raise InputError(Fault(name, "has no nodes", remedy="give the nodes of a face of the sector"))
    axis, angle = symmetry.axis, 2.0 * np.pi / symmetry.sectors
    tries = []
    for sign in (1.0, -1.0):
        turn = rotation(axis, sign * angle)
        apart, place = cKDTree(turned(axis, turn, at[0])).query(at[1])
        tries.append((float(np.sum(apart)), turn, np.asarray(apart), np.asarray(place)))
    _, turn, apart, place = min(tries, key=lambda one: one[0])
    allowed = ON_FACE * _spacing(at[0]) if tolerance is None else tolerance
    worst = int(np.argmax(apart))
    if apart[worst] > allowed:
        raise InputError(_unpaired(symmetry, high[worst], float(apart[worst]), allowed, at))
    back, _ = cKDTree(at[1]).query(turned(axis, turn, at[0]))
    far = int(np.argmax(back))
    if back[far] > allowed or len(low) != len(high) or len(np.unique(place)) != len(place):
        found = f"{len(low)} nodes of low and {len(high)} of high"
        where = f"node {low[far]} of low is {back[far]:.3g} from its place on high"
        raise InputError(
            Fault("high", found=f"{found}; {where}", expected="faces with the same nodes", remedy="give both whole")
        )
    mates = low[place]
    own = high == mates
    return Pairing(
        low=mates[~own], high=high[~own], on_axis=high[own], turn=turn, distance=float(apart.max(initial=0.0))
    )


def _unpaired(symmetry: CyclicSymmetry, label: int, apart: float, allowed: float, at: tuple[Array, Array]) -> Fault:
    angles = [symmetry.axis.angle(part) for part in at]
    between = np.angle(np.mean(np.exp(1j * angles[1])) / np.mean(np.exp(1j * angles[0])))
    is_at = f"node {label} of high is {apart:.4g} from the nearest node of low turned by 360/{symmetry.sectors} degrees"
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
    """How the degrees of freedom of a sector follow from those without its high face.

    Attributes
    ----------
    T0, T1
        Sparse real (n, n_p): ``q = (T0 + e^{-i phi} T1) p``.
    rows
        Which of the n each p is, (n_p,).
    axial
        Places among p of x, y, z of the nodes on the axis, (n_axis, 3); -1 where they are held.
    axis, sectors
        Of the ring.
    turn
        Rotation (3, 3) from the low face to the high one.
    """

    T0: csr_array
    T1: csr_array
    rows: IntArray
    axial: IntArray
    axis: Axis
    sectors: int
    turn: Array

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
        """``e^{-i phi}`` for ``phi = 2 pi k / N``; exactly real where it is."""
        k %= self.sectors
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
                if np.any(np.abs(vector[places < 0]) > _SAME):
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
    of_low, of_high = (_rows_of(place, labels) for labels in (pairing.low, pairing.high))
    faults = [*_held(pairing, of_low, of_high)]
    if faults:
        raise InputError(faults[:20])
    taken = np.zeros(n, dtype=bool)
    taken[of_high[of_high >= 0]] = True
    rows = np.flatnonzero(~taken)
    column = np.full(n, -1, dtype=np.int64)
    column[rows] = np.arange(len(rows))
    i, j, v = [], [], []
    for first in (0, 3):
        for a in range(3):
            for b in range(3):
                if abs(pairing.turn[a, b]) < 1e-15:
                    continue
                to, source = of_high[:, first + a], of_low[:, first + b]
                both = (to >= 0) & (source >= 0)
                i.append(to[both])
                j.append(column[source[both]])
                v.append(np.full(int(both.sum()), pairing.turn[a, b]))
    T0 = csr_array((np.ones(len(rows)), (rows, np.arange(len(rows)))), shape=(n, len(rows)))
    T1 = csr_array((np.concatenate(v), (np.concatenate(i), np.concatenate(j))), shape=(n, len(rows)))
    at_axis = _rows_of(place, pairing.on_axis)[:, :3]
    axial = np.where(at_axis >= 0, column[at_axis], -1)
    return Joined(
        T0=T0, T1=T1, rows=rows, axial=axial[(axial >= 0).any(axis=1)], axis=symmetry.axis, sectors=symmetry.sectors,
        turn=pairing.turn,
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


def _held(pairing: Pairing, of_low: IntArray, of_high: IntArray) -> Iterator[Fault]:
    """Nodes that are held on one face and not, or otherwise, on the other."""
    for first in (0, 3):
        low_held, high_held = of_low[:, first : first + 3] < 0, of_high[:, first : first + 3] < 0
        R = np.abs(pairing.turn) > _SAME
        for at in np.flatnonzero(low_held.any(axis=1) | high_held.any(axis=1)):
            if np.any(R[np.ix_(high_held[at], ~low_held[at])]) or np.any(R[np.ix_(~high_held[at], low_held[at])]):
                statement = f"node {pairing.high[at]} is held otherwise than node {pairing.low[at]} of low"
                yield Fault("high", statement, remedy="hold both faces alike, seen in directions that turn with them")


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
