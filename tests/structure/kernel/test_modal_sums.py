"""The compiled sum is the sum over modes, and its derivative that of the sum."""

import numpy as np

from slipstick.structure.kernel.modal_sums import modal_sums
from slipstick.structure.receptance import ModalReceptance

RNG = np.random.default_rng(0)
LEFT, RIGHT = RNG.normal(size=(3, 5)), RNG.normal(size=(2, 5))
STIFFNESS, DAMPING = np.arange(1.0, 6.0) ** 2 * (1.0 + 0.02j), 0.1j * np.arange(5.0)
REST = RNG.normal(size=(2, 3, 2)) + 1j * RNG.normal(size=(2, 3, 2))
ORDERS = np.array([1.0, 2.0, 5.0])
STATIC = RNG.normal(size=(3, 2))


def expected(omega: float) -> np.ndarray:
    """``A`` (k, n_rows, n_columns)."""
    return np.array(
        [(LEFT / (STIFFNESS + w * (DAMPING - w))) @ RIGHT.T + REST[0] + w * w * REST[1] for w in ORDERS * omega]
    )


def summed(omega: float) -> np.ndarray:
    """Conjugates of ``A`` and its derivative, row by row."""
    out = np.full((2, 2, 3, 4), 7.0 + 0j)
    for row, left in enumerate(LEFT):
        places = np.arange(2)[:, None]
        modal_sums(STATIC, left * RIGHT, places, row, STIFFNESS, DAMPING, REST, ORDERS, ORDERS * omega, out)
    return out


def test_value_and_slope():
    found, h = summed(1.7), 1e-5
    slope = (expected(1.7 + h) - expected(1.7 - h)) / (2 * h)
    np.testing.assert_allclose(found[0, ..., 1:].conj().transpose(2, 1, 0), expected(1.7), rtol=1e-12)
    np.testing.assert_allclose(found[1, ..., 1:].conj().transpose(2, 1, 0), slope, rtol=1e-7)
    np.testing.assert_array_equal(found[0, ..., 0], STATIC.T)
    np.testing.assert_array_equal(found[1, ..., 0], 0.0)


def test_all_rows_at_once_are_the_same():
    out = np.zeros((2, 2, 3, 4), dtype=complex)
    products = (RIGHT[:, None] * LEFT[None]).reshape(-1, 5)
    modal_sums(STATIC, products, np.arange(6).reshape(2, 3), 0, STIFFNESS, DAMPING, REST, ORDERS, ORDERS * 1.7, out)
    np.testing.assert_allclose(out, summed(1.7), rtol=1e-12)


def test_products_that_are_the_same_both_ways_are_summed_once():
    """Three ports and a load: six products of ports, and three of the load."""
    right = np.vstack([LEFT, RIGHT[:1]])
    receptance = ModalReceptance(
        left=LEFT, right=right, stiffness=STIFFNESS, damping=DAMPING.imag, static=RNG.normal(size=(3, 4))
    )
    products, places = receptance._different_products
    assert len(products) == 9
    np.testing.assert_array_equal(products[places], right[:, None] * LEFT[None])
    found = receptance.conjugates(ORDERS, 1.7)
    np.testing.assert_allclose(found[0, ..., 1:].conj().transpose(2, 1, 0), receptance.at(ORDERS, 1.7)[0], rtol=1e-12)
    np.testing.assert_allclose(found[1, ..., 1:].conj().transpose(2, 1, 0), receptance.at(ORDERS, 1.7)[1], rtol=1e-11)
