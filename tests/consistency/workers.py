"""The same batches in this process, in worker processes of each kind and in threads: ``python workers.py METHOD``."""

from __future__ import annotations

import multiprocessing
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy import sparse

from slipstick import Harmonics
from slipstick.contact.forces import element_forces
from slipstick.solve.linear.factorisation import factorise


def batch(seed: int, count: int = 200) -> bytes:
    """Forces and tangents of a batch that is split over threads."""
    rng, h = np.random.default_rng(seed), Harmonics(range(6))
    X, Y = rng.normal(size=(2, count, h.size))
    one = np.ones(count)
    f = element_forces(h, X, Y, v=rng.normal(size=count), kt=one, mu=0.3 * one, kn=one, gap=-one)
    return f.Fx.tobytes() + f.dFx_dX.tobytes() + f.work.tobytes()


def solution(n: int = 20) -> bytes:
    """A sparse factorisation large enough for several threads, and two BLAS products."""
    line = sparse.diags_array([-np.ones(n - 1), 2.01 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    one = sparse.eye_array(n)
    A = sum(sparse.kron(sparse.kron(*p), q) for p, q in (((line, one), one), ((one, line), one), ((one, one), line)))
    x = factorise(A.tocsr(), check=False).solve(np.ones((n**3, 4)))
    return (x.T @ x).tobytes()


def work(seed: int) -> bytes:
    return batch(seed) + solution()


def main(method: str) -> bool:
    """Whether workers agree with this process bit for bit, which has used all threads before they start."""
    seeds = range(4)
    if method == "threads":
        alone = [batch(seed) for seed in seeds]
        with ThreadPoolExecutor(8) as pool:
            return list(pool.map(batch, list(seeds) * 25)) == alone * 25
    alone = [work(seed) for seed in seeds]
    with multiprocessing.get_context(method).Pool(2) as workers:
        return workers.map_async(work, seeds).get(60) == alone


if __name__ == "__main__":
    print(main(sys.argv[1]))
