"""Typical sizes of a problem's motion, from its linear responses and its friction, in whatever units it is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.inputs import Inputs
from slipstick.balance.jacobian_backends import AnyCompliance
from slipstick.contact.law import Linear, add_to
from slipstick.solve.continuation import ArclengthScaling
from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class Scales:
    """Typical sizes by which motions and velocities count as small; the solution does not depend on them otherwise.

    Parameters
    ----------
    displacement
        Typical relative motion at the contacts, length, > 0.
    velocity
        Rubbing velocity at which contacts with that motion are in full slip, length/time, > 0.
    ports, coefficients
        Numbers of contact ports, and of coefficients of each: ``N = ports coefficients``.
    """

    displacement: float
    velocity: float
    ports: int
    coefficients: int

    def arclength(self, *, weight: float = 0.1) -> ArclengthScaling:
        """Scaling by the present solution, and by the typical displacement while that is zero."""
        judged = np.arange(self.coefficients) > 0 if self.coefficients > 1 else None
        return ArclengthScaling(x=self.displacement, weight=weight, rows=self.ports, judged=judged)


def scales(balance: Balance, inputs: Inputs, omega: float) -> Scales:
    """Sizes at one frequency: linear responses, motion up to slip, rubbing motions."""
    sizes = [_norm(v) for v in motions_at(balance, inputs, omega).values()]
    for batch, contact_inputs in zip(balance.batches, inputs.batches, strict=True):
        sizes += [_largest(contact_inputs.motion[..., 1:]), _largest(batch.law.size(contact_inputs.values))]
    present = [size for size in sizes if np.isfinite(size) and size > 0]
    displacement = max(present) if present else 1.0
    return Scales(
        displacement=displacement,
        velocity=omega * max(1, balance.harmonics.highest) * displacement,
        ports=balance.n_ports,
        coefficients=balance.L,
    )


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _norm(x: Array) -> float:
    return float(np.linalg.norm(x))


def motions_at(balance: Balance, inputs: Inputs, omega: float) -> dict[str, Array]:
    """``linear_motions`` at a frequency; the balance caches the latest, which are needed several times in a row."""
    key = inputs, balance.backend, balance.springs
    known = balance.linear_known
    if known is None or known[1] != omega or any(a is not b for a, b in zip(known[0], key, strict=True)):
        found = linear_motions(balance, inputs, balance.compliance(omega, inputs.structure), omega)
        balance.linear_known = known = key, omega, found
    return {name: x.copy() for name, x in known[2].items()}


def linear_motions(balance: Balance, inputs: Inputs, compliance: AnyCompliance, omega: float) -> dict[str, Array]:
    """Unknowns (N,) of the linear systems in which every law is held in one state, by its name, likeliest first."""
    names = dict.fromkeys(name for batch in balance.batches for name in batch.law.linear_states)
    motions = {name: _linear(balance, inputs, compliance, omega, name) for name in names}
    found = {name: x for name, x in motions.items() if x is not None}
    if (
        not found and balance.support_springs is not None
    ):  # a structure that only contacts hold rests on some that are open at first
        x = _linear(balance, inputs, compliance, omega, "pressed")
        found = {} if x is None else {"pressed": x}
    return found


def _linear(balance: Balance, inputs: Inputs, compliance: AnyCompliance, omega: float, state: str) -> Array | None:
    """Linear laws ``F = K Q + c`` in the balance: ``(I + A K) x = A (P - c - K u)``, u the rubbing motion."""
    unit, tangents, constants, any_linear = np.eye(balance.L), [], [], False
    for batch, contact_inputs in zip(balance.batches, inputs.batches, strict=True):
        held = batch.law.linear(state, contact_inputs.values, contact_inputs.drift(omega))
        any_linear = any_linear or held is not None
        held = held or Linear({}, {})
        tangents.append({key: k[:, None, None] * unit for key, k in held.stiffness.items()})
        constants.append(_constant(held, contact_inputs.motion))
    if not any_linear:
        return None
    jacobian = balance.jacobian(tangents, compliance)
    if jacobian.singular:
        return None
    if balance.is_unsupported(tangents):
        return None
    x = jacobian.solve(-balance.moved_by(constants, inputs.P, compliance))
    return x if np.all(np.isfinite(x)) else None


def _constant(held: Linear, motion: Array) -> dict[int, Array]:
    """Forces (n, L) by port while the structure is at rest."""
    forces: dict[int, Array] = {}
    for (i, j), k in held.stiffness.items():
        part = k[:, None] * motion[j]
        add_to(forces, i, part)
    for i, c in held.constant.items():
        force = forces.get(i)
        forces[i] = np.zeros_like(motion[0]) if force is None else force.copy()
        forces[i][:, 0] += c
    return forces
