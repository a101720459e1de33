"""Amplitudes exact to rounding, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import slipstick as ss
from slipstick.results.measures import amplitude, amplitude_with_slope


@pytest.mark.parametrize("orders", [[0, 1], [0, 1, 2, 3], [0, 2, 5, 10], [0, 7]])
def test_amplitude_against_a_fine_grid(orders: list[int]) -> None:
    h = ss.Harmonics(orders)
    X = np.random.default_rng(3).standard_normal((300, h.size))
    found = amplitude(h, X)
    tau = np.linspace(0, 2 * np.pi, 20001)
    dense = np.abs(X[:, 1:] @ h.H_minus(tau)[:, 1:].T).max(axis=1)
    bend = (0.5 * (tau[1] / 2) ** 2 * np.abs(X[:, 1:]) @ np.repeat(h.m.astype(float) ** 2, 2)).max()
    assert np.all(found.value >= dense - 1e-12)
    assert np.all(found.value <= dense + 2 * bend)
    x = (h.H_minus(found.time) * X)[:, 1:].sum(axis=1)
    assert found.sign * x == pytest.approx(found.value, rel=1e-14)
    slope = (h.H_minus(found.time) * h.derivative(X)).sum(axis=1)
    assert np.abs(slope).max() < 1e-7


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_amplitude_of_one_harmonic(mean: float, c: float, s: float) -> None:
    assert float(amplitude(ss.Harmonics([0, 3]), [mean, c, s]).value) == pytest.approx(
        np.hypot(c, s), rel=1e-12, abs=1e-12
    )


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
def test_amplitude_shapes(shape: tuple[int, ...]) -> None:
    X = np.ones((*shape, 5))
    assert amplitude(ss.Harmonics([0, 1, 2]), X).value.shape == shape
    assert amplitude(ss.Harmonics([0]), np.ones((*shape, 1))).value.shape == shape
    assert np.all(amplitude(ss.Harmonics([0, 1, 2]), 0 * X).value == 0)


def test_slope_of_the_amplitude() -> None:
    h, rng = ss.Harmonics(range(6)), np.random.default_rng(1)
    X, dX = rng.standard_normal((2, 50, h.size))
    step = 1e-6
    wanted = (amplitude(h, X + step * dX).value - amplitude(h, X - step * dX).value) / (2 * step)
    size, slope = amplitude_with_slope(h, X, dX)
    assert slope == pytest.approx(wanted, abs=1e-7)
    assert size == pytest.approx(amplitude(h, X).value, rel=1e-15)


def test_what_is_beside_a_motion_changes_no_bit_of_its_amplitude() -> None:
    """Rows of one harmonic, of several, still and with a mean alone, in every order."""
    X = np.random.default_rng(4).normal(size=(6, 7))
    X[1, 3:], X[2, 1:5], X[3], X[4, 1:] = 0.0, 0.0, 0.0, 0.0
    h, dX, orders = ss.Harmonics([0, 1, 2, 5]), np.ones((6, 7)), np.array([5, 3, 1, 0, 4, 2])
    value, time, _ = amplitude(h, X)
    size, slope = amplitude_with_slope(h, X, dX)
    np.testing.assert_array_equal(amplitude(h, X[orders]).value, value[orders])
    for i in range(6):
        alone = amplitude(h, X[i])
        assert (float(alone.value), float(alone.time)) == (value[i], time[i])
        assert [float(part[0]) for part in amplitude_with_slope(h, X[[i]], dX[[i]])] == [size[i], slope[i]]
