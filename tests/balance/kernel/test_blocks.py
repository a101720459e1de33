"""The compiled products of blocks and modes against the same in sums of numpy."""

import numpy as np
import pytest

from slipstick.balance.kernel.blocks import add_own, blocks_times, onto_modes, subtract_along_modes

RNG = np.random.default_rng(0)
PORTS, N = 5, 2
L = 2 * N + 1
ROWS = np.array([[3, 0], [1, -1], [4, 2]])
HERE = ROWS >= 0


def at_ports():
    """Numbers at the ports, and zeros of those that are not there."""
    return np.vstack([RNG.normal(size=(PORTS, L)), np.zeros(L)])


@pytest.mark.parametrize("transposed", [False, True])
def test_blocks_move_the_ports_of_their_elements(transposed):
    blocks, X, out = RNG.normal(size=(3, 2 * L, 2 * L)), at_ports(), np.full((PORTS + 1, L), np.nan)
    blocks_times(blocks, ROWS, X, out, transposed)
    expected = np.einsum("nji,nj->ni" if transposed else "nij,nj->ni", blocks, X[ROWS].reshape(3, -1))
    np.testing.assert_allclose(out[ROWS[HERE]], expected.reshape(3, 2, L)[HERE], atol=1e-13)


def test_own_compliance_moves_the_same_element():
    compliance = RNG.normal(size=(3, 2, 2, N + 1)) + 1j * RNG.normal(size=(3, 2, 2, N + 1))
    F, before = at_ports(), at_ports()
    out = before.copy()
    add_own(compliance, ROWS, F, out)
    z = np.concatenate([F[:, :1] + 0j, F[:, 1::2] + 1j * F[:, 2::2]], axis=1)[ROWS]
    moved = np.einsum("nijm,njm->nim", compliance, z)[HERE]
    found = (out - before)[ROWS[HERE]]
    np.testing.assert_allclose(found[:, 0], moved[:, 0].real, atol=1e-13)
    np.testing.assert_allclose(found[:, 1::2] + 1j * found[:, 2::2], moved[:, 1:], atol=1e-13)


def test_modes_of_each_order_have_their_own_coefficients():
    """Two modes of the mean, none of the first order, three of the second."""
    first, coefficients = np.array([0, 2, 2, 5]), np.array([0, 0, 3, 3, 3, 4, 4, 4])
    shapes, X = RNG.normal(size=(PORTS, 5)), at_ports()
    each = shapes[:, [0, 1, 2, 3, 4, 2, 3, 4]]
    out = np.empty(8)
    onto_modes(shapes, first, X, out)
    np.testing.assert_allclose(out, np.sum(each * X[:-1, coefficients], axis=0), atol=1e-13)
    a, rest = RNG.normal(size=8), X.copy()
    subtract_along_modes(shapes, first, a, rest)
    moved = np.zeros((PORTS, L))
    np.add.at(moved.T, coefficients, (each * a).T)
    np.testing.assert_allclose(X[:-1] - rest[:-1], moved, atol=1e-13)
    np.testing.assert_array_equal(rest[-1], 0.0)
