"""The monodromy matrix, as a product over intervals of constant contact states (THEORY.md section 13).

The friction system linearised about a periodic solution has constant coefficients in each of these intervals, and the
memory of a friction spring begins anew with each stick. The eigenvalues of the product over one period are the Floquet
multipliers, all of them and no others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.state_sequence import Change, StateInterval, StickStarts, Timeline
from slipstick.analysis.stability.switched_system import Combinations
from slipstick.analysis.time_domain.law_in_time import LawsInTime
from slipstick.contact.kernel.tuples import STICK
from slipstick.trig.basis import TWO_PI
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


def _memories(line: Timeline, count: int) -> tuple[int, ...]:
    """Friction contacts stuck where the period is cut but not all through it: what they remember may vary."""
    return tuple(i for i, state in enumerate(line.cut[:count]) if state == STICK and i in line.changing)


def _unit(combinations: Combinations, kept: tuple[int, ...]) -> tuple[list[int], Array]:
    """Rows of the coordinates of a monodromy matrix among all, and unit disturbances of each (2 r + n, k)."""
    r, n = combinations.dynamics.size, combinations.contacts.count
    rows = [*range(2 * r), *(2 * r + i for i in kept)]
    Phi = np.zeros((2 * r + n, len(rows)))
    Phi[rows, range(len(rows))] = 1.0
    return rows, Phi


def monodromy(line: Timeline, starts: StickStarts, combinations: Combinations, omega: float) -> Monodromy | None:
    """The product over all intervals of a period (THEORY.md (13.4)); None where it would take minutes."""
    kept, known = (
        _memories(line, combinations.contacts.count),
        list(dict.fromkeys(interval.states for interval in line.intervals)),
    )
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
    """The same with contacts of other laws, whose stiffness and damping vary along the motion.

    They remember nothing, or their laws switch: then what they remember is among the coordinates too. Each interval is
    taken in steps of the sixth-order Magnus method [Blanes, Casas, Oteo, Ros, Physics Reports 470 (2009) 151,
    section 5.4]. None where velocities jump because the structure answers forces at once.
    """
    d, omega, laws, nc = combinations.dynamics, motion.omega, motion.laws, combinations.contacts.count
    laws_along = LawsAlong.of(combinations, motion, law_ports)
    if laws_along is None:
        return None
    r, n, m = d.size, combinations.contacts.count, laws.n_memory
    kept, first = _memories(line, nc), line.intervals[0]
    which = [
        k for k, own in enumerate(laws.switching)
        if nc + k in line.changing or line.cut[nc + k] not in own.regimes.neutral
    ]  # fmt: skip
    remembered = laws.remembered(line.cut[nc:], which)
    places = [*range(2 * r), *(2 * r + i for i in kept), *(2 * r + n + i for i in remembered)]
    Phi = np.zeros((2 * r + n + m, len(places)))
    Phi[places, range(len(places))] = 1.0
    begin = 0.0 if first.change is None else first.change.time - first.length
    longest, sound = 2.0 * np.pi / max(_FEWEST_STEPS, _STEPS_PER_ORDER * motion.harmonics.highest), True
    steep = _steep_times(line, laws, nc)
    for interval in line.intervals:
        friction, regimes = interval.states[:nc], interval.states[nc:]
        ends = _step_ends(begin, begin + interval.length, longest, steep)
        steps = np.diff(ends)
        tau = (ends[:-1, None] + steps[:, None] * _NODES).reshape(-1)
        piece = combinations(friction)
        A = np.zeros((len(tau), 2 * r + n + m, 2 * r + n + m))
        A[:, :r, r : 2 * r] = combinations.scale * np.eye(r)
        A[:, r : 2 * r, : 2 * r + n] = -piece.forces
        if not laws_along.add_to(A, tau, regimes):
            return None
        for factor in _magnus(A.reshape(len(steps), len(_NODES), *A.shape[1:]), steps / omega):
            Phi = factor @ Phi
        begin, sound = begin + interval.length, sound and piece.sound
        change = interval.change
        if change is not None and change.contact >= nc:
            rows, map_of = laws_along.reset(change, begin, nc)
            Phi[rows] = map_of @ Phi
        elif change is not None:
            target, row = _start(replace(interval, states=friction), starts)
            Phi[2 * r + target] = 0.0 if row is None else row @ Phi[: 2 * r + n]
    return Monodromy(Phi[places], kept, sound)


def _steep_times(line: Timeline, laws: LawsInTime, nc: int) -> list[float]:
    """When contacts whose law switches begin or end: what they remember changes without bound there."""
    changes = [interval.change for interval in line.intervals if interval.change is not None]
    return [
        c.time for c in changes
        if c.contact >= nc and 0 in (laws.switching[c.contact - nc].regimes.memory_used[s] for s in (c.state, c.origin))
    ]  # fmt: skip


def _step_ends(begin: float, end: float, longest: float, steep: Sequence[float]) -> Array:
    """Ends of steps from ``begin`` to ``end`` (rad), which shorten towards steep times."""
    if not steep:
        return np.linspace(begin, end, max(1, int(np.ceil((end - begin) / longest))) + 1)
    every = np.array([t + turn for t in steep for turn in (-TWO_PI, 0.0, TWO_PI, 2.0 * TWO_PI)])
    ends = [begin]
    while ends[-1] < end:
        away = every - ends[-1]
        ahead, behind = away[away > _NEAREST].min(initial=np.inf), -away[away <= _NEAREST].max(initial=-np.inf)
        step = min(longest, max(0.5 * behind, _NEAREST), max(ahead / 3.0, _NEAREST), end - ends[-1])
        ends.append(ends[-1] + step if end - ends[-1] - step > 1e-12 else end)
    return np.array(ends)


_NEAREST = 1e-6
"""Distance (rad) from a steep time within which nothing is resolved."""


class LawsAlong:
    """Contacts of other laws linearised along a motion, coordinates as in ``monodromy_with_laws``."""

    def __init__(
        self, combinations: Combinations, motion: SmoothMotion, rows: Array, columns: Array, R: Array | None
    ) -> None:
        self._combinations, self._motion, self._rows, self._columns = combinations, motion, rows, columns
        self._R = R

    @classmethod
    def of(cls, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray) -> LawsAlong | None:
        """None where the structure answers their forces at once and what comes of that is not known."""
        d, there, P = combinations.dynamics, law_ports >= 0, len(law_ports)
        ports = law_ports[there]
        rows, columns, R = np.zeros((P, d.size)), np.zeros((d.size, P)), np.zeros((P, P))
        rows[there], columns[:, there], R[np.ix_(there, there)] = (
            d.rows[ports],
            d.columns[:, ports],
            d.R[np.ix_(ports, ports)],
        )
        at_once = np.any(d.R[ports]) or np.any(d.R[:, ports])
        if at_once and (combinations.contacts.count or motion.laws.switching):
            return None
        return cls(combinations, motion, rows, columns, R if at_once else None)

    def add_to(self, A: Array, tau: Array, regimes: tuple[int, ...]) -> bool:
        """What the laws add to the linear system (k, size, size) at phases (k,)."""
        motion, d, P = self._motion, self._combinations.dynamics, len(self._rows)
        r, scale, m = d.size, self._combinations.scale, motion.laws.n_memory
        q, velocity = motion.law_arguments(tau)
        slopes = motion.laws.slopes(q, velocity, self._memory(tau, regimes, q, velocity), regimes)
        if self._R is not None:
            if np.any(slopes[:, :P, P:]):
                return False
            K = slopes[:, :P, :P]
            slopes[:, :P, :P] = K @ np.linalg.inv(np.eye(P) + self._R @ K)
        by = np.concatenate(
            [slopes[:, :, :P] @ self._rows, scale * (slopes[:, :, P : 2 * P] @ self._rows), slopes[:, :, 2 * P :]],
            axis=2,
        )
        A[:, r : 2 * r, : 2 * r] -= self._columns @ by[:, :P, : 2 * r] / scale
        if m:
            A[:, r : 2 * r, -m:] -= self._columns @ by[:, :P, 2 * r :] / scale
            A[:, -m:, : 2 * r], A[:, -m:, -m:] = by[:, P:, : 2 * r], by[:, P:, 2 * r :]
        return True

    def _memory(self, tau: Array, regimes: tuple[int, ...], q: Array, velocity: Array) -> Array:
        """What contacts remember at phases (k,), those whose law switches by their forces there: (k, m)."""
        motion = self._motion
        out = motion.laws.memory_in_sliding(q, velocity)
        for law, ports, _, places in motion.laws.each:
            if law.law.regimes is None:
                continue
            values = {name: value[:, 0] for name, value in law.values.items()}
            told = law.law.forces_in_time(motion.of_law(law, ports), values, tau)
            assert told is not None
            for own in motion.laws.switching[places]:
                force = np.stack([port[own.element] for port in told])[:, None]
                at = own.at(q, velocity, out)
                out[:, own.memory] = own.regimes.memory_of(regimes[places.start + own.element], force, at)[:, 0].T
        return out

    def reset(self, change: Change, tau: float, nc: int) -> tuple[IntArray, Array]:
        """Rows of what a contact remembers, and the rows that give it from the coordinates just before a change."""
        motion, d, scale = self._motion, self._combinations.dynamics, self._combinations.scale
        number = change.contact - nc
        own, m, r = motion.laws.switching[number], motion.laws.n_memory, d.size
        q, velocity = motion.law_arguments(np.array([tau]))
        regimes = [0] * len(motion.laws.switching)
        regimes[number] = change.origin
        at = own.at(q, velocity, self._memory(np.array([tau]), tuple(regimes), q, velocity))
        slopes, p = own.regimes.reset_slopes(change.origin, change.state, at), len(own.ports)
        size = 2 * r + self._combinations.contacts.count + m
        out = np.zeros((len(own.memory), size))
        out[:, :r] = slopes[:, :p] @ self._rows[own.ports]
        out[:, r : 2 * r] = scale * (slopes[:, p : 2 * p] @ self._rows[own.ports])
        rows = size - m + own.memory
        out[:, rows] = slopes[:, 2 * p :]
        return rows, out


_FEWEST_STEPS, _STEPS_PER_ORDER = 48, 3
VELOCITIES_JUMP = (
    "stability: a law of motion and velocity acts where the structure answers forces at once (a static residual); "
    "give the structure more modes and no residual"
)
_NODES = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])


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
