"""The structure as modes: the same receptance whatever form it comes in."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.stability.dynamics import FEWEST, dynamics
from slipstick.structure.protocol import TimeEquations

RNG = np.random.default_rng(0)
N = 12
ROOT = RNG.normal(size=(N, N))
M = np.diag(RNG.uniform(0.5, 2.0, N))
K = 10.0 * ROOT @ ROOT.T + 5.0 * np.eye(N)
C = 0.02 * K + 0.1 * M
ROWS = RNG.normal(size=(3, N))


def equations(stiffness=K, mass=M):
    return TimeEquations(M=mass, C=C, K=stiffness, rows=ROWS, columns=ROWS.T, feedthrough=0.01 * np.eye(3))


def receptance(d, w):
    """Motion at the ports by forces on them, with the sign of ``s = rows q - R f``."""
    return d.rows @ np.linalg.solve(d.K - w * w * np.eye(d.size) + 1j * w * d.C, d.columns) + d.R


@pytest.mark.parametrize("unsymmetric", [False, True])
def test_the_receptance_at_the_ports_stays(unsymmetric) -> None:
    own = K + unsymmetric * np.triu(np.ones((N, N)), 1)
    found, w = dynamics(equations(own)), 3.0
    wanted = ROWS @ np.linalg.solve(own - w * w * M + 1j * w * C, ROWS.T) + 0.01 * np.eye(3)
    assert np.abs(receptance(found, w) - wanted).max() < 1e-12 * np.abs(wanted).max()
    assert unsymmetric == bool(np.any(found.K - np.diag(np.diag(found.K))))


def test_fast_modes_are_static() -> None:
    whole = dynamics(equations())
    cut = np.sqrt(np.sort(np.diag(whole.K))[9]) * 1.001
    some = whole.slowest(whole.count_below(cut))
    assert some.size == 10
    assert np.abs(receptance(some, 0.0) - receptance(whole, 0.0)).max() < 1e-12
    assert np.abs(receptance(some, 1.0) - receptance(whole, 1.0)).max() < 1e-3
    assert whole.count_below(1e9) == N
    assert whole.count_below(0.0) == FEWEST
    assert whole.slowest(N) is whole


def test_coordinates_that_are_no_modes_all_stay() -> None:
    own = dynamics(equations(K + np.triu(np.ones((N, N)), 1)))
    assert own.count_below(0.0) == N
    assert own.slowest(3) is own


def test_a_singular_mass_is_told() -> None:
    with pytest.raises(ss.InputError, match="stability: the mass matrix is singular"):
        dynamics(equations(K + np.triu(np.ones((N, N)), 1), 0.0 * M))
