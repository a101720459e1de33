"""Many motions of one balance at once: every element at every motion in one call of its law."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import groupby

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.factored import FactoredCompliance
from slipstick.balance.inputs import Assigned, ContactInputs
from slipstick.contact.law import Motion, Response
from slipstick.structure.receptance import Receptance, mapped
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_MANY = 2**18
"""Entries of a receptance from which on its size is that of its factors."""


def forces_together(balance: Balance) -> bool:
    """Whether forces and residuals at motions of a balance can be computed together.

    Not with contact states, which depend on the neighbouring solution, and not with springs, whose forces go with the
    motion.
    """
    return not balance.states and balance.springs is None and balance.support_springs is None


def evaluated_together(balance: Balance) -> bool:
    """Whether motions of a balance can be evaluated together: Jacobians too, which iterative ones are not."""
    return forces_together(balance) and balance.backend.name == "dense"


def respond(
    balance: Balance, k: int, x: Array, omega: Array, inputs: Assigned, harmonics: Harmonics | None = None
) -> Response:
    """Batch ``k`` at n motions: unknowns (n, N), frequencies (n,); elements at the first motion first.

    With other ``harmonics`` that hold those of the balance, forces are given in these.
    """
    return motion_and_response(balance, k, x, omega, inputs.contacts(k), harmonics)[1]


def motion_and_response(
    balance: Balance, k: int, x: Array, omega: Array, contact_inputs: ContactInputs, harmonics: Harmonics | None = None
) -> tuple[Motion, Response]:
    """The same with the motion of the elements; their ``contact_inputs`` are those of all motions, and written on."""
    batch, kept = balance.batches[k], balance.harmonics
    X = x.reshape(len(x), balance.n_ports, balance.L)
    moved = []
    for port, Q in zip(batch.ports, contact_inputs.motion, strict=True):
        if port.size:
            Q.reshape(len(x), batch.count, -1)[:, port.members] += X[:, port.rows]
        moved.append(_in(harmonics or kept, kept, Q))
    each = np.repeat(omega, batch.count)
    law = batch.law if harmonics is None else batch.law.widened(kept, harmonics)
    motion = Motion(harmonics or kept, each, tuple(moved), contact_inputs.drift(each))
    return motion, law.respond(motion, contact_inputs.values)


def _in(wide: Harmonics, narrow: Harmonics, Q: Array) -> Array:
    """Coefficients (k, L) in a set that holds their own."""
    if wide is narrow:
        return Q
    out = np.zeros((len(Q), wide.size))
    out[:, [wide.index(0), *(wide.index(m, part) for m in narrow.orders[1:] for part in ("c", "s"))]] = Q
    return out


class Together:
    """The response of each batch as ``respond`` gives it at n motions: unknowns (n, N), frequencies (n,)."""

    def __init__(self, balance: Balance, x: Array, omega: Array, inputs: Assigned) -> None:
        self._balance, self._x, self._omega, self._inputs = balance, x, omega, inputs
        self.responses: Sequence[Response] = [
            respond(balance, k, x, omega, inputs) for k in range(len(balance.batches))
        ]

    @cached_property
    def loads(self) -> Array:
        """Forces of the loads (n, n_loads, L)."""
        return self._inputs.loads

    @cached_property
    def forces(self) -> Array:
        """Forces on all ports (n, n_ports, L)."""
        return self._on_ports(lambda k, i: self.responses[k].force[i])

    def force_changes(self, dx: Array) -> Array:
        """Their changes for changes (n, N) of the unknowns."""
        balance, dX = self._balance, dx.reshape(len(dx), self._balance.n_ports, self._balance.L)

        def change(k: int, i: int) -> Array:
            batch, total = balance.batches[k], np.zeros_like(self.responses[k].force[i])
            for (felt, j), tangent in self.responses[k].by_motion.items():
                port = batch.ports[j]
                if felt == i and port.size:
                    dQ = np.zeros((len(dx), batch.count, balance.L))
                    dQ[:, port.members] = dX[:, port.rows]
                    total += np.einsum("cij,cj->ci", tangent, dQ.reshape(-1, balance.L))
            return total

        return self._on_ports(change)

    def _on_ports(self, of: Callable[[int, int], Array]) -> Array:
        """Something (n * count, L) of each port of each batch, on all ports."""
        balance, out = self._balance, np.zeros((len(self._x), self._balance.n_ports, self._balance.L))
        for k, batch in enumerate(balance.batches):
            for i, port in enumerate(batch.ports):
                if port.size:
                    out[:, port.rows] = of(k, i).reshape(len(out), batch.count, -1)[:, port.members]
        return out

    def residuals(self) -> Array:
        """``X + A (F - P)``, (n, N)."""
        return self._x + self._answer().reshape(self._x.shape)

    def relative_residuals(self) -> Array:
        """Norms (n,) of the residuals, each entry over the sizes of its terms, as in ``balance.residual.terms``."""
        balance, x = self._balance, self._x
        stiffness, prescribed = np.zeros((len(x), balance.n_ports)), np.zeros(len(x))
        for k, (batch, response) in enumerate(zip(balance.batches, self.responses, strict=True)):
            sizes = [np.sum(one.batches[k].motion[..., 1:] ** 2) for one in self._inputs.distinct]
            prescribed += np.array(sizes)[self._inputs.which]
            for i, springs in batch.law.springs(response).items():
                port = batch.ports[i]
                stiffness[:, port.rows] += springs.reshape(len(x), batch.count)[:, port.members]
        reach = np.empty_like(self.forces)
        for receptance, at in self._receptances():
            reach[at] = _reach(receptance, balance.orders, self._omega[at], stiffness[at])
        motion = np.sqrt(np.vecdot(x, x))
        terms = motion[:, None, None] + reach * (motion + np.sqrt(prescribed))[:, None, None]
        residual = self.residuals().reshape(terms.shape)
        return np.sqrt(np.sum((residual / np.where(terms > 0, terms, 1.0)) ** 2, axis=(1, 2)))

    def _answer(self) -> Array:
        """``A (F - P)`` (n, n_ports, L)."""
        G, out = np.concatenate([self.forces, -self.loads], axis=1), np.empty_like(self.forces)
        for receptance, at in self._receptances():
            out[at, :, 0] = mapped(receptance.static, G[at, :, 0, None])[:, :, 0]
            out[at, :, 1:] = receptance.answer(self._balance.orders, self._omega[at], G[at, :, 1:])
        return out

    def _receptances(self) -> Iterator[tuple[Receptance, slice]]:
        """The receptance of each structure, and the motions that it answers."""
        first = 0
        for structure, same in groupby(self._inputs.structures):
            at = slice(first, first + len(list(same)))
            yield self._balance.receptance.adjusted(structure), at
            first = at.stop


def _reach(receptance: Receptance, orders: Array, omega: Array, stiffness: Array) -> Array:
    """``|A|`` times stiffnesses (n, n_ports), for each coefficient (n, n_ports, L)."""
    n, ports = stiffness.shape
    if receptance.static.size > _MANY and receptance.summed:
        by_modes = [
            FactoredCompliance(receptance.factors(orders, float(w))).reach(k)
            for w, k in zip(omega, stiffness, strict=True)
        ]
        reached = np.array(by_modes).reshape(n, -1, 1 + orders.size)
        return np.concatenate([reached[..., :1], np.repeat(reached[..., 1:], 2, axis=2)], axis=2)
    receptance = receptance.written()
    out = np.empty((n, ports, 1 + 2 * orders.size))
    out[..., 0] = mapped(np.abs(receptance.static[:, :ports]), stiffness[:, :, None])[:, :, 0]
    if orders.size:
        A, _ = receptance.at(orders, omega)
        size = (np.abs(A[..., :ports]) @ stiffness[:, None, :, None])[..., 0].transpose(0, 2, 1)
        out[..., 1::2] = out[..., 2::2] = size
    return out
