"""Contacts on a surface: which nodes, which directions, and the patch over which force and heat are spread.

The displacement (and the temperature) under a force (a heat source) at a single node grows without limit as the mesh is
refined. A contact therefore acts on a *patch*: weights ``w_i = int N_i g dS / int g dS`` with ``g = 1 - (d/r)^2``
inside the radius r around the contact point. The force is ``f w``, the motion of the contact is ``w^T u``: the two are
conjugate, the compliance ``w^T K^-1 w`` is symmetric and converges with the mesh.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, hstack

from slipstick.errors import Fault, InputError
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.geometry import face_geometry
from slipstick.fem.loads import area_weights
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.quadrature import Rule, gauss
from slipstick.typing import Array, IntArray

_PATCH_POINTS = 8


@dataclass(frozen=True, kw_only=True)
class ContactPatches:
    """Patches around the contact points of one surface.

    Attributes
    ----------
    points
        Positions, normals averaged over the patch, areas.
    nodes
        Contact node of each, (n_contacts,).
    weights
        Sparse (n_nodes, n_contacts), each column sums to 1.
    radii
        Radius of each patch, (n_contacts,).
    """

    points: ContactPoints
    nodes: IntArray
    weights: csc_array
    radii: Array

    def directions(self, vectors: Array) -> csc_array:
        """Columns (3 n_nodes, n_contacts): motion of each contact along its unit vector, (n_contacts, 3)."""
        along = [csc_array(self.weights * vectors[:, axis]) for axis in range(3)]
        coo = [part.tocoo() for part in along]
        rows = np.concatenate([3 * part.row + axis for axis, part in enumerate(coo)])
        columns = np.concatenate([part.col for part in coo])
        values = np.concatenate([part.data for part in coo])
        return csc_array((values, (rows, columns)), shape=(3 * self.weights.shape[0], self.weights.shape[1]))


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
    points, shares = mesh.nodes[nodes], area_weights(mesh, surface)[nodes]
    centres = points[_farthest(points, shares, count)]
    for _ in range(100):
        owner = _distances(points, centres).argmin(axis=1)
        moved = np.stack([np.average(points[owner == k], axis=0, weights=shares[owner == k]) for k in range(count)])
        change = np.abs(moved - centres).max()
        centres = moved
        if change < 1e-9 * np.ptp(points):
            break
    return nodes[_nearest_different(points, centres)]


def _farthest(points: Array, shares: Array, count: int) -> list[int]:
    middle = np.average(points, axis=0, weights=shares)
    chosen = [int(np.linalg.norm(points - middle, axis=1).argmax())]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


def _distances(points: Array, centres: Array) -> Array:
    return np.linalg.norm(points[:, None, :] - centres[None, :, :], axis=2)


def _nearest_different(points: Array, centres: Array) -> IntArray:
    distance = _distances(points, centres)
    chosen: list[int] = []
    for k in range(len(centres)):
        distance[chosen, k] = np.inf
        chosen.append(int(distance[:, k].argmin()))
    return np.array(chosen, dtype=np.int64)


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
    owned = np.zeros(len(nodes))
    for _, _, places, areas, _ in _samples(mesh, surface):
        owner = _distances(places.reshape(-1, 3), positions).argmin(axis=1)
        owned += np.bincount(owner, areas.ravel(), minlength=len(nodes))
    radii = np.sqrt(owned / (2.0 * np.pi)) if radius is None else np.full(len(nodes), float(radius))
    columns, normals = [], np.zeros((len(nodes), 3))
    for k, (position, r) in enumerate(zip(positions, radii, strict=True)):
        column, normals[k] = _patch(mesh, surface, position, r)
        columns.append(csc_array(column[:, None]))
    weights = csc_array(hstack(columns))
    points = ContactPoints(positions=positions, normals=normals, areas=owned)
    return ContactPatches(points=points, nodes=nodes, weights=weights, radii=radii)


def _located(mesh: Mesh, surface: Surface, at: IntArray) -> tuple[IntArray, Array]:
    """Contact nodes and positions; positions are taken to their nearest node for the name."""
    if at.ndim == 2 and at.shape[1] == 3 and len(at):
        positions = at.astype(float)
        return surface.nodes[_distances(mesh.nodes[surface.nodes], positions).argmin(axis=0)], positions
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


def _patch(mesh: Mesh, surface: Surface, position: Array, radius: float) -> tuple[Array, Array]:
    weights, normal, total = np.zeros(mesh.n_nodes), np.zeros(3), 0.0
    for faces, values, points, areas, normals in _samples(mesh, surface):
        near = np.linalg.norm(points - position, axis=2)
        density = areas * np.maximum(1.0 - (near / radius) ** 2, 0.0)
        np.add.at(weights, faces, density @ values)
        normal += np.einsum("mq,mqa->a", density, normals)
        total += density.sum()
    if not total > 0.05 * radius**2:
        raise InputError(
            Fault(
                f"contact patch at {position.tolist()}",
                f"radius {radius:.3g} meets too little of the surface",
                remedy="enlarge it, or move the contact",
            )
        )
    return weights / total, normal / np.linalg.norm(normal)


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
