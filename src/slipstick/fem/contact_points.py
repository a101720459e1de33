"""Contact points on a surface: positions, normals, shares of the area, and patches that spread force and heat.

Points are named "c1", "c2", ...; the motion of point k, averaged over its patch, has the degrees of freedom "c<k>x",
"c<k>y", "c<k>z".

The displacement (and the temperature) under a force (a heat source) at a single node grows without limit as the mesh is
refined. A contact therefore acts on a *patch*: weights ``w_i = int N_i g dS / int g dS`` with ``g = 1 - (d/r)^2``
inside the radius r around the contact point. The force is ``f w``, the motion of the contact is ``w^T u``: the two are
conjugate, the compliance ``w^T K^-1 w`` is symmetric and converges with the mesh.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, listed, numbers, shown, whole, wrong
from slipstick.fem.axis import DIRECTIONS, Axis
from slipstick.fem.elements import Rule, gauss
from slipstick.fem.geometry import face_geometry
from slipstick.fem.loads import area_weights
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import Array, IntArray, Reals

if TYPE_CHECKING:
    from scipy.spatial import KDTree

_EDGE_ON = 0.1
"""Cosine between a normal direction and the surface's own normal below which the surface does not look that way."""


@dataclass(frozen=True, kw_only=True)
class ContactPoints:
    """Contact points of one surface.

    Attributes
    ----------
    positions, normals
        Coordinates and outward unit normals, (n, 3).
    areas
        Share of the surface nearest to each point, (n,); they sum to the surface's area.
    influence
        Temperature rise per power, (n, n); None without conduction.
    side
        Letter with which their names begin.
    """

    positions: Array
    normals: Array
    areas: Array
    influence: Array | None = None
    side: str = "c"

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.positions)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the points: "c1", "c2", ..."""
        return tuple(f"{self.side}{k}" for k in range(1, self.count + 1))

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom, point by point, x y z."""
        return tuple(f"{name}{axis}" for name in self.names for axis in "xyz")

    def tangents(self, direction: Reals | str, *, axis: Axis | None = None, across: Array | None = None) -> Array:
        """Unit vectors (n, 3): a direction, as of rubbing, projected on the surface at each point.

        Parameters
        ----------
        direction
            (3,), or with an ``axis`` "radial", "circumferential" or "axial".
        across
            Unit vectors (n, 3) that stand for the normals of the surface; None: these.

        Raises
        ------
        InputError
            If the direction is zero or normal to the surface at a point.
        """
        normals = self.normals if across is None else across
        wanted = np.broadcast_to(self._wanted(direction, axis), normals.shape)
        flat = wanted - np.sum(normals * wanted, axis=1)[:, None] * normals
        size = np.linalg.norm(flat, axis=1)
        if not np.all(size > np.maximum(1e-3 * np.linalg.norm(wanted, axis=1), SMALLEST)):
            along = direction if isinstance(direction, str) else np.asarray(direction).tolist()
            raise InputError(Fault("direction", f"{along} is normal to the surface", remedy="give one along it"))
        return np.asarray(flat / size[:, None])

    def _wanted(self, direction: Any, axis: Axis | None) -> Array:
        """A direction (3,), or one of the axis at each point, (n, 3)."""
        if isinstance(direction, str):
            return self.about(axis, direction, "direction")
        expected = "a vector of three finite numbers"
        wanted = numbers("direction", direction, expected)
        if wanted.shape != (3,):
            raise wrong("direction", direction, expected)
        return wanted

    def about(self, axis: Axis | None, word: str, name: str = "normal") -> Array:
        """Unit vectors "radial", "circumferential" or "axial" at the points, (n, 3)."""
        if word not in DIRECTIONS:
            raise InputError(Fault(name, found=shown(word), expected=f"one of {', '.join(DIRECTIONS)}"))
        if axis is None:
            remedy = 'give axis, such as {"point": (0, 0, 0), "direction": (0, 0, 1)}'
            raise InputError(Fault(name, f"{word} needs the axis of the rotor", remedy=remedy))
        return axis.frame(self.positions)[word]

    def outward(self, axis: Axis | None, word: str) -> Array:
        """The same vectors, each with the sign that points out of the body, (n, 3).

        Raises
        ------
        InputError
            If the surface does not look that way at a point.
        """
        across = self.about(axis, word)
        side = np.sum(across * self.normals, axis=1)
        edge_on = np.abs(side) < _EDGE_ON
        if edge_on.any():
            at = int(np.argmax(edge_on))
            statement = f"{word} runs along the surface at point {at + 1}, not across it"
            raise InputError(Fault("normal", statement, remedy="give another direction, or the axis of the rotor"))
        return np.asarray(across * np.sign(side)[:, None])

    def tangential(self, direction: Reals | str, **options: Any) -> list[dict[str, float]]:
        """A direction projected on the surface, as direction cosines by dof, one dict a point; see ``tangents``."""
        return self.cosines(self.tangents(direction, **options))

    @property
    def normal(self) -> list[dict[str, float]]:
        """Outward normals as direction cosines by dof: a positive motion closes the contact."""
        return self.cosines(self.normals)

    def cosines(self, vectors: Array) -> list[dict[str, float]]:
        """Direction cosines by dof of one unit vector a point, (n, 3); those that are rounding alone are left out."""
        return [
            {f"{name}{axis}": float(value) for axis, value in zip("xyz", vector, strict=True) if abs(value) > 1e-12}
            for name, vector in zip(self.names, vectors, strict=True)
        ]

    def chosen(self, points: str | Iterable[int]) -> list[int]:
        """Rows of points by their numbers, counted from 1, or of "all".

        Raises
        ------
        InputError
            If a point is not there or given twice.
        """
        if isinstance(points, str) and points == "all":
            return list(range(self.count))
        wanted = listed("points", points, '"all" or numbers counted from 1')
        numbers = [whole("points", p, 1, self.count) for p in wanted]
        if not numbers or len(set(numbers)) != len(numbers):
            raise InputError(Fault("points", found=shown(numbers), remedy="give every point once"))
        return [p - 1 for p in numbers]

    def share(self, total: float, points: str | Iterable[int] = "all") -> Array:
        """A total (normal load, stiffness) shared among the chosen points by area, (n_chosen,)."""
        areas = self.areas[self.chosen(points)]
        return np.asarray(total * areas / areas.sum())

    def resistance(self, points: str | Iterable[int] = "all", *, own: ArrayLike = 0.0) -> Array:
        """Temperature per power among the chosen points, (n_chosen, n_chosen), for a thermal model.

        ``own`` is added to the diagonal: what each contact has by itself, as at the spots where the metals touch.

        Raises
        ------
        InputError
            If the body has no influence matrix.
        """
        if self.influence is None:
            raise InputError(
                Fault("influence", "the body has no influence matrix", remedy="give films or cold and a conductivity")
            )
        at = self.chosen(points)
        return np.asarray(self.influence[np.ix_(at, at)] + np.diag(np.broadcast_to(np.asarray(own, float), len(at))))


