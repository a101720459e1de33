"""The compiled sums against the same in matrices of real coefficients."""

import numpy as np

from slipstick.balance.kernel.sums import add_products, compliance_times

RNG = np.random.default_rng(0)
COLUMNS, ROWS, N = 4, 3, 2
L = 2 * N + 1
VALUE = RNG.normal(size=(COLUMNS, ROWS, N + 1)) + 1j * RNG.normal(size=(COLUMNS, ROWS, N + 1))
VALUE[..., 0] = VALUE[..., 0].real


def real() -> np.ndarray:
    """What ``VALUE`` does to real coefficients, (ROWS * L, COLUMNS * L)."""
    out = np.zeros((ROWS, L, COLUMNS, L))
    for row in range(ROWS):
        for column in range(COLUMNS):
            out[row, 0, column, 0] = VALUE[column, row, 0].real
            for m in range(1, N + 1):
                a, b = VALUE[column, row, m].real, VALUE[column, row, m].imag
                out[row, 2 * m - 1 : 2 * m + 1, column, 2 * m - 1 : 2 * m + 1] = [[a, -b], [b, a]]
    return out.reshape(ROWS * L, COLUMNS * L)


def test_moved_by_the_first_columns():
    given = RNG.normal(size=(COLUMNS, L))
    pairs = np.zeros((COLUMNS, L + 1))
    pairs[:, 0], pairs[:, 2:] = given[:, 0], given[:, 1:]
    for count in (COLUMNS, 2):
        expected = real()[:, : count * L] @ given[:count].ravel()
        out = np.full((ROWS, L), 7.0)
        compliance_times(VALUE, pairs.view(complex)[:count], out)
        np.testing.assert_allclose(out.ravel(), expected, atol=1e-14)


def test_products_are_added_where_the_ports_stand():
    tangent = RNG.normal(size=(3, L, L))
    tangent[0, :, 1] = 0.0
    members, felt, moving = np.array([2, 0]), np.array([1, 0]), np.array([0, 2])
    forces = np.zeros((COLUMNS, L, ROWS, L))
    forces[1, :, 0, :], forces[0, :, 2, :] = tangent[2], tangent[0]
    before = RNG.normal(size=(ROWS * L + 1, ROWS * L + 1))
    out = before.copy()
    filled = np.zeros(len(out), dtype=bool)
    add_products(VALUE, tangent, members, felt, moving, out, filled)
    expected = real() @ forces.reshape(COLUMNS * L, -1)
    np.testing.assert_allclose((out - before)[:-1, :-1].T, expected, atol=1e-13)
    np.testing.assert_array_equal(out[-1], before[-1])
    np.testing.assert_array_equal(out[:, -1], before[:, -1])
    np.testing.assert_array_equal(filled[:-1], np.any(expected, axis=0))
    assert not filled[-1]
