"""Power that the contacts of one law dissipate, with its derivatives [THEORY.md section 7]."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from slipstick.contact.law import ByPort, Law, Motion, Response, add_to
from slipstick.typing import Array


class Power:
    """Power ``Edot = omega sum_i [drift_i F_i0 + (1/2) (L Q_i)^T F_i]`` dissipated, and derivatives [THEORY.md (7.2)].

    Each derivative is at fixed other arguments. Those by omega are at constant velocity in length/time, except for its
    part in proportion to omega. The sum is over the ports whose force does work.
    """

    def __init__(self, law: Law, motion: Motion, response: Response) -> None:
        self.motion, self.response = motion, response
        self._ports = law.dissipating

    @cached_property
    def _slopes(self) -> dict[int, Array]:
        return {i: self.motion.harmonics.derivative(self.motion.Q[i]) for i in self._ports}

    @property
    def value(self) -> Array:
        """Power (n,), force x length / time."""
        return self.motion.omega * self.response.work

    def along(self, forces: ByPort) -> Array:
        """Change of the power by changes of the forces alone, (n,)."""
        total = np.zeros(self.motion.drift.shape[1])
        for i in self._ports:
            if i in forces:
                total += self.motion.drift[i] * forces[i][:, 0] + 0.5 * np.einsum(
                    "el,el->e", self._slopes[i], forces[i]
                )
        return self.motion.omega * total

    @cached_property
    def by_motion(self) -> dict[int, Array]:
        """``j -> dEdot/dQ_j`` (n, L)."""
        omega, drift = self.motion.omega, self.motion.drift
        slopes: dict[int, Array] = {}
        for (i, j), tangent in self.response.by_motion.items():
            if i in self._ports:
                part = omega * (
                    drift[i][:, None] * tangent[:, 0] + 0.5 * np.einsum("el,elk->ek", self._slopes[i], tangent)
                )
                add_to(slopes, j, part)
        for j in self._ports:
            # L is antisymmetric: the explicit derivative by Q_j is -(1/2) L F_j
            part = -0.5 * omega * self.motion.harmonics.derivative(self.response.force[j])
            add_to(slopes, j, part)
        return slopes

    @cached_property
    def by_velocity(self) -> Array:
        """By the velocity along each port in length/time, (n_ports, n)."""
        slopes = np.zeros_like(self.motion.drift)
        for j in range(len(slopes)):
            slopes[j] = self.along({i: f for (i, k), f in self.response.by_drift.items() if k == j}) / self.motion.omega
            if j in self._ports:
                slopes[j] += self.response.force[j][:, 0]
        return slopes

    @property
    def omega(self) -> Array:
        """By omega, (n,)."""
        moved = np.einsum("pn,pn->n", self.motion.drift - self.motion.swept, self.by_velocity)
        return self.response.work - moved + self.along(self.response.by_omega)

    def by_parameter(self, name: str) -> Array:
        """By a parameter of the law, (n,) [THEORY.md (6.2), (6.3)]."""
        return self.along(self.response.by_parameter(name))
