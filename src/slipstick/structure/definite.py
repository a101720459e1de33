"""Whether stiffness and mass are positive definite, and whether damping takes energy out, dense and sparse alike."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from slipstick.errors import Fault
from slipstick.faults import SMALLEST
from slipstick.typing import Array, Sparse

DAMPING_ROUNDING = 1e-10
"""Smallest eigenvalue of the damping with unit diagonal, negative, that still passes as rounding."""

_SMALLEST_DIAGONAL = 1e-4
"""Below this part of the largest damping (mass-normalised) a diagonal entry is not scaled up further: it is noise."""

_NOT_DEFINITE = {
    "M": ("the mass matrix is not positive definite", "give every dof a mass, or condense the massless ones"),
    "K": ("the stiffness matrix is not positive definite", "look for wrong signs or a missing triangle"),
}
_FREE = Fault(
    "K",
    "the stiffness matrix is singular, the structure can move without deforming",
    remedy="a grounded structure is required because harmonic 0 (the mean) needs its static compliance: constrain it, "
    "or attach weak springs to ground",
)


def definite_faults(name: str, matrix: Sparse) -> list[Fault]:
    """Faults of M or K (n, n), which must be positive definite; judged with unit diagonal: dofs may differ in units.

    Dense: the smallest eigenvalue. Sparse: the signs of the pivots of a symmetric elimination.
    """
    diagonal = matrix.diagonal()
    if np.any(diagonal < SMALLEST):
        if name == "K" and np.all(diagonal >= 0) and not _has_negative_pair(matrix):
            return [_FREE]
        return [_not_definite(name, f"smallest diagonal entry {diagonal.min():g}")]
    if sparse.issparse(matrix):
        smallest, limit = smallest_pivot(scaled(matrix, diagonal)), 1e-14 * matrix.shape[0]
        what = "smallest scaled pivot"
    else:
        smallest, limit = float(np.linalg.eigvalsh(scaled(matrix, diagonal))[0]), 1e-13 * matrix.shape[0]
        what = "smallest eigenvalue with unit diagonal"
    if smallest > (limit if name == "K" or not sparse.issparse(matrix) else 0.0):
        return []
    if name == "K" and smallest >= -limit:
        return [_FREE]
    return [_not_definite(name, f"{what} {smallest:g}")]


def _not_definite(name: str, found: str) -> Fault:
    statement, remedy = _NOT_DEFINITE[name]
    return Fault(name, f"{statement} ({found})", remedy=remedy)


def energy_fed(C: Sparse, M: Sparse) -> str:
    """How viscous damping C (n, n) feeds energy in, in words; empty where it is positive semidefinite to rounding.

    C is scaled by the masses, which settles units, then to unit diagonal. Dense: its smallest eigenvalue must not lie
    below ``-DAMPING_ROUNDING``. Sparse: with as much added to the diagonal, all pivots must be positive, which is the
    same condition (Sylvester).
    """
    if abs(C).max() == 0.0:
        return ""
    per_mass = C.diagonal() / M.diagonal()
    floor = _SMALLEST_DIAGONAL * np.abs(per_mass).max()
    unit = scaled(C, np.maximum(per_mass, floor if floor > 0.0 else 1.0) * M.diagonal())
    if sparse.issparse(C):
        smallest = smallest_pivot(unit + DAMPING_ROUNDING * sparse.eye_array(C.shape[0]))
        found = f"pivot {smallest:.2g} with unit diagonal"
        right = smallest > 0.0
    else:
        smallest = float(np.linalg.eigvalsh(unit)[0])
        found = f"smallest eigenvalue with unit diagonal {smallest:.2g}"
        right = smallest >= -DAMPING_ROUNDING
    return "" if right else found


_FED = 3
"""Modes that are named."""


def fed_modes(omega: Array, ratios: Array) -> str:
    """Modes with a damping ratio below 0, in words.

    >>> fed_modes(np.array([6.0, 9.0]), np.array([-0.01, 0.02]))
    'mode 1 at 6 rad/s, damping ratio -0.01'
    """
    fed = np.flatnonzero(ratios < -DAMPING_ROUNDING)
    words = [f"mode {k + 1} at {omega[k]:.5g} rad/s, damping ratio {ratios[k]:.3g}" for k in fed[:_FED]]
    return "; ".join(words) + (f"; ... ({fed.size} modes)" if fed.size > _FED else "")


def semidefinite_to(matrix: Array, diagonal: Array, tolerance: float) -> float | None:
    """None where no eigenvalue of a dense symmetric matrix, scaled by ``diagonal``, lies below -tolerance; else it."""
    unit = scaled(0.5 * (matrix + matrix.T), np.where(diagonal > 0.0, diagonal, 1.0))
    try:  # far cheaper than eigenvalues
        np.linalg.cholesky(unit + tolerance * np.eye(len(unit)))
    except np.linalg.LinAlgError:
        return float(np.linalg.eigvalsh(unit)[0])
    return None


def smallest_pivot(matrix: Sparse) -> float:
    """Smallest pivot of a symmetric elimination of a sparse matrix; zero or below where an eigenvalue is.

    A pivot that is exactly zero beside other entries hides the sign (the elimination then leaves the diagonal): the
    matrix is tried again with a trace added, which shows it. Zero for a singular matrix.

    >>> float(smallest_pivot(sparse.csc_array([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]))) < 0.0
    True
    """
    smallest = _pivots(matrix)
    if smallest is not None:
        return smallest
    trace = 1e-13 * float(np.abs(matrix.diagonal()).max())
    smallest = _pivots(matrix + trace * sparse.eye_array(matrix.shape[0]))
    return 0.0 if smallest is None else min(smallest, 0.0)


def _pivots(matrix: Sparse) -> float | None:
    """Smallest pivot when all lie on the diagonal, else None."""
    from scipy.sparse.linalg import splu

    options = {"SymmetricMode": True}
    try:
        factors = splu(sparse.csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:
        return None
    return float(factors.U.diagonal().min()) if np.array_equal(factors.perm_r, factors.perm_c) else None


def scaled(matrix: Sparse, diagonal: Array) -> Any:
    """The matrix, dense or sparse, divided by the roots of ``diagonal`` from both sides."""
    scale = 1.0 / np.sqrt(diagonal)
    if sparse.issparse(matrix):
        root = sparse.diags_array(scale)
        return root @ matrix @ root
    return matrix * scale * scale[:, None]


def _has_negative_pair(matrix: Sparse) -> bool:
    """Whether a row of zero diagonal holds anything: with any other dof it makes motions of negative energy."""
    return bool(np.any(abs(matrix)[matrix.diagonal() == 0].sum(axis=1)))
