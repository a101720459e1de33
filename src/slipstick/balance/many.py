"""Balances of one form with different numbers, evaluated together: the systems of many curves over the frequency."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.balance import Balance
from slipstick.balance.batch_evaluation import evaluated_together
from slipstick.balance.batches import Batch, Places
from slipstick.balance.inputs import Assigned, Inputs
from slipstick.contact.law import Motion, Response
from slipstick.structure.receptance import Receptance
from slipstick.typing import Array, ComplexArray

Numbers = NDArray[np.intp]


@cache
def _compiled() -> ModuleType:
    from slipstick.balance.kernel import many

    return many


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
        self._P = self.inputs.loads
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
        x, omega = states[:, :-1], states[:, -1]
        value = self._compliance(branches, omega)
        G = np.zeros((k, b.n_ports + b.n_loads, 2 * b.orders.size + 2))
        slope = np.zeros((k, b.n_ports, 2 * b.orders.size + 2))
        P = self._P[branches]
        G[:, b.n_ports :, 0], G[:, b.n_ports :, 2:] = -P[:, :, 0], -P[:, :, 1:]
        jacobian = np.zeros((k, N, N))
        jacobian[:, np.arange(N), np.arange(N)] = 1.0
        slopes = False
        for number, batch in enumerate(b.batches):
            response, velocity = self.respond(number, branches, x, omega)
            for i, force in enumerate(response.force):
                _on_ports(batch, i, force, G)
            for (i, j), tangent in response.by_motion.items():
                members, felt, moving = batch.couplings[i, j]
                if members.size:
                    each = np.ascontiguousarray(tangent).reshape(k, batch.count, b.L, b.L)
                    _compiled().products_of_many(value[:, 0], each, members, felt, moving, jacobian)
            for i, part in response.by_omega.items():
                slopes = True
                _on_ports(batch, i, part, slope)
            if velocity.any():
                slopes = True
                rate = velocity / -np.repeat(omega * omega, batch.count)
                for (i, j), part in response.by_drift.items():
                    _on_ports(batch, i, rate[j][:, None] * part, slope)
        residual, by_omega = (np.empty((k, b.n_ports, b.L)) for _ in range(2))
        times = _compiled().times_of_many
        times(value[:, 0], G.view(complex), residual)
        times(value[:, 1], G.view(complex), by_omega)
        by_state = np.empty((k, N, N + 1))
        by_state[:, :, :N] = jacobian.transpose(0, 2, 1)
        by_state[:, :, N] = by_omega.reshape(k, N)
        if slopes:
            times(value[:, 0], slope.view(complex), by_omega)
            by_state[:, :, N] += by_omega.reshape(k, N)
        return x + residual.reshape(k, N), by_state

    def respond(self, k: int, branches: Numbers, x: Array, omega: Array) -> tuple[Response, Array]:
        """Batch ``k`` at motions (m, N), elements of the first motion first; their velocities (n_ports, m count)."""
        b, batch = self._balance, self._balance.batches[k]
        here = self.inputs.at(branches).contacts(k)
        X = x.reshape(len(x), b.n_ports, b.L)
        moved = []
        for port, Q in zip(batch.ports, here.motion, strict=True):
            if port.size:
                Q.reshape(len(x), batch.count, -1)[:, port.members] += X[:, port.rows]
            moved.append(Q)
        each = np.repeat(omega, batch.count)
        motion = Motion(b.harmonics, each, tuple(moved), here.drift(each), here.velocity_per_omega)
        return batch.law.respond(motion, here.values), here.velocity

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


def _on_ports(batch: Batch, i: int, part: Array, out: Array) -> None:
    """Add something (k count, L) of port i of a batch to that of all ports (k, any, 2 n + 2): pairs (c, s)."""
    port = batch.ports[i]
    if port.size:
        F = part.reshape(len(out), batch.count, -1)[:, port.members]
        out[:, port.rows, 0] += F[..., 0]
        out[:, port.rows, 2:] += F[..., 1:]
