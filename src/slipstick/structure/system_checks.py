"""What is wrong with the matrices of a structure, each by itself and with the others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from slipstick.errors import Fault
from slipstick.structure.checks import DAMPING_ELSEWHERE, entry_faults, number_faults, real, symmetry_faults
from slipstick.structure.definite import definite_faults
from slipstick.typing import Matrix


def system_matrices(given: Mapping[str, Any], n: int, *, dense: bool) -> tuple[dict[str, Any], list[Fault]]:
    """Those of the matrices M, K, C (n, n) that are right, stored dense or sparse, and all faults.

    What needs another matrix is left out where that one is missing or at fault.
    """
    right: dict[str, Any] = {}
    faults: list[Fault] = []
    for name, value in given.items():
        wrong = number_faults(name, value, DAMPING_ELSEWHERE)
        matrix = None if wrong else _numbers(value)
        wrong = wrong or _shape_faults(name, matrix, n) or symmetry_faults(name, matrix)
        faults += wrong
        if not wrong:
            right[name] = stored(matrix, dense)
    for name in ("M", "K"):
        wrong = definite_faults(name, right[name]) if name in right else []
        faults += wrong
        if wrong:
            del right[name]
    return right, faults


def stored(matrix: Matrix, dense: bool) -> Any:
    """Dense, or compressed sparse by columns."""
    if dense:
        return matrix.toarray() if hasattr(matrix, "toarray") else matrix
    from scipy.sparse import csc_array

    return csc_array(matrix)


def _numbers(value: Any) -> Any:
    return real(value).tocsc(copy=True) if hasattr(value, "tocsc") else real(value)


def _shape_faults(name: str, matrix: Matrix, n: int) -> list[Fault]:
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        return [Fault(name, found=f"shape {matrix.shape}", expected="a square matrix")]
    if matrix.shape[0] != n:
        return [Fault(name, found=f"shape {matrix.shape} but {n} dofs are named", remedy="they must agree")]
    return entry_faults(name, matrix.tocoo().data if hasattr(matrix, "tocoo") else matrix)
