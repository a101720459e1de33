"""The monodromy matrix, as a product over intervals of constant contact states (THEORY.md section 13).

The friction system linearised about a periodic solution has constant coefficients in each of these intervals, and the
memory of a friction spring begins anew with each stick. The eigenvalues of the product over one period are the Floquet
multipliers. Three products follow: of friction alone, with other laws that vary along the motion, and with other laws
that stick on a spring.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from scipy.linalg.lapack import dgeev

from slipstick.analysis.stability.laws_along import LawsAlong
from slipstick.analysis.stability.linear_systems import Combinations
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.state_sequence import StateInterval, StickStarts, Timeline
from slipstick.analysis.time_domain.law_in_time import LawsInTime
from slipstick.contact.kernel.tuples import STICK
from slipstick.contact.law import Interval, Motion
from slipstick.trig.basis import TWO_PI
from slipstick.trig.compiled import compiled
from slipstick.typing import AnyArray, Array, ComplexArray, IntArray

_MOST_STEPS = 1e6
"""Bound on rate times period: with more, steps would take minutes, and nothing is computed."""

TAYLOR_REACH = 5.0
"""Bound on rate times length of a step of the Taylor series: a longer one would lose digits to cancellation."""

_TAYLOR_ROUNDING, _TAYLOR_TERMS = 1e-13, 60
"""The series ends where the sum of two terms over the size is smaller, or after so many terms."""

_FEWEST_STEPS, _STEPS_PER_ORDER = 48, 3
"""Steps a period of the Magnus method, by the highest harmonic of the motion."""

_NODES = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])
"""Gauss nodes of a step of the Magnus method, (3,)."""

_SHORTEST_STEP = 1e-6
"""Length (rad) of the steps next to a steep time; shorter ones bring no accuracy."""

_BEFORE_CHANGE = 1e-9
"""Phase before a change of state at which the law has the slopes of the state that ends."""

_SIDES = {"slip+": 1.0, "slip-": -1.0}
"""Signs of the states of slip."""


@dataclass(frozen=True)
class Monodromy:
    """The map of a disturbance over one period, and the coordinates that it maps."""

    matrix: Array
    """(k, k): modes' motion, velocities over ``Combinations.scale``, memories of contacts stuck at the cut."""
    memories: tuple[int, ...]
    """Contacts whose memory is among the coordinates."""
    sound: bool
    """Whether the contact forces determine the motion in every combination, see ``LinearisedStates.sound``."""

    @property
    def multipliers(self) -> ComplexArray:
        """Eigenvalues, the largest first."""
        return multipliers_of(self.matrix)


def multipliers_of(matrix: Array) -> ComplexArray:
    """Eigenvalues (k,) of a map of disturbances over one period, the largest first; LinAlgError if not finite."""
    if not matrix.size:
        return np.zeros(0, dtype=complex)
    if not isfinite(matrix.sum()):
        raise np.linalg.LinAlgError("the map of disturbances is not finite")
    real, imaginary, *_, failed = dgeev(matrix, compute_vl=0, compute_vr=0)  # a fifth of the time of numpy's
    if failed:
        raise np.linalg.LinAlgError("the eigenvalues of the map of disturbances did not converge")
    return _largest_first(real + 1j * imaginary)


def multipliers_of_each(matrices: Sequence[Array]) -> list[ComplexArray]:
    """As ``multipliers_of``, of several maps."""
    if len({len(matrix) for matrix in matrices}) == 1:  # as most are: together
        return [_largest_first(one) for one in np.linalg.eigvals(np.array(matrices))]
    return [multipliers_of(matrix) for matrix in matrices]


def _largest_first(multipliers: AnyArray) -> ComplexArray:
    multipliers = multipliers.astype(complex)
    return np.asarray(multipliers[np.lexsort((-multipliers.imag, -np.abs(multipliers).round(12)))])


def _memories(line: Timeline, count: int) -> tuple[int, ...]:
    """Friction contacts stuck where the period is cut, but not all period: their memory may vary."""
    return tuple(i for i, state in enumerate(line.cut[:count]) if state == STICK and i in line.changing)


