"""Matrices and boxes to import."""

import numpy as np
from scipy.sparse import csr_array

from slipstick.fem.materials import Material
from slipstick.importers.raw_model import DofMap, Nodes, RawModel

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


def spd(n: int, seed: int = 0) -> np.ndarray:
    a = np.random.default_rng(seed).normal(size=(n, n))
    a[np.abs(a) < 0.7] = 0.0
    return a @ a.T + n * np.eye(n)


def raw(K, M, held=(), nodes=None, **matrices) -> RawModel:
    n = np.shape(K)[0]
    rows = np.arange(n)
    held = np.array(held, dtype=np.int64).reshape(-1, 2)
    return RawModel(
        matrices={"K": csr_array(K), "M": csr_array(M), **{k: csr_array(v) for k, v in matrices.items()}},
        dof_map=DofMap(nodes=10 + rows // 3, components=rows % 3) if nodes is None else nodes,
        nodes=Nodes(held=held),
    )
