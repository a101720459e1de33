"""Steady heat conduction with convection: temperatures, and the influence matrix of contact patches.

``(Kt + sum_s h_s int_s N N^T dS) theta = q``, theta the temperature above the surrounding fluid, q the nodal heat.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from slipstick.errors import Fault, InputError
from slipstick.fem.boundary import boundary
from slipstick.fem.loads import film_matrix
from slipstick.fem.mesh import Mesh
from slipstick.structure.checks import dense
from slipstick.typing import Array, IntArray, Matrix

LinearSolver = Callable[[csr_array, Array], Array]
"""``solve(A, B) -> X`` for a sparse symmetric positive definite A (n, n) and B (n, m)."""


def default_solver(A: csr_array, B: Array) -> Array:
    """Direct solution by the sparse factorisation chosen for this machine."""
    from slipstick.solve.linear.factorisation import factorise

    return factorise(A).solve(B)


def conductance(mesh: Mesh, conduction: csr_array, films: Mapping[str, float]) -> csr_array:
    """Conduction matrix plus convection, films given as ``{surface name: h}``, W/(m2 K).

    "boundary" is the whole boundary where the mesh has no surface of that name.
    """
    total = conduction
    for name, coefficient in films.items():
        whole = name == "boundary" and name not in mesh.surfaces
        total = total + film_matrix(mesh, boundary(mesh) if whole else mesh.surface(name), coefficient)
    return total.tocsr()


def steady_temperature(
    matrix: csr_array,
    heat: Array,
    *,
    fixed: IntArray | None = None,
    values: ArrayLike = 0.0,
    solve: LinearSolver = default_solver,
) -> Array:
    """Temperatures (n_nodes,) or (n_nodes, m) for nodal heat of the same shape, with nodes held at given values.

    Raises
    ------
    InputError
        If nothing carries the heat away: no convection and no fixed temperature.
    """
    n = matrix.shape[0]
    loads = np.reshape(heat, (n, -1))
    held = np.zeros(n, dtype=bool)
    held[np.empty(0, dtype=np.int64) if fixed is None else fixed] = True
    _require_sink(matrix, held)
    theta = np.zeros_like(loads)
    if held.any():
        theta[held] = np.broadcast_to(np.reshape(values, (-1, 1)), (held.sum(), 1))
    free = ~held & (matrix.diagonal() > 0.0)
    rows = matrix[free]
    theta[free] = np.reshape(solve(rows[:, free].tocsr(), loads[free] - rows[:, held] @ theta[held]), (free.sum(), -1))
    return theta.reshape(np.shape(heat))


def _require_sink(matrix: csr_array, held: NDArray[np.bool_]) -> None:
    if held.any():
        return
    scale = matrix.diagonal().sum()
    if not abs(matrix.sum()) > 1e-12 * scale:
        remedy = "give convection on a surface or a fixed temperature"
        raise InputError(Fault("heat conduction", "nothing carries the heat away", remedy=remedy))


def influence_matrix(
    matrix: csr_array, weights: Matrix, *, fixed: IntArray | None = None, solve: LinearSolver = default_solver
) -> Array:
    """Temperature rise of each patch by one unit of heat into each, (n_contacts, n_contacts), K/W, symmetric.

    ``weights`` (n_nodes, n_contacts) are those of `ContactPatches`: heat is spread, and temperature averaged, over the
    patch. Fixed nodes keep their temperature (rise zero).
    """
    spread = np.asarray(dense(weights), dtype=float)
    rise = weights.T @ steady_temperature(matrix, spread, fixed=fixed, solve=solve)
    return (rise + rise.T) / 2.0
