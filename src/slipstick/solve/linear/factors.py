"""What a factorised sparse matrix is, whoever factorised it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol, runtime_checkable

import numpy as np

from slipstick.errors import InputError
from slipstick.typing import AnyArray


class SingularMatrixError(InputError):
    """The matrix has no inverse to working accuracy; ``null_vector`` (n,) is a motion it does not resist, if known."""

    def __init__(self, problem: str, null_vector: AnyArray | None = None) -> None:
        super().__init__(problem)
        self.null_vector = null_vector


@dataclass(frozen=True, kw_only=True)
class Inertia:
    """Numbers of positive, negative and zero eigenvalues (Sylvester)."""

    positive: int
    negative: int
    zero: int


@runtime_checkable
class Factorisation(Protocol):
    """A factorised square matrix of n rows."""

    @property
    def name(self) -> str:
        """The solver's name, for the results."""
        ...

    @property
    def inertia(self) -> Inertia | None:
        """Numbers of eigenvalues by sign; None when the solver does not tell or the matrix is complex."""
        ...

    @property
    def memory(self) -> int:
        """Bytes held by the factors, estimated."""
        ...

    @property
    def ordering(self) -> Any:
        """What the solver found out about the pattern alone; serves other matrices of the pattern. None if nothing."""
        ...

    def solve(self, B: AnyArray) -> AnyArray:
        """Solution X of ``A X = B``; B is (n,) or (n, n_columns), X has its shape."""
        ...


class SolvedFactors:
    """What the solvers share: a name, an inertia, a size, an ordering, and a function that solves (n, n_columns)."""

    def __init__(
        self,
        name: str,
        solve: Callable[[AnyArray], AnyArray],
        memory: int,
        inertia: Inertia | None = None,
        dtype: Any = np.float64,
        ordering: Any = None,
    ) -> None:
        self.name = name
        self.memory = memory
        self.inertia = inertia
        self.ordering = ordering
        self._solve = solve
        self._dtype = dtype

    def solve(self, B: AnyArray) -> AnyArray:
        """As in ``Factorisation``; complex columns of a real matrix are solved for in two parts."""
        B = np.asarray(B)
        if np.iscomplexobj(B) and not np.issubdtype(self._dtype, np.complexfloating):
            return self.solve(B.real) + 1j * self.solve(B.imag)
        columns = np.asarray(B if B.ndim == 2 else B[:, None], dtype=self._dtype)
        if columns.shape[1] == 0:
            return columns.reshape(B.shape)
        with one_blas_thread():
            return np.asarray(self._solve(columns)).reshape(B.shape)


def one_blas_thread() -> AbstractContextManager[Any]:
    """Context in which numpy's and MKL's linear algebra use one thread."""
    limit: AbstractContextManager[Any] = blas_libraries().limit(limits=1, user_api="blas")
    return limit


@cache
def blas_libraries() -> Any:
    """Those that are loaded. Finding them takes milliseconds: once, and again (``cache_clear``) when one is loaded."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
