"""Series against exponentials of the whole matrix."""

import numpy as np
import pytest
from scipy.linalg import expm

from slipstick.analysis.stability.monodromy import propagate

RNG = np.random.default_rng(2)
R, N, SCALE = 3, 2, 5.0


def whole(forces):
    """The matrix of ``q' = scale p, p' = -forces [q, p, c], c' = 0``."""
    A = np.zeros((2 * R + N, 2 * R + N))
    A[:R, R : 2 * R] = SCALE * np.eye(R)
    A[R : 2 * R] = -forces
    return A


@pytest.mark.parametrize("length", [0.0, 0.01, 1.0, 20.0])
def test_intervals_are_exponentials_and_starts_are_rows(length) -> None:
    stiff = [np.hstack([np.diag([4.0, 9.0, 30.0]), 0.3 * np.eye(R), RNG.normal(size=(R, N))]) for _ in range(2)]
    row = RNG.normal(size=2 * R + N)
    Phi = np.eye(2 * R + N)
    propagate(
        Phi, SCALE, np.array(stiff), np.array([15.0, 15.0]), np.array([0, 1, 0]), np.array([length, 0.3, 0.0]),
        np.array([1, 0, -1]), np.array([row, 0.0 * row, row]),
    )  # fmt: skip
    wanted = expm(whole(stiff[0]) * length)
    wanted[2 * R + 1] = row @ wanted
    wanted = expm(whole(stiff[1]) * 0.3) @ wanted
    wanted[2 * R] = 0.0
    assert np.abs(Phi - wanted).max() < 1e-12 * max(1.0, np.abs(wanted).max())
