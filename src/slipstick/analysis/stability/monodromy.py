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
from slipstick.analysis.stability.state_sequence import Change, StateInterval, StickStarts, Timeline, slope_at
from slipstick.analysis.stability.switched_system import Combinations, StateCodes
from slipstick.analysis.time_domain.law_in_time import LawsInTime, RegimeNumbers
from slipstick.analysis.time_domain.static_residual import Behind, force_rate, motion_behind, slopes_behind
from slipstick.contact.friction_law import friction_in_time
from slipstick.contact.kernel.tuples import SEPARATION, SLIP_PLUS, STICK
from slipstick.contact.law import Motion
from slipstick.trig.basis import TWO_PI
from slipstick.trig.compiled import compiled
from slipstick.typing import AnyArray, Array, ComplexArray, IntArray

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
    return _largest_first(np.linalg.eigvals(matrix))


def multipliers_of_each(matrices: Sequence[Array]) -> list[ComplexArray]:
    """The same of several maps."""
    if len({len(matrix) for matrix in matrices}) == 1:  # as most are: together
        return [_largest_first(one) for one in np.linalg.eigvals(np.array(matrices))]
    return [multipliers_of(matrix) for matrix in matrices]


def _largest_first(multipliers: AnyArray) -> ComplexArray:
    multipliers = multipliers.astype(complex)
    return np.asarray(multipliers[np.lexsort((-multipliers.imag, -np.abs(multipliers).round(12)))])


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
    kept = _memories(line, combinations.contacts.count)
    known = tuple(dict.fromkeys(interval.states for interval in line.intervals))
    forces, rates, sound = combinations.of_each(known)
    if not rates.max() * 2.0 * np.pi / omega < _LONGEST:
        return None
    places, Phi = _unit(combinations, kept)
    number = {states: k for k, states in enumerate(known)}
    rows = [_start(interval, starts) for interval in line.intervals]
    propagate(
        Phi, combinations.scale, forces, rates,
        np.array([number[interval.states] for interval in line.intervals]),
        np.array([interval.length for interval in line.intervals]) / omega,
        np.array([target for target, _ in rows]),
        np.array([np.zeros(len(Phi)) if row is None else row for _, row in rows]),
    )  # fmt: skip
    return Monodromy(Phi[places], kept, sound)


