"""What the harmonics left out would add: one element call with more of them at the points found.

The forces at the motion of the kept harmonics have others too; those move the structure by ``-A(m omega) F_m``, which
the balance leaves out (THEORY.md (11.1)). Orders taken: all that are missing below the highest one kept (a set of odd
harmonics under rubbing lacks the even ones most of all) and half as many again beyond it, at least two. Loads have none
of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.factored import FactoredCompliance
from slipstick.balance.many import applied, respond
from slipstick.results.measures import largest_deviation
from slipstick.structure.dynamic import adjusted
from slipstick.structure.protocol import Receptance
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance
    from slipstick.results.record import Outputs, Point

Structures = Sequence[Mapping[str, float]]

_MANY = 1000
"""Entries of a receptance from which on it is applied by its modes."""

WARNED_TRUNCATION = 1e-2
"""From here on results are warned of."""


def with_further(harmonics: Harmonics) -> Harmonics:
    """The set with the orders that are looked at besides.

    >>> with_further(Harmonics([0, 1, 3, 5])).orders
    (0, 1, 2, 3, 4, 5, 6, 7, 8)
    """
    return Harmonics(range(harmonics.highest + max(2, ceil(harmonics.highest / 2)) + 1))


def truncation(outputs: Outputs, points: Sequence[Point], x: Array, motion: Array, omega: Array) -> Array:
    """Largest deviation of what is left out over the largest deviation of the motion itself, (n_points,).

    Both are the largest over the period, without the zero harmonic, among all relative motions of the contacts and all
    outputs; 0 where nothing moves. ``x`` (n, N) and ``motion`` (n, n_outputs, L) are those of the balance.
    """
    balance = outputs.balance
    h, wide = balance.harmonics, with_further(balance.harmonics)
    further = Harmonics([0, *sorted(set(wide.orders) - set(h.orders))])
    kept = [wide.index(m, part) for m in further.orders[1:] for part in ("c", "s")]
    ports = x.reshape(len(x), balance.n_ports, balance.L)
    force = np.zeros((len(x), balance.n_ports, len(kept)))
    for k, batch in enumerate(balance.batches):
        found = _forces(balance, k, points, omega, wide)
        for i, port in enumerate(batch.ports):
            force[:, port.rows] = found[i][:, port.members][..., kept]
    added = _added(outputs, force, omega, further.m.astype(float), [p.detail.inputs.structure for p in points])
    size = largest_deviation(h, np.concatenate([ports, motion], axis=1)).max(axis=1, initial=0.0)
    more = largest_deviation(further, added).max(axis=1, initial=0.0)
    return np.asarray(np.divide(more, size, out=np.zeros_like(size), where=size > 0))


def _forces(balance: Balance, k: int, points: Sequence[Point], omega: Array, wide: Harmonics) -> list[Array]:
    """Forces of one batch in the wider set at every point, (n_points, n, L') for each port."""
    batch, shape = balance.batches[k], (len(points), balance.batches[k].count, wide.size)
    if not points:
        return [np.zeros(shape) for _ in batch.ports]
    x = np.array([p.x for p in points])
    found = respond(balance, k, x, omega, [p.detail.warm for p in points], wide)
    return [F.reshape(shape) for F in found.force]


def truncation_sentence(
    name: str, values: Array, estimate: Array, unit: str = "rad/s", asked: float | None = None
) -> str | None:
    """A warning where harmonics are missing, None where they are not.

    ``name`` is what ``values`` (n,) are of, ``unit`` that of frequencies; ``asked`` the accuracy that was asked for.
    """
    limit = min(WARNED_TRUNCATION, asked or WARNED_TRUNCATION)
    if not np.any(estimate > limit):
        return None
    worst = int(np.nanargmax(estimate))
    above, least = int(np.sum(estimate > limit)), 100.0 * limit
    where = f"{name} = {values[worst]:.6g}" + (f" {unit}" if name == "omega" else "")
    return (
        f"the harmonics left out would add about {100.0 * estimate[worst]:.2g} % of the amplitude at {where} (and more "
        f"than {least:g} % at {above} of {estimate.size} points): keep more harmonics"
    )


def _added(outputs: Outputs, F: Array, omega: Array, orders: Array, structures: Structures) -> Array:
    """Motion of contact ports and far outputs (n, rows, 1 + 2 k) by forces (n, n_ports, 2 k) of the orders (k,)."""
    balance = outputs.balance
    G = np.concatenate([F, np.zeros((len(F), balance.n_loads, F.shape[2]))], axis=1)
    receptances = [balance.receptance, *([outputs.receptance] if outputs.receptance is not None else [])]
    return np.concatenate([moved(receptance, orders, G, omega, structures) for receptance in receptances], axis=1)


def moved(receptance: Receptance, orders: Array, G: Array, omega: Array, structures: Structures) -> Array:
    """``-A G`` (n, n_rows, 1 + 2 k) for forces (n, n_columns, 2 k), zero harmonic 0.

    ``structures`` (n) holds the parameters of the structure at each point that are not its own.
    """
    out, first = np.zeros((len(G), receptance.static.shape[0], 1 + 2 * orders.size)), 0
    for values, same in groupby(structures):
        part = slice(first, first + len(list(same)))
        out[part] = _moved(adjusted(receptance, values), orders, G[part], omega[part])
        first = part.stop
    return out


def _moved(receptance: Receptance, orders: Array, G: Array, omega: Array) -> Array:
    """The same of one structure, in slices of limited memory."""
    n = orders.size
    if receptance.static.size > _MANY and getattr(receptance, "factors", None) is not None:
        return _moved_by_modes(receptance, orders, G, omega)
    out = np.zeros((len(G), receptance.static.shape[0], 1 + 2 * n))
    slices = max(1, int(4e6 / max(1, n * receptance.static.size)))
    for first in range(0, len(G) if n else 0, slices):
        w, g = omega[first : first + slices], G[first : first + slices]
        hat = (g[:, :, 0::2] - 1j * g[:, :, 1::2]).transpose(0, 2, 1)
        answer = applied(receptance, orders, w, hat).transpose(0, 2, 1)
        out[first : first + slices, :, 1::2] = -answer.real
        out[first : first + slices, :, 2::2] = answer.imag
    return out


def _moved_by_modes(receptance: Any, orders: Array, G: Array, omega: Array) -> Array:
    """The same without a receptance between all ports, which would be large."""
    out = np.zeros((len(G), receptance.static.shape[0], 1 + 2 * orders.size))
    for i, w in enumerate(omega):
        own = np.zeros((G.shape[1], 1 + orders.size), dtype=complex)
        own[:, 1:] = G[i, :, 0::2] + 1j * G[i, :, 1::2]
        answer = FactoredCompliance(receptance.factors(orders, float(w))).answer(own)
        out[i, :, 1:] = -answer.reshape(len(out[i]), -1)[:, 1:]
    return out
