"""Largest deviations of trigonometric polynomials: against a fine grid, closed forms and ties."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.trig.extremes import largest_deviations
from slipstick.trig.harmonics import Harmonics


@pytest.mark.parametrize("orders", [range(2), range(6), range(11), [0, 1, 3, 7], [0, 2, 4, 6], [0, 13], range(41)])
def test_against_a_fine_grid(orders) -> None:
    h, rng = Harmonics(orders), np.random.default_rng(0)
    X = rng.normal(size=(200, h.size)) / np.maximum(1, np.repeat([0, *h.m], 2)[1:]) ** rng.integers(0, 3)
    tau = np.arange(40_000) * (2 * np.pi / 40_000)
    values = (X[:, 1:]) @ h.H_minus(tau)[:, 1:].T
    found, time = largest_deviations(h, X)
    size = np.abs(values).max(axis=1)
    assert np.all(np.abs(found) >= size * (1 - 1e-12))
    curvature = (np.repeat(h.m**2, 2) * np.abs(X[:, 1:])).sum(axis=1)
    assert np.all(np.abs(found) - size <= 0.5 * curvature * (np.pi / 40_000) ** 2 + 1e-12 * size)
    here = np.einsum("kl,kl->k", X[:, 1:], h.H_minus(time)[:, 1:])
    assert found == pytest.approx(here, rel=1e-12)
    assert np.all((time >= 0) & (time < 2 * np.pi))


def test_closed_forms() -> None:
    h = Harmonics([0, 1, 2])
    found, time = largest_deviations(h, np.array([[5.0, 3.0, 4.0, 0, 0], [1.0, 0, 0, 0, -2.0], [0.0] * 5]))
    assert np.abs(found) == pytest.approx([5.0, 2.0, 0.0], rel=1e-15)
    assert np.tan(time[0]) == pytest.approx(4 / 3)
    # cos t + cos 2 t is largest at 0 with 2, its trough is -9/8
    assert largest_deviations(h, np.array([[0, 1.0, 0, 1.0, 0]]))[0] == pytest.approx([2.0], rel=1e-15)
    assert largest_deviations(h, np.array([[0, -1.0, 0, -1.0, 0]]))[0] == pytest.approx([-2.0], rel=1e-15)


def test_shift_in_time_changes_nothing_but_the_time() -> None:
    """Round shifts put extremes on grid times and between them."""
    h, rng = Harmonics(range(8)), np.random.default_rng(1)
    X = rng.normal(size=h.size)
    size, at = largest_deviations(h, X[None])
    for k in range(1, 48):
        shift = 2 * np.pi * k / 48
        c, s = np.cos(h.m * shift), np.sin(h.m * shift)
        moved = X.copy()
        moved[1::2], moved[2::2] = X[1::2] * c - X[2::2] * s, X[1::2] * s + X[2::2] * c
        found, time = largest_deviations(h, moved[None])
        assert found == pytest.approx(size, rel=1e-13)
        assert np.exp(1j * time) == pytest.approx(np.exp(1j * (at + shift)), abs=1e-7)
