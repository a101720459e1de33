"""The monodromy matrix with laws that stick on a spring, and whose slip has no memory.

Such a law tells its ``smooth_states``, a memory of steady sliding (``Law.memory_in_sliding``) and the spring of its
first port. In a stick the force is ``kt w + e`` with a constant e that begins anew with each stick, in slip it follows
motion and velocity: between changes of state the linearised system is smooth, and nothing stiff is integrated.

Where a stick begins, e takes the value ``f - kt w`` of the slip before. That value is stationary there, so a shift in
time changes nothing [R. I. Leine and H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004),
section 8.2: a saltation matrix that projects]; but for a corner of the law, where its rate jumps to zero at a velocity
that a disturbance reaches earlier or later.
"""

from __future__ import annotations

import numpy as np

from slipstick.analysis.stability.monodromy import _FEWEST_STEPS, _NODES, _STEPS_PER_ORDER, Monodromy, _magnus
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.switched_system import Combinations
from slipstick.contact.law import Interval, Motion
from slipstick.typing import Array, IntArray

_SIDES = {"slip+": 1.0, "slip-": -1.0}
_BEFORE = 1e-9
"""Phase before a change of state at which the law has the slopes of the state that ends."""


def monodromy_stick_slip(combinations: Combinations, motion: SmoothMotion, law_ports: IntArray) -> Monodromy | None:
    """The product over the intervals of all contacts; None for contacts of which it is not known.

    Disturbances of motion and velocity (time is not scaled), then of e.
    """
    laws, d, omega = motion.laws, combinations.dynamics, motion.omega
    if combinations.contacts.count or len(laws.each) != 1 or np.any(d.R[law_ports]) or np.any(d.R[:, law_ports]):
        return None
    law = laws.each[0][0]
    p, memories, n = law.shape
    values = {name: value[:, 0] for name, value in law.values.items()}
    ports = tuple(motion.law_motion.reshape(p, n, -1))
    states = law.law.smooth_states(Motion(motion.harmonics, omega, ports, motion.law_drift.reshape(p, n)), values)
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
    changing = [any(state != "stick" for _, _, state in one) for one in states]
    kept = tuple(e for e, one in enumerate(states) if changing[e] and _state(one, edges[0] + 1e-12) == "stick")
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
        K, C = (part[0] for part in slopes(np.array([b - _BEFORE]), now))
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
    return Monodromy(Phi[places], kept, sound=True)


def _state(intervals: list[Interval], tau: float) -> str:
    """The state at a phase."""
    for start, end, state in intervals:
        if (tau - start) % (2.0 * np.pi) <= end - start:
            return state
    return intervals[-1][2]
