"""Contacts of other laws linearised along a motion: what they add between changes of state, and the map at a change."""

from __future__ import annotations

import numpy as np

from slipstick.analysis.stability.linear_systems import Combinations, StateCodes
from slipstick.analysis.stability.refined_motion import SmoothMotion
from slipstick.analysis.stability.state_sequence import Change, StickStarts, slope_at
from slipstick.analysis.time_domain.law_in_time import PortMotion, RegimeNumbers, force_rate, port_motion, port_slopes
from slipstick.contact.friction_law import friction_in_time
from slipstick.contact.kernel.tuples import SEPARATION, SLIP_PLUS, STICK
from slipstick.contact.law import Motion
from slipstick.typing import Array, IntArray

VELOCITIES_JUMP = (
    "stability: a law of motion and velocity acts on a static residual of the structure; "
    "give the structure more modes and no residual"
)


class LawsAlong:
    """Contacts of other laws linearised along a motion, in the coordinates of ``monodromy_with_laws``.

    Where the structure answers their forces at once, velocities jump with the states. They follow by ``port_motion``
    from the motion of the modes, which is smooth.
    """

    def __init__(self, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray, at_once: bool) -> None:
        self._combinations, self._motion, self.at_once = combinations, motion, at_once
        d, c, there = combinations.dynamics, combinations.contacts, law_ports >= 0
        self._nc, self._ports = c.count, np.zeros((len(d.R), len(law_ports)))
        """Selects the ports of the laws among all, (n_ports, P)."""
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
        """Part of the motion that modes and loads make."""

    @classmethod
    def of(cls, combinations: Combinations, motion: SmoothMotion, law_ports: IntArray) -> LawsAlong | None:
        """None where the structure answers their forces at once and the velocities are not known."""
        R, ports, switching = combinations.dynamics.R, law_ports[law_ports >= 0], len(motion.laws.switching)
        at_once = bool(np.any(R[ports]) or np.any(R[:, ports]))
        if at_once and switching < motion.laws.count and (switching or combinations.contacts.count):
            return None
        return cls(combinations, motion, law_ports, at_once)

    def _compliance(self, states: StateCodes) -> tuple[Array, Array]:
        """Static compliance ``B`` (n_ports, P), all ports moving by ``-B F``; its rows at the ports of the laws."""
        piece = self._combinations(states[: self._nc])
        B = piece.relative @ self._combinations.dynamics.R @ self._ports
        return B, self._ports.T @ B

    def _port_rows(self, states: StateCodes) -> Array:
        """Rows (2 P + m, size): motion and velocity at the ports without the forces of the laws, and the memory."""
        combinations, m = self._combinations, self._motion.laws.n_memory
        r, rows = combinations.dynamics.size, self._ports.T @ combinations(states[: self._nc]).motion
        P, free = rows.shape
        out = np.zeros((2 * P + m, free + m))
        out[:P, :free], out[P : 2 * P, r : 2 * r] = rows, combinations.scale * rows[:, :r]
        out[2 * P :, free:] = np.eye(m)
        return out

    def _slopes(self, tau: Array, states: StateCodes) -> tuple[Array, ...] | None:
        """Derivatives of motion, velocity, forces and rates of the memory by the coordinates; None: not known."""
        laws, given, regimes = self._motion.laws, self._port_rows(states), self._regimes(states)
        motion, P = self._port_state(tau, states), laws.n_ports
        if self.at_once and not laws.switching and np.any(laws.slopes(*motion, regimes)[:, :P, P:]):
            return None
        residual = self._compliance(states)[1] if self.at_once else None
        return port_slopes(laws, residual, given, *motion, regimes)[:4]

    def _regimes(self, states: StateCodes) -> RegimeNumbers:
        return tuple(states[self._nc :])

    def add_to(self, A: Array, tau: Array, states: StateCodes) -> bool:
        """Adds the laws to the linear system (k, size, size) at phases (k,); False where they are not known."""
        d, scale, m = self._combinations.dynamics, self._combinations.scale, self._motion.laws.n_memory
        slopes = self._slopes(tau, states)
        if slopes is None:
            return False
        _, _, force, rate = slopes
        columns = d.columns @ (self._ports - self._combinations(states[: self._nc]).D @ self._compliance(states)[0])
        A[:, d.size : 2 * d.size] -= columns @ force / scale
        if m:
            A[:, -m:] += rate
        return True

    def _port_state(self, tau: Array, states: StateCodes) -> tuple[Array, Array, Array]:
        """Motion and velocity (k, P) and memory (k, m) at phases, in these states."""
        q, velocity = self._motion.law_arguments(tau)
        memory = self._memory(tau, self._regimes(states), q, velocity)
        if self.at_once and self._motion.laws.switching:
            at_ports = self._port_motion(tau, states, memory)
            return at_ports.q, at_ports.velocity, memory
        return q, velocity, memory

    def _port_motion(self, tau: Array, states: StateCodes, memory: Array) -> PortMotion:
        motion, H = self._motion, self._motion.harmonics.H_minus(tau)
        relative = self._ports.T @ self._combinations(states[: self._nc]).relative
        moved, rate = self._without_laws(tau, states)
        drift, slope = motion.law_drift, motion.harmonics.derivative(motion.law_rubbing)
        q0, v0 = moved @ relative.T + H @ motion.law_rubbing.T, motion.omega * (rate @ relative.T + H @ slope.T + drift)
        return port_motion(motion.laws, self._compliance(states)[1], q0, v0, memory, self._regimes(states))

    def _without_laws(self, tau: Array, states: StateCodes) -> tuple[Array, Array]:
        """``s + R D s`` (k, n_ports) of the ports' motion without forces of other laws, and its derivative by phase.

        Forces of friction contacts are ``D s`` and a part that does not follow the motion.
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
        """Memory (k, m) of the contacts at phases (k,); that of laws that switch follows from their forces there."""
        motion = self._motion
        out = motion.laws.memory_in_sliding(q, velocity)
        for law, ports, _, places in motion.laws.each:
            if law.law.regimes is None:
                continue
            values = {name: value[:, 0] for name, value in law.values.items()}
            forces = law.law.forces_in_time(motion.of_law(law, ports), values, tau)
            assert forces is not None
            for own in motion.laws.switching[places]:
                force = np.stack([port[own.element] for port in forces])[:, None]
                at = own.at(q, velocity, out)
                out[:, own.memory] = own.regimes.memory_of(regimes[places.start + own.element], force, at)[:, 0].T
        return out

    def reset(self, change: Change, tau: float, states: StateCodes) -> tuple[IntArray, Array]:
        """Rows of the memory that a change of regime resets, and their map from the coordinates before it.

        ``states`` are those before. The memory of the contact itself begins anew. Where velocities jump, the rates of
        all memories jump too, at an instant that the disturbance moves.
        """
        laws, given = self._motion.laws, self._port_rows(states)
        number, phase = change.contact - self._nc, np.array([tau])
        own, size = laws.switching[number], given.shape[1]
        motion, slopes = self._port_state(phase, states), self._slopes(phase, states)
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
        rates = self._port_motion(phase, states, before).rates[0]
        return rates, self._port_motion(phase, next_states, after).rates[0] - rates

    def friction_begins(
        self, change: Change, tau: float, states: StateCodes, starts: StickStarts
    ) -> tuple[IntArray, Array]:
        """As ``reset`` where a friction contact changes its state: its own memory, then that of the laws."""
        motion, c, i, phase = self._motion, self._combinations.contacts, change.contact, np.array([tau])
        laws, r, piece = motion.laws, self._combinations.dynamics.size, self._combinations(states[: self._nc])
        given, slopes, along = self._port_rows(states), self._slopes(phase, states), self._port_state(phase, states)
        assert slopes is not None
        B, size = self._compliance(states)[0], given.shape[1]
        moved = -B @ slopes[2][0]
        moved[:, : piece.motion.shape[1]] += piece.motion
        at_ports = self._port_motion(phase, states, along[2])
        pushed = (
            force_rate(laws, at_ports.q, at_ports.velocity, along[2], self._regimes(states), at_ports.rates)[0]
            / motion.omega
        )
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