def _unit(size: int, r: int, memories: Sequence[int]) -> tuple[list[int], Array]:
    """Rows of the k coordinates of a monodromy matrix among all, and unit disturbances of each (size, k).

    All of the 2 r motions and velocities are coordinates, and the memories behind them with the given numbers.
    """
    rows = [*range(2 * r), *(2 * r + i for i in memories)]
    Phi = np.zeros((size, len(rows)))
    Phi[rows, range(len(rows))] = 1.0
    return rows, Phi


def monodromy(line: Timeline, starts: StickStarts, combinations: Combinations, omega: float) -> Monodromy | None:
    """The product over all intervals of a period (THEORY.md (13.4)); None where it would take minutes."""
    r, n = combinations.dynamics.size, combinations.contacts.count
    memories = _memories(line, n)
    known = tuple(dict.fromkeys(interval.states for interval in line.intervals))
    forces, rates, sound = combinations.of_each(known)
    if not rates.max() * 2.0 * np.pi / omega < _MOST_STEPS:
        return None
    places, Phi = _unit(2 * r + n, r, memories)
    number = {states: k for k, states in enumerate(known)}
    rows = [_start(interval, starts) for interval in line.intervals]
    propagate(
        Phi, combinations.scale, forces, rates,
        np.array([number[interval.states] for interval in line.intervals]),
        np.array([interval.length for interval in line.intervals]) / omega,
        np.array([target for target, _ in rows]),
        np.array([np.zeros(len(Phi)) if row is None else row for _, row in rows]),
    )  # fmt: skip
    return Monodromy(Phi[places], memories, sound)


def monodromy_with_laws(
    line: Timeline, starts: StickStarts, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray
) -> Monodromy | None:
    """The product with contacts of other laws, whose stiffness and damping vary along the motion.

    They have no memory, or their laws switch: then their memory is among the coordinates too. Each interval is taken in
    steps of the sixth-order Magnus method [Blanes, Casas, Oteo, Ros, Physics Reports 470 (2009) 151, section 5.4]. None
    where the structure answers at once the forces of laws that do not switch, unless these are springs and act alone.
    """
    d, omega, laws, nc = combinations.dynamics, motion.omega, motion.laws, combinations.contacts.count
    laws_along = LawsAlong.of(combinations, motion, law_ports)
    if laws_along is None:
        return None
    r, n, m = d.size, combinations.contacts.count, laws.n_memory
    memories, first = _memories(line, nc), line.intervals[0]
    which = [
        k for k, own in enumerate(laws.switching)
        if nc + k in line.changing or line.cut[nc + k] not in own.regimes.neutral
    ]  # fmt: skip
    remembered = laws.remembered(line.cut[nc:], which)
    places, Phi = _unit(2 * r + n + m, r, [*memories, *(n + i for i in remembered)])
    begin = 0.0 if first.change is None else first.change.time - first.length
    longest, sound = _longest_step(motion), True
    steep = _steep_times(line, laws, nc)
    for interval in line.intervals:
        friction = interval.states[:nc]
        steps, tau = _gauss_nodes(_step_ends(begin, begin + interval.length, longest, steep))
        piece = combinations(friction)
        A = np.zeros((len(tau), 2 * r + n + m, 2 * r + n + m))
        A[:, :r, r : 2 * r] = combinations.scale * np.eye(r)
        A[:, r : 2 * r, : 2 * r + n] = -piece.forces
        if not laws_along.add_to(A, tau, interval.states):
            return None
        Phi = _carried(Phi, A, steps / omega)
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
    return Monodromy(Phi[places], memories, sound)


def _steep_times(line: Timeline, laws: LawsInTime, nc: int) -> list[float]:
    """Times at which contacts whose law switches touch or part: the rate of their memory is unbounded there."""
    changes = [interval.change for interval in line.intervals if interval.change is not None]
    return [
        c.time for c in changes
        if c.contact >= nc and 0 in (laws.switching[c.contact - nc].regimes.memory_used[s] for s in (c.state, c.origin))
    ]  # fmt: skip