_PATCH_POINTS = 8
"""Gauss points each way on a face: the density of a patch has a kink at its radius, so that the face needs many."""


@dataclass(frozen=True, kw_only=True)
class WeightedPoints:
    """Contact points, and the weights of the nodes whose motion makes theirs.

    Attributes
    ----------
    points
        Positions, normals, areas.
    weights
        Sparse (n_nodes, n_contacts): the motion of a contact is its column times that of the nodes.
    """

    points: ContactPoints
    weights: csc_array

    def directions(self, vectors: Array) -> csc_array:
        """Columns (3 n_nodes, n_contacts): motion of each contact along its unit vector, (n_contacts, 3)."""
        along = [csc_array(self.weights * vectors[:, axis]) for axis in range(3)]
        coo = [part.tocoo() for part in along]
        rows = np.concatenate([3 * part.row + axis for axis, part in enumerate(coo)])
        columns = np.concatenate([part.col for part in coo])
        values = np.concatenate([part.data for part in coo])
        return csc_array((values, (rows, columns)), shape=(3 * self.weights.shape[0], self.weights.shape[1]))


@dataclass(frozen=True, kw_only=True)
class ContactPatches(WeightedPoints):
    """Patches around the contact points of one surface: normals are means over them, and each column sums to 1.

    Attributes
    ----------
    nodes
        Contact node of each, (n_contacts,).
    radii
        Radius of each patch, (n_contacts,).
    """

    nodes: IntArray
    radii: Array


