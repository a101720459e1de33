"""Certified roots against companion-matrix eigenvalues and constructed near-double roots."""

import numpy as np
import pytest
from helpers.counting import calls_of
from helpers.interpreted import interpreted
from hypothesis import given
from hypothesis import strategies as st

from slipstick.errors import SlipstickError
from slipstick.trig import roots as module
from slipstick.trig.harmonics import Harmonics
from slipstick.trig.roots import roots


def companion(h, p):
    """Roots on the unit circle by an eigenvalue method, ascending in [0, 2 pi)."""
    M = h.highest
    z = np.zeros(2 * M + 1, complex)
    z[M] = p[0]
    z[M + h.m] = (p[1::2] - 1j * p[2::2]) / 2
    z[M - h.m] = (p[1::2] + 1j * p[2::2]) / 2
    all_roots = np.roots(z[::-1])
    return np.sort(np.angle(all_roots[abs(abs(all_roots) - 1) < 1e-7]) % (2 * np.pi))


@pytest.mark.parametrize("orders", [range(2), range(4), range(11), [0, 1, 3, 7], [0, 5, 12]])
def test_all_roots_of_random_polynomials(orders):
    h = Harmonics(orders)
    rng = np.random.default_rng(7)
    for offset in (0.0, 1.0, 4.0):
        for _ in range(150):
            p = rng.normal(size=h.size)
            p[0] *= offset
            times, rising = roots(h, p)
            expected = companion(h, p)
            assert len(times) == len(expected)
            np.testing.assert_allclose(times, expected, atol=1e-7)
            np.testing.assert_allclose(h.H_minus(times) @ p, 0, atol=2e-13 * abs(p).sum())
            assert np.all(rising[1:] != rising[:-1])


@pytest.mark.parametrize("width", [1e-1, 1e-3, 1e-5, 1e-6])
def test_a_pair_of_roots_however_close_is_found(width):
    h = Harmonics(range(11))
    centre = 1.2345
    # cos(tau - centre) - cos(width / 2): two roots `width` apart
    p = np.zeros(h.size)
    p[0], p[1], p[2] = -np.cos(width / 2), np.cos(centre), np.sin(centre)
    times, rising = roots(h, p)
    assert rising.tolist() == [True, False]
    # a rounding error e of p moves the roots by e / width
    np.testing.assert_allclose(times, [centre - width / 2, centre + width / 2], atol=3e-16 / width + 1e-15)


def test_sampling_misses_roots_that_isolation_finds():
    h = Harmonics(range(11))
    rng = np.random.default_rng(3)
    samples = h.H_minus(np.arange(64) * (2 * np.pi / 64))
    missed = 0
    for _ in range(2000):
        p = rng.normal(size=h.size)
        signs = samples @ p > 0
        seen = np.count_nonzero(signs != np.roll(signs, 1))
        found = len(roots(h, p)[0])
        assert found == len(companion(h, p))
        assert seen <= found
        missed += seen < found
    assert missed > 10


def test_a_touching_root_is_no_crossing():
    h = Harmonics([0, 1])
    for shift in (0.0, 0.3, 2.0):
        assert len(roots(h, [1.0, -np.cos(shift), -np.sin(shift)])[0]) == 0


def test_flat_roots_do_not_multiply_by_rounding():
    """(1 - cos tau)^k is zero to rounding over a whole stretch; it never crosses."""
    h = Harmonics(range(11))
    t = np.arange(64) * (2 * np.pi / 64)
    for k in range(1, 11):
        c = np.fft.rfft((1 - np.cos(t - 0.3)) ** k) / 64
        p = np.zeros(h.size)
        p[0], p[1::2], p[2::2] = c[0].real, 2 * c[1:11].real, -2 * c[1:11].imag
        assert len(roots(h, p)[0]) == 0
        p[0] -= 1e-6
        assert len(roots(h, p)[0]) == 2


def test_constants_have_no_roots():
    h = Harmonics(range(4))
    for constant in (0.0, 1.0, -1.0):
        assert len(roots(h, [constant, *np.zeros(6)])[0]) == 0


def test_roots_at_the_seam_are_found_once():
    h = Harmonics(range(3))
    for shift in (-1e-15, -1e-17, 0.0, 1e-17, 1e-15, 1e-12):
        # sin(tau - shift)
        times, _ = roots(h, [0.0, -np.sin(shift), np.cos(shift), 0.0, 0.0])
        assert len(times) == 2


@given(st.integers(1, 10), st.integers(0, 2**32 - 1), st.floats(-6.3, 6.3))
def test_a_shift_in_time_shifts_the_roots(n, seed, shift):
    h = Harmonics(range(n + 1))
    p = np.random.default_rng(seed).normal(size=h.size)
    q = p.copy()
    c, s = np.cos(h.m * shift), np.sin(h.m * shift)
    q[1::2], q[2::2] = p[1::2] * c - p[2::2] * s, p[2::2] * c + p[1::2] * s
    a, _ = roots(h, p)
    b, _ = roots(h, q)
    assert len(a) == len(b)
    if len(a) and np.min(np.diff(np.r_[a, a[0] + 2 * np.pi])) > 1e-3:
        distance = np.abs(np.exp(1j * (a + shift))[:, None] - np.exp(1j * b)).min(axis=1)
        np.testing.assert_allclose(distance, 0, atol=1e-10)


