"""Layout of the contacts: all elements of one law in one batch, and the places of their ports among the unknowns."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.inputs import ContactInputs
from slipstick.contact.law import Law, Motion, Placed, Response, add_to
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray, IntArray

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair, Direction
    from slipstick.balance.problem import Problem

Places = slice | NDArray[np.intp]


class Port(NamedTuple):
    """Places of one port of the elements of a batch."""

    rows: Places
    """Numbers of the ports among all ports of the balance."""
    members: Places
    """Elements of the batch that have this port, in the order of ``rows``."""
    size: int
    shared: bool = False
    """Whether elements have a port in common, so that ``rows`` repeat."""

    def add(self, values: Array, out: Array, axis: int = -1) -> None:
        """Add values of the elements that have the port to those of all ports, which lie along ``axis``."""
        if axis:
            out, values = out.swapaxes(axis, 0), values.swapaxes(axis, 0)
        if self.shared:
            np.add.at(out, _indices(self.rows), values)
        else:
            out[self.rows] += values


class PortPair(NamedTuple):
    """Elements of a batch that have both of two ports, and the numbers of these among all ports of the balance."""

    members: IntArray
    felt: IntArray
    """The port of the force."""
    moving: IntArray
    """The port of the motion."""


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
    def shared(self) -> bool:
        """Whether elements have ports in common."""
        return any(port.shared for port in self.ports)

    @cached_property
    def elements(self) -> Places:
        """``numbers`` as an index."""
        return places(np.array(self.numbers, dtype=int))

    @cached_property
    def rows(self) -> IntArray:
        """Number of each port of each element among all ports of the balance, (n_ports, count); -1: none."""
        rows = np.full((len(self.ports), self.count), -1, dtype=np.int64)
        for numbers, port in zip(rows, self.ports, strict=True):
            numbers[port.members] = _indices(port.rows)
        return rows

    @cached_property
    def couplings(self) -> Mapping[tuple[int, int], PortPair]:
        """For each pair of ports ``(i, j)``: elements in which a force along i may depend on motion along j."""
        return {
            (i, j): PortPair(both := np.flatnonzero((felt >= 0) & (moving >= 0)), felt[both], moving[both])
            for i, felt in enumerate(self.rows)
            for j, moving in enumerate(self.rows)
        }

    @cached_property
    def coupled(self) -> Mapping[tuple[int, int], PortPair]:
        """The ``couplings`` of those pairs of ports that some element has."""
        return {pair: places for pair, places in self.couplings.items() if places.members.size}


def batches_of(pairs: Sequence[ContactPair]) -> tuple[tuple[Batch, ...], list[Direction]]:
    """Batches of the contacts, and the direction of every port of the balance: batch by batch, port by port.

    Contacts of one pair that move together have their ports in common.
    """
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
            new = [pairs[p].place_of_motion(k) == k for p, k in (members_of_kind[e] for e in have)]
            rows = len(directions) + np.cumsum(new, dtype=int) - 1
            directions += [of_port[e] for e, first in zip(have, new, strict=True) if first]  # type: ignore[misc]
            ports.append(Port(places(rows), places(np.array(have, dtype=int)), len(have), not all(new)))
        numbers = tuple(number[member] for member in members_of_kind)
        batches.append(Batch(law=law, members=tuple(members_of_kind), numbers=numbers, ports=tuple(ports)))
    return tuple(batches), directions


def places(indices: NDArray[np.intp]) -> Places:
    """A slice where the indices are consecutive, so that arrays are viewed and not copied; arrays where any repeat."""
    if indices.size == 0:
        return slice(0, 0)
    if np.all(np.diff(indices) == 1):
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices


def _indices(rows: Places) -> NDArray[np.intp]:
    return np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows


Forces = Sequence[Mapping[int, Array]]
"""For each batch, coefficients (n * count, L) by port; ports left out are zero."""
Tangents = Sequence[Mapping[tuple[int, int], Array]]
"""For each batch, ``(i, j) -> dF_i/dQ_j`` (n * count, L, L)."""


class PortLayout:
    """Places of the ports of a problem's contacts among the unknowns, at the problem's harmonics.

    Attributes
    ----------
    batches
        The contacts, one ``Batch`` for each kind of law.
    orders
        Harmonics above 0, as floats.
    n_ports, n_contacts, L, size
        Numbers of ports, of contacts, of coefficients of each port, and of unknowns ``N = n_ports L``.
    """

    def __init__(self, problem: Problem) -> None:
        self.harmonics, self.batches = problem.harmonics, problem.batches
        self.orders, self.L = self.harmonics.m.astype(float), self.harmonics.size
        self.n_ports, self.n_contacts = len(problem.port_directions), len(problem.elements)
        self.size = self.n_ports * self.L

    def motion(
        self,
        k: int,
        x: Array,
        omega: float | Array,
        contact_inputs: ContactInputs,
        harmonics: Harmonics | None = None,
    ) -> Motion:
        """Motion of batch ``k`` at unknowns (N,) or (n, N), the rubbing motion included.

        Other ``harmonics`` have to contain those of the balance.
        """
        batch, lead = self.batches[k], x.shape[:-1]
        X, moved = x.reshape(*lead, self.n_ports, self.L), []
        for port, Q in zip(batch.ports, contact_inputs.motion, strict=True):
            if port.size == batch.count:
                Q = X[..., port.rows, :].reshape(-1, self.L) + Q if lead else X[port.rows] + Q
            elif port.size:
                Q = Q.copy()
                Q.reshape(*lead, batch.count, self.L)[..., port.members, :] += X[..., port.rows, :]
            moved.append(Q if harmonics is None else _widened(self.harmonics, harmonics, Q))
        each = np.repeat(omega, batch.count) if lead else omega
        return Motion(
            harmonics or self.harmonics, each, tuple(moved), contact_inputs.drift(each),
            contact_inputs.velocity_per_omega,
        )  # fmt: skip

    def respond(self, k: int, x: Array, omega: float | Array, contact_inputs: ContactInputs, out: Array) -> Response:
        """Forces of batch ``k`` at unknowns (N,) or (n, N), written on the ports ``out`` (2, [n,] n_ports, L).

        ``out`` is zero before; the second half receives derivatives by omega at fixed motion.
        """
        batch = self.batches[k]
        if (tabulated := batch.law.tabulated) and not batch.shared:  # it writes forces, which would not add up
            each = omega if isinstance(omega, np.ndarray) else np.array([omega])
            places = -1, self.n_ports, self.L
            rubbing, velocity, per_omega, values = contact_inputs.table(tabulated)
            X = x.reshape(places)
            if not X.flags.carray:  # the one type that is compiled
                X = np.require(X, float, ["C", "W"])
            placed = Placed(X, batch.rows, rubbing, velocity, per_omega, each, values)
            return batch.law.respond_on_ports(self.harmonics, placed, out.reshape(2, *places), contact_inputs.values)
        response = batch.law.respond(self.motion(k, x, omega, contact_inputs), contact_inputs.values)
        self.write(k, response, contact_inputs, omega, out)
        return response

    def write(
        self, k: int, response: Response, contact_inputs: ContactInputs, omega: float | Array, out: Array
    ) -> None:
        """Write the forces of batch ``k`` and their derivatives by omega on the ports ``out``, as ``respond``."""
        slopes = by_omega(response, contact_inputs, omega)
        for part, by_port in zip(out, (dict(enumerate(response.force)), slopes), strict=True):
            self._gather(k, by_port, part)

    def spread(self, dx: Array) -> list[dict[int, Array]]:
        """Changes of the motion by batch and port, of changes (N,) or (n, N) of the unknowns."""
        lead = dx.shape[:-1]
        dX = dx.reshape(*lead, self.n_ports, self.L)
        by_batch: list[dict[int, Array]] = []
        for batch in self.batches:
            moved: dict[int, Array] = {}
            for i, port in enumerate(batch.ports):
                if port.size == batch.count:
                    moved[i] = dX[..., port.rows, :].reshape(-1, self.L)
                elif port.size:
                    dQ = np.zeros((*lead, batch.count, self.L))
                    dQ[..., port.members, :] = dX[..., port.rows, :]
                    moved[i] = dQ.reshape(-1, self.L)
            by_batch.append(moved)
        return by_batch

    def gathered(self, forces: Forces, out: Array) -> Array:
        """Write forces on their ports in ``out`` (..., n_ports or more, L), which is zero before; returned."""
        for k, by_port in enumerate(forces):
            self._gather(k, by_port, out)
        return out

    def _gather(self, k: int, by_port: Mapping[int, Array], out: Array) -> None:
        batch, lead = self.batches[k], out.shape[:-2]
        for i, force in by_port.items():
            port = batch.ports[i]
            if port.size:
                F = force.reshape(*lead, batch.count, self.L) if lead else force
                F = F if port.size == batch.count else F[..., port.members, :]
                if port.shared:
                    port.add(F, out, -2)
                else:
                    out[..., port.rows, :] = F

    def excitation(self, forces: Forces, P: Array | None = None, n: tuple[int, ...] = ()) -> ComplexArray:
        """``F - P`` on all columns as complex numbers (..., n_columns, n + 1); without loads, on the ports alone.

        ``n`` is () of one motion, (n,) of n motions.
        """
        return paired(self.gathered(forces, np.zeros((*n, self.n_ports, self.L))), P)

    def real(self, z: ComplexArray) -> Array:
        """Complex numbers (rows, n + 1) as coefficients (rows * L,)."""
        pairs = z.view(float)
        out = np.empty((len(z), self.L))
        out[:, 0], out[:, 1:] = pairs[:, 0], pairs[:, 2:]
        return out.reshape(-1)


def paired(F: Array, P: Array | None = None) -> ComplexArray:
    """``F - P`` on all columns as complex numbers (..., n_columns, n + 1), of forces (..., n_ports, L) and loads."""
    ports, L = F.shape[-2:]
    G = np.zeros((*F.shape[:-2], ports + (0 if P is None else P.shape[-2]), L + 1))
    G[..., :ports, 1:] = F
    if P is not None:
        np.negative(P, out=G[..., ports:, 1:])
    G[..., 0], G[..., 1] = G[..., 1], 0.0
    return G.view(complex)


def by_omega(response: Response, contact_inputs: ContactInputs, omega: float | Array) -> dict[int, Array]:
    """Derivatives of the forces by omega at fixed motion; velocities that grow with omega do not change the drift."""
    slope = dict(response.by_omega)
    if response.by_drift and contact_inputs.at_speed:
        velocity = contact_inputs.velocity
        each = np.repeat(omega, velocity.shape[1] // omega.size) if isinstance(omega, np.ndarray) else omega
        rate = velocity / -(each**2)
        for (i, j), tangent in response.by_drift.items():
            part = rate[j][:, None] * tangent
            add_to(slope, i, part)
    return slope


def _widened(narrow: Harmonics, wide: Harmonics, Q: Array) -> Array:
    """Coefficients (k, L) in a set of harmonics that contains their own."""
    out = np.zeros((len(Q), wide.size))
    out[:, wide.columns(narrow.orders)] = Q
    return out
