"""What surrounds a computation: one thread of linear algebra, and signals that wait."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from slipstick.interrupts import held
from slipstick.solve.linear.factorisation import one_blas_thread


def one_thread() -> AbstractContextManager[Any]:
    """Matrices of the balance are small: more BLAS threads only wait for each other."""
    return one_blas_thread()


@contextmanager
def undisturbed() -> Iterator[None]:
    """One thread, and signals wait. It takes as long to enter as a small evaluation: once round many of them."""
    with one_thread(), held():
        yield