def _step_ends(begin: float, end: float, longest: float, steep: Sequence[float] = ()) -> Array:
    """Ends of steps from ``begin`` to ``end`` (rad), which shorten towards steep times."""
    if not steep:
        return np.linspace(begin, end, max(1, int(np.ceil((end - begin) / longest))) + 1)
    every = np.array([t + turn for t in steep for turn in (-TWO_PI, 0.0, TWO_PI, 2.0 * TWO_PI)])
    ends = [begin]
    while ends[-1] < end:
        distance = every - ends[-1]
        is_ahead = distance > _SHORTEST_STEP
        ahead, behind = distance[is_ahead].min(initial=np.inf), -distance[~is_ahead].max(initial=-np.inf)
        step = min(longest, max(0.5 * behind, _SHORTEST_STEP), max(ahead / 3.0, _SHORTEST_STEP), end - ends[-1])
        ends.append(ends[-1] + step if end - ends[-1] - step > 1e-12 else end)
    return np.array(ends)


def monodromy_stick_slip(combinations: Combinations, motion: SmoothMotion, law_ports: IntArray) -> Monodromy | None:
    """The product with laws that stick on a spring and whose slip has no memory; None for all others.

    Such a law gives its ``smooth_states``, a memory of steady sliding (``Law.memory_in_sliding``) and the spring of its
    first port. In a stick the force is ``kt w + e``, with a constant e for each stick; in slip it follows motion and
    velocity. Between changes of state the linearised system is smooth, and nothing stiff is integrated.

    Where a stick begins, e takes the value ``f - kt w`` of the slip before. That value is stationary there, so a shift
    in time changes nothing [R. I. Leine and H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems
    (2004), section 8.2: a saltation matrix that projects]. The exception is a corner of the law, where its rate jumps
    to zero at a velocity that a disturbance reaches earlier or later.

    Coordinates are disturbances of motion and velocity (time is not scaled), then of e.
    """
    laws, d, omega = motion.laws, combinations.dynamics, motion.omega
    if combinations.contacts.count or len(laws.each) != 1 or np.any(d.R[law_ports]) or np.any(d.R[:, law_ports]):
        return None
    law = laws.each[0][0]
    p, n_memory, n = law.shape
    values = {name: value[:, 0] for name, value in law.values.items()}
    ports = tuple(motion.law_motion.reshape(p, n, -1))
    states = law.law.smooth_states(Motion(motion.harmonics, omega, ports, motion.law_drift.reshape(p, n)), values)
    if states is None or n_memory != 1 or 0 not in law.law.stiffness_names:
        return None
    kt, P, r = values[law.law.stiffness_names[0]], laws.n_ports, d.size
    there = (law_ports >= 0).astype(float)
    rows, columns = d.rows[law_ports] * there[:, None], d.columns[:, law_ports] * there

    def slopes(tau: Array, now: list[str]) -> tuple[Array, Array]:
        """Derivatives (k, P, P) of the forces by motion and velocity at phases; those of sticks are the spring's."""
        q, velocity = motion.law_arguments(tau)
        side = np.array([_SIDES.get(state, 0.0) for state in now])
        by_port = laws.slopes(q, velocity, side * np.abs(laws.memory_in_sliding(q, velocity)))
        K, C = by_port[:, :P, :P].copy(), by_port[:, :P, P : 2 * P].copy()
        for e, state in enumerate(now):
            if state not in _SIDES:
                K[:, e], C[:, e] = 0.0, 0.0
                K[:, e, e] = kt[e] * (state == "stick")
        return K, C

    edges = np.array(sorted({start % (2.0 * np.pi) for one in states for start, _, _ in one}))
    changing = [any(state != "stick" for _, _, state in one) for one in states]
    memories = tuple(e for e, one in enumerate(states) if changing[e] and _state(one, edges[0] + 1e-12) == "stick")
    places, Phi = _unit(2 * r + n, r, memories)
    longest = _longest_step(motion)
    spans = list(zip(edges, [*edges[1:], edges[0] + 2.0 * np.pi], strict=True))
    middle = [[_state(one, 0.5 * (a + b)) for one in states] for a, b in spans]
    for i, (a, b) in enumerate(spans):
        now, after = middle[i], middle[(i + 1) % len(spans)]
        steps, tau = _gauss_nodes(_step_ends(a, b, longest))
        K, C = slopes(tau, now)
        A = np.zeros((len(tau), 2 * r + n, 2 * r + n))
        A[:, :r, r : 2 * r] = np.eye(r)
        A[:, r : 2 * r, :r] = -d.K - columns @ K @ rows
        A[:, r : 2 * r, r : 2 * r] = -d.C - columns @ C @ rows
        for e, state in enumerate(now):
            if state == "stick":
                A[:, r : 2 * r, 2 * r + e] = -columns[:, e]
        Phi = _carried(Phi, A, steps / omega)
        K, C = (part[0] for part in slopes(np.array([b - _BEFORE_CHANGE]), now))
        _, (velocity,) = motion.law_arguments(np.array([b]))
        (acceleration,) = motion.law_acceleration(np.array([b]))
        for e in range(n):
            if after[e] == "stick" and now[e] != "stick":
                begun = -kt[e] * rows[e] @ Phi[:r]
                if now[e] in _SIDES:
                    by_motion, by_velocity = rows @ Phi[:r], rows @ Phi[r : 2 * r]
                    begun += K[e] @ by_motion + C[e] @ by_velocity
                    rate = K[e] @ velocity + C[e] @ acceleration - kt[e] * velocity[e]
                    begun -= rate / acceleration[e] * by_velocity[e]
                else:
                    begun += kt[e] * velocity[e] / velocity[n + e] * rows[n + e] @ Phi[:r]
                Phi[2 * r + e] = begun
            elif now[e] == "stick" and after[e] != "stick":
                Phi[2 * r + e] = 0.0
    return Monodromy(Phi[places], memories, sound=True)


