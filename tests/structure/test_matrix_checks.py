"""Faults of mass, damping and stiffness: the judgement is that of the eigenvalues, whatever the scale of the dofs."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.sparse import csc_array, csr_array

from slipstick.structure.matrix_checks import (
    definite_faults,
    energy_fed,
    matrix_faults,
    name_of,
    scaled,
    semidefinite_to,
    smallest_pivot,
    system_matrices,
)

K = np.array([[3.0, -1.0, 0.0], [-1.0, 3.0, -1.0], [0.0, -1.0, 3.0]])
DOFS = ("a", "b", "c")


def problems(k=K, m=None, dofs=DOFS):
    return matrix_faults(csr_array(k), csr_array(np.eye(3) if m is None else m), dofs)


def changed(a, at, value):
    a = a.copy()
    a[at] = value
    return a


def test_a_sound_pair_has_none():
    assert problems() == []
    assert problems(dofs=None) == []
    assert problems(m=np.diag([1.0, 0.0, 1.0])) == []  # a dof without mass is condensed later


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"k": K[:2], "dofs": None}, "give a square one"),
        ({"m": np.eye(2)}, "differ in size"),
        ({"dofs": ("a", "b")}, "2 dof names for matrices of 3 rows"),
        ({"dofs": ("a", "b", "a")}, "dof name 'a' appears more than once"),
        ({"k": changed(K, (1, 1), np.nan)}, "not finite or above .* in the row of dof 'b'"),
        ({"k": changed(K, (0, 1), 5.0)}, "the stiffness matrix is not symmetric"),
        ({"m": np.diag([1.0, -1.0, 1.0])}, "dof 'b' has negative mass -1"),
        ({"m": np.zeros((3, 3))}, "the mass matrix is zero"),
        ({"m": np.eye(3) - 0.9 * (np.ones((3, 3)) - np.eye(3))}, "some motion has negative kinetic energy"),
    ],
)
def test_faults(given, said):
    (fault,) = problems(**given)
    assert re.search(said, fault)


def test_rows_without_names_are_numbered():
    assert name_of(None, 4) == "number 4"
    assert name_of(DOFS, 1) == "'b'"


RNG = np.random.default_rng(0)


def symmetric_with(lowest, n=8, seed=0):
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
        assert definite_faults(name, store(D @ symmetric_with(0.1, seed=seed) @ D)) == []
        assert len(definite_faults(name, store(D @ symmetric_with(-0.1, seed=seed) @ D))) == 1


def test_a_free_structure_is_told_from_a_wrong_one():
    free = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for store in (np.asarray, csc_array):
        assert "can move without deforming" in str(definite_faults("K", store(free))[0])
        assert "wrong signs" in str(definite_faults("K", store(np.array([[1.0, -2.0], [-2.0, 1.0]])))[0])


@pytest.mark.parametrize("store", [np.asarray, csc_array])
def test_damping_that_feeds_energy_in_is_known(store):
    M = np.diag(RNG.uniform(0.5, 2.0, 8))
    assert energy_fed(store(0.0 * M), store(M)) == ""
    assert energy_fed(store(symmetric_with(0.0)), store(M)) == ""
    assert "with unit diagonal" in energy_fed(store(symmetric_with(-0.01)), store(M))


@pytest.mark.parametrize("lowest", [0.5, -0.5, -1e-6])
def test_pivots_have_the_sign_of_the_smallest_eigenvalue(lowest):
    for seed in range(5):
        assert np.sign(smallest_pivot(csc_array(symmetric_with(lowest, seed=seed)))) == np.sign(lowest)


def test_scaling_gives_a_unit_diagonal():
    A = symmetric_with(0.1)
    for store in (np.asarray, csc_array):
        np.testing.assert_allclose(scaled(store(A), A.diagonal()).diagonal(), 1.0)
    assert semidefinite_to(A, A.diagonal(), 1e-12) is None
    assert semidefinite_to(symmetric_with(-0.1), np.ones(8), 1e-3) == pytest.approx(-0.1)


EYE = np.eye(2)
SKEW = np.array([[2.0, 1.0], [0.0, 2.0]])


def faults(**given):
    return system_matrices(given, 2, dense=True)


def test_right_ones_come_back():
    right, wrong = faults(M=EYE, K=2 * EYE, C=0 * EYE)
    assert not wrong
    assert sorted(right) == ["C", "K", "M"]
    assert hasattr(system_matrices({"M": EYE}, 2, dense=False)[0]["M"], "tocsc")


def test_no_fault_hides_another():
    right, wrong = faults(M=SKEW, K=-EYE, C=np.eye(3))
    assert [(fault.where, fault.statement[:13]) for fault in wrong] == [
        (("M",), "not symmetric"), (("C",), ""), (("K",), "the stiffness"),
    ]  # fmt: skip
    assert not set(right) & {"M", "K", "C"}


def test_damping_may_feed_energy_in():
    assert faults(M=EYE, K=EYE, C=-EYE)[1] == []
    assert [fault.where for fault in faults(M=-EYE, K=EYE, C=-EYE)[1]] == [("M",)]
