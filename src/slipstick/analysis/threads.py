"""What surrounds a computation: one thread of linear algebra, and signals that wait."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from typing import Any

from slipstick.interrupts import held


@cache
def _blas() -> Any:
    """Finding the BLAS libraries takes milliseconds: once a process."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def one_thread() -> AbstractContextManager[Any]:
    """Matrices of the balance are small: more BLAS threads only wait for each other."""
    limit: AbstractContextManager[Any] = _blas().limit(limits=1, user_api="blas")
    return limit


@contextmanager
def undisturbed() -> Iterator[None]:
    """One thread, and signals wait. It takes as long to enter as a small evaluation: once round many of them."""
    with one_thread(), held():
        yield