def spread_nodes(mesh: Mesh, surface: Surface, count: int) -> IntArray:
    """``count`` nodes spread uniformly over a surface, the same ones on every run.

    Farthest points first, then Lloyd's iteration with area weights: each node ends nearest to the centroid of its own
    part of the surface. Distances are straight lines.

    Raises
    ------
    InputError
        If the surface has fewer nodes than asked.
    """
    nodes = surface.nodes
    if not 1 <= count <= len(nodes):
        raise InputError(
            Fault("contacts", f"{count} nodes asked on a surface of {len(nodes)}", remedy=f"ask for 1 to {len(nodes)}")
        )
    points = mesh.nodes[nodes]
    return nodes[_nearest_different(points, spread(points, area_weights(mesh, surface)[nodes], count))]


def spread(points: Array, shares: Array, count: int) -> Array:
    """Centres (count, d) of the uniform parts of points (n, d) with shares of an area (n,), by ``spread_nodes``."""
    centres = points[_farthest(points, shares, count)]
    for _ in range(100):
        owner = nearest_centres(points, centres)
        order = np.argsort(owner, kind="stable")
        parts = np.split(order, np.cumsum(np.bincount(owner, minlength=count))[:-1])
        moved = np.stack([
            np.average(points[part], axis=0, weights=shares[part]) if len(part) else centres[k]
            for k, part in enumerate(parts)
        ])  # fmt: skip
        change = np.abs(moved - centres).max()
        centres = moved
        if change < 1e-9 * np.ptp(points):
            break
    return centres


def _farthest(points: Array, shares: Array, count: int) -> list[int]:
    middle = np.average(points, axis=0, weights=shares)
    chosen = [int(np.linalg.norm(points - middle, axis=1).argmax())]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


_CANDIDATES = 16
"""Neighbours among which the nearest is chosen: on grids several are equally near, and the first by index counts."""


def _candidates(points: Array, centres: Array, count: int) -> tuple[IntArray, Array]:
    """The ``count`` centres nearest to each point (n, count), ascending by index, and their distances."""
    from scipy.spatial import KDTree

    near = np.sort(KDTree(centres).query(points, k=np.arange(1, min(count, len(centres)) + 1))[1], axis=1)
    return near, np.linalg.norm(points[:, None, :] - centres[near], axis=2)


def nearest_centres(points: Array, centres: Array) -> IntArray:
    """The centre nearest to each point (n,), the first of those equally near."""
    near, distance = _candidates(points, centres, _CANDIDATES)
    return np.asarray(near[np.arange(len(points)), distance.argmin(axis=1)])


def _nearest_different(points: Array, centres: Array) -> IntArray:
    """For each centre the nearest point that is not another's already."""
    near, distance = _candidates(centres, points, _CANDIDATES)
    free = np.ones(len(points), dtype=bool)
    chosen = np.zeros(len(centres), dtype=np.int64)
    for k in range(len(centres)):
        here, distances = near[k], distance[k]
        if not free[here].any():
            here, distances = np.arange(len(points)), np.linalg.norm(points - centres[k], axis=1)
        best = here[np.where(free[here], distances, np.inf).argmin()]
        free[best], chosen[k] = False, best
    return chosen


def contact_patches(mesh: Mesh, surface: Surface, at: ArrayLike, radius: float | None = None) -> ContactPatches:
    """Patches around contacts on a surface.

    Parameters
    ----------
    at
        Node indices (n_contacts,), integers, or positions (n_contacts, 3) on the surface: positions make contacts which
        do not depend on the mesh.
    radius
        One length for all; by default each patch is a disc with half the area nearest to its contact,
        ``r = sqrt(area / (2 pi))``, so that neighbouring patches hardly overlap.

    Raises
    ------
    InputError
        If a node is not on the surface, is given twice, or the patch does not meet enough of the surface.
    """
    nodes, positions = _located(mesh, surface, np.asarray(at))
    samples, owned = [_Sampled(*part) for part in _samples(mesh, surface)], np.zeros(len(nodes))
    for part in samples:
        owner = nearest_centres(part.points.reshape(-1, 3), positions)
        owned += np.bincount(owner, part.areas.ravel(), minlength=len(nodes))
    radii = np.sqrt(owned / (2.0 * np.pi)) if radius is None else np.full(len(nodes), float(radius))
    columns, normals = [], np.zeros((len(nodes), 3))
    for k, (position, r) in enumerate(zip(positions, radii, strict=True)):
        at, values, normals[k] = _patch(samples, position, r)
        columns.append((at, values))
    ends = np.cumsum([0, *(len(at) for at, _ in columns)])
    rows, values = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    weights = csc_array((values, rows, ends), shape=(mesh.n_nodes, len(nodes)))
    points = ContactPoints(positions=positions, normals=normals, areas=owned)
    return ContactPatches(points=points, nodes=nodes, weights=weights, radii=radii)


