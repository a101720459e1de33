"""Compilation of the contact kernel: once on a machine, kept on disk."""

from __future__ import annotations

import os
from time import perf_counter

import numpy as np

COMPILE_TIME = "10 to 30 s"
"""Time of the first evaluation: 14 s of processor time were measured, more elapsed time on a busy machine."""
INTERPRETED = "NUMBA_DISABLE_JIT"
"""Environment variable of numba's that leaves its functions plain Python: an element takes 2 ms instead of 10 us."""


def is_interpreted() -> bool:
    """Whether the kernel runs as plain Python."""
    return os.environ.get(INTERPRETED, "0") not in ("", "0")


def is_compiled() -> bool:
    """Whether the compiled kernel is in the cache, so that the first evaluation starts at once."""
    from slipstick.trig.compiled import cache_folder

    return any(cache_folder().glob("run_elements-slipstick.contact.kernel.batch-*.nbc"))


def compile_kernel() -> float:
    """Compile the kernel and the search for extreme motions, or load them from the cache; returns the seconds taken."""
    from slipstick.contact.forces import element_forces
    from slipstick.trig.extremes import largest_deviations
    from slipstick.trig.harmonics import Harmonics

    start = perf_counter()
    h = Harmonics([0, 1])
    one = np.ones(1)
    element_forces(h, np.ones((1, 3)), np.zeros((1, 3)), v=one, kt=one, mu=one, kn=one, gap=-one)
    largest_deviations(h, np.ones((1, 3)))
    return perf_counter() - start
