"""Contacts of laws that have equations in time: forces, memory and their derivatives.

Ports are ordered by batch, port and element; the memory likewise. An element without a port has a row there that never
moves. Contacts of laws that switch have a regime each, in the order of ``switching``.

Where the structure answers their forces at once (a static residual R), the ports move by ``q = q0 - R F(q, m)``, with
``q0`` the motion by the structure's coordinates and the loads. Their velocity is ``v = v0 - R (F_q q' + F_m m')``, with
the rate ``m'(q, v, m)`` of the memory. Forces are linear in the motion and rates in the velocity (``Regimes``), so that
each is one linear system. Forces are continuous where a regime begins, their rates are not: velocities jump there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from slipstick.contact.law import Law, TimeSlopes
from slipstick.contact.regimes import InTime, Regimes
from slipstick.errors import InputError
from slipstick.typing import Array, IntArray

RegimeNumbers = tuple[int, ...]
"""Regime of every contact whose law switches."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LawInTime:
    """Contacts of one law."""

    law: Law
    values: Mapping[str, Array]
    """Parameters, (n, 1) each."""
    elements: IntArray
    """Numbers (n,) among all contacts."""
    velocity: Array
    """Constant velocity of the opposing surface along the ports, (n_ports, n), length/time."""
    length: float = 1.0
    """Typical motion."""

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of ports, of memories of an element, and of elements."""
        return len(self.law.ports), len(self.law.memory), len(self.elements)

    def at(self, q: Array, velocity: Array, memory: Array, which: Sequence[int] | slice = slice(None)) -> InTime:
        """Some of the elements at motion, velocity and memory (count, n, k) of all of them."""
        if not isinstance(which, slice) and len(which) == len(self.elements):
            which = slice(None)
        values = {name: value[which] for name, value in self.values.items()}
        drift = self.velocity[:, which, None]
        return InTime(q[:, which], velocity[:, which], memory[:, which], values, drift, self.length)

    def by_regime(self, regimes: Sequence[int]) -> Iterator[tuple[int, list[int]]]:
        """Regimes (n,) that elements are in, each with the elements."""
        for regime in sorted(set(regimes)):
            yield regime, [e for e, own in enumerate(regimes) if own == regime]


@dataclass(frozen=True)
class Switching:
    """One contact whose law switches."""

    law: LawInTime
    element: int
    """Its number among those of its law."""
    ports: IntArray
    """Its rows among the ports (n_ports,)."""
    memory: IntArray
    """Its rows among the memory (n_memory,)."""

    @property
    def number(self) -> int:
        """Its number among all contacts."""
        return int(self.law.elements[self.element])

    @property
    def regimes(self) -> Regimes:
        """Regimes of its law."""
        result = self.law.law.regimes
        assert result is not None
        return result

    def at(self, q: Array, velocity: Array, memory: Array) -> InTime:
        """This contact alone, at motion, velocity (k, n_ports) and memory (k, rows) of all contacts."""
        own = [part.T[rows][:, None] for part, rows in ((q, self.ports), (velocity, self.ports), (memory, self.memory))]
        e = slice(self.element, self.element + 1)
        values = {name: value[e] for name, value in self.law.values.items()}
        return InTime(own[0], own[1], own[2], values, self.law.velocity[:, e, None], self.law.length)


class _InRegime(NamedTuple):
    """Contacts of one law in one regime."""

    regimes: Regimes
    regime: int
    at: InTime
    ports: IntArray
    """Their rows among the ports (p, n)."""
    columns: IntArray
    """Their places among ports and memory (p + m, n)."""
    numbers: list[int]
    """Numbers of the contacts among ``switching``."""


class LawsInTime:
    """Forces and memory of all contacts together; motion, velocity and memory are (k, rows) at k instants."""

    def __init__(self, laws: Sequence[LawInTime]) -> None:
        switching: list[Switching] = []
        each, port, kept = [], 0, 0
        for law in laws:
            p, m, n = law.shape
            first = len(switching)
            if law.law.regimes is not None:
                rows, memory = port + n * np.arange(p), kept + n * np.arange(m)
                switching += [Switching(law, e, rows + e, memory + e) for e in range(n)]
            regimes = slice(first, len(switching))
            each.append((law, slice(port, port + p * n), slice(kept, kept + m * n), regimes))
            port, kept = port + p * n, kept + m * n
        self.n_ports, self.n_memory = port, kept
        self.each = tuple(each)
        """The laws, with their rows among the ports, those of their memory, and their places among ``switching``."""
        self.switching = tuple(switching)
        self.count = sum(len(law.elements) for law in laws)
        """Number of all contacts."""
        self.drift = np.concatenate([np.zeros(0), *(law.velocity.reshape(-1) for law in laws)])
        """Constant velocity along the ports (n_ports,)."""

    def __bool__(self) -> bool:
        return bool(self.each)

    @property
    def remembers_smoothly(self) -> bool:
        """Whether some law has a memory and does not switch."""
        return any(law.law.memory and law.law.regimes is None for law, *_ in self.each)

    def sized(self, length: float) -> LawsInTime:
        """These laws with a typical motion."""
        return LawsInTime([replace(law, length=length) for law, *_ in self.each])

    def rate(self, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers = ()) -> tuple[Array, Array]:
        """Forces (k, n_ports) and rates of the memory (k, n_memory)."""
        forces, rates = np.empty_like(q), np.empty_like(memory)
        for law, ports, kept, places in self.each:
            p, m, _ = law.shape
            motion = _split(q[:, ports], p, law), _split(velocity[:, ports], p, law), _split(memory[:, kept], m, law)
            if law.law.regimes is None:
                result = law.law.rate(*motion, law.values)
            else:
                result = np.empty_like(motion[0]), np.empty_like(motion[2])
                for regime, own in law.by_regime(regimes[places]):
                    result[0][:, own], result[1][:, own] = law.law.regimes.rate(regime, law.at(*motion, own))
            if result is None:
                raise InputError(f"law {type(law.law).__name__}: its rate is not told at some motion")
            forces[:, ports], rates[:, kept] = _joined(result[0], len(q)), _joined(result[1], len(q))
        return forces, rates

    def memory_in_sliding(self, q: Array, velocity: Array) -> Array:
        """Memory (k, n_memory) of contacts that slide steadily."""
        memory = np.zeros((len(q), self.n_memory))
        for law, ports, kept, _ in self.each:
            p, m, _ = law.shape
            if m:
                result = law.law.memory_in_sliding(
                    _split(q[:, ports], p, law), _split(velocity[:, ports], p, law), law.values
                )
                if result is not None:
                    memory[:, kept] = _joined(result, len(q))
        return memory

    def slopes(self, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers = ()) -> Array:
        """Derivatives of forces and rates by motion, velocity and memory, (k, P + m, 2 P + m), P ports in all."""
        return self.linearised(q, velocity, memory, regimes)[2]

    def linearised(
        self, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers = ()
    ) -> tuple[Array, Array, Array]:
        """Forces (k, P), rates of the memory (k, m), and the derivatives of both."""
        P, m = self.n_ports, self.n_memory
        out = np.zeros((len(q), P + m, 2 * P + m))
        forces, rates = np.empty_like(q), np.empty_like(memory)
        sizes = tuple(float(np.abs(a).max(initial=0.0)) or 1.0 for a in (q, velocity))
        for law, ports, kept, places in self.each:
            p, r, n = law.shape
            motion = _split(q[:, ports], p, law), _split(velocity[:, ports], p, law), _split(memory[:, kept], r, law)
            if law.law.regimes is None:
                result = law.law.time_slopes(*motion, law.values, (sizes[0], sizes[1]))
            else:
                result = TimeSlopes(
                    np.empty((p + r, 2 * p + r, n, len(q))), np.empty_like(motion[0]), np.empty_like(motion[2])
                )
                for regime, own in law.by_regime(regimes[places]):
                    for whole, part in zip(result, law.law.regimes.slopes(regime, law.at(*motion, own)), strict=True):
                        whole[..., own, :] = part
            forces[:, ports], rates[:, kept] = _joined(result.force, len(q)), _joined(result.memory_rate, len(q))
            motions = np.arange(ports.start, ports.stop).reshape(p, n)
            remembered = P + np.arange(kept.start, kept.stop).reshape(r, n)
            rows = np.concatenate([motions, remembered])
            columns = np.concatenate([motions, P + motions, P + remembered])
            out[:, rows[:, None], columns] = result.values.transpose(3, 0, 1, 2)
        return forces, rates, out

    def force_slopes(self, q: Array, memory: Array, regimes: RegimeNumbers) -> tuple[Array, Array]:
        """Forces (k, P) of laws that switch, and their derivatives by motion and memory (k, P, P + m)."""
        forces, out = np.zeros_like(q), np.zeros((len(q), self.n_ports, self.n_ports + self.n_memory))
        for some in self._in_regimes(q, q, memory, regimes):
            result, slopes = some.regimes.force_and_slopes(some.regime, some.at)
            forces[:, some.ports] = result.transpose(2, 0, 1)
            out[:, some.ports[:, None], some.columns] = slopes.transpose(3, 0, 1, 2)
        return forces, out

    def force_rate_slopes(
        self, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers, memory_rate: Array
    ) -> Array:
        """Derivatives (k, P, P + m) of the rates of these forces by motion and memory, at given rates of both."""
        P = self.n_ports
        out = np.zeros((len(q), P, P + self.n_memory))
        for some in self._in_regimes(q, velocity, memory, regimes):
            rates = memory_rate[:, some.columns[len(some.ports) :] - P].transpose(1, 2, 0)
            slopes = some.regimes.force_rate_slopes(some.regime, some.at, rates)
            out[:, some.ports[:, None], some.columns] = slopes.transpose(3, 0, 1, 2)
        return out

    def _in_regimes(self, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers) -> Iterator[_InRegime]:
        """The contacts whose law switches, law by law and regime by regime."""
        for law, ports, kept, places in self.each:
            if law.law.regimes is None:
                continue
            p, m, n = law.shape
            motion = _split(q[:, ports], p, law), _split(velocity[:, ports], p, law), _split(memory[:, kept], m, law)
            for regime, own in law.by_regime(regimes[places]):
                rows = ports.start + n * np.arange(p)[:, None] + own
                remembered = self.n_ports + kept.start + n * np.arange(m)[:, None] + own
                columns, numbers = np.concatenate([rows, remembered]), [places.start + e for e in own]
                yield _InRegime(law.law.regimes, regime, law.at(*motion, own), rows, columns, numbers)

    def guards(
        self, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers
    ) -> tuple[list[tuple[int, int]], Array]:
        """Numbers of contacts among ``switching`` and of their guards, and the guards (k, n)."""
        which, values = [], [np.zeros((len(q), 0))]
        for some in self._in_regimes(q, velocity, memory, regimes):
            result = some.regimes.guards(some.regime, some.at)
            which += [(number, g) for g in range(len(result)) for number in some.numbers]
            values.append(result.reshape(-1, len(q)).T)
        return which, np.concatenate(values, axis=1)

    def relaxation(self, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers) -> tuple[list[int], Array]:
        """Rows of the memory that are angles, and the derivatives of their rates by themselves, (rows, k)."""
        rows, values = [], []
        for contact, regime in zip(self.switching, regimes, strict=True):
            if regime in contact.regimes.angles:
                rows.append(int(contact.memory[0]))
                values.append(contact.regimes.relaxation(regime, contact.at(q, velocity, memory))[0])
        return rows, np.array(values).reshape(len(rows), len(q))

    def remembered(self, regimes: RegimeNumbers, which: Sequence[int] | None = None) -> list[int]:
        """Rows of the memory in use; of contacts whose law switches those alone whose numbers are in ``which``."""
        rows = [r for law, _, kept, _ in self.each if law.law.regimes is None for r in range(kept.start, kept.stop)]
        numbers = range(len(self.switching)) if which is None else which
        return sorted([*rows, *self.remembered_by_switching(regimes, numbers)])

    def remembered_by_switching(self, regimes: RegimeNumbers, which: Sequence[int]) -> list[int]:
        """The rows of those of the contacts whose law switches."""
        pairs = [(self.switching[i], regimes[i]) for i in which]
        return [int(row) for c, regime in pairs for row in c.memory[: c.regimes.memory_used[regime]]]

    def angles(self, regimes: RegimeNumbers) -> list[int]:
        """Rows of the memory that are angles."""
        pairs = zip(self.switching, regimes, strict=True)
        return [int(c.memory[0]) for c, regime in pairs if regime in c.regimes.angles]


def _split(rows: Array, count: int, law: LawInTime) -> Array:
    """(k, count n) -> (count, n, k)."""
    return np.ascontiguousarray(rows.T).reshape(count, law.shape[2], len(rows))


def _joined(result: Array, k: int) -> Array:
    """(count, n, k) -> (k, count n)."""
    return np.asarray(result, dtype=float).reshape(-1, k).T


class PortMotion(NamedTuple):
    """Motion, velocity and forces (k, P) at the ports, and rates of the memory (k, m), with a static residual."""

    q: Array
    velocity: Array
    forces: Array
    rates: Array


def port_motion(laws: LawsInTime, R: Array, q0: Array, v0: Array, memory: Array, regimes: RegimeNumbers) -> PortMotion:
    """Motion at the ports from that without the forces; velocities include constant ones."""
    P, one = laws.n_ports, np.eye(laws.n_ports)
    force, slopes = laws.force_slopes(q0, memory, regimes)
    q = q0 - _solved(one + R @ slopes[:, :, :P], force @ R.T)
    force, rate, slopes = laws.linearised(q, v0, memory, regimes)
    by_motion, by_memory, by_velocity = slopes[:, :P, :P], slopes[:, :P, 2 * P :], slopes[:, P:, P : 2 * P]
    force_rate = _times(by_motion, v0 - laws.drift) + _times(by_memory, rate)
    change = -_solved(one + R @ (by_motion + by_memory @ by_velocity), force_rate @ R.T)
    return PortMotion(q, v0 + change, force, rate + _times(by_velocity, change))


def force_rate(
    laws: LawsInTime, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers, memory_rate: Array
) -> Array:
    """Rates of the forces (k, P), per unit of time."""
    P = laws.n_ports
    _, slopes = laws.force_slopes(q, memory, regimes)
    return _times(slopes[:, :, :P], velocity - laws.drift) + _times(slopes[:, :, P:], memory_rate)


def port_motion_slopes(
    laws: LawsInTime, R: Array, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers
) -> tuple[Array, Array, Array, Array, Array]:
    """Derivatives of ``port_motion`` by q0, v0 and memory, (k, ..., 2 P + m).

    These are of motion, velocity, forces, rates of the memory, and rates of the forces of laws that switch; ``q`` and
    ``velocity`` are those of ``port_motion``.
    """
    P, m, k = laws.n_ports, laws.n_memory, len(q)
    _, rate, own = laws.linearised(q, velocity, memory, regimes)
    further = laws.force_rate_slopes(q, velocity, memory, regimes, rate)
    (F_q, F_v, F_m), (M_q, M_v, M_m) = (np.split(part, [P, 2 * P], axis=2) for part in (own[:, :P], own[:, P:]))
    one = np.eye(P)
    given = np.broadcast_to(np.eye(2 * P + m), (k, 2 * P + m, 2 * P + m))
    q0, v0, dm = given[:, :P], given[:, P : 2 * P], given[:, 2 * P :]
    dq = np.asarray(np.linalg.solve(one + R @ F_q, q0 - R @ F_m @ dm), dtype=float)
    turned = further[:, :, :P] @ dq + further[:, :, P:] @ dm
    rest = turned + F_m @ (M_q @ dq + M_m @ dm)
    dv = np.asarray(np.linalg.solve(one + R @ (F_q + F_m @ M_v), v0 - R @ rest), dtype=float)
    d_rate = M_q @ dq + M_v @ dv + M_m @ dm
    return dq, dv, F_q @ dq + F_v @ dv + F_m @ dm, d_rate, turned + F_q @ dv + F_m @ d_rate


def port_slopes(
    laws: LawsInTime, R: Array | None, given: Array, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers
) -> tuple[Array, Array, Array, Array, Array]:
    """As ``port_motion_slopes``, by coordinates (size,); ``given`` (2 P + m, size) gives q0, v0 and memory from these.

    ``R`` is None where the structure does not answer at once; rates of the forces are not used then, and zero.
    """
    if R is not None:
        dq, dv, force, rate, force_rate = port_motion_slopes(laws, R, q, velocity, memory, regimes)
        return dq @ given, dv @ given, force @ given, rate @ given, force_rate @ given
    P, by = laws.n_ports, laws.slopes(q, velocity, memory, regimes) @ given
    still = np.broadcast_to(given, (len(q), *given.shape))
    return still[:, :P], still[:, P : 2 * P], by[:, :P], by[:, P:], np.zeros_like(by[:, :P])


def _times(matrices: Array, vectors: Array) -> Array:
    """(k, a, b) times (k, b)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def _solved(matrices: Array, vectors: Array) -> Array:
    """(k, a, a) and (k, a)."""
    return np.asarray(np.linalg.solve(matrices, vectors[:, :, None])[:, :, 0])
