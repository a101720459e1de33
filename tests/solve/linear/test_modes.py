"""Backward errors of modes: rounding for exact ones, their distance for others."""

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from slipstick.solve.linear.modes import Modes, backward_errors

K = np.diag([2.0] * 20) - np.diag([1.0] * 19, 1) - np.diag([1.0] * 19, -1)
M = np.diag(np.linspace(1.0, 2.0, 20))
VALUES, SHAPES = eigh(K, M)


def errors(values, shapes):
    return backward_errors(csr_array(K), csr_array(M), values, shapes)


def test_exact_and_wrong_modes():
    assert errors(VALUES, SHAPES).max() < 1e-14
    wrong = errors(VALUES * 1.001, SHAPES)
    assert wrong.min() > 1e-6
    assert wrong.max() < 1e-2
    np.testing.assert_allclose(errors(VALUES, 1e9 * SHAPES), errors(VALUES, SHAPES), atol=1e-15)


def test_rounding_below_zero_is_a_rigid_body():
    modes = Modes(eigenvalues=np.array([-1e-9, 4.0]), shapes=SHAPES, residuals=VALUES, complete=True, solver="x")
    assert modes.omega.tolist() == [0.0, 2.0]
