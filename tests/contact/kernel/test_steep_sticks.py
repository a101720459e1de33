"""Sticks integrated by Gauss's rule against the closed form, where both have all their digits."""

import numpy as np
import pytest
from helpers.elements import GRID, H, basis, batch, critical, given, tuples
from helpers.interpreted import interpreted

steep = interpreted("contact.kernel.steep_sticks")


@pytest.mark.parametrize(("start", "end"), [(0.3, 0.31), (0.3, 2.0), (5.0, 7.5)])
def test_against_dense_quadrature(start, end):
    """Force ``f + kt (w(t) - w(a))`` over a stick that stays within its limit, and its slopes."""
    inputs, k = given(2, v=0.3, gap=-1e6), batch.workspace(GRID)
    X = critical.padded(inputs.X, 0.0, k.parts[:2])
    Y = critical.padded(inputs.Y, inputs.Y[0] + 1e6, k.parts[2:])
    e = tuples.ElementMotion(X, Y, 0.3, 2.0, 0.4, 1.5, 0.6, True)
    out = tuples.ElementOutputs(np.zeros((7, H.size)), np.zeros((3, H.size, H.size)), np.zeros(6))
    h, force = np.empty(H.size), 0.7
    steep.steep_stick(np.array([start, end, force]), e, GRID, k.scratch, h, out)
    x, w = np.polynomial.legendre.leggauss(200)
    t, w = start + (end - start) * (x + 1) / 2, w * (end - start) / 2 / np.pi
    gain = H.H_minus(t) @ inputs.X - H.H_minus(start) @ inputs.X + 0.3 * (t - start)
    plus = H.H_plus(t)
    np.testing.assert_allclose(h, w @ plus, atol=1e-14)
    np.testing.assert_allclose(out.vectors[tuples.V_FX], (w * (force + 2.0 * gain)) @ plus, atol=1e-13)
    np.testing.assert_allclose(out.vectors[tuples.V_DV], (w * 2.0 * (t - start)) @ plus, atol=1e-13)
    np.testing.assert_allclose(out.vectors[tuples.V_DKT], (w * gain) @ plus, atol=1e-13)
    by_x = 2.0 * np.einsum("t,ti,tj->ij", w, plus, H.H_minus(t) - H.H_minus(start))
    np.testing.assert_allclose(out.matrices[0], by_x, atol=1e-13)


def test_the_rule_is_a_rule():
    assert steep.SHARES.sum() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose([steep.SHARES @ steep.NODES**k for k in range(12)], 1 / np.arange(1.0, 13.0), rtol=1e-14)
    assert 2 * np.pi == basis.TWO_PI
