"""Layout of harmonic coefficients."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.trig.harmonics import Harmonics


@pytest.mark.parametrize("orders", [[], [1, 2], [0, 2, 1], [0, 1, 1], [0, 1.5], [0, -1], [0, True]])
def test_refused(orders):
    with pytest.raises(InputError, match="harmonics"):
        Harmonics(orders)


def test_layout_and_derivative():
    h = Harmonics([0, 2, 5])
    assert h.labels == ("0", "c2", "s2", "c5", "s5")
    assert [h.index(2, "c"), h.index(2, "s"), h.index(5, "s"), h.index(0)] == [1, 2, 4, 0]
    with pytest.raises(InputError, match="harmonic 3 is not kept"):
        h.index(3)
    X = np.array([0.7, 1.0, -2.0, 0.5, 3.0])
    t = np.linspace(0, 6, 7)
    x = 0.7 + np.cos(2 * t) - 2 * np.sin(2 * t) + 0.5 * np.cos(5 * t) + 3 * np.sin(5 * t)
    dx = -2 * np.sin(2 * t) - 4 * np.cos(2 * t) - 2.5 * np.sin(5 * t) + 15 * np.cos(5 * t)
    np.testing.assert_allclose(h.H_minus(t) @ X, x, atol=1e-14)
    np.testing.assert_allclose(h.H_minus(t) @ h.derivative(X), dx, atol=1e-13)
    np.testing.assert_allclose(h.H_plus(t)[:, 0], 0.5)
