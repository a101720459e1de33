"""Contacts whose law switches where the structure answers their forces at once (a static residual).

The ports move by ``q = q0 - R F(q, m)``, with ``q0`` what the coordinates of the structure and the loads make of it
and R the residual; their velocity is ``v = v0 - R (F_q q' + F_m m')``, with the rate ``m'(q, v, m)`` of the memory.
Forces are linear in the motion and rates in the velocity (``Regimes``), so that each is one linear system. Forces are
continuous where a regime begins, their rates are not: motion goes on there, and velocities jump.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipstick.analysis.time_domain.law_in_time import LawsInTime, RegimeNumbers
from slipstick.typing import Array


class Behind(NamedTuple):
    """Motion and velocity (k, P) at the ports, forces there (k, P) and rates of the memory (k, m)."""

    q: Array
    velocity: Array
    forces: Array
    rates: Array


def motion_behind(laws: LawsInTime, R: Array, q0: Array, v0: Array, memory: Array, regimes: RegimeNumbers) -> Behind:
    """From motion and velocity without the forces; constant velocities are included."""
    P, one = laws.n_ports, np.eye(laws.n_ports)
    force, slopes = laws.force_slopes(q0, memory, regimes)
    q = q0 - _solved(one + R @ slopes[:, :, :P], force @ R.T)
    force, rate, slopes = laws.linearised(q, v0, memory, regimes)
    by_motion, by_memory, by_velocity = slopes[:, :P, :P], slopes[:, :P, 2 * P :], slopes[:, P:, P : 2 * P]
    force_rate = _times(by_motion, v0 - laws.drift) + _times(by_memory, rate)
    change = -_solved(one + R @ (by_motion + by_memory @ by_velocity), force_rate @ R.T)
    return Behind(q, v0 + change, force, rate + _times(by_velocity, change))


def force_rate(
    laws: LawsInTime, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers, memory_rate: Array
) -> Array:
    """Rates of the forces (k, P), per unit of time."""
    P = laws.n_ports
    _, slopes = laws.force_slopes(q, memory, regimes)
    return _times(slopes[:, :, :P], velocity - laws.drift) + _times(slopes[:, :, P:], memory_rate)


def slopes_behind(
    laws: LawsInTime, R: Array, q: Array, velocity: Array, memory: Array, regimes: RegimeNumbers
) -> tuple[Array, Array, Array, Array, Array]:
    """Derivatives by q0, v0 and memory (k, ..., 2 P + m).

    Of motion, velocity, forces, rates of the memory and rates of the forces (these of laws that switch alone), at
    motion and velocity of ``motion_behind``.
    """
    P, m, k = laws.n_ports, laws.n_memory, len(q)
    _, rate, own = laws.linearised(q, velocity, memory, regimes)
    further = laws.force_rate_slopes(q, velocity, memory, regimes, rate)
    (F_q, F_v, F_m), (M_q, M_v, M_m) = (np.split(part, [P, 2 * P], axis=2) for part in (own[:, :P], own[:, P:]))
    one = np.eye(P)
    given = np.broadcast_to(np.eye(2 * P + m), (k, 2 * P + m, 2 * P + m))
    q0, v0, dm = given[:, :P], given[:, P : 2 * P], given[:, 2 * P :]
    dq = np.asarray(np.linalg.solve(one + R @ F_q, q0 - R @ F_m @ dm), dtype=float)
    turned = further[:, :, :P] @ dq + further[:, :, P:] @ dm
    rest = turned + F_m @ (M_q @ dq + M_m @ dm)
    dv = np.asarray(np.linalg.solve(one + R @ (F_q + F_m @ M_v), v0 - R @ rest), dtype=float)
    d_rate = M_q @ dq + M_v @ dv + M_m @ dm
    return dq, dv, F_q @ dq + F_v @ dv + F_m @ dm, d_rate, turned + F_q @ dv + F_m @ d_rate


def _times(matrices: Array, vectors: Array) -> Array:
    """(k, a, b) times (k, b)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def _solved(matrices: Array, vectors: Array) -> Array:
    """(k, a, a) and (k, a)."""
    return np.asarray(np.linalg.solve(matrices, vectors[:, :, None])[:, :, 0])
