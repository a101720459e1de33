"""Measuring several things in turn, so that what else the machine does meets all of them alike; and memory."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

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


def peak_memory() -> float:
    """The most that this process has had, GB.

    Told by Linux; ``ru_maxrss``, which other systems have too, is on Linux also that of the process it was started by.
    """
    told = Path("/proc/self/status")
    if told.exists():
        kilobytes = next(line for line in told.read_text().splitlines() if line.startswith("VmHWM")).split()[1]
        return int(kilobytes) * 1024 / 1e9
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0) / 1e9
