"""Balances of one form with different numbers, evaluated together: the systems of many curves over the frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.balance import Balance
from slipstick.balance.compliance import sums
from slipstick.balance.evaluation import detail, evaluated_together
from slipstick.balance.inputs import Assigned, Inputs
from slipstick.balance.layout import Batch, Places
from slipstick.structure.receptance import Receptance
from slipstick.typing import Array, ComplexArray

Numbers = NDArray[np.intp]


def same_form(first: Balance, other: Balance) -> bool:
    """Whether two balances differ in numbers alone: the same ports, loads, laws and harmonics."""
    return (
        evaluated_together(other)
        and first.harmonics == other.harmonics
        and first.n_loads == other.n_loads
        and len(first.batches) == len(other.batches)
        and all(_same_batch(a, b) for a, b in zip(first.batches, other.batches, strict=True))
        and first.problem.outputs == other.problem.outputs
        and np.array_equal(first.directions, other.directions)
    )


def _same_batch(a: Batch, b: Batch) -> bool:
    ports = zip(a.ports, b.ports, strict=True)
    return a.law.kind == b.law.kind and a.members == b.members and all(
        p.size == q.size and _same_places(p.rows, q.rows) and _same_places(p.members, q.members) for p, q in ports
    )  # fmt: skip


def _same_places(a: Places, b: Places) -> bool:
    if isinstance(a, slice) or isinstance(b, slice):
        return a == b if isinstance(a, slice) and isinstance(b, slice) else False
    return np.array_equal(a, b)


class ManyBalances:
    """Balances of the same form (see ``same_form``) with their inputs, n of each.

    Attributes
    ----------
    inputs
        Of each.
    structure
        Number of the structure of each, (n,): balances of one structure share a receptance.
    """

    def __init__(self, balances: Sequence[Balance], inputs: Sequence[Inputs]) -> None:
        self._balance, self.inputs = balances[0], Assigned(inputs, np.arange(len(inputs)))
        structures: dict[Any, int] = {}
        receptances, which = list[Receptance](), list[int]()
        for balance, one in zip(balances, inputs, strict=True):
            key = id(balance.problem.structure), tuple(sorted(one.structure.items()))
            if key not in structures:
                structures[key] = len(receptances)
                receptances.append(balance.receptance.adjusted(one.structure))
            which.append(structures[key])
        self._receptances, self.structure = receptances, np.array(which)

    def evaluate(self, branches: Numbers, states: Array) -> tuple[Array, Array]:
        """Residuals (k, N) and derivatives by the state (k, N, N + 1) at states (k, N + 1) of the balances named.

        As ``FrequencySystem.evaluate``: nan where the motion is not finite.
        """
        N = self._balance.size
        with np.errstate(over="ignore", invalid="ignore"):
            known = np.isfinite(np.vecdot(states, states)) & (states[:, -1] > 0.0)
        if known.all():
            return self._evaluated(branches, states)
        residual, by_state = np.full((len(states), N), np.nan), np.full((len(states), N, N + 1), np.nan)
        if known.any():
            residual[known], by_state[known] = self._evaluated(branches[known], states[known])
        return residual, by_state

    def _evaluated(self, branches: Numbers, states: Array) -> tuple[Array, Array]:
        b, k, N = self._balance, len(states), self._balance.size
        x, omega = np.ascontiguousarray(states[:, :-1]), states[:, -1]
        solution = detail(b, x, omega, self.inputs.at(branches).joined)
        both, shape = self._compliance(branches, omega), (k, b.n_ports, b.L)
        out = np.empty((k, 2, *shape[1:]))
        sums().residuals_of_many(both, x.reshape(shape), solution.on_ports, solution.inputs.P, out)
        jacobian = np.zeros((k, N, N))
        jacobian[:, np.arange(N), np.arange(N)] = 1.0
        for batch, response in zip(b.batches, solution.responses, strict=True):
            for pair, tangent in response.by_motion.items():
                if pair in batch.coupled:
                    each = np.ascontiguousarray(tangent).reshape(k, batch.count, b.L, b.L)
                    sums().products_of_many(both[:, 0], each, *batch.coupled[pair], jacobian)
        by_state = np.empty((k, N, N + 1))
        by_state[:, :, :N] = jacobian.transpose(0, 2, 1)
        by_state[:, :, N] = out[:, 1].reshape(k, N)
        return out[:, 0].reshape(k, N), by_state

    def _compliance(self, branches: Numbers, omega: Array) -> ComplexArray:
        """``conj(A)`` and its derivative by omega, (k, 2, n_columns, n_rows, n + 1)."""
        b, which = self._balance, self.structure[branches]
        columns, rows = b.n_ports + b.n_loads, b.n_ports
        out = np.empty((len(omega), 2, columns, rows, b.orders.size + 1), dtype=complex)
        for number in np.unique(which) if len(self._receptances) > 1 else (0,):
            at = np.flatnonzero(which == number)
            receptance = self._receptances[number]
            part = out if len(at) == len(out) else np.empty((len(at), *out.shape[1:]), dtype=complex)
            receptance.conjugates_of(b.orders, omega[at], part)
            if part is not out:
                out[at] = part
        return out
