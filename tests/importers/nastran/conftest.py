"""Matrices to write and read again."""

import numpy as np
import pytest


@pytest.fixture(scope="module")
def matrices() -> dict[str, np.ndarray]:
    a = np.random.default_rng(3).normal(size=(12, 12)).astype(np.float32).astype(float)
    a = a + a.T + 30 * np.eye(12)
    a[np.abs(a) < 0.8] = 0.0
    return {"KAA": a.astype(np.float32).astype(float), "MAA": np.diag(np.arange(1.0, 13.0))}
