"""The monodromy matrix by exact pieces and its eigenvalues, the Floquet multipliers (THEORY.md section 13).

Around a periodic solution the friction system is linear in each interval of constant contact states; what a stuck
friction spring remembers begins anew with each stick. The product over the period has all multipliers and no others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slipstick.analysis.stability.propagate import propagate
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.state_sequence import StateInterval, StickStarts, Timeline
from slipstick.analysis.stability.switched_system import Combinations
from slipstick.contact.kernel.tuples import STICK
from slipstick.typing import Array, ComplexArray, IntArray

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


def monodromy_with_laws(
    line: Timeline, starts: StickStarts, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray
) -> Monodromy | None:
    """The same with contacts of other laws without memory, whose tangents vary along the motion.

    Each interval goes in steps of the sixth-order Magnus method [Blanes, Casas, Oteo, Ros, Physics Reports 470 (2009)
    151, section 5.4]. None where velocities jump because the structure answers forces at once.
    """
    d, omega = combinations.dynamics, motion.omega
    r, n = d.size, combinations.contacts.count
    changing = {interval.change.contact for interval in line.intervals if interval.change is not None}
    kept = tuple(i for i, state in enumerate(line.cut) if state == STICK and i in changing)
    first = line.intervals[0]
    begin = 0.0 if first.change is None else first.change.time - first.length
    longest = 2.0 * np.pi / max(_FEWEST_STEPS, _STEPS_PER_ORDER * motion.harmonics.highest)
    counts = [max(1, int(np.ceil(interval.length / longest))) for interval in line.intervals]
    steps = np.repeat([interval.length / count for interval, count in zip(line.intervals, counts, strict=True)], counts)
    ends = begin + np.cumsum(steps)
    tau = ((ends - steps)[:, None] + steps[:, None] * _NODES).reshape(-1)
    tangent = law_tangent(combinations, motion, law_ports, tau)
    if tangent is None:
        return None
    places = [*range(2 * r), *(2 * r + i for i in kept)]
    Phi = np.zeros((2 * r + n, len(places)))
    Phi[places, range(len(places))] = 1.0
    tangent, at, sound = tangent.reshape(len(steps), len(_NODES), r, 2 * r), 0, True
    for interval, count in zip(line.intervals, counts, strict=True):
        piece = combinations(interval.states)
        A = np.zeros((count, len(_NODES), 2 * r + n, 2 * r + n))
        A[..., :r, r : 2 * r] = combinations.scale * np.eye(r)
        A[..., r : 2 * r, :] = -piece.forces
        A[..., r : 2 * r, : 2 * r] -= tangent[at : at + count]
        for own in _magnus(A, steps[at : at + count] / omega):
            Phi = own @ Phi
        at, sound = at + count, sound and piece.sound
        target, row = _start(interval, starts)
        if target >= 0:
            Phi[2 * r + target] = 0.0 if row is None else row @ Phi
    return Monodromy(Phi[places], kept, sound)


_FEWEST_STEPS, _STEPS_PER_ORDER = 48, 3
VELOCITIES_JUMP = (
    "stability: a law of motion and velocity acts where the structure answers forces at once (a static residual); "
    "give the structure more modes and no residual"
)
_NODES = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])


def law_tangent(combinations: Combinations, motion: SmoothMotion, law_ports: IntArray, tau: Array) -> Array | None:
    """What the laws add to ``LinearisedStates.forces`` at phases (k,): (k, r, 2 r)."""
    d, there = combinations.dynamics, law_ports >= 0
    ports, P = law_ports[there], len(law_ports)
    q, velocity = motion.law_arguments(tau)
    slopes = motion.laws.slopes(q, velocity, np.zeros((len(tau), 0)))
    K, C = slopes[:, there][:, :, :P][:, :, there], slopes[:, there][:, :, P:][:, :, there]
    if np.any(d.R[ports]) or np.any(d.R[:, ports]):
        if combinations.contacts.count or np.any(C):
            return None
        K = K @ np.linalg.inv(np.eye(len(ports)) + d.R[np.ix_(ports, ports)] @ K)
    columns, rows = d.columns[:, ports], d.rows[ports]
    return np.concatenate([columns @ K @ rows / combinations.scale, columns @ C @ rows], axis=2)


def _magnus(A: Array, steps: Array) -> Array:
    """Propagators (k, N, N) of steps (k,) from the matrices (k, 3, N, N) at their Gauss nodes."""
    from scipy.linalg import expm

    h = steps[:, None, None]
    a, b, c = (
        h * A[:, 1],
        h * np.sqrt(15.0) / 3.0 * (A[:, 2] - A[:, 0]),
        h * 10.0 / 3.0 * (A[:, 2] - 2.0 * A[:, 1] + A[:, 0]),
    )
    first = a @ b - b @ a
    second = 2.0 * c + first
    second = -(a @ second - second @ a) / 60.0
    left, right = -20.0 * a - c + first, b + second
    return np.asarray(expm(a + c / 12.0 + (left @ right - right @ left) / 240.0))


def _start(interval: StateInterval, starts: StickStarts) -> tuple[int, Array | None]:
    """The memory that changes at the end of an interval: its contact, and the row that gives it; None ends it."""
    change = interval.change
    if change is None:
        return -1, None
    if change.state == STICK:
        return change.contact, starts.row(change, interval.states)
    return change.contact, None
