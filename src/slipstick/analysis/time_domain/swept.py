"""Exact steps of a piecewise linear friction system whose speed of excitation grows evenly.

Time is ``tau = omega_0 t`` with a reference ``omega_0``; the excitation turns by ``phi = nu_0 tau + r tau^2 / 2``, so
that its speed is ``omega_0 nu`` with ``nu = nu_0 + r tau``. The forcing carried along is

    1, u = (cos m phi, sin m phi), nu, w = nu u, y = nu^2 u - r m^-2 G u

with ``u' = G w``: rubbing motions and forces are rows times u, their rates rows times w, so that every combination of
contact states still has constant rows; y is the forcing by an unbalance or a moving support, ``-u'' / m^2``. The
structure is linear with constant matrices: over a step the power series of z follows from that of the forcing, which
has a closed form, and is summed to rounding. Changes of contact state are roots of polynomials as at a constant speed.
Where contacts of other laws make the system smooth instead, the polynomial at Gauss nodes includes the forcing, from
its exact value at the start of each step.
"""

from __future__ import annotations

from cmath import rect
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from slipstick.analysis.time_domain.event_integrator import Piece, StateChange, Stepper, step_angle
from slipstick.analysis.time_domain.piecewise import FrictionSystem, LinearPiece, PiecewiseLinear
from slipstick.typing import Array

FEWEST_STEPS = 64
"""Steps a period at the higher end of the speeds: events shorter than a thirteenth of one may be missed."""

_FEW = 24
"""Number of unknowns up to which the power series is one stored matrix for each combination."""


@dataclass(frozen=True, kw_only=True)
class SweptSystem(FrictionSystem):
    """Structure, contacts and forcing; coefficients over the forcing above, in its order.

    Parameters
    ----------
    first, growth
        ``nu`` at the start, and r.
    velocity_per_nu
        Growth of the constant velocity of rubbing with nu, (n_contacts,).
    law_velocity_per_nu
        Growth of the velocity along the ports of other laws, (n,).
    """

    first: float
    growth: float
    velocity_per_nu: Array = field(default_factory=lambda: np.zeros(0))
    law_velocity_per_nu: Array = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def _places(self) -> tuple[slice, int, slice, slice]:
        """Places of u, nu, w and y in the forcing."""
        k = 2 * len(self.orders)
        return slice(1, 1 + k), 1 + k, slice(2 + k, 2 + 2 * k), slice(2 + 2 * k, 2 + 3 * k)

    @property
    def turning(self) -> Array:
        """G."""
        out = np.zeros((2 * len(self.orders),) * 2)
        for k, m in enumerate(self.orders):
            out[2 * k, 2 * k + 1], out[2 * k + 1, 2 * k] = -m, m
        return out

    @cached_property
    def _lagging(self) -> Array:
        """``(m^-2 G)^T``."""
        return np.asarray((self.turning / np.repeat(np.asarray(self.orders, dtype=float), 2)[:, None] ** 2).T)

    @cached_property
    def forcing_rates(self) -> Array:
        """``d forcing/dtau`` as a matrix times the forcing: of 1, u and nu; those of w and y are no such rows."""
        u, nu, w, y = self._places
        out = np.zeros((y.stop,) * 2)
        out[u, w] = self.turning
        out[nu, 0] = self.growth
        return out

    @property
    def sliding(self) -> Array:
        """Constant velocity of rubbing per unit of tau, as rows times the forcing."""
        _, nu, _, y = self._places
        out = np.zeros((self.n_contacts, y.stop))
        out[:, 0], out[:, nu] = self.velocity / self.omega, self.velocity_per_nu / self.omega
        return out

    @property
    def law_speed(self) -> Array:
        """Velocity of the opposing surface along the ports of other laws, as rows times the forcing, length/time."""
        out = super().law_speed
        out[:, self._places[1]] += self.law_velocity_per_nu
        return out

    def phase(self, tau: float) -> float:
        """phi."""
        return tau * (self.first + 0.5 * self.growth * tau)

    def time_of_phase(self, phase: float) -> float:
        """tau at which phi is ``phase`` first; infinite where it never is."""
        square = self.first**2 + 2.0 * self.growth * phase
        return 2.0 * phase / (self.first + float(np.sqrt(square))) if square >= 0.0 else np.inf

    def speed(self, tau: float) -> float:
        """nu."""
        return self.first + self.growth * tau

    def forcing(self, tau: float) -> Array:
        """The last entries of z."""
        return self.forcing_series(tau, 1.0, 0)[0]

    def forcing_series(self, tau: float, step: float, degree: int) -> Array:
        """Power series (degree + 1, n_forcing) of the forcing from tau on, in steps."""
        nu, slope, phase = self.speed(tau), self.growth * step, self.phase(tau)
        u = np.empty((degree + 1, 2 * len(self.orders)))
        for j, m in enumerate(self.orders):  # d/ds e^{i m phi} = i m step (nu + slope s) e^{i m phi}
            before, turn = 0.0j, rect(1.0, m * phase)
            even, rising = 1j * m * step * nu, 1j * m * step * slope
            column = [turn]
            for k in range(1, degree + 1):
                before, turn = turn, (even * turn + rising * before) / k
                column.append(turn)
            u[:, 2 * j : 2 * j + 2] = np.array(column).view(float).reshape(-1, 2)
        places = self._places
        out = np.zeros((degree + 1, places[3].stop))
        out[0, 0], out[:, places[0]] = 1.0, u
        out[:2, places[1]] = [nu, slope][: degree + 1]
        w = nu * u
        w[1:] += slope * u[:-1]
        faster = nu * w
        faster[1:] += slope * w[:-1]
        out[:, places[2]] = w
        out[:, places[3]] = faster - self.growth * (u @ self._lagging)
        return out

    def forcing_rate(self, forcing: Array) -> Array:
        """``d forcing/dtau`` of forcings (k, n_forcing), all of it."""
        u, nu, w, y = self._places
        out = np.asarray(forcing @ self.forcing_rates.T, dtype=float)
        speed = forcing[:, [nu]]
        out[:, w] = self.growth * forcing[:, u] + speed * out[:, u]
        out[:, y] = self.growth * forcing[:, w] + speed * out[:, w] - self.growth * out[:, u] @ self._lagging
        return out


