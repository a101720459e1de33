"""The Coulomb circle in time: stick, slip, separation, and the moment of contact with next to no load.

A spring kt in series with a slider whose force lies in the circle of radius ``b = mu kn (y - gap)``. While stuck the
force is ``kt w + e`` with the constant internal variables e. While slipping it is ``b (cos theta, sin theta)``, with
the angle as internal variable: ``theta' = kt w'.t / b``. That rate is unbounded where b = 0. So below ``SMALL`` of the
typical motion contact has only its normal force, with an error of the impulse of the order of the square of that.

No code is shared with the element of the balance, which is checked against this.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.law import TimeSlopes
from slipstick.contact.quasi_static import incremented
from slipstick.contact.regimes import InTime, Regimes
from slipstick.typing import Array, IntArray

SEPARATION, TOUCH, STICK, SLIP = range(4)
SMALL = 1e-8
"""Penetration over the typical motion below which friction is left out."""
_WITHIN = 1e-6
"""Distance from the circle, over its radius, within which a start slips."""


def _limit(at: InTime, normal: Array) -> Array:
    """Friction limit in slip: not below that of the penetration at which contacts open, whatever rounding leaves."""
    v = at.values
    return np.asarray(v["mu"] * np.maximum(normal, 0.5 * SMALL * at.length * v["kn"]))


class PlanarInTime(Regimes):
    """Two tangential ports and the normal one; parameters kt, mu, kn, gap."""

    names = ("separation", "separation", "stick", "slip")
    memory_used = (0, 0, 2, 1)
    angles = frozenset({SLIP})
    linear = frozenset({SEPARATION, TOUCH, STICK})
    neutral = frozenset({STICK})
    fastest = STICK

    def force_and_slopes(self, regime: int, at: InTime) -> tuple[Array, Array]:
        """Forces, and their derivatives by motion and memory."""
        v, forces, slopes = at.values, np.zeros_like(at.q), np.zeros((3, 5, *at.q.shape[1:]))
        if regime == SEPARATION:
            return forces, slopes
        forces[2], slopes[2, 2] = v["kn"] * (at.q[2] - v["gap"]), v["kn"]
        if regime == STICK:
            forces[:2] = v["kt"] * at.q[:2] + at.memory
            for i in (0, 1):
                slopes[i, i], slopes[i, 3 + i] = v["kt"], 1.0
        elif regime == SLIP:
            limit, c, s = v["mu"] * v["kn"], np.cos(at.memory[0]), np.sin(at.memory[0])
            forces[0], forces[1] = v["mu"] * forces[2] * c, v["mu"] * forces[2] * s
            slopes[0, 2], slopes[0, 3], slopes[1, 2], slopes[1, 3] = limit * c, -forces[1], limit * s, forces[0]
        return forces, slopes

    def rate(self, regime: int, at: InTime) -> tuple[Array, Array]:
        """Forces and rates of the internal variables."""
        forces = self.force_and_slopes(regime, at)[0]
        return forces, self._memory_rate(regime, at, forces)

    @staticmethod
    def _memory_rate(regime: int, at: InTime, forces: Array) -> Array:
        rates, v = np.zeros_like(at.memory), at.values
        if regime == STICK:
            rates[:] = v["kt"] * at.drift[:2]
        elif regime == SLIP:
            c, s = np.cos(at.memory[0]), np.sin(at.memory[0])
            rates[0] = v["kt"] * (at.velocity[1] * c - at.velocity[0] * s) / _limit(at, forces[2])
        return rates

    def slopes(self, regime: int, at: InTime) -> TimeSlopes:
        """Derivatives of ``rate``."""
        out, v = np.zeros((5, 8, *at.q.shape[1:])), at.values
        forces, by_force = self.force_and_slopes(regime, at)
        rates = self._memory_rate(regime, at, forces)
        out[:3, :3], out[:3, 6:] = by_force[:, :3], by_force[:, 3:]
        if regime == SLIP:
            b, c, s = _limit(at, forces[2]), np.cos(at.memory[0]), np.sin(at.memory[0])
            over = v["kt"] / b
            out[3, 3], out[3, 4], out[3, 2] = -over * s, over * c, -rates[0] * v["mu"] * v["kn"] / b
            out[3, 6] = -over * (at.velocity[0] * c + at.velocity[1] * s)
        return TimeSlopes(out, forces, rates)

    def force_rate_slopes(self, regime: int, at: InTime, memory_rate: Array) -> Array:
        """Derivatives of the forces' rates by motion and internal variables, at given rates of both."""
        out, v = np.zeros((3, 5, *at.q.shape[1:])), at.values
        if regime == SLIP:
            limit, c, s = v["mu"] * v["kn"], np.cos(at.memory[0]), np.sin(at.memory[0])
            y, closing, turning = at.q[2] - v["gap"], at.velocity[2] - at.drift[2], memory_rate[0]
            out[0, 2], out[0, 3] = -limit * s * turning, -limit * (closing * s + y * c * turning)
            out[1, 2], out[1, 3] = limit * c * turning, limit * (closing * c - y * s * turning)
        return out

    def relaxation(self, regime: int, at: InTime) -> Array:
        """Relaxation of the angle towards the direction of the velocity."""
        if regime != SLIP:
            return np.zeros(at.q.shape[1:])
        v = at.values
        along = at.velocity[0] * np.cos(at.memory[0]) + at.velocity[1] * np.sin(at.memory[0])
        return np.asarray(-v["kt"] * along / _limit(at, v["kn"] * (at.q[2] - v["gap"])))

    def guards(self, regime: int, at: InTime) -> Array:
        """Guards of beginning, loaded and ending contact; of the circle; of the velocity of slip."""
        v, least = at.values, SMALL * at.length
        y = at.q[2] - v["gap"]
        if regime == SEPARATION:
            return np.stack([-y / at.length])
        if regime == TOUCH:
            friction = (v["mu"] > 0) & (v["kt"] > 0)
            return np.stack([y / at.length, np.where(friction, (least - y) / at.length, 1.0)])
        held = (y - 0.5 * least) / at.length
        b = v["mu"] * v["kn"] * y
        if regime == STICK:
            spring = v["kt"] * at.q[:2]
            force = np.hypot(*(spring + at.memory))
            return np.stack(
                [held, (b - force) / (b + force + np.abs(spring).sum(axis=0) + np.abs(at.memory).sum(axis=0))]
            )
        closing = v["mu"] * v["kn"] * at.velocity[2] / v["kt"]
        along = at.velocity[0] * np.cos(at.memory[0]) + at.velocity[1] * np.sin(at.memory[0])
        size = np.hypot(at.velocity[0], at.velocity[1]) + np.abs(closing)
        return np.stack([held, (along - closing) / np.maximum(size, 1e-300)])

    def after(self, regime: int, guard: int, at: InTime) -> int:
        """The next regime."""
        if regime == SEPARATION:
            return TOUCH
        if regime == TOUCH:
            return SEPARATION if guard == 0 else self._onset(at)
        if guard == 0:
            return TOUCH
        return SLIP if regime == STICK else STICK

    @staticmethod
    def _onset(at: InTime) -> int:
        """Stick where the limit grows faster than the force."""
        v = at.values
        speed = np.hypot(at.velocity[0], at.velocity[1])
        return SLIP if (v["kt"] * speed > v["mu"] * v["kn"] * at.velocity[2]).item() else STICK

    def reset(self, before: int, after: int, at: InTime) -> Array:
        """Angle of the force or of the velocity, or force at zero motion of the spring."""
        out, v = np.zeros_like(at.memory), at.values
        if after in (SEPARATION, TOUCH):
            return out
        if before == TOUCH:
            if after == SLIP:
                out[0] = np.arctan2(at.velocity[1], at.velocity[0])
                return out
            since = np.divide(at.q[2] - v["gap"], at.velocity[2], out=np.zeros_like(at.q[2]), where=at.velocity[2] > 0)
            return np.asarray(v["kt"] * (at.velocity[:2] * since - at.q[:2]))
        forces = self.rate(before, at)[0]
        if after == SLIP:
            out[0] = np.arctan2(forces[1], forces[0])
            return out
        return np.asarray(forces[:2] - v["kt"] * at.q[:2])

    def guard_slope(self, regime: int, guard: int, at: InTime) -> Array:
        """Derivatives of the guards, see ``Regimes``."""
        v, out = {name: value.item() for name, value in at.values.items()}, np.zeros(8)
        q, (v1, v2, _), memory = at.q[:, 0, 0], at.velocity[:, 0, 0], at.memory[:, 0, 0]
        limit, kt = v["mu"] * v["kn"], v["kt"]
        if regime == STICK and guard:
            force = kt * q[:2] + memory
            out[:] = [*(-kt * force), limit**2 * (q[2] - v["gap"]), 0.0, 0.0, 0.0, *-force]
        elif regime == SLIP and guard:
            c, s = np.cos(memory[0]), np.sin(memory[0])
            out[3:7] = [c, s, -limit / kt, v2 * c - v1 * s]
        else:
            out[2] = 1.0 if guard == 0 and regime != SEPARATION else -1.0
        return out

    def jumping(self, before: int, after: int) -> int | None:
        """Guards of contact and of the beginning of slip; where slip ends its velocity is zero and nothing jumps."""
        if before == SLIP and after == STICK:
            return None
        return 1 if before == STICK and after == SLIP else 0

    def reset_slopes(self, before: int, after: int, at: InTime) -> Array:
        """Derivatives of the internal variables where a regime begins."""
        v, out = {name: value.item() for name, value in at.values.items()}, np.zeros((2, 8))
        q, (v1, v2, v3), memory = at.q[:, 0, 0], at.velocity[:, 0, 0], at.memory[:, 0, 0]
        y, limit, kt = q[2] - v["gap"], v["mu"] * v["kn"], v["kt"]
        if before == STICK and after == SLIP:
            force = kt * q[:2] + memory
            out[0, [0, 1, 6, 7]] = np.array([-force[1] * kt, force[0] * kt, -force[1], force[0]]) / (force @ force)
        elif before == SLIP and after == STICK:
            along = np.array([np.cos(memory[0]), np.sin(memory[0])])
            out[:, 2], out[:, 6] = limit * along, limit * y * np.array([-along[1], along[0]])
            out[[0, 1], [0, 1]] = -kt
        elif before in (SEPARATION, TOUCH) and after == SLIP:
            out[0, 3:5] = np.array([-v2, v1]) / (v1 * v1 + v2 * v2)
        elif before in (SEPARATION, TOUCH) and after == STICK:
            out[[0, 1], [0, 1]] = -kt
            if v3 > 0.0:
                out[[0, 1], [3, 4]] = kt * y / v3
                sliding = kt * at.velocity[:2, 0, 0] / v3
                out[:, 2], out[:, 5] = sliding, -sliding * y / v3
        return out

    def memory_of(self, regime: int, force: Array, at: InTime) -> Array:
        """Angle of the force, or force at zero motion of the spring."""
        out = np.zeros((2, *force.shape[1:]))
        if regime == STICK:
            out[:] = force[:2] - at.values["kt"] * at.q[:2]
        elif regime == SLIP:
            out[0] = np.arctan2(force[1], force[0])
        return out

    def regime_of(self, name: str) -> int:
        """Separation, stick or slip."""
        return {"separation": SEPARATION, "stick": STICK, "slip": SLIP}[name]

    def begin(self, force: Array, at: InTime) -> tuple[IntArray, Array]:
        """Regimes and internal variables from the friction force and its limit."""
        v = {name: value[:, 0] for name, value in at.values.items()}
        q, velocity = at.q[..., 0], at.velocity[..., 0]
        y = q[2] - v["gap"]
        b, size = v["mu"] * v["kn"] * y, np.hypot(force[0], force[1])
        slips = velocity[0] * force[0] + velocity[1] * force[1] > v["mu"] * v["kn"] * velocity[2] / np.where(
            v["kt"] > 0, v["kt"], 1.0
        ) * np.maximum(size, 1e-300)
        regimes = np.where((size >= b * (1.0 - _WITHIN)) & slips, SLIP, STICK)
        regimes = np.where((v["mu"] == 0) | (v["kt"] == 0) | (y <= SMALL * at.length), TOUCH, regimes)
        regimes = np.where(y <= 0, SEPARATION, regimes)
        memory = np.zeros(at.memory.shape[:2])
        stuck, slipping = regimes == STICK, regimes == SLIP
        within = np.minimum(1.0, b / np.maximum(size, 1e-300))
        memory[:, stuck] = (force[:2] * within - v["kt"] * q[:2])[:, stuck]
        memory[0, slipping] = np.arctan2(force[1], force[0])[slipping]
        return regimes, memory

    def next_force(self, force: Array, before: Array, after: Array, values: Mapping[str, Array]) -> Array:
        """Spring force, scaled back to the circle."""
        return incremented(force, before, after, {name: value[:, 0] for name, value in values.items()}).force

    def unsettled(self, q: Array, forces: Array, values: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Elements that neither slip nor separate: their forces follow the spring all period."""
        moved = np.diff(forces[:2], axis=2) - values["kt"] * np.diff(q[:2], axis=2)
        size = np.abs(forces[:2]).max(axis=(0, 2)) + 1e-300
        return np.asarray((np.abs(moved).max(axis=(0, 2)) < 1e-9 * size) & (forces[2] > 0).all(axis=1))
