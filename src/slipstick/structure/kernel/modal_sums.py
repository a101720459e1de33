"""The compiled sum over modes that a receptance is."""

from __future__ import annotations

import numpy as np

from slipstick.trig.compiled import compiled
from slipstick.typing import Array, ComplexArray, IntArray


@compiled(allocates=True, nogil=True)
def modal_sums(
    static: Array, products: Array, places: IntArray, first: int, stiffness: ComplexArray, damping: ComplexArray,
    left_out: ComplexArray, orders: Array, w: Array, out: ComplexArray,
) -> None:  # fmt: skip
    """Write ``conj(A)`` at ``w`` (k,) and its derivative by omega into ``out`` (2, n_columns, n_rows, 1 + k).

    The first place of the last axis is that of ``static`` (n_rows, n_columns). ``products`` (any, n_modes) are those of
    columns and rows; ``places`` (n_columns, any) says which one is that of a column and a row, from row ``first`` on.
    ``w`` grows with omega as ``orders`` (k,) say. ``left_out`` holds the residual and the second residual, (2, n_rows,
    n_columns), complex; ``damping`` is ``i`` times the viscous one.
    """
    n, modes, columns = w.size, stiffness.size, out.shape[1]
    weights = np.empty((modes, 4 * n))
    for r in range(modes):
        K, loss, c = stiffness[r].real, stiffness[r].imag, damping[r].imag  # real numbers: half the time to compile
        for k in range(n):
            a, b = K - w[k] * w[k], loss + w[k] * c
            s = 1.0 / (a * a + b * b)
            x, y = a * s, -b * s  # 1 / (a + i b)
            p, q = x * x - y * y, 2.0 * x * y  # (x + i y)^2
            weights[r, k], weights[r, n + k] = x, y
            weights[r, 2 * n + k] = orders[k] * (2.0 * w[k] * p + c * q)
            weights[r, 3 * n + k] = orders[k] * (2.0 * w[k] * q - c * p)
    sums = np.dot(products, weights)
    for column in range(columns):
        for row in range(first, first + places.shape[1]):
            sum_here = sums[places[column, row - first]]
            rest, second = left_out[0, row, column], left_out[1, row, column]
            out[0, column, row, 0], out[1, column, row, 0] = static[row, column], 0.0
            for k in range(n):
                square, grows = w[k] * w[k], 2.0 * orders[k] * w[k]
                A = complex(sum_here[k], sum_here[n + k]) + rest + square * second
                dA = complex(sum_here[2 * n + k], sum_here[3 * n + k]) + grows * second
                out[0, column, row, 1 + k], out[1, column, row, 1 + k] = A.conjugate(), dA.conjugate()


@compiled(allocates=True, nogil=True)
def modal_sums_of_many(
    static: Array, products: Array, places: IntArray, stiffness: ComplexArray, damping: ComplexArray,
    left_out: ComplexArray, orders: Array, omega: Array, out: ComplexArray,
) -> None:  # fmt: skip
    """``modal_sums`` at every omega (k,), into ``out`` (k, 2, n_columns, n_rows, n + 1)."""
    for i in range(omega.size):
        modal_sums(static, products, places, 0, stiffness, damping, left_out, orders, omega[i] * orders, out[i])
