"""Sizes of a receptance against the full modal sum, and what they are where it passes through zero."""

import numpy as np
import pytest

from slipstick.structure.receptance_size import CANCELLED, UNREACHED, ReceptanceSize, band

OMEGA = np.array([1.0, 2.0, 4.0])
SHAPES = np.array([[1.0, 0.5, 0.3], [0.4, -1.0, 0.2]])
RESIDUAL = np.array([[0.02, 0.01], [0.01, 0.03]])


def size(participation, load_residual):
    return ReceptanceSize(OMEGA, SHAPES, RESIDUAL, np.asarray(participation), np.asarray(load_residual))


def test_norms_of_the_sum_over_modes():
    p, residual = np.array([[1.0, 2.0, -1.0]]), np.array([[0.1], [-0.2]])
    found = size(p, residual).at([0.0, 0.7, 3.0])
    for w, row in zip([0.0, 0.7, 3.0], found, strict=True):
        c = 1.0 / (OMEGA**2 - w**2)
        whole = (SHAPES * c) @ np.column_stack([SHAPES.T, p.T]) + np.column_stack([RESIDUAL, residual])
        np.testing.assert_allclose(row, [np.linalg.norm(whole[:, :2]), np.linalg.norm(whole[:, 2])], rtol=1e-12)


def test_between_resonances_it_counts_as_a_tenth_of_what_cancels():
    one = ReceptanceSize(OMEGA[:2], np.ones((1, 2)), np.zeros((1, 1)), np.zeros((0, 2)), np.zeros((1, 0)))
    w = np.sqrt(2.5)  # 1 / (1 - w^2) + 1 / (4 - w^2) = 0
    assert one.at(w)[0] == pytest.approx(CANCELLED * 2.0 / 1.5)


def test_a_load_that_reaches_nothing_counts_as_what_it_might():
    found = size([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], np.zeros((2, 2)))
    assert found.at(0.5)[1] == 0.0
    shapes = np.array([[0.0, 1.0]])
    symmetric = ReceptanceSize(OMEGA[:2], shapes, np.zeros((1, 1)), np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    assert symmetric.at(0.0)[1] == pytest.approx(UNREACHED * np.sqrt(0.25 * 1.0))


def test_a_band_is_looked_at_between_its_resonances():
    omega = np.array([1.0, 1.001, 5.0])
    grid = band(omega, 0.0, 3.0)
    assert (grid[0], grid[-1]) == (0.0, 3.0)
    assert np.count_nonzero((grid > 1.0) & (grid < 1.001)) >= 8
    assert np.all(np.diff(band(omega, 2.0, 2.0)) > 0.0)
