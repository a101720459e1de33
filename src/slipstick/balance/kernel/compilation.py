"""Compilation of all that evaluating a balance needs: once on a machine, kept on disk."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from slipstick.balance.compliance import Compliance
from slipstick.contact.kernel.compilation import compile_kernel


def compile_all() -> float:
    """Compile the contact kernel and the sums of the balance, or load them; returns the seconds it took."""
    from slipstick.balance.kernel.sums import add_force_changes, add_products, residuals_of_many
    from slipstick.structure.receptance import undamped

    start = perf_counter()
    compile_kernel()
    one = np.ones((1, 1))
    compliance = Compliance(undamped(np.ones(1), one, one), np.array([2.0]), 1.0)
    compliance.answer(np.ones((1, 2), dtype=complex))
    none = np.empty(0)
    compliance.residual_with_slope(np.ones((1, 3)), np.ones((2, 1, 3)), np.empty((0, 3)), none, none)
    both, on_ports = np.ones((1, 2, 1, 1, 2), dtype=complex), np.ones((2, 1, 1, 3))
    residuals_of_many(both, np.ones((1, 1, 3)), on_ports, np.empty((1, 0, 3)), np.empty((1, 2, 1, 3)))
    first = np.zeros(1, dtype=np.int64)
    add_products(compliance.value, np.ones((1, 3, 3)), first, first, first, np.zeros((3, 3)), np.zeros(3, dtype=bool))
    add_force_changes(np.ones((1, 3, 3)), first, first, first, np.ones((1, 3)), np.zeros((1, 3)))
    return perf_counter() - start
