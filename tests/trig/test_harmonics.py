"""Layout of harmonic coefficients."""

import itertools

import numpy as np
import pytest
from helpers.faults import raises_fault

from slipstick.errors import InputError
from slipstick.trig.harmonics import Harmonics


@pytest.mark.parametrize("orders", [[], [1, 2], [0, 2, 1], [0, 1, 1], [0, 1.5], [0, -1], [0, True]])
def test_refused(orders):
    with raises_fault("harmonics"):
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


def test_parts_by_name():
    """The words "cos" and "sin" mean what they say, and nothing else is guessed."""
    h = Harmonics([0, 1, 3])
    assert [h.index(1, part) for part in ("c", "cos", "s", "sin")] == [1, 1, 2, 2]
    assert h.index(0, "cos") == 0
    for part in ("C", "cosine", "", None, 1, "x"):
        with pytest.raises(InputError, match='expected "c" or "cos"'):
            h.index(1, part)
    with pytest.raises(InputError, match="harmonic 0 has no sine"):
        h.index(0, "sin")


def test_a_count_stands_for_all_up_to_it():
    assert Harmonics(10) == Harmonics(range(11))
    assert Harmonics(np.int64(2)).orders == (0, 1, 2)
    for wrong in (True, -1, "0.10", 2.5, 10**9, itertools.count()):
        with raises_fault("harmonics"):
            Harmonics(wrong)
