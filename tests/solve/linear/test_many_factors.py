"""Factors of many matrices at once."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear.many_factors import factorise, signs, solutions
from slipstick.typing import Array


def factors_of(matrices: Array) -> Array:
    """With the row of swaps below each."""
    out = np.full((len(matrices), matrices.shape[1] + 1, matrices.shape[1]), 7.0)
    out[:, :-1] = matrices
    factorise(out)
    return out


@pytest.mark.parametrize("size", [1, 2, 7, 23, 50, 51, 90])
def test_they_solve_with_each_matrix(size: int) -> None:
    """A singular one and one that is no number beside them; residuals are the rounding of a solution in a new place."""
    generator = np.random.default_rng(size)
    matrices, right = generator.normal(size=(6, size, size)), generator.normal(size=(8, size))
    matrices[2], matrices[4] = 0.0, np.nan
    factors, which = factors_of(matrices), np.array([5, 0, 1, 3, 3, 0, 2, 4])
    found = solutions(factors, which, right)
    assert np.isnan(found[6:]).all()
    for i, x, b in zip(which[:6], found[:6], right[:6], strict=True):
        rounding = size * np.finfo(float).eps * (np.abs(matrices[i]) @ np.abs(x)).max()
        np.testing.assert_allclose(matrices[i] @ x, b, rtol=0, atol=10.0 * rounding)
        np.testing.assert_array_equal(solutions(factors_of(matrices[i : i + 1]), np.array([0]), b[None])[0], x)
    regular = [0, 1, 3, 5]
    np.testing.assert_array_equal(signs(factors[regular]), np.linalg.slogdet(matrices[regular])[0])


@pytest.mark.parametrize("size", [4, 60])
def test_right_hand_sides_may_end_early(size: int) -> None:
    generator = np.random.default_rng(1)
    factors, right = factors_of(generator.normal(size=(2, size, size))), generator.normal(size=(2, size))
    right[:, 3:] = 0.0
    which = np.array([1, 0])
    np.testing.assert_array_equal(solutions(factors, which, right[:, :3]), solutions(factors, which, right))


def test_a_zero_on_the_diagonal_and_a_singular_matrix() -> None:
    swapped = factors_of(np.array([[[0.0, 2.0], [4.0, 0.0]]]))
    np.testing.assert_array_equal(solutions(swapped, np.array([0]), np.array([[1.0, 2.0]])), [[0.5, 0.5]])
    assert signs(swapped).tolist() == [-1.0]
    singular = factors_of(np.array([[[1.0, 2.0], [2.0, 4.0]]]))
    assert np.isnan(solutions(singular, np.array([0]), np.array([[1.0, 2.0]]))).all()
