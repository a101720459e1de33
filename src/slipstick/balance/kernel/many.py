"""The compiled sums of a balance for many solutions in one call, one after the other: each as it is summed alone."""

from __future__ import annotations

from slipstick.balance.kernel.sums import add_products, compliance_times
from slipstick.trig.compiled import compiled
from slipstick.typing import Array, ComplexArray, IntArray


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
