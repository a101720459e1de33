"""What is wrong with mass, damping and stiffness, dense or sparse, each by itself and with the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.faults import LARGEST, SMALLEST, whole
from slipstick.structure.checks import (
    DAMPING_ELSEWHERE,
    array_faults,
    asymmetry,
    entry_faults,
    number_faults,
    real,
    symmetry_faults,
    within_range,
)
from slipstick.typing import Array, Matrix, Sparse

DAMPING_ROUNDING = 1e-10
"""Smallest eigenvalue of the damping with unit diagonal, negative, that still passes as rounding."""

_SMALLEST_DIAGONAL = 1e-4
"""Below this part of the largest damping (mass-normalised) a diagonal entry is not scaled up further: it is noise."""

_NOT_DEFINITE = {
    "M": ("the mass matrix is not positive definite", "give every dof a mass, or condense the massless ones"),
    "K": ("the stiffness matrix is not positive definite", "look for wrong signs or a missing triangle"),
}
FREE = Fault(
    "K",
    "the stiffness matrix is singular, the structure can move without deforming",
    remedy="constrain it, attach weak springs to ground, or take ss.models.free_structure; matrices of up to 1500 dofs "
    "may be held by contacts alone",
)


_FED = 3
"""Modes that are named."""


def system_matrices(
    arguments: Mapping[str, Any], n: int, *, dense: bool, turns: bool = False
) -> tuple[dict[str, Any], list[Fault]]:
    """Those of the matrices M, K, C (n, n) that are right, stored dense or sparse, and all faults.

    What needs another matrix is left out where that one is missing or at fault. K is definite unless something
    ``turns``, or C is unsymmetric: gyroscopic forces hold a rotor whose stiffness is not. A singular K is told as the
    fault ``FREE`` and is there all the same.
    """
    right: dict[str, Any] = {}
    faults: list[Fault] = []
    for name, value in arguments.items():
        wrong = number_faults(name, value, DAMPING_ELSEWHERE)
        matrix = None if wrong else _numbers(value)
        wrong = wrong or _shape_faults(name, matrix, n)
        wrong = wrong or (symmetry_faults(name, matrix) if name == "M" else triangle_faults(name, matrix))
        faults += wrong
        if not wrong:
            right[name] = stored(matrix, dense)
    turns = turns or not is_symmetric(right.get("C", np.zeros((1, 1))))
    for name in ("M", "K"):
        regular = name == "K" and name in right and (turns or not is_symmetric(right[name]))
        check = _regular_faults if regular else definite_faults
        wrong = check(name, right[name]) if name in right else []
        faults += wrong
        if wrong and wrong != [FREE]:
            del right[name]
    return right, faults


def rotation_matrices(
    arguments: Mapping[str, Any], speed: Any, engine_order: Any, n: int, *, dense: bool
) -> tuple[dict[str, Any], list[Fault]]:
    """Skew-symmetric matrices for unit speed (None: there is none), stored dense or sparse, and what is wrong.

    With them a speed or an engine order is needed, without them there is nothing to turn.
    """
    right: dict[str, Any] = {}
    faults: list[Fault] = []
    for name, value in arguments.items():
        wrong = [] if value is None else number_faults(name, value)
        matrix = None if wrong or value is None else _numbers(value)
        wrong = wrong or ([] if value is None else _shape_faults(name, matrix, n) or _skew_faults(name, matrix))
        faults += wrong
        if not wrong and value is not None:
            right[name] = stored(matrix, dense)
    faults += [] if speed is None else number_faults("speed", speed) or array_faults("speed", real(speed), ())
    if engine_order is not None:
        try:
            whole("engine_order", engine_order, 1)
        except InputError as error:
            faults += error.faults
    turns = any(value is not None for value in arguments.values())
    told = [name for name, value in (("speed", speed), ("engine_order", engine_order)) if value is not None]
    if turns and len(told) != 1:
        what = "both are given" if told else "neither is given"
        faults.append(Fault("speed", f"of speed and engine_order {what}", remedy="what turns needs one of them"))
    if told and not turns:
        faults.append(
            Fault(told[0], "nothing turns at it", remedy="give the gyroscopic matrix for unit speed, or leave it out")
        )
    if engine_order is not None and arguments.get("circulatory") is not None:
        tied = "with an engine order harmonic 0 would have another compliance at each frequency"
        faults.append(Fault("circulatory", tied, remedy="give a fixed speed"))
    return right, faults


def symmetric_part(matrix: Matrix) -> Any:
    """Half the sum of a dense or sparse matrix and its transpose."""
    return 0.5 * (matrix + matrix.T)


def is_symmetric(matrix: Matrix) -> bool:
    """Whether a dense or sparse square matrix is symmetric to rounding."""
    return asymmetry(matrix) is None


def triangle_faults(name: str, matrix: Matrix) -> list[Fault]:
    """Faults of a matrix (n, n), symmetric or not, of which one triangle alone was given."""
    if is_symmetric(matrix):
        return []
    return symmetry_faults(name, matrix) if any(abs(part).max() == 0.0 for part in _triangles(matrix)) else []


def _triangles(matrix: Matrix) -> tuple[Any, Any]:
    kind = sparse if sparse.issparse(matrix) else np
    return kind.triu(matrix, 1), kind.tril(matrix, -1)


def _skew_faults(name: str, matrix: Matrix) -> list[Fault]:
    even = symmetric_part(matrix)
    if abs(even).max() <= 1e-8 * abs(matrix).max():
        return []
    found = f"a symmetric part up to {abs(even).max():.3g} beside entries up to {abs(matrix).max():.3g}"
    remedy = "symmetric parts are damping or stiffness: give them as C or K"
    return [Fault(name, found=found, expected="a skew-symmetric matrix", remedy=remedy)]


def _regular_faults(_: str, matrix: Sparse) -> list[Fault]:
    """Faults of a matrix that must be regular."""
    if sparse.issparse(matrix):
        from scipy.sparse.linalg import splu

        try:
            pivots = np.abs(splu(sparse.csc_array(matrix)).U.diagonal())
        except RuntimeError:
            return [FREE]
        return [] if pivots.min() > 1e-14 * pivots.max() else [FREE]
    size = np.abs(matrix).sum(axis=1)
    root = np.sqrt(size)
    unit = matrix / root[:, None] / root if np.all(root > 0.0) else 0.0 * matrix
    return [] if np.linalg.svd(unit, compute_uv=False)[-1] > 1e-13 * len(matrix) else [FREE]


def stored(matrix: Any, dense: bool) -> Any:
    """Dense, or compressed sparse by columns."""
    if dense:
        return matrix.toarray() if sparse.issparse(matrix) else matrix
    return sparse.csc_array(matrix)


def _numbers(value: Any) -> Any:
    return real(value).tocsc(copy=True) if sparse.issparse(value) else real(value)


def _shape_faults(name: str, matrix: Any, n: int) -> list[Fault]:
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        return [Fault(name, found=f"shape {matrix.shape}", expected="a square matrix")]
    if matrix.shape[0] != n:
        return [Fault(name, found=f"shape {matrix.shape} but {n} dofs are named", remedy="they must agree")]
    return entry_faults(name, matrix.tocoo().data if sparse.issparse(matrix) else matrix)


def definite_faults(name: str, matrix: Sparse) -> list[Fault]:
    """Faults of M or K (n, n), which must be positive definite; judged with unit diagonal: dofs may differ in units.

    Dense: the smallest eigenvalue. Sparse: the signs of the pivots of a symmetric elimination.
    """
    diagonal = matrix.diagonal()
    if np.any(diagonal < SMALLEST):
        if name == "K" and np.all(diagonal >= 0) and not _has_negative_pair(matrix):
            stiff = np.flatnonzero(diagonal >= SMALLEST)
            return (definite_faults(name, matrix[stiff][:, stiff]) if stiff.size else []) or [FREE]
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
        return [FREE]
    return [_not_definite(name, f"{what} {smallest:g}")]


def _not_definite(name: str, evidence: str) -> Fault:
    statement, remedy = _NOT_DEFINITE[name]
    return Fault(name, f"{statement} ({evidence})", remedy=remedy)


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
        evidence = f"pivot {smallest:.2g} with unit diagonal"
        right = smallest > 0.0
    else:
        smallest = float(np.linalg.eigvalsh(unit)[0])
        evidence = f"smallest eigenvalue with unit diagonal {smallest:.2g}"
        right = smallest >= -DAMPING_ROUNDING
    return "" if right else evidence


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


def scaled(matrix: Sparse, diagonal: Array) -> Sparse:
    """The matrix, dense or sparse, divided by the roots of ``diagonal`` from both sides."""
    scale = 1.0 / np.sqrt(diagonal)
    if sparse.issparse(matrix):
        root = sparse.diags_array(scale)
        return root @ matrix @ root
    return matrix * scale * scale[:, None]


def _has_negative_pair(matrix: Sparse) -> bool:
    """Whether a row of zero diagonal holds anything: with any other dof it makes motions of negative energy."""
    return bool(np.any(abs(matrix)[matrix.diagonal() == 0].sum(axis=1)))


def matrix_faults(K: Sparse, M: Sparse, dofs: Sequence[str] | None = None) -> list[str]:
    """One sentence for each fault of K and M (n, n): size, finite numbers, symmetry, negative mass."""
    faults = list(_size_faults(K, M, dofs))
    if faults:
        return faults
    for name, matrix in (("stiffness", K), ("mass", M)):
        faults += _value_faults(name, matrix, dofs)
    return faults or list(_mass_faults(M, dofs))


def name_of(dofs: Sequence[str] | None, index: int) -> str:
    """The name of a degree of freedom, quoted, or its number."""
    return f"number {index}" if dofs is None else f"'{dofs[index]}'"


def _size_faults(K: Sparse, M: Sparse, dofs: Sequence[str] | None) -> Iterator[str]:
    odd = [
        (name, A.shape) for name, A in (("stiffness", K), ("mass", M)) if A.shape != A.shape[:1] * 2 or not A.shape[0]
    ]
    yield from (f"the {name} matrix has shape {shape}; give a square one" for name, shape in odd)
    if not odd and K.shape != M.shape:
        yield f"stiffness {K.shape} and mass {M.shape} differ in size; export both with the same constraints"
    if dofs is not None and len(dofs) != K.shape[0]:
        yield f"{len(dofs)} dof names for matrices of {K.shape[0]} rows; give the map that belongs to these matrices"
    elif dofs is not None and len(set(dofs)) != len(dofs):
        seen: set[str] = set()
        twice = next(name for name in dofs if name in seen or seen.add(name))  # type: ignore[func-returns-value]
        yield f"dof name '{twice}' appears more than once; each row needs its own name"


def _value_faults(name: str, A: Sparse, dofs: Sequence[str] | None) -> Iterator[str]:
    if not within_range(A.data):
        where = name_of(dofs, int(A.tocoo().row[~(np.abs(A.data) <= LARGEST)][0]))
        yield f"the {name} matrix holds a value that is not finite or above {LARGEST:g}, in the row of dof {where}"
        return
    pair = asymmetry(A)
    if pair is not None:
        yield (
            f"the {name} matrix is not symmetric, first in the row of dof {name_of(dofs, pair.row)} "
            f"({pair.entry:.6g} there, {pair.mirrored:.6g} in its column); "
            "if one half is stored, mirror it; of gyroscopic or follower terms use ss.models.craig_bampton"
        )


def _mass_faults(M: Sparse, dofs: Sequence[str] | None) -> Iterator[str]:
    diagonal = M.diagonal()
    if diagonal.min() < 0.0:
        where = name_of(dofs, int(np.argmin(diagonal)))
        yield f"dof {where} has negative mass {diagonal.min():.3g}; check the mass matrix"
    elif diagonal.max() < SMALLEST:
        yield "the mass matrix is zero; give the material a density"
    elif (lowest := _lowest_ritz_value(M, diagonal)) < -1e-8:
        yield (
            f"the mass matrix is indefinite: some motion has negative kinetic energy ({lowest:.1e} of its dofs' own); "
            "check distorted elements and the mapping of the rows"
        )


def _lowest_ritz_value(M: Sparse, diagonal: NDArray[np.float64], steps: int = 30) -> float:
    """Lowest Ritz value of M scaled to unit diagonal, by Lanczos; being never below the true one, a negative proves."""
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    q = np.random.default_rng(2).standard_normal(M.shape[0])
    q, before, beta = q / np.linalg.norm(q), np.zeros_like(q), 0.0
    alphas: list[float] = []
    betas: list[float] = []
    for _ in range(min(steps, M.shape[0])):
        w = scale * (M @ (scale * q)) - beta * before
        alphas.append(float(q @ w))
        w -= alphas[-1] * q
        beta = float(np.linalg.norm(w))
        if beta < 1e-12:
            break
        betas.append(beta)
        before, q = q, w / beta
    T = np.diag(alphas) + np.diag(betas[: len(alphas) - 1], 1) + np.diag(betas[: len(alphas) - 1], -1)
    return float(np.linalg.eigvalsh(T)[0])
