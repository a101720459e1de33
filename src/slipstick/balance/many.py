"""Many states of one balance at once: every element of every state in one call of its law."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import groupby

import numpy as np

from slipstick.balance.inputs import SURFACE, Given, Inputs
from slipstick.balance.ports import Balance
from slipstick.contact import traits
from slipstick.contact.law import Motion, Response
from slipstick.solve.norm import norm
from slipstick.structure.dynamic import adjusted
from slipstick.structure.protocol import Receptance
from slipstick.structure.receptance import ModalReceptance
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray


def evaluated_together(balance: Balance) -> bool:
    """Whether states of a balance can be evaluated together.

    Not with heat, which depends on the neighbouring solution, and not in the forms of the equations that are made for
    one frequency at a time.
    """
    return balance.heated is None and balance.springs is None and balance.kind.name == "dense"


def respond(
    balance: Balance, k: int, x: Array, omega: Array, inputs: Sequence[Inputs], harmonics: Harmonics | None = None
) -> Response:
    """Batch ``k`` at n states: unknowns (n, N), frequencies (n,); elements of the first state first.

    With other ``harmonics`` that hold those of the balance, forces are given in these.
    """
    batch, own = balance.batches[k], balance.harmonics
    given = _joined([one.batches[k] for one in inputs])
    X = x.reshape(len(x), balance.n_ports, balance.L)
    moved = []
    for port, Q in zip(batch.ports, given.motion, strict=True):
        Q.reshape(len(x), batch.count, -1)[:, port.members] += X[:, port.rows]
        moved.append(_in(harmonics or own, own, Q))
    each = np.repeat(omega, batch.count)
    law = batch.law if harmonics is None else traits.widened(batch.law, own, harmonics)
    return law.respond(Motion(harmonics or own, each, tuple(moved), given.drift(each)), given.values)


def _joined(given: Sequence[Given]) -> Given:
    """The elements of all in one, in new arrays."""
    surface = {name: np.concatenate([getattr(g, name) for g in given], axis=1) for name in SURFACE}
    values = {name: np.concatenate([g.values[name] for g in given]) for name in given[0].values}
    return Given(values=values, **surface)


def _in(wide: Harmonics, own: Harmonics, Q: Array) -> Array:
    """Coefficients (k, L) in a set that holds their own."""
    if wide is own:
        return Q
    out = np.zeros((len(Q), wide.size))
    out[:, [wide.index(0), *(wide.index(m, part) for m in own.orders[1:] for part in ("c", "s"))]] = Q
    return out


class Together:
    """The response of each batch as ``respond`` gives it at n states: unknowns (n, N), frequencies (n,)."""

    def __init__(self, balance: Balance, x: Array, omega: Array, inputs: Sequence[Inputs]) -> None:
        self._balance, self._x, self._omega, self._inputs = balance, x, omega, inputs
        self.responses: Sequence[Response] = [
            respond(balance, k, x, omega, inputs) for k in range(len(balance.batches))
        ]

    @cached_property
    def loads(self) -> Array:
        """Forces of the loads (n, n_loads, L)."""
        return np.array([one.P for one in self._inputs]).reshape(len(self._x), self._balance.n_loads, self._balance.L)

    @cached_property
    def forces(self) -> Array:
        """Forces on all ports (n, n_ports, L)."""
        return self._on_ports(lambda k, i: self.responses[k].force[i])

    def force_changes(self, dx: Array) -> Array:
        """Their changes for changes (n, N) of the unknowns."""
        balance, dX = self._balance, dx.reshape(len(dx), self._balance.n_ports, self._balance.L)

        def change(k: int, i: int) -> Array:
            batch, total = balance.batches[k], np.zeros_like(self.responses[k].force[i])
            for (own, j), tangent in self.responses[k].by_motion.items():
                port = batch.ports[j]
                if own == i and port.size:
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
        return self._x + self._answers(None)[0].reshape(self._x.shape)

    def relative_residuals(self) -> Array:
        """Norms (n,) of the residuals, each entry over the sizes of its terms, as in ``balance.residual.terms``."""
        balance, x = self._balance, self._x
        stiffness, prescribed = np.zeros((len(x), balance.n_ports)), np.zeros(len(x))
        for k, (batch, response) in enumerate(zip(balance.batches, self.responses, strict=True)):
            prescribed += [float(np.sum(one.batches[k].motion[..., 1:] ** 2)) for one in self._inputs]
            for i, springs in traits.springs(batch.law, response).items():
                port = batch.ports[i]
                stiffness[:, port.rows] += springs.reshape(len(x), batch.count)[:, port.members]
        moved, reach = self._answers(stiffness)
        motion = np.array([norm(own) for own in x])
        terms = motion[:, None, None] + reach * (motion + np.sqrt(prescribed))[:, None, None]
        residual = moved + x.reshape(moved.shape)
        return np.sqrt(np.sum((residual / np.where(terms > 0, terms, 1.0)) ** 2, axis=(1, 2)))

    def _answers(self, stiffness: Array | None) -> tuple[Array, Array]:
        """``A (F - P)`` and ``|A|`` times stiffnesses (n, n_ports), both (n, n_ports, L); without these zeros."""
        balance, G = self._balance, np.concatenate([self.forces, -self.loads], axis=1)
        moved, reach = np.zeros((2, *self.forces.shape))
        first = 0
        for structure, same in groupby(self._inputs, lambda one: one.structure):
            at = slice(first, first + len(list(same)))
            own = None if stiffness is None else stiffness[at]
            first = at.stop
            moved[at], reach[at] = _answer(balance, structure, self._omega[at], G[at], own)
        return moved, reach


def _answer(
    balance: Balance, structure: Mapping[str, float], omega: Array, G: Array, stiffness: Array | None
) -> tuple[Array, Array]:
    """``A G`` and ``|A|`` times the stiffnesses, both (n, n_ports, L), of one structure."""
    receptance, ports = adjusted(balance.receptance, structure), balance.n_ports
    moved, reach = np.zeros((2, len(G), ports, balance.L))
    moved[..., 0] = G[..., 0] @ receptance.static.T
    if stiffness is not None:
        reach[..., 0] = stiffness @ np.abs(receptance.static[:, :ports]).T
    if balance.orders.size:
        hat = (G[..., 1::2] - 1j * G[..., 2::2]).transpose(0, 2, 1)
        answer = applied(receptance, balance.orders, omega, hat).transpose(0, 2, 1)
        moved[..., 1::2], moved[..., 2::2] = answer.real, -answer.imag
        if stiffness is not None:
            A, _ = receptance.at(balance.orders, omega)
            size = (np.abs(A[..., :ports]) @ stiffness[:, None, :, None])[..., 0].transpose(0, 2, 1)
            reach[..., 1::2] = reach[..., 2::2] = size
    return moved, reach


def applied(receptance: Receptance, orders: Array, omega: Array, forces: ComplexArray) -> ComplexArray:
    """``A forces`` (n, k, n_rows) of forces (n, k, n_columns) at the orders (k,) of frequencies (n,)."""
    if not isinstance(receptance, ModalReceptance):
        A, _ = receptance.at(orders, omega)
        return np.asarray((A @ forces[..., None])[..., 0])
    own = receptance.factors(orders, omega)
    places = (len(forces), len(orders), -1)
    out = ((forces @ own.right) * own.weight[1:].reshape(places)) @ own.left.T
    for part, weight in zip(own.parts, own.part_weight, strict=True):
        out += weight[1:].reshape(places) * (forces @ part.T)
    return np.asarray(out)
