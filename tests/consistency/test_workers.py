"""Worker processes and threads: none hangs, all agree bit for bit, and results belong to one batch."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from slipstick import Harmonics
from slipstick.contact import forces
from slipstick.contact.forces import element_forces

METHODS = [
    "threads",
    *(m if m == "fork" else pytest.param(m, marks=pytest.mark.verify) for m in multiprocessing.get_all_start_methods()),
]


@pytest.mark.parametrize("method", METHODS)
def test_workers_agree_and_end(method: str) -> None:
    """In a process of its own, with two threads whatever the machine has."""
    found = subprocess.run(
        [sys.executable, str(Path(__file__).parent / "workers.py"), method],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "NUMBA_NUM_THREADS": "2", "OMP_NUM_THREADS": "1"},
    )
    assert found.stdout == "True\n", found.stderr


def batch(count: int, seed: int = 0) -> forces.ContactForces:
    rng, h = np.random.default_rng(seed), Harmonics(range(4))
    X, Y = rng.normal(size=(2, count, h.size))
    one = np.ones(count)
    return element_forces(h, X, Y, v=one, kt=one, mu=0.3 * one, kn=one, gap=-one)


def test_threads_never_share_results() -> None:
    alone = [batch(100, seed).Fx.copy() for seed in range(6)]

    def kept(seed: int) -> bool:
        results = [batch(100, (seed + k) % 6) for k in range(6)]
        return all(np.array_equal(f.Fx, alone[(seed + k) % 6]) for k, f in enumerate(results))

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(kept, list(range(6)) * 5))
