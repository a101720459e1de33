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


def solver_named(solver: str | None) -> Callable[[Any], Factorisation]:
    """What factorises a matrix stored by columns; None or "auto" takes the first solver there is."""
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


def _rslab(A: Sparse) -> Factorisation:
    import rslab

    own: dict[str, Any] = {} if _home() == os.getpid() else {"threads": 1}
    try:
        factors = rslab.ldlt(A, **own)
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    inertia = None if np.iscomplexobj(A.data) else Inertia(**dict(zip(_SIGNS, factors.inertia, strict=True)))
    bytes_held = int(factors.factor_nnz) * (A.dtype.itemsize + 4)
    return SolvedFactors("rslab", factors.solve_many, bytes_held, inertia, A.dtype)


_SIGNS = ("positive", "negative", "zero")


def _pardiso(A: Sparse) -> Factorisation:
    from slipstick.solve.linear.pardiso import Pardiso

    factors = Pardiso(A)
    inertia = None if factors.inertia is None else Inertia(**dict(zip(_SIGNS, factors.inertia, strict=True)))
    return SolvedFactors("pardiso", factors.solve, factors.memory, inertia, A.dtype)


def _superlu(A: Sparse) -> Factorisation:
    from scipy.sparse.linalg import splu

    try:
        factors = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise SingularMatrixError("the matrix is singular: a pivot is zero") from error
    return SolvedFactors("superlu", factors.solve, int(factors.nnz) * (A.dtype.itemsize + 4), None, A.dtype)


_SOLVERS: dict[str, tuple[str, Callable[[Any], Factorisation]]] = {
    "rslab": ("rslab", _rslab),
    "pardiso": ("pypardiso", _pardiso),
    "superlu": ("scipy", _superlu),
}
_PACKAGES = {"rslab": "rslab", "pardiso": "pypardiso", "superlu": "scipy"}
