"""Faults of arrays: each by its sentence, and none where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.sparse import coo_array, csc_array, csr_array

from slipstick.errors import Fault
from slipstick.structure.checks import (
    array_faults,
    asymmetry,
    checked_names,
    directions,
    known_shapes,
    named_shapes,
    number_faults,
    real,
    symmetry_faults,
)

A = np.array([[2.0, -1.0], [-1.0, 2.0]])


@pytest.mark.parametrize("store", [np.asarray, coo_array, lambda a: a.tolist() if hasattr(a, "tolist") else a])
def test_numbers(store):
    assert number_faults("K", store(A)) == []
    assert number_faults("K", store(A.astype(complex))) == []
    (fault,) = number_faults("K", store(A * (1 + 0.5j)), "do this")
    assert "imaginary parts up to 1 beside real ones up to 2" in str(fault)
    assert fault.remedy == "do this"
    found = real(store(A.astype(complex)))
    np.testing.assert_array_equal(found.toarray() if hasattr(found, "toarray") else found, A)


@pytest.mark.parametrize("bad", [[[1.0], [2.0, 3.0]], [["a"]], [[object()]], np.array(["2020"], dtype="M8[Y]")])
def test_what_is_no_number(bad):
    assert len(number_faults("K", bad)) == 1


def test_shape_range_and_sign():
    assert array_faults("k", A, (2, 2)) == []
    assert "found shape (2, 2); expected (3, 3)" in str(array_faults("k", A, (3, 3))[0])
    assert "expected all positive" in str(array_faults("k", A, (2, 2), positive=True)[0])
    assert "expected none negative" in str(array_faults("k", A, (2, 2), non_negative=True)[0])
    assert "not finite" in str(array_faults("k", np.array([np.nan]), (1,))[0])
    assert symmetry_faults("k", A) == []
    assert "not symmetric (entry (" in str(symmetry_faults("k", np.array([[1.0, 2.0], [3.0, 1.0]]))[0])


@pytest.mark.parametrize(
    ("dofs", "said"), [([], "none given"), (["x", "x"], "used more than once"), (["x", ""], "non-empty"), (5, "dofs")]
)
def test_names(dofs, said):
    assert said in str(checked_names(dofs)[1][0])
    assert checked_names("x") == (("x",), [])
    assert checked_names(["x", "y"]) == (("x", "y"), [])


def test_directions_and_load_shapes():
    assert directions("rows", [[1], [2]], 2).dtype == float
    for bad in ([1.0, 2.0], [[1.0]], [[np.nan], [1.0]]):
        with raises_fault("rows", expected="(2, number of directions), finite"):
            directions("rows", bad, 2)
    faults: list[Fault] = []
    assert named_shapes(None, faults) == {}
    assert named_shapes([1], faults) == {}
    assert len(faults) == 1
    known_shapes(["a"], {"a": 1})
    with raises_fault("load shape", "b", statement="is unknown"):
        known_shapes(["b"], {"a": 1})


@pytest.mark.parametrize("store", [np.asarray, coo_array, csc_array, csr_array])
def test_the_entry_that_differs_is_found(store):
    rng = np.random.default_rng(3)
    A = rng.standard_normal((40, 40))
    A += A.T
    assert asymmetry(store(A)) is None
    A[7, 21] += 1e-3
    found = asymmetry(store(A))
    assert found == (7, 21, A[7, 21], A[21, 7])
    assert asymmetry(store(A), tolerance=1e-2) is None


def test_rows_of_small_entries_count_as_much():
    """Rotations in other units: a difference in their rows is not hidden by large entries elsewhere."""
    units = np.array([1e6, 1e6, 1e-3, 1e-3])
    A = np.outer(units, units)
    assert asymmetry(A) is None
    A[2, 3] *= 1.0 + 1e-2
    assert asymmetry(A) is None  # beside what couples the row to the large ones it is nothing
    A[:2, 2:] = A[2:, :2] = 0.0
    found = asymmetry(A)
    assert found is not None
    assert found[:2] == (2, 3)


def test_nothing_is_symmetric():
    assert asymmetry(np.zeros((0, 0))) is None
    assert asymmetry(np.zeros((3, 3))) is None


@pytest.mark.parametrize("dtype", [int, np.float32, complex])
def test_sparse_numbers_of_any_kind_become_real_floats(dtype):
    made = real(csr_array(np.diag([1, 2]).astype(dtype)))
    assert made.dtype == np.float64
    np.testing.assert_array_equal(made.toarray(), np.diag([1.0, 2.0]))
