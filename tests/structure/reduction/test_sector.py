"""Phases of a sector are reduced as bodies are: to a number of modes, or to an accuracy up to a frequency."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csc_array, csr_array

from slipstick.solve.linear.factorisation import Factorisation, Inertia
from slipstick.structure.reduction.data import Columns
from slipstick.structure.reduction.request import Accuracy
from slipstick.structure.reduction.sector import reduce_phase

N = 120


class Dense:
    """Factors of Hermitian matrices that are dense, with their inertia."""

    counted = None

    def __init__(self, K: Any, M: Any) -> None:
        self.K, self.M = K.toarray(), M.toarray()

    def at(self, shift: float, solve: bool = True) -> Factorisation:
        matrix = self.K - shift * self.M
        negative = int((np.linalg.eigvalsh(matrix) < 0.0).sum())
        return Factorisation("dense", partial(np.linalg.solve, matrix), 0, Inertia(N - negative, negative, 0), complex)


def phase() -> tuple[csr_array, csr_array, csc_array]:
    """A chain of masses whose springs turn the phase: Hermitian, with frequencies from 0.6 to 27 rad/s."""
    turn = np.exp(0.3j)
    K = np.diag(2.1 + 0.05 * np.arange(N) ** 2) - turn * np.eye(N, k=1) - turn.conj() * np.eye(N, k=-1)
    keep = np.zeros((N, 2))
    keep[[3, 40], [0, 1]] = 1.0
    return csr_array(K), csr_array(np.eye(N)), csc_array(keep)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5])
def test_accuracy_up_to_a_frequency_holds_below_it(accuracy: float) -> None:
    K, M, B = phase()
    top = 1.5
    want = Accuracy(relative=accuracy, highest=top)
    made = reduce_phase(K, M, Columns(B, np.zeros((N, 0))), want, Dense(K, M))
    a, w2 = made.amplitudes, made.omega**2
    assert made.error_estimate is not None
    assert made.error_estimate <= accuracy
    assert made.omega.size < N
    for omega in np.linspace(0.05, top, 7):
        exact = B.T @ np.linalg.solve(K.toarray() - omega**2 * M.toarray(), B.toarray())
        modal = (a * (1.0 / (w2 - omega**2) - 1.0 / w2)) @ a.conj().T + made.static + omega**2 * made.second_residual
        assert np.linalg.norm(modal - exact) <= accuracy * np.linalg.norm(exact)
