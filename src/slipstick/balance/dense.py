"""The Jacobian of the balance with all entries written out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from slipstick.balance.compliance import Compliance
from slipstick.balance.heat import heat_columns, power_rows
from slipstick.contact.law import add_to
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.thermal.model import Heat
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.batches import Column
    from slipstick.balance.ports import Balance, Tangents

Own = Mapping[tuple[int, int], Array]
"""Tangents of one batch: ``(i, j) -> dF_i/dQ_j`` (n, L, L)."""


def dense_jacobian(
    balance: Balance, tangents: Tangents, compliance: Compliance, heat: Heat | None = None
) -> DenseJacobian:
    """``I + A dF/dX`` (N, N), with what heat adds; written out when it is asked for."""
    return DenseJacobian(lambda: _written_out(balance, tangents, compliance, heat))


def _written_out(balance: Balance, tangents: Tangents, compliance: Compliance, heat: Heat | None) -> Array:
    # transposed, so that what is written lies together
    transposed = np.empty((balance.n_ports, balance.L, balance.n_ports, balance.L))
    for k, given in enumerate(tangents):
        own = given if balance.springs is None else _anchored(balance, balance.springs, k, given)
        filled: set[int] = set()
        for column in balance.columns_of(k, tuple(own)):
            _fill(balance, transposed, k, column, own, compliance.value)
            filled.add(column.port)
        for j, port in enumerate(balance.batches[k].ports):
            if j not in filled and port.size:
                transposed[port.rows] = 0.0
    matrix = transposed.reshape(balance.size, balance.size)
    matrix.reshape(-1)[:: balance.size + 1] += 1.0
    if heat is not None:
        matrix.T[...] += heat_columns(balance, heat, compliance) @ power_rows(balance, heat)
    return matrix.T


def _anchored(balance: Balance, k: Array, number: int, given: Own) -> Own:
    """Tangents of one batch less the springs ``i k``."""
    batch, found = balance.batches[number], dict(given)
    sine, cosine = np.arange(2, balance.L, 2), np.arange(1, balance.L, 2)
    for i, port in enumerate(batch.ports):
        turned = np.zeros((batch.count, balance.L, balance.L))
        members, springs = np.arange(batch.count)[port.members], k[port.rows]
        turned[np.ix_(members, sine, cosine)] = np.einsum("c,sk->csk", springs, np.eye(sine.size))
        turned[np.ix_(members, cosine, sine)] = -np.einsum("c,sk->csk", springs, np.eye(sine.size))
        add_to(found, (i, i), turned)
    return found


def _fill(balance: Balance, out: Array, k: int, column: Column, own: Own, value: ComplexArray) -> None:
    """The columns of one port's motion: what all forces that feel it do to all ports."""
    port, moved = balance.batches[k].ports[column.port], None
    for i, members, at, rows in column.terms:
        z = _complex_rows(balance, own[i, column.port][members])
        part = z[:, :, None, :] * value[rows, None, : balance.n_ports, :]
        if moved is None and len(part) == port.size:
            moved = part
        else:
            if moved is None:
                moved = np.zeros((port.size, *part.shape[1:]), dtype=complex)
            moved[at] += part
    assert moved is not None
    pairs = moved.view(float)
    target = out[port.rows]
    target[..., 0], target[..., 1:] = pairs[..., 0], pairs[..., 2:]
    if not isinstance(port.rows, slice):
        out[port.rows] = target


def _complex_rows(balance: Balance, matrices: Array) -> ComplexArray:
    """Derivatives (c, L, L) with their rows paired: (c, column, n + 1)."""
    out = np.zeros((len(matrices), balance.L, 2 * balance.orders.size + 2))
    turned = matrices.transpose(0, 2, 1)
    out[:, :, 0], out[:, :, 2:] = turned[:, :, 0], turned[:, :, 1:]
    return out.view(complex)
