"""Laws in time that switch: smooth in each of their regimes, with events between them.

What integrates in time and what makes multipliers know regimes, guards and resets alone, none of their meanings.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.law import TimeSlopes
from slipstick.typing import Array, IntArray


class InTime(NamedTuple):
    """Motion of n elements at k instants, as ``Law.rate`` has it, with what a law that switches needs besides."""

    q: Array
    """Motion along the ports, (n_ports, n, k), but for the way that a constant velocity has made."""
    velocity: Array
    """(n_ports, n, k), length/time."""
    memory: Array
    """(n_memory, n, k)."""
    values: Mapping[str, Array]
    """Parameters, (n, 1) each."""
    drift: Array
    """Constant part of the velocity, (n_ports, n, 1)."""
    length: float
    """Typical motion: what is far below it is nothing."""


class Regimes(ABC):
    """A law in time that switches between regimes, which are numbered from 0.

    Attributes
    ----------
    names
        The state that each regime is in results; regimes of one name are one state.
    memory_used
        How many entries of the memory each regime uses, the first ones; the others are zero in it.
    angles
        Regimes whose first entry of the memory is an angle (rad): whole turns do not matter.
    linear
        Regimes in which ``rate`` is linear in motion, velocity and memory, but for a constant.
    neutral
        Regimes in which what is remembered stays as it is: a contact that is always in one has no multiplier of it.
    fastest
        The regime in which the contact is stiffest.
    """

    names: tuple[str, ...]
    memory_used: tuple[int, ...]
    angles: frozenset[int] = frozenset()
    linear: frozenset[int] = frozenset()
    neutral: frozenset[int] = frozenset()
    fastest: int = 0

    @abstractmethod
    def rate(self, regime: int, at: InTime) -> tuple[Array, Array]:
        """Forces (n_ports, n, k) and time derivatives of the memory (n_memory, n, k)."""

    @abstractmethod
    def slopes(self, regime: int, at: InTime) -> TimeSlopes:
        """Derivatives of ``rate``."""

    @abstractmethod
    def force_and_slopes(self, regime: int, at: InTime) -> tuple[Array, Array]:
        """Forces (n_ports, n, k) and their derivatives by motion and memory, (n_ports, n_ports + n_memory, n, k).

        The velocity of ``at`` is not looked at. Forces are linear in the motion, and rates of the memory in the
        velocity: where the structure answers forces at once, both follow from one linear system each.
        """

    @abstractmethod
    def force_rate_slopes(self, regime: int, at: InTime, memory_rate: Array) -> Array:
        """Derivatives of the forces' rates by motion and memory, at given velocity and rates of the memory.

        (n_ports, n_ports + n_memory, n, k).
        """

    def relaxation(self, regime: int, at: InTime) -> Array:
        """Derivative of the rate of the first entry of the memory by that entry, (n, k): it may be fast."""
        p = len(at.q)
        return np.asarray(self.slopes(regime, at).values[p, 2 * p])

    @abstractmethod
    def guards(self, regime: int, at: InTime) -> Array:
        """Numbers of order 1 that stay positive while the regime lasts, (n_guards, n, k)."""

    @abstractmethod
    def after(self, regime: int, guard: int, at: InTime) -> int:
        """The regime of one element (n = k = 1) where one of its guards becomes negative."""

    @abstractmethod
    def reset(self, before: int, after: int, at: InTime) -> Array:
        """What is remembered (n_memory, n, k) where one regime follows another."""

    @abstractmethod
    def begin(self, force: Array, at: InTime) -> tuple[IntArray, Array]:
        """Regimes (n,) and memory (n_memory, n) at given forces (n_ports, n); of ``at`` k = 1, without memory."""

    @abstractmethod
    def next_force(self, force: Array, before: Array, after: Array, values: Mapping[str, Array]) -> Array:
        """Forces after a small motion from forces and motion before, (n_ports, n) each, nearly: for a start."""

    @abstractmethod
    def unsettled(self, q: Array, forces: Array, values: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Which elements (n,) keep forces (n_ports, n, k) of one period for ever because nothing ever switches."""

    def difference(self, regime: int, memory: Array) -> Array:
        """A difference of memories (n_memory, ...), without whole turns of an angle."""
        if regime not in self.angles:
            return memory
        out = memory.copy()
        out[0] = (out[0] + np.pi) % (2.0 * np.pi) - np.pi
        return out

    @abstractmethod
    def guard_slope(self, regime: int, guard: int, at: InTime) -> Array:
        """Derivatives of a guard of one element (n = k = 1) where it is zero, but for a factor.

        By motion, velocities and memory, (2 n_ports + n_memory,).
        """

    @abstractmethod
    def jumping(self, before: int, after: int) -> int | None:
        """The guard that ends a regime where rates of the forces jump; None where they do not.

        It depends on motion and memory alone.
        """

    @abstractmethod
    def reset_slopes(self, before: int, after: int, at: InTime) -> Array:
        """Derivatives of ``reset`` of one element, (n_memory, 2 n_ports + n_memory)."""

    @abstractmethod
    def memory_of(self, regime: int, force: Array, at: InTime) -> Array:
        """What is remembered (n_memory, n, k) in a regime with forces (n_ports, n, k)."""

    @abstractmethod
    def regime_of(self, name: str) -> int:
        """The regime that a state of results is, the lasting one of several."""