def monodromy_with_laws(
    line: Timeline, starts: StickStarts, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray
) -> Monodromy | None:
    """The same with contacts of other laws, whose stiffness and damping vary along the motion.

    They remember nothing, or their laws switch: then what they remember is among the coordinates too. Each interval is
    taken in steps of the sixth-order Magnus method [Blanes, Casas, Oteo, Ros, Physics Reports 470 (2009) 151,
    section 5.4]. None where the structure answers forces at once of laws that do not switch, unless these are springs
    and act alone.
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
        friction = interval.states[:nc]
        ends = _step_ends(begin, begin + interval.length, longest, steep)
        steps = np.diff(ends)
        tau = (ends[:-1, None] + steps[:, None] * _NODES).reshape(-1)
        piece = combinations(friction)
        A = np.zeros((len(tau), 2 * r + n + m, 2 * r + n + m))
        A[:, :r, r : 2 * r] = combinations.scale * np.eye(r)
        A[:, r : 2 * r, : 2 * r + n] = -piece.forces
        if not laws_along.add_to(A, tau, interval.states):
            return None
        for factor in _magnus(A.reshape(len(steps), len(_NODES), *A.shape[1:]), steps / omega):
            Phi = factor @ Phi
        begin, sound = begin + interval.length, sound and piece.sound
        change = interval.change
        if change is not None and change.contact >= nc:
            rows, map_of = laws_along.reset(change, begin, interval.states)
            Phi[rows] = map_of @ Phi
        elif change is not None and laws_along.at_once:
            rows, map_of = laws_along.friction_begins(change, begin, interval.states, starts)
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
    """Contacts of other laws linearised along a motion, coordinates as in ``monodromy_with_laws``.

    Where the structure answers their forces at once, velocities jump with the states: they are those of
    ``motion_behind`` from what the modes, whose motion is smooth, make of them.
    """

    def __init__(self, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray, at_once: bool) -> None:
        self._combinations, self._motion, self.at_once = combinations, motion, at_once
        d, c, there = combinations.dynamics, combinations.contacts, law_ports >= 0
        self._nc, self._ports = c.count, np.zeros((len(d.R), len(law_ports)))
        """Places of their ports among all."""
        self._ports[law_ports[there], there] = 1.0
        shape = (len(d.R), motion.harmonics.size)
        self._moved, self._rubbing, force = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        """Motion of the structure at all ports, and that of the opposing surfaces."""
        each = [(c.tangential, motion.X, motion.rubbing[0], motion.force[0])]
        each += [(c.normal, motion.Y, motion.rubbing[1], motion.force[1])]
        each += [(law_ports, motion.law_motion, motion.law_rubbing, motion.law_force)]
        for ports, total, rubbing, pushed in each:
            own = ports >= 0
            self._moved[ports[own]], self._rubbing[ports[own]] = (total - rubbing)[own], rubbing[own]
            np.add.at(force, ports[own], pushed[own])
        self._smooth = self._moved + d.R @ force
        """What of it the modes and the loads make."""

    @classmethod
    def of(cls, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray) -> LawsAlong | None:
        """None where the structure answers their forces at once and what comes of that is not known."""
        R, ports, switching = combinations.dynamics.R, law_ports[law_ports >= 0], len(motion.laws.switching)
        at_once = bool(np.any(R[ports]) or np.any(R[:, ports]))
        if at_once and switching < motion.laws.count and (switching or combinations.contacts.count):
            return None
        return cls(combinations, motion, law_ports, at_once)

    def _answered(self, states: StateCodes) -> tuple[Array, Array]:
        """``B`` (n_ports, P): all ports move by ``-B F`` at once; its rows at the ports of the laws."""
        piece = self._combinations(states[: self._nc])
        B = piece.relative @ self._combinations.dynamics.R @ self._ports
        return B, self._ports.T @ B

    def _given(self, states: StateCodes) -> Array:
        """Rows (2 P + m, size) of motion and velocity at the ports without their forces, and of the memory."""
        combinations, m = self._combinations, self._motion.laws.n_memory
        r, rows = combinations.dynamics.size, self._ports.T @ combinations(states[: self._nc]).motion
        P, free = rows.shape
        out = np.zeros((2 * P + m, free + m))
        out[:P, :free], out[P : 2 * P, r : 2 * r], out[2 * P :, free:] = (
            rows,
            combinations.scale * rows[:, :r],
            np.eye(m),
        )
        return out

    def _slopes(self, tau: Array, states: StateCodes) -> tuple[Array, ...] | None:
        """Derivatives of motion, velocity, forces and rates of the memory by the coordinates; None: not known."""
        laws, given, motion, regimes = (
            self._motion.laws,
            self._given(states),
            self._along(tau, states),
            self._of(states),
        )
        P = laws.n_ports
        if self.at_once:
            if not laws.switching and np.any(laws.slopes(*motion, regimes)[:, :P, P:]):
                return None
            return tuple(part @ given for part in slopes_behind(laws, self._answered(states)[1], *motion, regimes)[:4])
        by = laws.slopes(*motion, regimes) @ given
        still = np.broadcast_to(given, (len(tau), *given.shape))
        return still[:, :P], still[:, P : 2 * P], by[:, :P], by[:, P:]

    def _of(self, states: StateCodes) -> RegimeNumbers:
        return tuple(states[self._nc :])

    def add_to(self, A: Array, tau: Array, states: StateCodes) -> bool:
        """What the laws add to the linear system (k, size, size) at phases (k,); False where it is not known."""
        d, scale, m = self._combinations.dynamics, self._combinations.scale, self._motion.laws.n_memory
        slopes = self._slopes(tau, states)
        if slopes is None:
            return False
        _, _, force, rate = slopes
        columns = d.columns @ (self._ports - self._combinations(states[: self._nc]).D @ self._answered(states)[0])
        A[:, d.size : 2 * d.size] -= columns @ force / scale
        if m:
            A[:, -m:] += rate
        return True

    def _along(self, tau: Array, states: StateCodes) -> tuple[Array, Array, Array]:
        """Motion and velocity (k, P) and memory (k, m) at phases, in these states."""
        q, velocity = self._motion.law_arguments(tau)
        memory = self._memory(tau, self._of(states), q, velocity)
        if self.at_once and self._motion.laws.switching:
            told = self._behind(tau, states, memory)
            return told.q, told.velocity, memory
        return q, velocity, memory

    def _behind(self, tau: Array, states: StateCodes, memory: Array) -> Behind:
        motion, H = self._motion, self._motion.harmonics.H_minus(tau)
        relative = self._ports.T @ self._combinations(states[: self._nc]).relative
        moved, rate = self._without_laws(tau, states)
        drift, slope = motion.law_drift, motion.harmonics.derivative(motion.law_rubbing)
        q0, v0 = moved @ relative.T + H @ motion.law_rubbing.T, motion.omega * (rate @ relative.T + H @ slope.T + drift)
        return motion_behind(motion.laws, self._answered(states)[1], q0, v0, memory, self._of(states))

    def _without_laws(self, tau: Array, states: StateCodes) -> tuple[Array, Array]:
        """``s + R D s`` (k, n_ports) of the ports' motion without forces of other laws, and its derivative by phase.

        Friction contacts answer by ``D s`` and what they hold beside that.
        """
        motion, c, h = self._motion, self._combinations.contacts, self._motion.harmonics
        H, R, piece = h.H_minus(tau), self._combinations.dynamics.R, self._combinations(states[: self._nc])
        moved, rate = H @ self._smooth.T, H @ h.derivative(self._smooth).T
        if not self._nc:
            return moved, rate
        v = motion.values["v"]
        own = Motion(h, motion.omega, (motion.X, motion.Y), np.stack([v, np.zeros_like(v)]))
        held = -(H @ self._moved.T) @ piece.D.T
        for ports, force in zip((c.tangential, c.normal), friction_in_time(own, motion.values, tau), strict=True):
            np.add.at(held.T, ports[ports >= 0], force[ports >= 0])
        held_rate = H @ h.derivative(self._rubbing).T @ piece.D.T + piece.E @ (c.kt * v)
        return moved - held @ R.T, rate - held_rate @ R.T

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

    def reset(self, change: Change, tau: float, states: StateCodes) -> tuple[IntArray, Array]:
        """Rows of what contacts remember, and the rows that give it from the coordinates before a change.

        ``states``: those before. It is what the contact remembers that changes its regime; where velocities jump, what
        others do changes its rate, at an instant that the disturbance moves.
        """
        laws, given = self._motion.laws, self._given(states)
        number, phase = change.contact - self._nc, np.array([tau])
        own, size = laws.switching[number], given.shape[1]
        motion, slopes = self._along(phase, states), self._slopes(phase, states)
        assert slopes is not None
        at = own.at(*motion)
        moved, speed = (part[0, own.ports] for part in slopes[:2])
        by_own = np.concatenate([moved, speed, given[2 * laws.n_ports + own.memory]])
        kept = own.regimes.reset_slopes(change.origin, change.state, at)
        remembered = size - laws.n_memory + np.arange(laws.n_memory)
        guard = own.regimes.jumping(change.origin, change.state) if self.at_once else None
        if guard is None:
            return remembered[own.memory], kept @ by_own
        memory = motion[2].copy()
        memory[:, own.memory] = own.regimes.reset(change.origin, change.state, at)[:, 0].T
        rates, jump = self._jump(change, phase, states, motion[2], memory)
        # along the motion; accelerations do not matter where velocities jump
        moving = np.concatenate([(motion[1] - laws.drift)[0, own.ports], np.zeros(len(own.ports)), rates[own.memory]])
        begins = 0 in (own.regimes.memory_used[change.origin], own.regimes.memory_used[change.state])
        jump[own.memory] = 0.0 if begins else jump[own.memory] + rates[own.memory] - kept @ moving
        out = np.eye(size)[remembered]
        out[own.memory] = kept @ by_own
        margin = own.regimes.guard_slope(change.origin, guard, at)
        slope = margin @ moving
        if slope != 0.0:
            out += np.outer(jump, margin @ by_own) / slope
        return remembered, out

    def _jump(
        self, change: Change, phase: Array, states: StateCodes, before: Array, after: Array
    ) -> tuple[Array, Array]:
        """Rates of the memory (m,) before a change and how they jump there, with the memory before and after."""
        next_states = (*states[: change.contact], change.state, *states[change.contact + 1 :])
        rates = self._behind(phase, states, before).rates[0]
        return rates, self._behind(phase, next_states, after).rates[0] - rates

    def friction_begins(
        self, change: Change, tau: float, states: StateCodes, starts: StickStarts
    ) -> tuple[IntArray, Array]:
        """The same where a friction contact changes its state: its own memory, and that of the laws."""
        motion, c, i, phase = self._motion, self._combinations.contacts, change.contact, np.array([tau])
        laws, r, piece = motion.laws, self._combinations.dynamics.size, self._combinations(states[: self._nc])
        given, slopes, along = self._given(states), self._slopes(phase, states), self._along(phase, states)
        assert slopes is not None
        B, size = self._answered(states)[0], given.shape[1]
        moved = -B @ slopes[2][0]
        moved[:, : piece.motion.shape[1]] += piece.motion
        told = self._behind(phase, states, along[2])
        pushed = force_rate(laws, told.q, told.velocity, along[2], self._of(states), told.rates)[0] / motion.omega
        u = motion.harmonics.H_minus(phase) @ motion.harmonics.derivative(self._rubbing).T
        rates = self._without_laws(phase, states)[1][0] @ piece.relative.T - B @ pushed + u[0]
        x, y = c.tangential[i], c.normal[i]
        sliding = (rates[x] if x >= 0 else 0.0) + float(motion.values["v"][i])
        closing = rates[y] if y >= 0 else float(motion.Y[i] @ slope_at(motion.harmonics.m, tau))
        remembered = size - laws.n_memory + np.arange(laws.n_memory)
        out = np.eye(size)[[2 * r + i, *remembered]]
        out[0] = starts.row(change, states[: self._nc], moved, (sliding, closing)) if change.state == STICK else 0.0
        margin, slope = np.zeros(size), 0.0
        if y >= 0:
            margin, slope = moved[y], closing
        if SEPARATION not in (change.origin, change.state):
            way = 1.0 if change.state == SLIP_PLUS else -1.0
            limit = float(c.mu[i] * c.kn[i])
            margin, slope = limit * margin, limit * closing - way * float(c.kt[i]) * sliding
            if x >= 0:
                margin = margin - way * c.kt[i] * moved[x]
                margin[2 * r + i] -= way
        if change.state != STICK or change.origin == SEPARATION:  # where slip ends, nothing jumps
            jump = self._jump(change, phase, states, along[2], along[2])[1]
            if slope != 0.0:
                out[1:] += np.outer(jump, margin) / (motion.omega * slope)
        return np.array([2 * r + i, *remembered]), out


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
