"""The monodromy matrix, as a product over intervals of constant contact states (THEORY.md section 13).

The friction system linearised about a periodic solution has constant coefficients in each of these intervals, and the
memory of a friction spring begins anew with each stick. The eigenvalues of the product over one period are the Floquet
multipliers, all of them and no others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.state_sequence import StateInterval, StickStarts, Timeline
from slipstick.analysis.stability.switched_system import Combinations
from slipstick.contact.kernel.tuples import STICK
from slipstick.trig.compiled import compiled
from slipstick.typing import Array, ComplexArray, IntArray

_LONGEST = 1e6
"""Rate times period beyond which nothing is computed: as many steps as that would take minutes."""


@dataclass(frozen=True)
class Monodromy:
    """The map of a disturbance over one period, and the coordinates that it maps."""

    matrix: Array
    """(k, k): modes' motion, velocities over ``Combinations.scale``, memories of contacts stuck at the cut."""
    kept: tuple[int, ...]
    """Contacts whose memory is among the coordinates."""
    sound: bool
    """Whether the contact forces determine the motion in every combination, see ``LinearisedStates.sound``."""

    @property
    def multipliers(self) -> ComplexArray:
        """Eigenvalues, the largest first."""
        return multipliers_of(self.matrix)


def multipliers_of(matrix: Array) -> ComplexArray:
    """Eigenvalues (k,) of a map of disturbances over one period, the largest first."""
    multipliers = np.linalg.eigvals(matrix).astype(complex)
    return multipliers[np.lexsort((-multipliers.imag, -np.abs(multipliers).round(12)))]


def _memories(line: Timeline) -> tuple[int, ...]:
    """Contacts stuck where the period is cut but not all through it: what they remember may vary."""
    changing = {interval.change.contact for interval in line.intervals if interval.change is not None}
    return tuple(i for i, state in enumerate(line.cut) if state == STICK and i in changing)


def _unit(combinations: Combinations, kept: tuple[int, ...]) -> tuple[list[int], Array]:
    """Rows of the coordinates of a monodromy matrix among all, and unit disturbances of each (2 r + n, k)."""
    r, n = combinations.dynamics.size, combinations.contacts.count
    rows = [*range(2 * r), *(2 * r + i for i in kept)]
    Phi = np.zeros((2 * r + n, len(rows)))
    Phi[rows, range(len(rows))] = 1.0
    return rows, Phi


def monodromy(line: Timeline, starts: StickStarts, combinations: Combinations, omega: float) -> Monodromy | None:
    """The product over all intervals of a period (THEORY.md (13.4)); None where it would take minutes."""
    kept, known = _memories(line), list(dict.fromkeys(interval.states for interval in line.intervals))
    pieces = [combinations(states) for states in known]
    rates = np.array([piece.rate for piece in pieces])
    if not rates.max() * 2.0 * np.pi / omega < _LONGEST:
        return None
    places, Phi = _unit(combinations, kept)
    number = {states: k for k, states in enumerate(known)}
    rows = [_start(interval, starts) for interval in line.intervals]
    propagate(
        Phi, combinations.scale, np.array([piece.forces for piece in pieces]), rates,
        np.array([number[interval.states] for interval in line.intervals]),
        np.array([interval.length for interval in line.intervals]) / omega,
        np.array([target for target, _ in rows]),
        np.array([np.zeros(len(Phi)) if row is None else row for _, row in rows]),
    )  # fmt: skip
    return Monodromy(Phi[places], kept, all(piece.sound for piece in pieces))