class SweptPiecewise(PiecewiseLinear):
    """Linear systems of the combinations of states, driven by forcing in closed form."""

    system: SweptSystem

    def rate(self, linear: LinearPiece, z: Array) -> Array:
        """``dz/dtau`` at states (k, size)."""
        out = super().rate(linear, z)
        out[:, self.system.n_dynamic :] = self.system.forcing_rate(z[:, self.system.n_dynamic :])
        return out


def fewest_steps(model: PiecewiseLinear) -> int:
    """Steps a period at the reference speed that are enough for the fastest motion, and for events."""
    return max(FEWEST_STEPS, int(np.ceil(2 * np.pi * model.fastest() / step_angle(model.system.laws))))


class SweptStepper(Stepper):
    """Carries ``(tau, z, states)`` forward while the excitation speeds up."""

    model: SweptPiecewise

    def __init__(self, model: SweptPiecewise, steps: int | None = None) -> None:
        super().__init__(model, fewest_steps(model) if steps is None else steps)

    def turn(self, number: int) -> Iterator[Piece | StateChange]:
        """Pieces and state changes of a numbered turn of the excitation, from ``self.z`` and ``self.states`` on."""
        system = self.model.system
        tau, end = (system.time_of_phase(2 * np.pi * k) for k in (number, number + 1))
        while tau < end:
            stop = min((np.floor(tau / self.step + 1e-9) + 1) * self.step, end)
            yield from self._one_step(tau, (stop - tau) / self.step)
            tau = stop
        self.z[system.n_dynamic :] = system.forcing(end)

    def _path(self, linear: LinearPiece, tau: float, length: float) -> tuple[Array, float]:
        """The polynomial of z from ``self.z`` at tau on, and how far it reaches: ``length`` or less, in steps."""
        if not linear.smooth:
            return self._driven(linear, tau), length
        self.z[self.model.system.n_dynamic :] = self.model.system.forcing(tau)
        return self._smooth(linear, self.z, length)

    def _driven(self, linear: LinearPiece, tau: float) -> Array:
        """Power series (degree + 1, size) of z from tau on, in steps."""
        one = self.model.system.n_dynamic
        forcing = self.model.system.forcing_series(tau, self.step, self.degree)
        self.z[one:] = forcing[0]
        out = np.empty((self.degree + 1, len(self.z)))
        out[:, one:] = forcing
        driven = forcing[:-1] @ (linear.A[:one, one:].T * self.step)
        if one <= _FEW:
            given = np.concatenate([self.z[:one], driven.ravel()])
            out[:, :one] = (self._series(linear) @ given).reshape(-1, one)
            return out
        free = linear.A[:one, :one] * self.step
        out[0, :one] = self.z[:one]
        for k in range(1, self.degree + 1):
            out[k, :one] = (free @ out[k - 1, :one] + driven[k - 1]) / k
        return out

    def _series(self, linear: LinearPiece) -> Array:
        """Map from the unknowns and their drive, power by power, to the power series of the unknowns."""
        if "series" not in linear.cache:
            one = self.model.system.n_dynamic
            free, out = linear.A[:one, :one] * self.step, np.zeros((self.degree + 1, one, (self.degree + 1) * one))
            out[0, :, :one] = np.eye(one)
            for k in range(1, self.degree + 1):
                out[k] = free @ out[k - 1]
                out[k, :, k * one : (k + 1) * one] += np.eye(one)
                out[k] /= k
            linear.cache["series"] = out.reshape(-1, out.shape[2])
        return linear.cache["series"]  # type: ignore[return-value]
