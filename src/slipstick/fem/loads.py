"""Surface integrals: pressure, heat flux, convection film, nodal areas.

Load vectors are consistent (they integrate the shape functions): uniform pressure pulls on the corners of 8-node faces.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from slipstick.errors import Fault, InputError
from slipstick.fem.geometry import face_geometry
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import Array


def area(mesh: Mesh, surface: Surface) -> float:
    """Area of a surface."""
    return float(sum(weights.sum() for _, _, weights, _ in face_geometry(mesh, surface)))


def area_vector(mesh: Mesh, surface: Surface) -> Array:
    """``int n dS`` (3,): along the mean normal, and as long as a plane surface is large."""
    parts = [np.einsum("mq,mqa->a", weights, normals) for _, _, weights, normals in face_geometry(mesh, surface)]
    return np.asarray(np.sum(parts, axis=0))


def pressure_load(mesh: Mesh, surface: Surface, pressure: float = 1.0) -> Array:
    """Nodal forces (3 n_nodes,) of a uniform pressure, ``-p int N n dS``: a positive pressure pushes into the body."""
    load = np.zeros((mesh.n_nodes, 3))
    for faces, values, weights, normals in face_geometry(mesh, surface):
        np.add.at(load, faces, np.einsum("mq,mqa,qn->mna", weights, normals, values))
    return -pressure * load.ravel()


def shape_integrals(mesh: Mesh, surface: Surface) -> Array:
    """``int N_i dS`` of each node, (n_nodes,): with a field at the nodes the integral of that field.

    Those of corners of 8-node faces are negative; ``area_weights`` are not.
    """
    integrals = np.zeros(mesh.n_nodes)
    for faces, values, weights, _ in face_geometry(mesh, surface):
        np.add.at(integrals, faces, weights @ values)
    return integrals


def film_matrix(mesh: Mesh, surface: Surface, coefficient: float) -> csr_array:
    """Convection matrix ``h int N_i N_j dS``, (n_nodes, n_nodes), W/K for h in W/(m2 K).

    Raises
    ------
    InputError
        If the coefficient is negative or not finite.
    """
    if not (np.isfinite(coefficient) and coefficient >= 0.0):
        raise InputError(Fault(f"convection coefficient {coefficient}", expected="a finite value >= 0"))
    rows, columns, entries = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)], [np.empty(0)]
    for faces, values, weights, _ in face_geometry(mesh, surface):
        outer = (values[:, :, None] * values[:, None, :]).reshape(len(values), -1)
        rows.append(np.repeat(faces, faces.shape[1], axis=1).ravel())
        columns.append(np.tile(faces, (1, faces.shape[1])).ravel())
        entries.append((coefficient * weights @ outer).ravel())
    shape = (mesh.n_nodes, mesh.n_nodes)
    return coo_array((np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=shape).tocsr()


def area_weights(mesh: Mesh, surface: Surface) -> Array:
    """Positive share of the area for each node, (n_nodes,), zero off the surface, their sum is the area.

    Each face's area is shared in proportion to ``int N_i^2 dS`` (the lumping of Hinton, Rock and Zienkiewicz 1976): the
    consistent shares of 8-node faces are negative at the corners.
    """
    shares = np.zeros(mesh.n_nodes)
    for faces, values, weights, _ in face_geometry(mesh, surface):
        squares = weights @ values**2
        np.add.at(shares, faces, squares * (weights.sum(axis=1) / squares.sum(axis=1))[:, None])
    return shares
