"""MKL PARDISO for symmetric matrices, called through the library that the ``pypardiso`` package brings and finds."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from scipy import sparse

from slipstick.errors import InputError
from slipstick.solve.linear.factors import blas_libraries
from slipstick.typing import AnyArray, Sparse

_REAL_SYMMETRIC, _COMPLEX_SYMMETRIC = -2, 6
_FACTORISE, _SOLVE, _RELEASE = 12, 33, -1


class Pardiso:
    """LDL^T of a sparse symmetric matrix (n, n); real ones tell their inertia (positive, negative, zero)."""

    def __init__(self, A: Sparse) -> None:
        from pypardiso import PyPardisoSolver

        self._call = PyPardisoSolver().libmkl["pardiso"]  # a fresh handle: no argument types set
        blas_libraries.cache_clear()  # MKL is one of them now
        self._matrix = _upper(A)
        self._type = _COMPLEX_SYMMETRIC if np.iscomplexobj(A.data) else _REAL_SYMMETRIC
        self._handle = np.zeros(64, dtype=np.int64)
        self._options = np.zeros(64, dtype=np.int32)
        # own values; nested dissection; no refinement; perturbed pivots 1e-13; scaling and matching; zero-based indices
        for place, value in {0: 1, 1: 2, 9: 13, 10: 1, 12: 1, 17: -1, 20: 1, 34: 1}.items():
            self._options[place] = value
        self._run(_FACTORISE, np.zeros((0, 1), dtype=self._matrix.dtype))
        self.memory = 1024 * int(self._options[15] + self._options[16])

    @property
    def inertia(self) -> tuple[int, int, int] | None:
        """Positive, negative and zero eigenvalues; None for a complex matrix."""
        if self._type == _COMPLEX_SYMMETRIC:
            return None
        positive, negative = int(self._options[21]), int(self._options[22])
        return positive, negative, self._matrix.shape[0] - positive - negative

    def solve(self, B: AnyArray) -> AnyArray:
        """Solution of ``A X = B``, B (n, n_columns)."""
        return self._run(_SOLVE, np.asfortranarray(B, dtype=self._matrix.dtype))

    def _run(self, phase: int, B: AnyArray) -> AnyArray:
        X = np.empty_like(B, order="F")
        A, error, permutation = self._matrix, ctypes.c_int32(0), np.zeros(1, dtype=np.int32)
        numbers = [ctypes.byref(ctypes.c_int32(k)) for k in (1, 1, self._type, phase, A.shape[0])]
        arrays = [a.ctypes.data_as(ctypes.c_void_p) for a in (A.data, A.indptr, A.indices, permutation)]
        columns, quiet = ctypes.byref(ctypes.c_int32(B.shape[1])), ctypes.byref(ctypes.c_int32(0))
        tail = [a.ctypes.data_as(ctypes.c_void_p) for a in (B, X)]
        options = self._options.ctypes.data_as(ctypes.c_void_p)
        handle = self._handle.ctypes.data_as(ctypes.c_void_p)
        self._call(handle, *numbers, *arrays, columns, options, quiet, *tail, ctypes.byref(error))
        if error.value:
            raise InputError(f"PARDISO refused the matrix (its error {error.value}); choose another solver")
        return X

    def __del__(self) -> None:
        if getattr(self, "_handle", None) is not None and self._handle.any():
            self._run(_RELEASE, np.zeros((0, 1), dtype=self._matrix.dtype))


def _upper(A: Sparse) -> Any:
    """Upper triangle in rows, every diagonal entry stored, as PARDISO wants it."""
    coordinates = sparse.triu(A).tocoo()
    rows = np.concatenate([coordinates.row, np.arange(A.shape[0])])
    columns = np.concatenate([coordinates.col, np.arange(A.shape[0])])
    values = np.concatenate([coordinates.data, np.zeros(A.shape[0], dtype=A.dtype)])
    full = sparse.csr_array((values, (rows, columns)), shape=A.shape)
    full.sum_duplicates()
    full.sort_indices()
    return sparse.csr_array((full.data, full.indices.astype(np.int32), full.indptr.astype(np.int32)), shape=A.shape)