def _located(mesh: Mesh, surface: Surface, at: IntArray) -> tuple[IntArray, Array]:
    """Contact nodes and positions; positions are taken to their nearest node for the name."""
    if at.ndim == 2 and at.shape[1] == 3 and len(at):
        positions = at.astype(float)
        return surface.nodes[nearest_centres(positions, mesh.nodes[surface.nodes])], positions
    if at.ndim > 1 or not np.issubdtype(at.dtype, np.integer) or not at.size:
        raise InputError(
            Fault(
                "contacts",
                found=f"{at.dtype} of shape {at.shape}",
                expected="node indices (n,) or positions (n, 3)",
            )
        )
    nodes = np.atleast_1d(at).astype(np.int64)
    outside = nodes[~np.isin(nodes, surface.nodes)]
    if len(outside):
        named = mesh.labels[outside[0]] if 0 <= outside[0] < mesh.n_nodes else f"index {outside[0]}"
        raise InputError(Fault("contacts", f"node {named} is not on the surface ({len(outside)} such in the list)"))
    if len(np.unique(nodes)) != len(nodes):
        raise InputError(Fault("contacts", "a contact node is given twice", remedy="name each node once"))
    return nodes, mesh.nodes[nodes]


def _patch(samples: list[_Sampled], position: Array, radius: float) -> tuple[IntArray, Array, Array]:
    """Nodes of a patch, ascending, their weights, and its normal."""
    corners, parts, normal, total = [np.empty(0, dtype=np.int64)], [np.empty(0)], np.zeros(3), 0.0
    for part in samples:
        here = part.near(position, radius)
        distances = np.linalg.norm(part.points[here] - position, axis=2)
        density = part.areas[here] * np.maximum(1.0 - (distances / radius) ** 2, 0.0)
        corners.append(part.faces[here].ravel())
        parts.append((density @ part.values).ravel())
        normal += np.einsum("mq,mqa->a", density, part.normals[here])
        total += density.sum()
    if not total > 0.05 * radius**2:
        raise InputError(
            Fault(
                f"contact patch at {position.tolist()}",
                f"radius {radius:.3g} meets too little of the surface",
                remedy="enlarge it, or move the contact",
            )
        )
    nodes, place = np.unique(np.concatenate(corners), return_inverse=True)
    weights = np.bincount(place, np.concatenate(parts), minlength=len(nodes))
    there = weights != 0.0
    return nodes[there], weights[there] / total, normal / np.linalg.norm(normal)


@dataclass(frozen=True)
class _Sampled:
    """Faces of one type (m, corners), shape values (q, corners), points, areas and normals of a dense rule."""

    faces: IntArray
    values: Array
    points: Array
    areas: Array
    normals: Array

    @cached_property
    def _centres(self) -> tuple[KDTree, float]:
        """Means of the points of each face, and how far from it one of them lies at most."""
        from scipy.spatial import KDTree

        centres = self.points.mean(axis=1)
        return KDTree(centres), float(np.linalg.norm(self.points - centres[:, None], axis=2).max(initial=0.0))

    def near(self, position: Array, radius: float) -> IntArray:
        """Faces of which a point may lie within a radius of a position, ascending."""
        tree, extent = self._centres
        return np.sort(np.asarray(tree.query_ball_point(position, (radius + extent) * 1.0001), dtype=np.int64))


def _samples(mesh: Mesh, surface: Surface) -> Iterator[tuple[IntArray, Array, Array, Array, Array]]:
    """Faces, shape values, points (m, q, 3), areas (m, q) and unit normals (m, q, 3) at a dense rule."""
    for faces, values, areas, normals in face_geometry(mesh, surface, _dense_rule):
        yield faces, values, np.einsum("qn,mna->mqa", values, mesh.nodes[faces]), areas, normals


def _dense_rule(kind: str) -> Rule:
    square = gauss(_PATCH_POINTS, 2)
    if kind.startswith("quad"):
        return square
    x, y = (1.0 + square.points.T) / 2.0
    return Rule(points=np.stack([x * (1.0 - y), y], axis=1), weights=square.weights / 4.0 * (1.0 - y))
