"""What is wrong with a pair of sparse stiffness and mass matrices, in sentences, before any long computation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from slipstick.faults import LARGEST, SMALLEST
from slipstick.structure.checks import within_range
from slipstick.structure.symmetry import asymmetry
from slipstick.typing import Sparse


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
            "if one half is stored, mirror it; gyroscopic or follower terms cannot be reduced here"
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
