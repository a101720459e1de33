"""Matrices and boxes to import."""

import numpy as np
from scipy.sparse import csr_array

from slipstick.fem.materials import Material
from slipstick.importers.deck import Deck

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


def spd(n: int, seed: int = 0) -> np.ndarray:
    a = np.random.default_rng(seed).normal(size=(n, n))
    a[np.abs(a) < 0.7] = 0.0
    return a @ a.T + n * np.eye(n)


def raw(K, M, held=(), rows=None, **matrices) -> Deck:
    at = np.arange(np.shape(K)[0])
    return Deck(
        matrices={"K": csr_array(K), "M": csr_array(M), **{k: csr_array(v) for k, v in matrices.items()}},
        rows=np.stack([10 + at // 3, at % 3], axis=1) if rows is None else rows,
        held=set(held),
    )
