"""The Jacobian of the balance with all entries written out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from slipstick.balance.compliance import Compliance, sums
from slipstick.balance.states import power_rows, state_columns
from slipstick.contact.law import add_to
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.state.contact_state import Carried
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance, Tangents

Own = Mapping[tuple[int, int], Array]
"""Tangents of one batch: ``(i, j) -> dF_i/dQ_j`` (n, L, L)."""


def dense_jacobian(
    balance: Balance, tangents: Tangents, compliance: Compliance, states: Sequence[Carried] = ()
) -> DenseJacobian:
    """``I + A dF/dX`` (N, N), with what contact states add; written when and where it is asked for."""
    return DenseJacobian(lambda out: _write(balance, tangents, compliance, states, out), balance.size)


def _write(balance: Balance, tangents: Tangents, compliance: Compliance, states: Sequence[Carried], out: Array) -> None:
    N, add = balance.size, sums().add_products
    out.T.reshape(-1)[: N * (len(out) + 1) : len(out) + 1] = 1.0
    for k, by_ports in enumerate(tangents):
        tangents_here = by_ports if balance.springs is None else _anchored(balance, balance.springs, k, by_ports)
        for pair, tangent in tangents_here.items():
            members, felt, moving = balance.batches[k].couplings[pair]
            if members.size:
                fit = tangent if tangent.flags.carray else np.require(tangent, float, ["C", "W"])
                add(compliance.value, fit, members, felt, moving, out.T)
    for carried in states:
        out[:N, :N] += state_columns(balance, carried, compliance) @ power_rows(balance, carried)


def _anchored(balance: Balance, k: Array, number: int, tangents: Own) -> Own:
    """Tangents of one batch less the springs ``i k``."""
    batch, anchored = balance.batches[number], dict(tangents)
    sine, cosine = np.arange(2, balance.L, 2), np.arange(1, balance.L, 2)
    for i, port in enumerate(batch.ports):
        turned = np.zeros((batch.count, balance.L, balance.L))
        members, springs = np.arange(batch.count)[port.members], k[port.rows]
        turned[np.ix_(members, sine, cosine)] = np.einsum("c,sk->csk", springs, np.eye(sine.size))
        turned[np.ix_(members, cosine, sine)] = -np.einsum("c,sk->csk", springs, np.eye(sine.size))
        add_to(anchored, (i, i), turned)
    return anchored
