"""Interval integrals against Gauss-Legendre quadrature."""

import numpy as np
import pytest

from slipstick.trig.harmonics import Harmonics
from slipstick.trig.integrals import interval_integrals


@pytest.mark.parametrize("orders", [[0], range(3), range(11), [0, 1, 3, 7], [0, 5, 40]])
@pytest.mark.parametrize(("a", "b"), [(0.3, 2.2), (5.0, 9.0), (1.0, 1.0 + 1e-7), (0.0, 2 * np.pi)])
def test_against_quadrature(orders, a, b):
    h = Harmonics(orders)
    x, w = np.polynomial.legendre.leggauss(200)
    t, w = a + (b - a) * (x + 1) / 2, w * (b - a) / 2
    plus, minus = h.H_plus(t), h.H_minus(t)
    W, vector, ramp = interval_integrals(h, a, b)
    scale = b - a
    np.testing.assert_allclose(W, np.einsum("t,ti,tj->ij", w, plus, minus) / np.pi, atol=2e-14 * scale + 1e-16)
    np.testing.assert_allclose(vector, w @ plus / np.pi, atol=2e-14 * scale + 1e-16)
    np.testing.assert_allclose(ramp, (w * (t - a)) @ plus / np.pi, atol=2e-14 * scale + 1e-16)
