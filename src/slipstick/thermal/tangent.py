"""Consistent derivatives of contact forces whose parameters follow the friction power (THEORY.md sections 7 and 8)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.forces import ContactForces
from slipstick.thermal.friction_curve import Sampled
from slipstick.trig.harmonics import Harmonics

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class PowerDerivatives:
    """Dissipated power ``Edot = omega [v Fx0 + (1/2) (L W)^T Fx]``, ``W = X + U`` [Eq. 41], and its derivatives.

    Each is at fixed other arguments; ``omega`` at constant rubbing velocity in length/time, ``velocity`` by that one.
    """

    power: Array
    X: Array
    """(n, L)."""
    Y: Array
    """(n, L)."""
    omega: Array
    """(n,), as are all below."""
    velocity: Array
    mu: Array
    kt: Array
    kn: Array
    gap: Array


def power_derivatives(
    harmonics: Harmonics, W: Array, forces: ContactForces, *, v: Array, omega: float
) -> PowerDerivatives:
    """Derivatives of the power from those of the forces; W (n, L) is ``X + U``, v (n,) is velocity/omega.

    ``L`` is antisymmetric, so the explicit derivative by W is ``-(1/2) L Fx``.
    """
    LW = harmonics.derivative(W)

    def by_motion(force: Array) -> Array:
        return omega * (v[:, None] * force[:, 0] + 0.5 * np.einsum("el,elk->ek", LW, force))

    parameters = np.stack([forces.dFx_dv, forces.dFx_dmu, forces.dFx_dkt, forces.dFx_dkn, forces.dFx_dgap])
    work_v, mu, kt, kn, gap = v * parameters[:, :, 0] + 0.5 * np.einsum("el,pel->pe", LW, parameters)
    work_v = work_v + forces.Fx[:, 0]
    return PowerDerivatives(
        power=omega * forces.work,
        X=by_motion(forces.dFx_dX) - 0.5 * omega * harmonics.derivative(forces.Fx),
        Y=by_motion(forces.dFx_dY),
        omega=forces.work - v * work_v,
        velocity=work_v,
        mu=omega * mu,
        kt=omega * kt,
        kn=omega * kn,
        gap=omega * gap,
    )


def parameter_power(LW: Array, forces: ContactForces, name: str, *, v: Array, omega: float) -> Array:
    """What a parameter's derivative of ``Fx`` does to the power, (n,) [Eqs. 46 to 52]."""
    force: Array = getattr(forces, f"dFx_d{name}")
    work: Array = v * force[:, 0] + 0.5 * np.einsum("el,el->e", LW, force)
    return omega * work


@dataclass(frozen=True, kw_only=True)
class ThermalTangent:
    """How the equilibrium temperatures answer to power, and the forces to temperature.

    ``gain`` (n, n) is ``(I - R Edot_T)^-1 R``: entry (e, f) is the rise at e by power put in at f, with the feedback of
    every element's own friction. ``dFx_dT``, ``dFy_dT`` (n, L) act at fixed motion.
    """

    gain: Array
    dFx_dT: Array
    dFy_dT: Array

    def temperature(self, dpower: Array) -> Array:
        """Total change of temperature (n, ...) by something each element's power depends on through (n, ...)."""
        return np.tensordot(self.gain, dpower, axes=1)

    def coupled(self, dpower: Array) -> Array:
        """``dT_e/dq_f`` (n, n, L) for own coordinates q_f (L,) with ``dEdot_f/dq_f`` (n, L)."""
        return self.gain[:, :, None] * dpower[None]

    def forces(self, dpower: Array) -> tuple[Array, Array]:
        """What heat adds to ``dFx_e/dq_f`` and ``dFy_e/dq_f``, both (n, L, n, L), for own coordinates q_f."""
        by_q = self.coupled(dpower)
        return self.dFx_dT[:, :, None, None] * by_q[:, None], self.dFy_dT[:, :, None, None] * by_q[:, None]

    def forces_common(self, dpower: Array) -> tuple[Array, Array]:
        """What heat adds to ``dFx/dp`` and ``dFy/dp``, both (n, L), for one parameter p common to all: dpower (n,)."""
        dT = self.temperature(dpower)[:, None]
        return self.dFx_dT * dT, self.dFy_dT * dT


def power_by_temperature(n: int, power: Mapping[str, Array], sampled: Mapping[str, Sampled]) -> Array:
    """``dEdot/dT`` (n,) at fixed motion: ``Edot_b b_T`` over the parameters b that depend on temperature [Eq. 45]."""
    slope = np.zeros(n)
    for name, parameter in sampled.items():
        slope += power[name] * parameter.derivative
    return slope


def thermal_tangent(
    resistance: Array, dpower_dT: Array, forces: ContactForces, sampled: Mapping[str, Sampled]
) -> ThermalTangent:
    """The tangent at an equilibrium: resistance (n,) or (n, n), ``dpower_dT`` (n,), parameters with their slopes."""
    R = np.diag(resistance) if resistance.ndim == 1 else resistance
    dFx_dT, dFy_dT = np.zeros_like(forces.Fx), np.zeros_like(forces.Fy)
    for name, parameter in sampled.items():
        dFx_dT = dFx_dT + getattr(forces, f"dFx_d{name}") * parameter.derivative[:, None]
    if "kn" in sampled:
        dFy_dT = forces.dFy_dkn * sampled["kn"].derivative[:, None]
    gain = np.asarray(np.linalg.solve(np.eye(dpower_dT.size) - R * dpower_dT, R), dtype=float)
    return ThermalTangent(gain=gain, dFx_dT=dFx_dT, dFy_dT=dFy_dT)
