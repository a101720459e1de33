"""Certified roots against companion-matrix eigenvalues and constructed near-double roots."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
