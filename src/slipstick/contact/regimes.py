"""Laws in time that switch: smooth in each of their regimes, with events between them.

Time integration and multipliers use regimes, guards and resets, whatever their meaning in a law.
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
    """Motion of n elements at k instants as in ``Law.rate``, with the drift and a typical length."""

    q: Array
    """Motion along the ports, (n_ports, n, k), without the drift at constant velocity."""
    velocity: Array
    """(n_ports, n, k), length/time."""
    memory: Array
    """(n_memory, n, k)."""
    values: Mapping[str, Array]
    """Parameters, (n, 1) each."""
    drift: Array
    """Constant part of the velocity, (n_ports, n, 1)."""
    length: float
    """Typical motion, to which tolerances are relative."""


class Regimes(ABC):
    """A law in time that switches between regimes, which are numbered from 0.

    Attributes
    ----------
    names
        State of each regime in results; regimes may share one.
    memory_used
        Number of internal variables that each regime uses, the first ones; the others are zero in it.
    angles
        Regimes whose first internal variable is an angle (rad), modulo 2 pi.
    linear
        Regimes in which ``rate`` is affine in motion, velocity and internal variables.
    neutral
        Regimes with constant internal variables: a contact that is always in one has no multipliers of these.
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

        The velocity of ``at`` is not used. Forces are linear in the motion, and rates of the internal variables in the
        velocity: where the structure has a feedthrough, both follow from one linear system each.
        """

    @abstractmethod
    def force_rate_slopes(self, regime: int, at: InTime, memory_rate: Array) -> Array:
        """Derivatives of the forces' rates by motion and memory, at given velocity and rates of the memory.

        (n_ports, n_ports + n_memory, n, k).
        """

    def relaxation(self, regime: int, at: InTime) -> Array:
        """Derivative of the rate of the first internal variable by that variable, (n, k); it may be large."""
        p = len(at.q)
        return np.asarray(self.slopes(regime, at).values[p, 2 * p])

    @abstractmethod
    def guards(self, regime: int, at: InTime) -> Array:
        """Guard functions of order 1, positive while the regime lasts, (n_guards, n, k)."""

    @abstractmethod
    def after(self, regime: int, guard: int, at: InTime) -> int:
        """The regime of one element (n = k = 1) where one of its guards becomes negative."""

    @abstractmethod
    def reset(self, before: int, after: int, at: InTime) -> Array:
        """Internal variables (n_memory, n, k) where one regime follows another."""

    @abstractmethod
    def begin(self, force: Array, at: InTime) -> tuple[IntArray, Array]:
        """Regimes (n,) and internal variables (n_memory, n) at given forces (n_ports, n); ``at`` has k = 1."""

    @abstractmethod
    def next_force(self, force: Array, before: Array, after: Array, values: Mapping[str, Array]) -> Array:
        """Approximate forces after a small motion, from forces and motion before, (n_ports, n) each; for a start."""

    @abstractmethod
    def unsettled(self, q: Array, forces: Array, values: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Elements (n,) that never switch, so that forces (n_ports, n, k) of one period depend on the initial state."""

    def difference(self, regime: int, memory: Array) -> Array:
        """A difference of internal variables (n_memory, ...), angles modulo 2 pi."""
        if regime not in self.angles:
            return memory
        out = memory.copy()
        out[0] = (out[0] + np.pi) % (2.0 * np.pi) - np.pi
        return out

    @abstractmethod
    def guard_slope(self, regime: int, guard: int, at: InTime) -> Array:
        """Derivatives of a guard of one element (n = k = 1) where it is zero, up to a factor.

        By motion, velocities and memory, (2 n_ports + n_memory,).
        """

    @abstractmethod
    def jumping(self, before: int, after: int) -> int | None:
        """The guard at whose zero rates of the forces jump; None where they do not.

        It depends on motion and internal variables alone.
        """

    @abstractmethod
    def reset_slopes(self, before: int, after: int, at: InTime) -> Array:
        """Derivatives of ``reset`` of one element, (n_memory, 2 n_ports + n_memory)."""

    @abstractmethod
    def memory_of(self, regime: int, force: Array, at: InTime) -> Array:
        """Internal variables (n_memory, n, k) of a regime with forces (n_ports, n, k)."""

    @abstractmethod
    def regime_of(self, name: str) -> int:
        """Regime of a state in results; of several the one that lasts."""
