"""What friction heat adds to the balance: parameters at the contact temperature, and one term in each derivative.

With ``T = T_0 + R Edot`` solved for the temperatures, every derivative of the residual gains ``C dEdot``, where
``C = A F_T (I - R Edot_T)^-1 R`` (N, n) and ``dEdot`` is the derivative of the powers at fixed temperatures
(THEORY.md (8.2)). The heated contacts are one batch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from slipstick.balance.inputs import Inputs
from slipstick.contact.law import add_to
from slipstick.thermal.model import Heat
from slipstick.thermal.tangent import Power
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.compliance import Compliance
    from slipstick.balance.kinds import AnyCompliance
    from slipstick.balance.ports import Balance


def heat_columns(balance: Balance, heat: Heat, compliance: Compliance) -> Array:
    """``A F_T (I - R Edot_T)^-1 R``, (N, n): the residual by power put in at each heated contact."""
    batch = balance.batches[heat.batch]
    moved = np.zeros((batch.count, balance.n_ports, balance.orders.size + 1), dtype=complex)
    for i, force in heat.tangent.by_temperature.items():
        port = batch.ports[i]
        if port.size:
            pairs = np.zeros((port.size, 2 * balance.orders.size + 2))
            own = force[port.members]
            pairs[:, 0], pairs[:, 2:] = own[:, 0], own[:, 1:]
            moved[port.members] += compliance.value[port.rows] * pairs.view(complex)[:, None, :]
    by_temperature = balance.real(moved.reshape(-1, moved.shape[2])).reshape(batch.count, -1)
    return np.asarray(by_temperature.T @ heat.tangent.gain, dtype=float)


def heated(balance: Balance, heat: Heat, dpower: Array, compliance: AnyCompliance) -> Array:
    """Change (N,) of the residual for a change (n,) of the heated contacts' powers at fixed temperatures."""
    dT = heat.tangent.gain @ dpower
    forces: list[dict[int, Array]] = [{} for _ in balance.batches]
    forces[heat.batch] = {i: dT[:, None] * force for i, force in heat.tangent.by_temperature.items()}
    return compliance.answer(balance.excitation(forces))


class Powered(Protocol):
    """A batch and the power of its contacts."""

    @property
    def batch(self) -> int:
        """Which batch of the balance."""

    @property
    def power(self) -> Power:
        """Its power with derivatives."""


def power_rows(balance: Balance, heat: Powered) -> Array:
    """Derivatives of the powers by the unknowns at fixed temperatures, (n, N)."""
    batch = balance.batches[heat.batch]
    rows = np.zeros((batch.count, balance.n_ports, balance.L))
    elements, ports = np.arange(batch.count), np.arange(balance.n_ports)
    for j, tangent in heat.power.by_motion.items():
        port = batch.ports[j]
        rows[elements[port.members], ports[port.rows]] = tangent[port.members]
    return rows.reshape(batch.count, -1)


def heat_change(balance: Balance, heat: Heat, dx: Array, dpower: Array | None, changed: list[dict[int, Array]]) -> None:
    """Add what the temperatures do to changes of the forces, for a change ``dx`` of the motion and ``dpower`` (n,)."""
    total = power_rows(balance, heat) @ dx
    dT = heat.tangent.gain @ (total if dpower is None else total + dpower)
    own = changed[heat.batch]
    for i, force in heat.tangent.by_temperature.items():
        part = dT[:, None] * force
        add_to(own, i, part)


def warm_direction(heat: Heat, direction: Inputs) -> Inputs:
    """A direction in the inputs, whose parameters are cold values, as one in the parameters at the temperature."""
    given = direction.batches[heat.batch]
    warm = {name: heat.per_cold(name) * given.values[name] for name in heat.hot}
    return direction.with_batch(heat.batch, **warm)


def power_along(heat: Powered, direction: Inputs) -> Array:
    """Derivative of the powers along a (warm) direction at fixed temperatures, (n,)."""
    given = direction.batches[heat.batch]
    along, speed = np.zeros(given.velocity.shape[1]), given.speed(heat.power.motion.omega)
    if speed.any():
        along += np.einsum("pn,pn->n", heat.power.by_velocity, speed)
    if given.motion.any():
        for j, tangent in heat.power.by_motion.items():
            along += np.einsum("nl,nl->n", tangent, given.motion[j])
    for name, rate in given.values.items():
        if rate.any():
            along += heat.power.by_parameter(name) * rate
    return np.asarray(along, dtype=float)