def monodromy_with_laws(
    line: Timeline, starts: StickStarts, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray
) -> Monodromy | None:
    """The same with contacts of other laws without memory, whose stiffness and damping vary along the motion.

    Each interval is taken in steps of the sixth-order Magnus method [Blanes, Casas, Oteo, Ros, Physics Reports 470
    (2009) 151, section 5.4]. None where velocities jump because the structure answers forces at once.
    """
    d, omega = combinations.dynamics, motion.omega
    r, n = d.size, combinations.contacts.count
    kept, first = _memories(line), line.intervals[0]
    begin = 0.0 if first.change is None else first.change.time - first.length
    longest = 2.0 * np.pi / max(_FEWEST_STEPS, _STEPS_PER_ORDER * motion.harmonics.highest)
    counts = [max(1, int(np.ceil(interval.length / longest))) for interval in line.intervals]
    steps = np.repeat([interval.length / count for interval, count in zip(line.intervals, counts, strict=True)], counts)
    ends = begin + np.cumsum(steps)
    tau = ((ends - steps)[:, None] + steps[:, None] * _NODES).reshape(-1)
    tangent = law_tangent(combinations, motion, law_ports, tau)
    if tangent is None:
        return None
    places, Phi = _unit(combinations, kept)
    tangent, at, sound = tangent.reshape(len(steps), len(_NODES), r, 2 * r), 0, True
    for interval, count in zip(line.intervals, counts, strict=True):
        piece = combinations(interval.states)
        A = np.zeros((count, len(_NODES), 2 * r + n, 2 * r + n))
        A[..., :r, r : 2 * r] = combinations.scale * np.eye(r)
        A[..., r : 2 * r, :] = -piece.forces
        A[..., r : 2 * r, : 2 * r] -= tangent[at : at + count]
        for factor in _magnus(A, steps[at : at + count] / omega):
            Phi = factor @ Phi
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
    slopes = motion.laws.slopes(q, velocity, motion.laws.memory_in_sliding(q, velocity))[:, :P][:, there]
    K, C = slopes[:, :, :P][:, :, there], slopes[:, :, P : 2 * P][:, :, there]
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
    """The contact whose memory changes at the end of an interval, and the row that gives it; None: it is zero."""
    change = interval.change
    if change is None:
        return -1, None
    if change.state == STICK:
        return change.contact, starts.row(change, interval.states)
    return change.contact, None


REACH = 5.0
"""Bound on rate times length of a step."""

_ROUNDING = 1e-13
_TERMS = 60


@compiled(allocates=True, nogil=True)
def propagate(
    Phi: Array, scale: float, forces: Array, rates: Array, which: IntArray, lengths: Array, targets: IntArray,
    starts: Array,
) -> None:  # fmt: skip
    """Carry ``Phi`` (2 r + n, m) through intervals in which its linear system is constant, in place.

    No matrix exponential is formed: its Taylor series acts on ``Phi``, in steps so short that no digits are lost
    [Al-Mohy, Higham, SIAM J. Sci. Comput. 33 (2011) 488].

    ``forces`` (k, r, 2 r + n) and ``rates`` (k,) are those of the combinations, ``which`` and ``lengths`` (time) the
    intervals. After interval i row ``2 r + targets[i]`` becomes ``starts[i] Phi``; a target of -1 leaves all as it is.
    """
    r = forces.shape[1]
    term, moved = np.empty_like(Phi), np.empty((r, Phi.shape[1]))
    for i in range(lengths.size):
        steps = max(1, int(np.ceil(rates[which[i]] * lengths[i] / REACH)))
        step = lengths[i] / steps
        for _ in range(steps):
            _advance(Phi, term, moved, forces[which[i]], scale, step)
        if targets[i] >= 0:
            Phi[2 * r + targets[i]] = np.dot(starts[i], Phi)


@compiled(allocates=True, nogil=True)
def _advance(Phi: Array, term: Array, moved: Array, forces: Array, scale: float, step: float) -> None:
    """``Phi = exp(A step) Phi``."""
    r, m = moved.shape
    term[:] = Phi
    size, last = np.abs(Phi).max(), 0.0
    for k in range(1, _TERMS):
        np.dot(forces, term, moved)
        largest = 0.0
        for a in range(r):
            for b in range(m):
                x, y = scale * step / k * term[r + a, b], -step / k * moved[a, b]
                term[a, b], term[r + a, b] = x, y
                Phi[a, b] += x
                Phi[r + a, b] += y
                largest = max(largest, abs(x), abs(y))
        if k == 1:
            term[2 * r :] = 0.0
        if largest + last <= _ROUNDING * size:
            break
        last = largest
