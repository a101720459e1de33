"""Contacts of laws that tell their ``rate``, as they enter equations in time: forces, memory and their derivatives.

Their ports stand batch by batch, port by port, element by element; the memory likewise. An element that goes without a
port has a row there that never moves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.contact.law import Law
from slipstick.errors import InputError
from slipstick.typing import Array, IntArray


@dataclass(frozen=True, kw_only=True, eq=False)
class LawInTime:
    """Contacts of one law."""

    law: Law
    values: Mapping[str, Array]
    """Parameters, (n, 1) each."""
    elements: IntArray
    """Numbers (n,) among all contacts."""

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of ports, of what an element remembers, of elements."""
        return len(self.law.ports), len(self.law.memory), len(self.elements)


class LawsInTime:
    """Forces and memory of all of them at once; motion, velocity and memory are (k, rows) at k instants."""

    def __init__(self, laws: Sequence[LawInTime]) -> None:
        each, port, kept = [], 0, 0
        for law in laws:
            p, m, n = law.shape
            each.append((law, slice(port, port + p * n), slice(kept, kept + m * n)))
            port, kept = port + p * n, kept + m * n
        self.n_ports, self.n_memory = port, kept
        self.each = tuple(each)
        """The laws, with their rows among the ports and those of their memory."""

    def __bool__(self) -> bool:
        return bool(self.each)

    def rate(self, q: Array, velocity: Array, memory: Array) -> tuple[Array, Array]:
        """Forces (k, n_ports) and rates of the memory (k, n_memory)."""
        forces, rates = np.empty_like(q), np.empty_like(memory)
        for law, ports, kept in self.each:
            p, m, _ = law.shape
            told = law.law.rate(
                _split(q[:, ports], p, law),
                _split(velocity[:, ports], p, law),
                _split(memory[:, kept], m, law),
                law.values,
            )
            if told is None:
                raise InputError(f"law {type(law.law).__name__}: its rate is not told at some motion")
            forces[:, ports], rates[:, kept] = _joined(told[0], len(q)), _joined(told[1], len(q))
        return forces, rates

    def memory_in_sliding(self, q: Array, velocity: Array) -> Array:
        """What contacts that slide steadily remember, (k, n_memory)."""
        memory = np.zeros((len(q), self.n_memory))
        for law, ports, kept in self.each:
            p, m, _ = law.shape
            if m:
                told = law.law.memory_in_sliding(
                    _split(q[:, ports], p, law), _split(velocity[:, ports], p, law), law.values
                )
                if told is not None:
                    memory[:, kept] = _joined(told, len(q))
        return memory

    def slopes(self, q: Array, velocity: Array, memory: Array) -> Array:
        """Derivatives of forces and rates by motion, velocity and memory, (k, P + m, 2 P + m), P ports in all."""
        P, m = self.n_ports, self.n_memory
        out = np.zeros((len(q), P + m, 2 * P + m))
        sizes = tuple(float(np.abs(a).max(initial=0.0)) or 1.0 for a in (q, velocity))
        for law, ports, kept in self.each:
            p, r, n = law.shape
            slopes = law.law.time_slopes(
                _split(q[:, ports], p, law), _split(velocity[:, ports], p, law), _split(memory[:, kept], r, law),
                law.values, (sizes[0], sizes[1]),
            ).values  # fmt: skip
            numbers = np.arange(n)
            row = [ports.start + i * n + numbers for i in range(p)] + [
                P + kept.start + i * n + numbers for i in range(r)
            ]
            column = [ports.start + j * n + numbers for j in range(p)]
            column += [P + c for c in column] + [2 * P + kept.start + j * n + numbers for j in range(r)]
            for i, rows in enumerate(row):
                for j, columns in enumerate(column):
                    out[:, rows, columns] = slopes[i, j].T
        return out


def _split(rows: Array, count: int, law: LawInTime) -> Array:
    """(k, count n) -> (count, n, k)."""
    return np.ascontiguousarray(rows.T).reshape(count, law.shape[2], len(rows))


def _joined(told: Array, k: int) -> Array:
    """(count, n, k) -> (k, count n)."""
    return np.asarray(told, dtype=float).reshape(-1, k).T
