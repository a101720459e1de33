"""Definite matrices and passive damping: the judgement is that of the eigenvalues, whatever the scale of the dofs."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from slipstick.structure.definite import definite_faults, energy_fed, scaled, semidefinite_to, smallest_pivot

RNG = np.random.default_rng(0)


def symmetric(lowest, n=8, seed=0):
    """A random one with this smallest eigenvalue."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return Q @ np.diag([lowest, *rng.uniform(1.0, 3.0, n - 1)]) @ Q.T


@pytest.mark.parametrize("store", [np.asarray, csc_array])
@pytest.mark.parametrize("name", ["K", "M"])
@pytest.mark.parametrize("units", [1.0, 1e6])
def test_definite_or_not(store, name, units):
    D = np.diag(np.where(np.arange(8) % 2, units, 1.0))
    for seed in range(5):
        assert definite_faults(name, store(D @ symmetric(0.1, seed=seed) @ D)) == []
        assert len(definite_faults(name, store(D @ symmetric(-0.1, seed=seed) @ D))) == 1


def test_a_free_structure_is_told_from_a_wrong_one():
    free = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for store in (np.asarray, csc_array):
        assert "can move without deforming" in str(definite_faults("K", store(free))[0])
        assert "wrong signs" in str(definite_faults("K", store(np.array([[1.0, -2.0], [-2.0, 1.0]])))[0])


@pytest.mark.parametrize("store", [np.asarray, csc_array])
def test_damping_that_feeds_energy_in_is_known(store):
    M = np.diag(RNG.uniform(0.5, 2.0, 8))
    assert energy_fed(store(0.0 * M), store(M)) == ""
    assert energy_fed(store(symmetric(0.0)), store(M)) == ""
    assert "with unit diagonal" in energy_fed(store(symmetric(-0.01)), store(M))


@pytest.mark.parametrize("lowest", [0.5, -0.5, -1e-6])
def test_pivots_have_the_sign_of_the_smallest_eigenvalue(lowest):
    for seed in range(5):
        assert np.sign(smallest_pivot(csc_array(symmetric(lowest, seed=seed)))) == np.sign(lowest)


def test_scaling_gives_a_unit_diagonal():
    A = symmetric(0.1)
    for store in (np.asarray, csc_array):
        np.testing.assert_allclose(scaled(store(A), A.diagonal()).diagonal(), 1.0)
    assert semidefinite_to(A, A.diagonal(), 1e-12) is None
    assert semidefinite_to(symmetric(-0.1), np.ones(8), 1e-3) == pytest.approx(-0.1)
