"""Inverses of many matrices at once."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.linear.inverses import inverses


@pytest.mark.parametrize("size", [1, 2, 7, 23, 64, 65])
def test_they_are_those_of_each_matrix(size: int) -> None:
    """A singular one and one that is no number beside them; products differ from unity by rounding."""
    matrices = np.random.default_rng(size).normal(size=(6, size, size))
    matrices[2], matrices[4] = 0.0, np.nan
    found = inverses(matrices)
    assert np.isnan(found[[2, 4]]).all()
    for i in (0, 1, 3, 5):
        rounding = size * np.finfo(float).eps * (np.abs(found[i]) @ np.abs(matrices[i])).max()
        np.testing.assert_allclose(found[i] @ matrices[i], np.eye(size), rtol=0, atol=rounding)
        np.testing.assert_allclose(matrices[i] @ found[i], np.eye(size), rtol=0, atol=rounding)
        np.testing.assert_array_equal(inverses(matrices[i : i + 1])[0], found[i])


def test_a_zero_on_the_diagonal_and_a_singular_matrix() -> None:
    swapped = np.array([[0.0, 2.0], [4.0, 0.0]])
    np.testing.assert_array_equal(inverses(swapped[None])[0], [[0.0, 0.25], [0.5, 0.0]])
    assert np.isnan(inverses(np.array([[[1.0, 2.0], [2.0, 4.0]]]))).all()
