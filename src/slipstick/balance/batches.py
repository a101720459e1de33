"""Contacts made ready for the balance: all elements of one law in one batch, and where their ports stand."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.law import Law
from slipstick.typing import IntArray

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair, Direction

Places = slice | NDArray[np.intp]


class Port(NamedTuple):
    """Where one port of a batch's elements stands."""

    rows: Places
    """Numbers of the ports among all ports of the balance."""
    members: Places
    """Elements of the batch that have this port, in the order of ``rows``."""
    size: int


class PortPair(NamedTuple):
    """Elements of a batch that have both of two ports, and the numbers of these among all ports of the balance."""

    members: IntArray
    felt: IntArray
    """The port along which the force is."""
    moving: IntArray
    """The port along which the motion is."""


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Elements of one kind of law, in the order of the problem.

    Attributes
    ----------
    members, numbers
        Each element's contact pair and place in it, and its number among all elements of the problem.
    ports
        One ``Port`` for each port of the law.
    """

    law: Law
    members: tuple[tuple[int, int], ...]
    numbers: tuple[int, ...]
    ports: tuple[Port, ...]

    @cached_property
    def count(self) -> int:
        """Number of elements."""
        return len(self.members)

    @cached_property
    def elements(self) -> Places:
        """``numbers`` as an index."""
        return places(np.array(self.numbers, dtype=int))

    @cached_property
    def couplings(self) -> Mapping[tuple[int, int], PortPair]:
        """For each pair of ports ``(i, j)``: where a force along i may depend on motion along j."""
        rows = np.full((len(self.ports), self.count), -1, dtype=np.int64)
        for numbers, port in zip(rows, self.ports, strict=True):
            numbers[port.members] = _indices(port.rows)
        return {
            (i, j): PortPair(both := np.flatnonzero((felt >= 0) & (moving >= 0)), felt[both], moving[both])
            for i, felt in enumerate(rows)
            for j, moving in enumerate(rows)
        }

    @cached_property
    def coupled(self) -> Mapping[tuple[int, int], PortPair]:
        """The ``couplings`` of those pairs of ports that some element has."""
        return {pair: places for pair, places in self.couplings.items() if places.members.size}


def batches_of(pairs: Sequence[ContactPair]) -> tuple[tuple[Batch, ...], list[Direction]]:
    """Batches of the contacts, and the direction of every port of the balance: batch by batch, port by port."""
    kinds: dict[Hashable, list[tuple[int, int]]] = {}
    members = [(p, k) for p, pair in enumerate(pairs) for k in range(len(pair))]
    for p, k in members:
        kinds.setdefault(pairs[p].contact.kind, []).append((p, k))
    number = {member: e for e, member in enumerate(members)}
    batches: list[Batch] = []
    directions: list[Direction] = []
    for members_of_kind in kinds.values():
        law, ports = pairs[members_of_kind[0][0]].contact, []
        for name in law.ports:
            of_port = [pairs[p].direction(name, k) for p, k in members_of_kind]
            have = [e for e, direction in enumerate(of_port) if direction is not None]
            rows = np.arange(len(directions), len(directions) + len(have))
            directions += [direction for direction in of_port if direction is not None]
            ports.append(Port(places(rows), places(np.array(have, dtype=int)), len(have)))
        numbers = tuple(number[member] for member in members_of_kind)
        batches.append(Batch(law=law, members=tuple(members_of_kind), numbers=numbers, ports=tuple(ports)))
    return tuple(batches), directions


def places(indices: NDArray[np.intp]) -> Places:
    """A slice where the indices follow one another, so that arrays are viewed and not copied."""
    if indices.size == 0:
        return slice(0, 0)
    if np.all(np.diff(indices) == 1):
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices


def _indices(rows: Places) -> NDArray[np.intp]:
    return np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
