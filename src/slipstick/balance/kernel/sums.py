"""The compiled sums of the balance: a pair (cosine, sine) is the complex number ``c + i s``, see ``evaluation.py``."""

from __future__ import annotations

import numpy as np

from slipstick.trig.compiled import compiled
from slipstick.typing import Array, BoolArray, ComplexArray, IntArray


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
def residual_with_slope(
    both: ComplexArray, x: Array, on_ports: Array, P: Array, springs: Array, support: Array, out: Array
) -> None:
    """Write ``R = X + A (F - P)`` and its derivative at fixed motion into ``out`` (2, n_ports, L).

    ``both`` (2, n_columns, n_rows, n + 1) is ``conj(A)`` with its derivative; ``on_ports`` (2, n_ports, L) are the
    forces and their derivatives. Springs ``i k`` and those of harmonic 0, (n_ports,) each, or empty, are subtracted.
    """
    columns, ports, n = both.shape[1], x.shape[0], both.shape[3] - 1
    A, dA = both[0], both[1]
    for p in range(ports):
        for j in range(2 * n + 1):
            out[0, p, j], out[1, p, j] = x[p, j], 0.0
    for c in range(columns):
        port = c < ports
        F = on_ports[0, c] if port else P[c - ports]
        sign = 1.0 if port else -1.0
        still, still_slope = sign * F[0], on_ports[1, c, 0] if port else 0.0
        if port and support.size:
            still -= support[c] * x[c, 0]
        for p in range(ports):
            out[0, p, 0] += A[c, p, 0].real * still
            out[1, p, 0] += dA[c, p, 0].real * still + A[c, p, 0].real * still_slope
        for m in range(1, n + 1):
            i = 2 * m - 1
            g = sign * complex(F[i], F[i + 1])
            slope = complex(on_ports[1, c, i], on_ports[1, c, i + 1]) if port else 0j
            if port and springs.size:
                g += springs[c] * complex(-x[c, i + 1], x[c, i])
            for p in range(ports):
                z, dz = A[c, p, m] * g, dA[c, p, m] * g + A[c, p, m] * slope
                out[0, p, i] += z.real
                out[0, p, i + 1] += z.imag
                out[1, p, i] += dz.real
                out[1, p, i + 1] += dz.imag


@compiled(allocates=True, nogil=True)
def residuals_of_many(both: ComplexArray, x: Array, on_ports: Array, P: Array, out: Array) -> None:
    """``residual_with_slope`` of each, without springs, into ``out`` (k, 2, n_ports, L); ``on_ports`` (2, k, ...)."""
    none = np.empty(0)
    for i in range(len(both)):
        residual_with_slope(both[i], x[i], on_ports[:, i], P[i], none, none, out[i])


@compiled(allocates=True, nogil=True)
def add_products(
    value: ComplexArray, tangent: Array, members: IntArray, felt: IntArray, moving: IntArray, out: Array,
    filled: BoolArray,
) -> None:  # fmt: skip
    """Add ``A dF_i/dQ_j`` of the elements ``members`` to a transposed Jacobian (N or more each way).

    ``tangent`` (n, L, L) are their derivatives; ``felt`` and ``moving`` the numbers of their ports i and j. Unknowns
    (N or more,) on which a force depends are marked ``filled``.
    """
    rows, n = value.shape[1], value.shape[2] - 1
    L = 2 * n + 1
    force = np.empty(n + 1, np.complex128)
    for t in range(members.size):
        i, e = felt[t], members[t]
        for k in range(L):
            acts = tangent[e, 0, k] != 0.0
            force[0] = tangent[e, 0, k]
            for m in range(1, n + 1):
                force[m] = complex(tangent[e, 2 * m - 1, k], tangent[e, 2 * m, k])
                acts |= force[m] != 0j
            if not acts:
                continue
            column = out[moving[t] * L + k]
            filled[moving[t] * L + k] = True
            for p in range(rows):
                column[p * L] += value[i, p, 0].real * force[0].real
                for m in range(1, n + 1):
                    z = value[i, p, m] * force[m]
                    column[p * L + 2 * m - 1] += z.real
                    column[p * L + 2 * m] += z.imag


@compiled(allocates=True, nogil=True)
def add_force_changes(
    tangent: Array, members: IntArray, felt: IntArray, moving: IntArray, x: Array, out: Array
) -> None:
    """Add changes of the forces (n_ports, L) by changes ``x`` of the motion; see ``add_products``."""
    for t in range(members.size):
        T, moved, force = tangent[members[t]], x[moving[t]], out[felt[t]]
        for i in range(force.size):
            total = 0.0
            for j in range(force.size):
                total += T[i, j] * moved[j]
            force[i] += total


@compiled(allocates=True, nogil=True)
def products_of_many(
    value: ComplexArray, tangent: Array, members: IntArray, felt: IntArray, moving: IntArray, out: Array
) -> None:
    """``add_products`` of each: ``tangent`` (k, count, L, L), transposed Jacobians ``out`` (k, N or more each way)."""
    filled = np.empty(out.shape[1], np.bool_)
    for i in range(len(value)):
        add_products(value[i], tangent[i], members, felt, moving, out[i], filled)
