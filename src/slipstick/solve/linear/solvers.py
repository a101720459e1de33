"""The sparse direct solvers there are, in the order of the automatic choice.

``rslab`` (LDL^T with inertia), ``pardiso`` (MKL, through the ``pypardiso`` package, LDL^T with inertia) and ``superlu``
(SciPy, LU, always there, no inertia).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from slipstick.errors import InputError
from slipstick.solve.linear.factors import Factorisation, Inertia, SingularMatrixError, SolvedFactors
from slipstick.typing import Sparse


def available_solvers() -> tuple[str, ...]:
    """Names of the direct solvers installed here, the preferred one first.

    >>> "superlu" in available_solvers()
    True
    """
    return tuple(name for name, (module, _) in _SOLVERS.items() if find_spec(module) is not None)


Solver = Callable[[Any, Any], Factorisation]
"""Factorises a matrix stored by columns; takes an ``ordering`` known from another matrix too, or None."""


def solver_named(solver: str | None) -> Solver:
    """The function of a solver; None or "auto" takes the first there is."""
    return _SOLVERS[_choose(solver)][1]


def _choose(solver: str | None) -> str:
    available = available_solvers()
    if solver is None or solver == "auto":
        return available[0]
    if solver not in _SOLVERS:
        raise InputError(f"solver '{solver}' is not known; choose one of {', '.join(_SOLVERS)} or leave it out")
    if solver not in available:
        raise InputError(
            f"solver '{solver}' is not installed: pip install {_PACKAGES[solver]}, or choose {' or '.join(available)}"
        )
    return solver


@cache
def _home() -> int:
    """The process that has rslab's threads: in one forked from it they are gone, and waiting for them never ends."""
    return os.getpid()


def _rslab(A: Sparse, known: Any) -> Factorisation:
    own: dict[str, Any] = {} if _home() == os.getpid() else {"threads": 1}
    try:
        factors, ordering = _ordered(A, known, own)
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    inertia = None if np.iscomplexobj(A.data) else Inertia(**dict(zip(_SIGNS, factors.inertia, strict=True)))
    bytes_held = int(factors.factor_nnz) * (A.dtype.itemsize + 4)
    return SolvedFactors("rslab", factors.solve_many, bytes_held, inertia, A.dtype, ordering)


def _ordered(A: Sparse, known: Any, own: dict[str, Any]) -> tuple[Any, Any]:
    """Factors and the ordering they were made with: the one known where A has its pattern, else its own."""
    import rslab

    if known is not None:
        try:
            return known.factor(A, **own), known
        except ValueError:  # another pattern
            pass
    ordering = rslab.analyze(A, path="ldlt", **own)
    return ordering.factor(A, **own), ordering


_SIGNS = ("positive", "negative", "zero")


def _pardiso(A: Sparse, known: Any) -> Factorisation:
    from slipstick.solve.linear.pardiso import Pardiso

    factors = Pardiso(A)
    inertia = None if factors.inertia is None else Inertia(**dict(zip(_SIGNS, factors.inertia, strict=True)))
    return SolvedFactors("pardiso", factors.solve, factors.memory, inertia, A.dtype)


def _superlu(A: Sparse, known: Any) -> Factorisation:
    from scipy.sparse.linalg import splu

    try:
        factors = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    return SolvedFactors("superlu", factors.solve, int(factors.nnz) * (A.dtype.itemsize + 4), None, A.dtype)


_SOLVERS: dict[str, tuple[str, Solver]] = {
    "rslab": ("rslab", _rslab),
    "pardiso": ("pypardiso", _pardiso),
    "superlu": ("scipy", _superlu),
}
_PACKAGES = {"rslab": "rslab", "pardiso": "pypardiso", "superlu": "scipy"}
