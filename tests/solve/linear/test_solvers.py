"""The choice of a direct solver, and what is said where it cannot be."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from slipstick.errors import InputError
from slipstick.solve.linear.factors import SingularMatrixError
from slipstick.solve.linear.solvers import available_solvers, solver_named


def test_choice():
    assert "superlu" in available_solvers()
    assert solver_named(None) is solver_named("auto") is solver_named(available_solvers()[0])
    with pytest.raises(InputError, match="solver 'umfpack' is not known; choose one of"):
        solver_named("umfpack")


def test_a_zero_pivot_is_a_singular_matrix():
    with pytest.raises(SingularMatrixError, match="the matrix is singular"):
        solver_named("superlu")(csc_array(np.array([[1.0, 1.0], [1.0, 1.0]])), None)
