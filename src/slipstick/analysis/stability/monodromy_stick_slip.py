"""The monodromy matrix with laws that stick on a spring, and whose slip has no memory.

Such a law tells its ``states``, a memory of steady sliding (``Law.memory_in_sliding``) and the spring of its first
port. In a stick the force is ``kt w + e`` with a constant e that begins anew with each stick, in slip it follows
motion and velocity: between changes of state the linearised system is smooth, and nothing stiff is integrated.
"""

from __future__ import annotations

import numpy as np

from slipstick.analysis.stability.monodromy import _FEWEST_STEPS, _NODES, _STEPS_PER_ORDER, Monodromy, _magnus
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.switched_system import Combinations
from slipstick.contact.law import Interval, Motion
from slipstick.typing import Array, IntArray

_SIDES = {"slip+": 1.0, "slip-": -1.0}
_AT_REST, _BACK, _SMOOTH = 1e-6, 1e-5, 1e-2
"""Velocity over its largest at which a slip reverses; phase before a stick, and the share of the spring's rate by which
the slip before may miss it: more is a corner of the law, which moves with a disturbance."""


def monodromy_stick_slip(combinations: Combinations, motion: SmoothMotion, law_ports: IntArray) -> Monodromy | None:
    """The product over the intervals of all contacts; None for contacts of which it is not known."""
    laws, d, omega = motion.laws, combinations.dynamics, motion.omega
    if combinations.contacts.count or len(laws.each) != 1 or np.any(d.R[law_ports]) or np.any(d.R[:, law_ports]):
        return None
    law = laws.each[0][0]
    p, memories, n = law.shape
    values = {name: value[:, 0] for name, value in law.values.items()}
    ports = tuple(motion.law_motion.reshape(p, n, -1))
    states = law.law.states(Motion(motion.harmonics, omega, ports, motion.law_drift.reshape(p, n)), values)
    if states is None or memories != 1 or 0 not in law.law.stiffness_names:
        return None
    kt, P, r = values[law.law.stiffness_names[0]], laws.n_ports, d.size
    there = (law_ports >= 0).astype(float)
    rows, columns = d.rows[law_ports] * there[:, None], d.columns[:, law_ports] * there

    def slopes(tau: Array, now: list[str]) -> tuple[Array, Array]:
        """Derivatives (k, P, P) of the forces by motion and velocity at phases; those of sticks are the spring's."""
        q, velocity = motion.law_arguments(tau)
        side = np.array([_SIDES.get(state, 0.0) for state in now])
        told = laws.slopes(q, velocity, side * np.abs(laws.memory_in_sliding(q, velocity)))
        K, C = told[:, :P, :P].copy(), told[:, :P, P : 2 * P].copy()
        for e, state in enumerate(now):
            if state not in _SIDES:
                K[:, e], C[:, e] = 0.0, 0.0
                K[:, e, e] = kt[e] * (state == "stick")
        return K, C

    edges = np.array(sorted({start % (2.0 * np.pi) for one in states for start, _, _ in one}))
    kept = tuple(e for e, one in enumerate(states) if len(one) > 1 and _state(one, edges[0] + 1e-12) == "stick")
    places = [*range(2 * r), *(2 * r + e for e in kept)]
    Phi = np.zeros((2 * r + n, len(places)))
    Phi[places, range(len(places))] = 1.0
    longest = 2.0 * np.pi / max(_FEWEST_STEPS, _STEPS_PER_ORDER * motion.harmonics.highest)
    spans = list(zip(edges, [*edges[1:], edges[0] + 2.0 * np.pi], strict=True))
    middle = [[_state(one, 0.5 * (a + b)) for one in states] for a, b in spans]
    for i, (a, b) in enumerate(spans):
        now, after = middle[i], middle[(i + 1) % len(spans)]
        count = max(1, int(np.ceil((b - a) / longest)))
        step = (b - a) / count
        tau = a + step * (np.arange(count)[:, None] + _NODES)
        K, C = slopes(tau.reshape(-1), now)
        A = np.zeros((count * len(_NODES), 2 * r + n, 2 * r + n))
        A[:, :r, r : 2 * r] = np.eye(r)
        A[:, r : 2 * r, :r] = -d.K - columns @ K @ rows
        A[:, r : 2 * r, r : 2 * r] = -d.C - columns @ C @ rows
        for e, state in enumerate(now):
            if state == "stick":
                A[:, r : 2 * r, 2 * r + e] = -columns[:, e]
        for factor in _magnus(A.reshape(count, len(_NODES), 2 * r + n, -1), np.full(count, step / omega)):
            Phi = factor @ Phi
        q, velocity = motion.law_arguments(np.array([b - _BACK, b]))
        K, C = (part[0] for part in slopes(np.array([b]), now))
        forces = [f[:, 0] for f in _forces(law, q, velocity, now, laws)]
        for e in range(n):
            if after[e] == "stick" and now[e] != "stick":
                begun = -kt[e] * rows[e] @ Phi[:r]
                if now[e] in _SIDES:
                    begun += K[e] @ rows @ Phi[:r]
                    reversing = abs(velocity[1, e]) <= _AT_REST * np.abs(motion.law_arguments(edges)[1][:, e]).max()
                    if not reversing:
                        begun += C[e] @ rows @ Phi[r : 2 * r]
                        moved = kt[e] * (q[1, e] - q[0, e] + motion.law_drift[e] * _BACK)
                        if abs(moved - (forces[1][e] - forces[0][e])) > _SMOOTH * (abs(moved) + 1e-300):
                            return None
                else:
                    begun += kt[e] * velocity[1, e] / velocity[1, n + e] * rows[n + e] @ Phi[:r]
                Phi[2 * r + e] = begun
            elif now[e] == "stick" and after[e] != "stick":
                Phi[2 * r + e] = 0.0
    return Monodromy(Phi[places], kept, sound=True)


def _forces(law, q: Array, velocity: Array, now: list[str], laws) -> list[Array]:  # type: ignore[no-untyped-def]
    """Forces of slip (2 instants) as (n_elements, 1) each."""
    side = np.array([_SIDES.get(state, 0.0) for state in now])
    told = laws.rate(q, velocity, side * np.abs(laws.memory_in_sliding(q, velocity)))[0]
    return [row[: law.shape[2], None] for row in told]


def _state(intervals: list[Interval], tau: float) -> str:
    """The state at a phase."""
    for start, end, state in intervals:
        if (tau - start) % (2.0 * np.pi) <= end - start:
            return state
    return intervals[-1][2]
