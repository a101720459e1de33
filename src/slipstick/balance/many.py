"""Many states of one balance at once: every element of every state in one call of its law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby

import numpy as np

from slipstick.balance.inputs import SURFACE, Given, Inputs
from slipstick.balance.ports import Balance
from slipstick.contact import traits
from slipstick.contact.law import Motion, Response
from slipstick.solve.norm import norm
from slipstick.structure.dynamic import adjusted
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array


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


def answered(balance: Balance, x: Array, omega: Array, inputs: Sequence[Inputs]) -> tuple[list[Response], Array]:
    """The response of each batch as ``respond`` gives it, and relative residuals (n,), of n states.

    A residual is the norm of its entries over the sizes of their terms, as in ``balance.residual.terms``.
    """
    responses = [respond(balance, k, x, omega, inputs) for k in range(len(balance.batches))]
    return responses, _residuals(balance, x, omega, inputs, responses)


def _residuals(
    balance: Balance, x: Array, omega: Array, inputs: Sequence[Inputs], responses: Sequence[Response]
) -> Array:
    n, loads = len(x), balance.n_loads
    G = np.zeros((n, balance.n_ports + loads, balance.L))
    stiffness, prescribed = np.zeros((n, balance.n_ports)), np.zeros(n)
    for k, (batch, response) in enumerate(zip(balance.batches, responses, strict=True)):
        prescribed += [float(np.sum(one.batches[k].motion[..., 1:] ** 2)) for one in inputs]
        springs = traits.springs(batch.law, response)
        for i, port in enumerate(batch.ports):
            G[:, port.rows] = response.force[i].reshape(n, batch.count, -1)[:, port.members]
            if i in springs:
                stiffness[:, port.rows] += springs[i].reshape(n, batch.count)[:, port.members]
    if loads:
        G[:, balance.n_ports :] = [-one.P for one in inputs]
    residual, reach = np.empty((2, n, balance.n_ports, balance.L))
    first = 0
    for structure, same in groupby(inputs, lambda one: one.structure):
        at = slice(first, first + len(list(same)))
        first = at.stop
        residual[at], reach[at] = _answer(balance, structure, omega[at], G[at], stiffness[at])
    residual += x.reshape(residual.shape)
    motion = np.array([norm(own) for own in x])
    terms = motion[:, None, None] + reach * (motion + np.sqrt(prescribed))[:, None, None]
    return np.sqrt(np.sum((residual / np.where(terms > 0, terms, 1.0)) ** 2, axis=(1, 2)))


def _answer(
    balance: Balance, structure: Mapping[str, float], omega: Array, G: Array, stiffness: Array
) -> tuple[Array, Array]:
    """``A G`` and ``|A|`` times the stiffnesses, both (n, n_ports, L), of one structure."""
    receptance, ports = adjusted(balance.receptance, structure), balance.n_ports
    moved, reach = np.empty((2, len(G), ports, balance.L))
    moved[..., 0] = G[..., 0] @ receptance.static.T
    reach[..., 0] = stiffness @ np.abs(receptance.static[:, :ports]).T
    if balance.orders.size:
        A, _ = receptance.at(balance.orders, omega)
        hat = (G[..., 1::2] - 1j * G[..., 2::2]).transpose(0, 2, 1)[..., None]
        answer = (A @ hat)[..., 0].transpose(0, 2, 1)
        moved[..., 1::2], moved[..., 2::2] = answer.real, -answer.imag
        size = (np.abs(A[..., :ports]) @ stiffness[:, None, :, None])[..., 0].transpose(0, 2, 1)
        reach[..., 1::2] = reach[..., 2::2] = size
    return moved, reach
