"""What the solvers share: shapes kept, complex columns of a real matrix in two parts."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from slipstick.solve.linear.factors import Factorisation, SolvedFactors
from slipstick.solve.linear.solvers import available_solvers, solver_named

A = np.diag([4.0, 5.0, 6.0]) + np.ones((3, 3))


@pytest.mark.parametrize("solver", available_solvers())
@pytest.mark.parametrize("shape", [(3,), (3, 1), (3, 5), (3, 0)])
@pytest.mark.parametrize("factor", [1.0, 1.0 + 2.0j])
def test_every_solver_solves_every_shape(solver, shape, factor):
    factors = solver_named(solver)(csc_array(A), None)
    assert isinstance(factors, Factorisation)
    B = factor * np.random.default_rng(0).normal(size=shape)
    np.testing.assert_allclose(A @ factors.solve(B), B, atol=1e-13)
    assert factors.solve(B).shape == shape
    assert factors.memory > 0
    if factors.inertia is not None:
        assert (factors.inertia.positive, factors.inertia.negative, factors.inertia.zero) == (3, 0, 0)


def test_complex_columns_are_solved_in_two_parts():
    asked = []
    factors = SolvedFactors("own", lambda B: asked.append(B.dtype) or 2.0 * B, memory=1)
    np.testing.assert_array_equal(factors.solve(np.array([1.0 + 3.0j])), [2.0 + 6.0j])
    assert asked == [np.float64, np.float64]