def _state(intervals: list[Interval], tau: float) -> str:
    """The state at a phase."""
    for start, end, state in intervals:
        if (tau - start) % (2.0 * np.pi) <= end - start:
            return state
    return intervals[-1][2]


def _longest_step(motion: SmoothMotion) -> float:
    """The longest step (rad) of the Magnus method along a motion."""
    return float(TWO_PI / max(_FEWEST_STEPS, _STEPS_PER_ORDER * motion.harmonics.highest))


def _gauss_nodes(ends: Array) -> tuple[Array, Array]:
    """Lengths (k,) of the steps between ends (k + 1,), and the phases (3 k,) of their Gauss nodes."""
    steps = np.diff(ends)
    return steps, (ends[:-1, None] + steps[:, None] * _NODES).reshape(-1)


def _carried(Phi: Array, A: Array, steps: Array) -> Array:
    """``Phi`` after steps (k,) of time with the matrices (3 k, N, N) at their Gauss nodes."""
    for factor in _magnus(A.reshape(len(steps), len(_NODES), *A.shape[1:]), steps):
        Phi = factor @ Phi
    return Phi


def _magnus(A: Array, steps: Array) -> Array:
    """Propagators (k, N, N) of steps (k,) from the matrices (k, 3, N, N) at their Gauss nodes."""
    from scipy.linalg import expm

    h = steps[:, None, None]
    a, b = h * A[:, 1], h * np.sqrt(15.0) / 3.0 * (A[:, 2] - A[:, 0])
    c = h * 10.0 / 3.0 * (A[:, 2] - 2.0 * A[:, 1] + A[:, 0])
    first = a @ b - b @ a
    second = 2.0 * c + first
    second = -(a @ second - second @ a) / 60.0
    left, right = -20.0 * a - c + first, b + second
    return np.asarray(expm(a + c / 12.0 + (left @ right - right @ left) / 240.0))


def _start(interval: StateInterval, starts: StickStarts) -> tuple[int, Array | None]:
    """The contact whose memory changes at the end of an interval, and the row that gives it; None where it is zero."""
    change = interval.change
    if change is None:
        return -1, None
    if change.state == STICK:
        return change.contact, starts.row(change, interval.states)
    return change.contact, None


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
        steps = max(1, int(np.ceil(rates[which[i]] * lengths[i] / TAYLOR_REACH)))
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
    for k in range(1, _TAYLOR_TERMS):
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
        if largest + last <= _TAYLOR_ROUNDING * size:
            break
        last = largest
