"""Typical sizes of a problem's motion, from its linear responses and its friction, in whatever units it is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.residual import Balance, Compliance, Inputs
from slipstick.solve.continuation import ArclengthScaling

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Scales:
    """What counts as one: nothing in the solution depends on it but what is called small.

    Parameters
    ----------
    displacement
        Typical relative motion at the contacts, length, > 0.
    velocity
        Rubbing velocity at which contacts of that motion slip without end, length/time, > 0.
    """

    displacement: float
    velocity: float

    def arclength(self, *, weight: float = 0.1) -> ArclengthScaling:
        """Corrections and steps are measured against the present solution, and against this while it is zero."""
        return ArclengthScaling(x=self.displacement, weight=weight)


def scales(balance: Balance, inputs: Inputs, omega: float) -> Scales:
    """Sizes at one frequency: linear responses, motion up to slip, rubbing motion."""
    compliance = balance.compliance(omega)
    sizes = [_norm(v) for v in linear_motions(balance, inputs, compliance).values()]
    load = inputs.mu * inputs.kn * np.maximum(-inputs.gap, 0.0)
    sizes += [float(np.max(value, initial=0.0)) for value in (np.abs(inputs.U[:, 1:]), _ratio(load, inputs.kt))]
    present = [size for size in sizes if np.isfinite(size) and size > 0]
    displacement = max(present) if present else 1.0
    return Scales(displacement=displacement, velocity=omega * max(1, balance.harmonics.highest) * displacement)


def _ratio(a: Array, b: Array) -> Array:
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)


def _norm(x: Array) -> float:
    return float(np.linalg.norm(x))


def linear_motions(balance: Balance, inputs: Inputs, compliance: Compliance) -> dict[str, Array]:
    """Unknowns (N,) of the linear systems around: "free", "stuck" and "sliding" for ever where there is a velocity."""
    found = {name: _linear(balance, inputs, compliance, name) for name in ("free", "stuck", "sliding")}
    return {name: x for name, x in found.items() if x is not None}


def _linear(balance: Balance, inputs: Inputs, compliance: Compliance, state: str) -> Array | None:
    """Linear contact law ``F = K q + c`` in the balance: ``(I + A K) x = A (P - c)``."""
    unit = np.eye(balance.L)
    closed = (inputs.gap < 0).astype(float)
    kn = inputs.kn * closed * (state != "free")
    kt = inputs.kt * (state == "stuck")
    slope = np.sign(inputs.velocity) * inputs.mu * kn * (state == "sliding")
    if state == "stuck":
        kt = kt * closed
    if state == "sliding" and not inputs.velocity.any():
        return None
    xx, xy, yy = (k[:, None, None] * unit for k in (kt, slope, kn))
    jacobian = balance.jacobian(xx, xy, yy, compliance)
    Fx, Fy = kt[:, None] * inputs.U, np.zeros_like(inputs.U)
    Fx[:, 0] = -slope * inputs.gap
    Fy[:, 0] = -kn * inputs.gap
    try:
        x = np.asarray(np.linalg.solve(jacobian, -balance.moved_by(Fx, Fy, inputs.P, compliance)), dtype=float)
    except np.linalg.LinAlgError:
        return None
    return x if np.all(np.isfinite(x)) else None
