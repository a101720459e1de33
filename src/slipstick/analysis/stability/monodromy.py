"""The monodromy matrix by exact pieces and its eigenvalues, the Floquet multipliers (THEORY.md section 13).

Around a periodic solution the friction system is linear in each interval of constant contact states; what a stuck
friction spring remembers begins anew with each stick. The product over the period has all multipliers and no others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slipstick.analysis.stability.propagate import propagate
from slipstick.analysis.stability.state_sequence import StateInterval, StickStarts, Timeline
from slipstick.analysis.stability.switched_system import Combinations
from slipstick.contact.kernel.tuples import STICK
from slipstick.typing import Array, ComplexArray

_LONGEST = 1e6
"""Rate times period beyond which nothing is computed: as many steps as that would take minutes."""


@dataclass(frozen=True)
class Monodromy:
    """The map of a disturbance over one period, and the coordinates that it maps."""

    matrix: Array
    """(k, k): modes' motion, velocities over ``Combinations.scale``, memories of contacts stuck at the cut."""
    kept: tuple[int, ...]
    """FrictionPorts whose memory is among the coordinates."""
    sound: bool
    """Whether the motion followed from the forces without doubt in every combination."""

    @property
    def multipliers(self) -> ComplexArray:
        """Eigenvalues, the largest first."""
        found = np.linalg.eigvals(self.matrix).astype(complex)
        return found[np.lexsort((-found.imag, -np.abs(found).round(12)))]


def monodromy(line: Timeline, starts: StickStarts, combinations: Combinations, omega: float) -> Monodromy | None:
    """The product of all pieces of a period (THEORY.md (13.4)); None where it would be too long."""
    r, n = combinations.dynamics.size, combinations.contacts.count
    changing = {interval.change.contact for interval in line.intervals if interval.change is not None}
    kept = tuple(i for i, state in enumerate(line.cut) if state == STICK and i in changing)
    known = list(dict.fromkeys(interval.states for interval in line.intervals))
    pieces = [combinations(states) for states in known]
    rates = np.array([piece.rate for piece in pieces])
    if not rates.max() * 2.0 * np.pi / omega < _LONGEST:
        return None
    places = [*range(2 * r), *(2 * r + i for i in kept)]
    Phi = np.zeros((2 * r + n, len(places)))
    Phi[places, range(len(places))] = 1.0
    number = {states: k for k, states in enumerate(known)}
    rows = [_start(interval, starts) for interval in line.intervals]
    propagate(
        Phi, combinations.scale, np.array([piece.forces for piece in pieces]), rates,
        np.array([number[interval.states] for interval in line.intervals]),
        np.array([interval.length for interval in line.intervals]) / omega,
        np.array([target for target, _ in rows]),
        np.array([np.zeros(2 * r + n) if row is None else row for _, row in rows]),
    )  # fmt: skip
    return Monodromy(Phi[places], kept, all(piece.sound for piece in pieces))


def _start(interval: StateInterval, starts: StickStarts) -> tuple[int, Array | None]:
    """The memory that changes at the end of an interval: its contact, and the row that gives it; None ends it."""
    change = interval.change
    if change is None:
        return -1, None
    if change.state == STICK:
        return change.contact, starts.row(change, interval.states)
    return change.contact, None
