"""Factors of the matrices of a sector for all phases: what no phase changes is eliminated once.

With ``z = e^{-i phi}`` the matrix ``A(phi) = A0 + z A1 + z' A1^T`` differs between phases in the rows and columns of
the face that A1 leads to. All others are eliminated, in real numbers, from the open sector ``[[A0, A1], [A1^T, 0]]``.
The Schur complement S of the face here and there is left: that of A(phi) is ``[1, z]^H S [1, z]``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from slipstick.solve.linear.condensation import Condensed, DenseFactors, Dissection, dissect, negative_eigenvalues
from slipstick.solve.linear.factorisation import Factorisation, Inertia, shifted
from slipstick.typing import AnyArray, Array, IntArray, Sparse

Joint = tuple[Any, Any]
"""A0 and A1, (n, n)."""


@dataclass(frozen=True)
class _Open:
    """The sector but its face eliminated: ``near`` joins rows kept among themselves, ``far`` to the face beyond."""

    condensed: Condensed
    near: Array
    far: Array


class SectorFactors:
    """Of ``K(phi) - shift M(phi)`` for all phases, K and M by A0 and A1; ``also``: rows to keep with the face."""

    def __init__(self, K: Joint, M: Joint, also: IntArray) -> None:
        self._K, self._M, self._n = K, M, K[0].shape[0]
        coupling = sparse.csc_array(abs(K[1]) + abs(M[1]))
        coupling.eliminate_zeros()
        self._face = np.flatnonzero(np.diff(coupling.indptr))
        self._kept = np.concatenate([self._face, np.setdiff1d(also, self._face)])
        self._free = np.setdiff1d(np.arange(self._n), self._kept)
        self._ordering: Dissection | None = None
        self._static: _Open | None = None
        self._counting: _Open | None = None
        self.counted: float | None = None
        """Where eigenvalues were counted last: there those of another phase cost little."""

    def at(self, shift: float, phase: complex, left: Sparse | None, solve: bool = True) -> Factorisation:
        """Factors for a phase, projected on ``left`` (n, n_k), the identity but for rows kept; None: all of it.

        Without ``solve`` they only tell the inertia. Raises SingularMatrixError.
        """
        opened = self._opened(shift, solve)
        condensed, free, n_kept = opened.condensed, self._free, len(self._kept)
        whole = sparse.eye_array(self._n, format="csr") if left is None else sparse.csr_array(left)
        columns = whole[free].indices
        others = np.setdiff1d(np.arange(whole.shape[1]), columns)
        local = whole[self._kept][:, others]
        h = slice(len(self._face))  # the face comes first
        joined = np.array(opened.near, dtype=np.result_type(opened.near, phase), order="F")
        joined[:, h] += phase * opened.far
        joined[h] += np.conj(phase) * opened.far.T
        if left is not None:
            joined = np.asarray(local.conj().T @ (local.T @ joined.T).T)
        name, dtype = "nested dissection", joined.dtype
        if not solve:
            negative = condensed.negative + negative_eigenvalues(joined)
            return Factorisation(name, _unsolved, 0, Inertia(len(columns) + len(others) - negative, negative, 0), dtype)
        face = DenseFactors(joined)
        del joined
        places = columns[np.searchsorted(free, condensed.ordering.order[: len(free)])]

        def solution(B: AnyArray) -> AnyArray:
            X = np.zeros((len(condensed.ordering.order), B.shape[1]), dtype=face.L.dtype)
            inner, here, there = np.split(X, [len(free), len(free) + n_kept])
            inner[:] = B[places]
            condensed.forward(X.view(float))
            here[h] += np.conj(phase) * there
            y = face.solve(B[others] + local.conj().T @ here)
            here[:] = local @ y
            there[:] = phase * here[h]
            condensed.backward(X.view(float))
            found = np.empty((whole.shape[1], B.shape[1]), dtype=X.dtype)
            found[places], found[others] = inner, y
            return found

        negative = condensed.negative + face.negative
        inertia = Inertia(whole.shape[1] - negative, negative, 0)
        memory = condensed.memory + face.L.nbytes
        return Factorisation(name, solution, memory, inertia, dtype)

    def _opened(self, shift: float, solve: bool) -> _Open:
        """At rest, and where eigenvalues were counted last, it is kept."""
        if shift == 0.0 and self._static is not None:
            return self._static
        if not solve and shift == self.counted and self._counting is not None:
            return self._counting
        (K0, K1), (M0, M1) = self._K, self._M
        inside, across = (K0, K1) if shift == 0.0 else (shifted(K0, M0, shift), shifted(K1, M1, shift))
        across = sparse.csr_array(across[:, self._face])
        if self._ordering is None:
            whole, joint = (_pattern(A) + _pattern(B) for A, B in zip(self._K, self._M, strict=True))
            joint = joint[:, self._face]
            kept = np.concatenate([self._kept, self._n + np.arange(len(self._face))])
            self._ordering = dissect(sparse.block_array([[whole, joint], [joint.T, None]]), kept)
        condensed, schur = Condensed.of(
            sparse.block_array([[inside, across], [across.T, None]]), self._ordering, solve=solve
        )
        n_kept, h = len(self._kept), slice(len(self._face))
        near = schur[:n_kept, :n_kept].copy()
        near[h, h] += schur[n_kept:, n_kept:]
        found = _Open(condensed, near, schur[:n_kept, n_kept:].copy())
        if shift == 0.0 and solve:
            self._static = found
        elif not solve:
            self._counting, self.counted = found, shift
        return found


@dataclass(frozen=True)
class PhaseFactors:
    """Those of one phase, by shift."""

    sector: SectorFactors
    phase: complex
    left: Any

    def at(self, shift: float, solve: bool = True) -> Factorisation:
        """See :meth:`SectorFactors.at`."""
        return self.sector.at(shift, self.phase, self.left, solve)

    @property
    def counted(self) -> float | None:
        """Where eigenvalues of some phase were counted last."""
        return self.sector.counted


def _unsolved(B: AnyArray) -> AnyArray:
    raise NotImplementedError("these factors only count eigenvalues")


def _pattern(A: Any) -> Any:
    """One where something is stored."""
    A = sparse.csr_array(A)
    return sparse.csr_array((np.ones(A.nnz, dtype=np.int8), A.indices, A.indptr), shape=A.shape)
