"""Faults of stiffness and mass before a long computation."""

import re

import numpy as np
import pytest
from scipy.sparse import csr_array

from slipstick.structure.matrix_checks import matrix_faults, name_of

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
