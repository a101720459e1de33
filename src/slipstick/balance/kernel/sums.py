"""The compiled sums of the balance: a pair (cosine, sine) is the complex number ``c + i s``, see ``evaluation.py``."""

from __future__ import annotations

import numpy as np

from slipstick.trig.compiled import compiled
from slipstick.typing import Array, ComplexArray, IntArray


@compiled(allocates=True, nogil=True)
def compliance_times(value: ComplexArray, G: ComplexArray, out: Array) -> None:
    """Write ``conj(A) G`` as coefficients (n_rows, L), of the first columns' numbers ``G`` (any, n + 1)."""
    rows, n = value.shape[1], value.shape[2] - 1
    out[:] = 0.0
    for c in range(len(G)):
        for p in range(rows):
            out[p, 0] += value[c, p, 0].real * G[c, 0].real
            for m in range(1, n + 1):
                z = value[c, p, m] * G[c, m]
                out[p, 2 * m - 1] += z.real
                out[p, 2 * m] += z.imag


@compiled(allocates=True, nogil=True)
def compliance_sums(both: ComplexArray, G: ComplexArray, slope: ComplexArray, out: Array) -> None:
    """Write ``conj(A) G`` and its derivative, into ``out`` (2, n_rows, L), from ``both`` (2, n_columns, n_rows, n + 1).

    ``slope`` (any, n + 1) is the derivative of ``G`` on the first columns.
    """
    compliance_times(both[0], G, out[0])
    compliance_times(both[1], G, out[1])
    if len(slope):
        by_slope = np.empty(out[1].shape)
        compliance_times(both[0], slope, by_slope)
        out[1] += by_slope


@compiled(allocates=True, nogil=True)
def add_products(
    value: ComplexArray, tangent: Array, members: IntArray, felt: IntArray, moving: IntArray, out: Array
) -> None:
    """Add ``A dF_i/dQ_j`` of the elements ``members`` to a transposed Jacobian (N or more each way).

    ``tangent`` (n, L, L) are their derivatives; ``felt`` and ``moving`` the numbers of their ports i and j.
    """
    rows, n = value.shape[1], value.shape[2] - 1
    L = 2 * n + 1
    force = np.empty(n + 1, np.complex128)
    for t in range(members.size):
        i, e = felt[t], members[t]
        for k in range(L):
            column = out[moving[t] * L + k]
            force[0] = tangent[e, 0, k]
            for m in range(1, n + 1):
                force[m] = complex(tangent[e, 2 * m - 1, k], tangent[e, 2 * m, k])
            for p in range(rows):
                column[p * L] += value[i, p, 0].real * force[0].real
                for m in range(1, n + 1):
                    z = value[i, p, m] * force[m]
                    column[p * L + 2 * m - 1] += z.real
                    column[p * L + 2 * m] += z.imag


@compiled(allocates=True, nogil=True)
def times_of_many(value: ComplexArray, G: ComplexArray, out: Array) -> None:
    """``compliance_times`` of each, into ``out`` (k, n_rows, L)."""
    for i in range(len(value)):
        compliance_times(value[i], G[i], out[i])


@compiled(allocates=True, nogil=True)
def products_of_many(
    value: ComplexArray, tangent: Array, members: IntArray, felt: IntArray, moving: IntArray, out: Array
) -> None:
    """``add_products`` of each: ``tangent`` (k, count, L, L), transposed Jacobians ``out`` (k, N or more each way)."""
    for i in range(len(value)):
        add_products(value[i], tangent[i], members, felt, moving, out[i])
