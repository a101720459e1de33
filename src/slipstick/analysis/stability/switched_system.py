"""The contacts linearised in each combination of their states, and the linear system of the structure with them.

``df = D ds + E dc`` with ``dc`` what a stuck friction spring remembers; every combination is made once for as long as
the contacts keep their parameters.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slipstick.analysis.stability.dynamics import Dynamics
from slipstick.contact.kernel.tuples import SEPARATION, SLIP_PLUS, STICK
from slipstick.typing import Array, IntArray

StateCodes = tuple[int, ...]
"""State code of every contact."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionPorts:
    """Where the ports of n friction contacts stand, and their parameters, (n,) each."""

    tangential: IntArray
    """Number of the port, -1 where there is none."""
    normal: IntArray
    """Likewise."""
    kt: Array
    mu: Array
    kn: Array
    n_ports: int

    @property
    def count(self) -> int:
        """Number of contacts."""
        return len(self.kt)

    def tangent(self, states: StateCodes) -> tuple[Array, Array]:
        """``D`` (n_ports, n_ports) and ``E`` (n_ports, n) (THEORY.md (13.1))."""
        D, E = np.zeros((self.n_ports, self.n_ports)), np.zeros((self.n_ports, self.count))
        for i, state in enumerate(states):
            if state == SEPARATION:
                continue
            x, y = self.tangential[i], self.normal[i]
            if y >= 0:
                D[y, y] += self.kn[i]
            if x < 0:
                continue
            if state == STICK:
                D[x, x] += self.kt[i]  # sliders side by side share a port
                E[x, i] = 1.0
            elif y >= 0:
                D[x, y] += (1.0 if state == SLIP_PLUS else -1.0) * self.mu[i] * self.kn[i]
        return D, E


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearisedStates:
    """The linear system of one combination: ``q'' = -forces [q, q'/scale, dc]``.

    Attributes
    ----------
    forces
        (r, 2 r + n), divided by the scale.
    motion
        Rows (n_ports, 2 r + n) that give ``ds``.
    relative
        ``(I + R D)^-1`` (n_ports, n_ports): rates of the motion at the ports from those of the modes.
    D, E
        The contacts linearised, see ``FrictionPorts.tangent``.
    rate
        Bound (1/time) on the fastest motion.
    sound
        Whether ``det(I + R D) > 0``: the motion at the ports follows from that of the modes without a jump.
    """

    forces: Array
    motion: Array
    relative: Array
    D: Array
    E: Array
    rate: float
    sound: bool


@dataclass(eq=False)
class Combinations:
    """Makes the linear systems of combinations, each once (THEORY.md (13.3))."""

    dynamics: Dynamics
    contacts: FrictionPorts
    scale: float = 0.0
    """Velocities are divided by it (1/time), so that they are of the size of the motion."""
    _made: dict[StateCodes, LinearisedStates] = field(default_factory=dict)
    _latest: tuple[tuple[StateCodes, ...], tuple[Array, Array, bool]] = ((), (np.empty(0), np.empty(0), True))

    def __post_init__(self) -> None:
        d, c = self.dynamics, self.contacts
        spring = np.zeros(c.n_ports)
        for ports, stiffness in ((c.tangential, c.kt), (c.normal, c.kn)):
            np.add.at(spring, ports[ports >= 0], stiffness[ports >= 0])
        self.scale = float(np.sqrt(_size(d.K + (d.columns * spring) @ d.rows))) or 1.0

    def __call__(self, states: StateCodes) -> LinearisedStates:
        """The linear system of a combination."""
        if states not in self._made:
            self._made[states] = self._make(states)
        return self._made[states]

    def of_each(self, known: tuple[StateCodes, ...]) -> tuple[Array, Array, bool]:
        """Forces (k, r, 2 r + n) and rates (k,) of several combinations, and whether all of them are sound."""
        if known != self._latest[0]:  # neighbouring points have the same
            pieces = [self(states) for states in known]
            forces, rates = np.array([piece.forces for piece in pieces]), np.array([piece.rate for piece in pieces])
            self._latest = known, (forces, rates, all(piece.sound for piece in pieces))
        return self._latest[1]

    def _make(self, states: StateCodes) -> LinearisedStates:
        d, (D, E) = self.dynamics, self.contacts.tangent(states)
        r, n = d.size, self.contacts.count
        coupled = np.eye(len(D)) + d.R @ D
        relative = np.asarray(np.linalg.inv(coupled), dtype=float)
        motion = np.zeros((len(D), 2 * r + n))
        motion[:, :r], motion[:, 2 * r :] = relative @ d.rows, -relative @ d.R @ E
        force = D @ motion
        force[:, 2 * r :] += E
        answer = d.columns @ force
        answer[:, :r] += d.K
        rate = float(np.sqrt(_size(answer[:, :r]))) + _size(d.C)
        answer /= self.scale
        answer[:, r : 2 * r] += d.C
        return LinearisedStates(
            forces=np.ascontiguousarray(answer), motion=motion, relative=relative, D=D, E=E, rate=rate,
            sound=float(np.linalg.det(coupled)) > 0.0,
        )  # fmt: skip


def _size(matrix: Array) -> float:
    """Largest column sum of magnitudes."""
    return float(np.abs(matrix).sum(axis=0).max(initial=0.0))
