"""Measuring several things in turn, so that what else the machine does meets all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numba
import numpy as np
from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """numba and BLAS are held to one thread."""
    threads, numba.config.NUMBA_NUM_THREADS = numba.config.NUMBA_NUM_THREADS, 1
    try:
        with threadpool_limits(1):
            yield
    finally:
        numba.config.NUMBA_NUM_THREADS = threads


def interleaved(functions: Sequence[Callable[[], object]], repeats: int) -> np.ndarray:
    """Seconds of processor time (repeats, n) of functions called in turn, each called once before."""
    times = np.empty((repeats + 1, len(functions)))
    for row in times:
        for k, function in enumerate(functions):
            start = time.process_time()
            function()
            row[k] = time.process_time() - start
    return times[1:]
