"""Products with what the modes left out."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.structure import residuals
from slipstick.structure.receptance import ModalReceptance, mapped
from slipstick.structure.residuals import WrittenResiduals

WEIGHT = np.array([[1.0, 2.0 - 1j, 0.5j], [0.0, 3.0, 1j]])


def written(n=70, loads=2, **options):
    """Symmetric between the rows, with columns of loads."""
    roots = np.random.default_rng(1).standard_normal((2, n, n))
    columns = np.random.default_rng(2).standard_normal((2, n, loads))
    matrices = [np.hstack([root @ root.T, own]) for root, own in zip(roots, columns, strict=True)]
    return matrices, WrittenResiduals(matrices, **options)


@pytest.mark.parametrize("given", [72, 70, 40])
@pytest.mark.parametrize("tile", [7, 16, 70, 100])
def test_one_half_of_symmetric_matrices_is_all_of_them(tile, given, monkeypatch):
    """Tiles that part the rows evenly and not; with loads, without, and on the first columns alone."""
    monkeypatch.setattr(residuals, "_CACHE_ENTRIES", 100)
    monkeypatch.setattr(residuals, "_TILE", tile)
    matrices, own = written(symmetric=True)
    x = np.random.default_rng(3).standard_normal((given, 6)).view(complex)
    expected = sum((R[:, :given] @ x) * w for R, w in zip(matrices, WEIGHT, strict=True))
    np.testing.assert_allclose(own.times(x, WEIGHT), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_what_is_not_symmetric_is_taken_whole(monkeypatch):
    monkeypatch.setattr(residuals, "_CACHE_ENTRIES", 100)
    rng = np.random.default_rng(4)
    left, whole = rng.standard_normal((30, 5)), rng.standard_normal((30, 32))
    half = whole[:, :30] + whole[:, :30].T
    for R, symmetric in ((whole, False), (np.hstack([half, whole[:, 30:]]), True), (half[:, :20], False)):
        right = rng.standard_normal((R.shape[1], 5))
        receptance = ModalReceptance(
            left=left, right=right, stiffness=np.arange(1.0, 6.0) + 0j, damping=np.zeros(5), static=R, residual=R
        )
        x = rng.standard_normal((R.shape[1], 4)).view(complex)
        parts = receptance.factors(np.array([1.0]), 0.3).parts
        np.testing.assert_allclose(parts.times(x, np.ones((1, 2))), R @ x, rtol=1e-11, atol=1e-12)
        assert receptance._symmetric == symmetric


def test_the_slope_takes_no_product_that_the_value_took(monkeypatch):
    matrices, own = written()
    asked = []
    monkeypatch.setattr(own, "_product", lambda matrix, x: asked.append(1) or matrix[:, : len(x)] @ x)
    x, other = np.random.default_rng(5).standard_normal((2, 70, 6)).view(complex)
    value, slope = own.times(x, WEIGHT), own.times(x, WEIGHT * [[0.0], [2.0]])
    assert len(asked) == 2
    np.testing.assert_allclose(value, sum(R[:, :70] @ x * w for R, w in zip(matrices, WEIGHT, strict=True)), rtol=1e-12)
    np.testing.assert_allclose(slope, 2.0 * (matrices[1][:, :70] @ x) * WEIGHT[1], rtol=1e-12)
    np.testing.assert_allclose(own.times(other, WEIGHT[:, :3])[0], own.times(other.copy(), WEIGHT)[0], rtol=1e-12)
    assert len(asked) == 6


@pytest.mark.parametrize("rows", [5, 200])
def test_products_with_many_are_those_with_each(rows):
    rng = np.random.default_rng(6)
    matrix, columns = rng.standard_normal((rows, 120)), rng.standard_normal((3, 120, 4))
    for one, found in zip(columns, mapped(matrix, columns), strict=True):
        np.testing.assert_allclose(found, matrix @ one, rtol=0, atol=1e-12)
