"""Values at one time against numpy, to rounding; gains over short ways with all their digits."""

import numpy as np
import pytest
from helpers.interpreted import interpreted

from slipstick.trig.harmonics import Harmonics

basis = interpreted("trig.basis")
ORDERS = [[0], [0, 1], range(6), [0, 1, 3, 7], [0, 5, 40]]


def polynomial(harmonics, seed=0):
    """A random one, its coefficients (L,), its table, and room for a basis."""
    table = basis.grid(harmonics)
    X = np.random.default_rng(seed).normal(size=harmonics.size)
    cos, sin = np.zeros(table.orders.size), np.zeros(table.orders.size)
    cos[: harmonics.n], sin[: harmonics.n] = X[1::2], X[2::2]
    return basis.Polynomial(X[0], cos, sin), X, table, np.empty((2, table.orders.size))


def test_turns_are_exact_at_round_places():
    cos, sin = basis.turns(np.arange(-4, 9), 4)
    assert cos.tolist() == [1, 0, -1, 0] * 3 + [1]
    assert sin.tolist() == [0, 1, 0, -1] * 3 + [0]
    big = 3 * 10**15
    np.testing.assert_array_equal(basis.turns(big * 7 + 1, 7), basis.turns(1, 7))


def test_circle_to_rounding():
    t = np.concatenate([np.random.default_rng(0).uniform(-s, s, 500) for s in (1e-8, 1.0, 100.0, 1e6)])
    found = np.array([basis.circle(x) for x in t])
    np.testing.assert_allclose(found, np.stack([np.cos(t), np.sin(t)], axis=1), rtol=0, atol=4e-16)


@pytest.mark.parametrize("orders", ORDERS)
def test_grid_holds_the_cell_middles(orders):
    h = Harmonics(orders)
    table = basis.grid(h)
    cells = table.cos.shape[1]
    t = (np.arange(cells) + 0.5) * 2 * np.pi / cells
    assert table.orders.size % 4 == 0
    np.testing.assert_allclose(table.cos[: h.n], np.cos(np.outer(h.m, t)), atol=1e-13)
    np.testing.assert_allclose(table.sin[: h.n], np.sin(np.outer(h.m, t)), atol=1e-13)
    assert (table.n, table.top) == (h.n, 2 * max(h.highest, 1))


@pytest.mark.parametrize("orders", ORDERS)
@pytest.mark.parametrize("t", [0.0, 0.3, -2.7, 6.0])
def test_values_and_derivatives(orders, t):
    h = Harmonics(orders)
    p, X, table, (c, s) = polynomial(h)
    basis.basis(t, table, c, s)
    np.testing.assert_allclose(c[: h.n], np.cos(h.m * t), atol=1e-14)
    np.testing.assert_allclose(s[: h.n], np.sin(h.m * t), atol=1e-14)
    expected, slopes = [], X
    for _ in range(4):
        expected.append(float(h.H_minus(t) @ slopes))
        slopes = h.derivative(slopes)
    scale = 1e-13 * max(h.highest, 1) ** np.arange(4)
    assert abs(basis.value(p, c, s) - expected[0]) < scale[0]
    for found, exact, small in zip(basis.values(p, table.orders, c, s), expected, scale, strict=False):
        assert abs(found - exact) < small
    assert abs(basis.third(p, table.orders, c, s) - expected[3]) < scale[3]


@pytest.mark.parametrize("length", [3.0, 1e-3, 1e-9, 1e-15])
def test_a_rise_has_all_its_digits_however_short_the_way(length):
    """Over a short way it is the slope at the middle times the length; a difference of values has none left."""
    p, X, table, _ = polynomial(Harmonics(range(6)))
    h, start, v = Harmonics(range(6)), 0.7, 0.3
    room = basis.Scratch(*(np.empty(shape) for shape in (8, 8, (2, 8), (2, 8))))
    end = start + length
    found = basis.rise(start, end, v, p, table, room)
    if length > 1:
        assert found == pytest.approx(v * length + (h.H_minus(end) - h.H_minus(start)) @ X, rel=1e-13)
    else:
        middle, third = h.H_minus(0.5 * (start + end)), h.derivative(h.derivative(h.derivative(X)))
        slope = v + middle @ h.derivative(X) + (end - start) ** 2 / 24 * (middle @ third)
        assert found == pytest.approx(slope * (end - start), rel=2e-13)
