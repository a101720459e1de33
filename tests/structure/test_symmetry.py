"""One rule of symmetry for dense and sparse matrices."""

import numpy as np
import pytest
from scipy.sparse import coo_array, csc_array, csr_array

from slipstick.structure.symmetry import asymmetry


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