def pure_sets(whole):
    """Dense and sparse sets up to order 40; pairs of orders up to 30, every one or a few."""
    yield from ([0, k] for k in range(1, 41))
    yield from ([0, j, k] for j in range(1, 30) for k in range(j + 1, 31) if whole or (k - j) % 11 == 1)
    yield from (list(range(0, 25, q)) for q in range(2, 6))
    yield from (list(range(top + 1)) for top in (3, 6, 10, 15, 25, 40))
    yield [0, *range(1, 22, 2)]


def on_circle(times, expected):
    """Largest distance of each expected time from the nearest found one."""
    return np.abs(np.exp(1j * times)[:, None] - np.exp(1j * expected)).min(axis=0).max()


@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.verify)])
def test_pure_harmonics_have_all_their_roots(whole):
    """Their roots lie on round places, often on the edges of cells."""
    count = 0
    for orders in pure_sets(whole):
        h = Harmonics(orders)
        for m in orders[1:]:
            for part, first in (("c", 0.5), ("s", 0.0)):
                p = np.zeros(h.size)
                p[1 + 2 * (orders.index(m) - 1) + (part == "s")] = -3.7 if m % 2 else 1.0
                times, rising = roots(h, p)
                assert len(times) == 2 * m, (orders, m, part)
                assert np.all(np.diff(times) > 1.0 / m)
                assert np.all(rising[1:] != rising[:-1])
                assert on_circle(times, (np.arange(2 * m) + first) * np.pi / m) < 4e-15
                count += 1
    assert count > (1530 if whole else 450)


def rate_product(h, places):
    """Coefficients of the product of sin((tau - a)/2) over an even number of places, largest coefficient 1."""
    tau = 2 * np.pi * np.arange(128) / 128
    c = np.fft.rfft(np.prod([np.sin((tau - a) / 2) for a in places], axis=0)) / 128
    p = np.zeros(h.size)
    p[0], p[1::2], p[2::2] = c[0].real, 2 * c[h.m].real, -2 * c[h.m].imag
    return p / np.abs(p).max()


@pytest.mark.parametrize("k", [1, 2, 3, 4, 5, 6, 8, 12])
@pytest.mark.parametrize("top", [6, 10, 15])
def test_products_with_roots_at_round_places(k, top):
    """Simple, double and triple roots at multiples of pi/k: those of odd multiplicity are crossings, no other."""
    h, rng = Harmonics(range(top + 1)), np.random.default_rng(k)
    for _ in range(40):
        where = rng.choice(2 * k, min(2 * k, 4), replace=False)
        times = rng.choice([1, 1, 2, 3], len(where))
        if times.sum() % 2:
            times[0] += 1
        places = np.repeat(where * np.pi / k, times)
        found, rising = roots(h, rate_product(h, places))
        expected = np.sort(where[times % 2 == 1]) * np.pi / k
        assert len(found) == len(expected), (where, times)
        assert np.all(np.diff(found) > 0)
        assert np.all(rising[1:] != rising[:-1])
        if len(expected):
            # a triple root is known to the cube root of the rounding of its coefficients
            assert on_circle(found, expected) < (2e-3 if times.max() > 2 else 1e-12)


def test_values_that_equal_the_floor_over_a_stretch_end_the_search(monkeypatch):
    """A touching root: the values near it are few numbers, and the floor may be one of them.

    Its neighbourhood is halved to the square root of the rounding, 27 times on each side of each of two roots: 108
    pieces, as many parents of them. A stretch halved to the last digit takes millions.
    """
    h, plain = Harmonics(range(3)), interpreted("trig.roots")
    for size in (0.25, 0.5, 1.0, 2.0):
        assert len(roots(h, [size, 0, 0, -size, 0])[0]) == 0
        with monkeypatch.context() as patch:
            looks = calls_of(patch, plain, "derivatives_at")
            assert len(plain.roots(h, [size, 0, 0, -size, 0])[0]) == 0
        assert 0 < len(looks) < 300


def test_a_list_of_roots_is_never_cut_short(monkeypatch):
    compiled = module._roots
    monkeypatch.setattr(module, "_roots", lambda *a: compiled(*a[:-1], 3))
    with pytest.raises(SlipstickError, match=r"more roots than the harmonics \[0, 2\] allow"):
        roots(Harmonics([0, 2]), [0.0, 0.0, 1.0])


def test_a_search_that_finds_no_end_is_given_up():
    """Halving goes on where values are no numbers: it is bounded, and ends with an error."""
    h = Harmonics(range(6))
    with pytest.raises(SlipstickError, match="no end of them"):
        roots(h, [np.nan, *np.linspace(-1.0, 1.0, h.size - 1)])
