"""What friction heat adds to the balance: parameters at the contact temperature, and one term in each derivative.

With ``T = T_0 + R Edot`` solved for the temperatures, every derivative of the residual gains ``C dEdot``, where
``C = A F_T (I - R Edot_T)^-1 R`` (N, n) and ``dEdot`` is the derivative of the powers at fixed temperatures
(THEORY.md section 8).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.thermal.model import HeatedContacts, HeatedForces

if TYPE_CHECKING:
    from slipstick.balance.problem import ContactPair
    from slipstick.balance.residual import Balance, Compliance, Inputs

Array = NDArray[np.float64]


def cold_pairs(pairs: Sequence[ContactPair], heated: HeatedContacts) -> tuple[ContactPair, ...]:
    """The contacts with the parameters that their curves give at the background temperature."""
    changed = []
    for i, pair in enumerate(pairs):
        cold = {name: float(value[i]) for name, value in heated.nominal.items() if heated.follows(name, [i])}
        changed.append(replace(pair, contact=replace(pair.contact, **cold)) if cold else pair)
    return tuple(changed)


def heat_faults(pairs: Sequence[ContactPair], heated: HeatedContacts) -> list[str]:
    """Contacts that cannot be heated, in sentences."""
    return [
        f"contact '{pair.name}': kn depends on temperature but the contact has no normal direction, so its normal load "
        "is constant; give a normal direction, or no table of kn"
        for i, pair in enumerate(pairs)
        if pair.normal is None and heated.follows("kn", [i])
    ]


def heat_columns(balance: Balance, heat: HeatedForces, compliance: Compliance) -> Array:
    """``A F_T (I - R Edot_T)^-1 R``, (N, n_contacts): the residual by power put in at each contact."""
    c, p, tangent = balance.n_contacts, balance.n_ports, heat.tangent
    moved = compliance.value[:c] * balance.paired(tangent.dFx_dT)[:, None, :]
    if p > c:
        at = balance.with_normal
        moved[at] += compliance.value[c:p] * balance.paired(tangent.dFy_dT[at])[:, None, :]
    by_temperature = balance.real(moved.reshape(c * p, -1)).reshape(c, -1)
    return np.asarray(by_temperature.T @ tangent.gain, dtype=float)


def power_rows(balance: Balance, heat: HeatedForces) -> Array:
    """Derivatives of the powers by the unknowns at fixed temperatures, (n_contacts, N)."""
    c = balance.n_contacts
    rows = np.zeros((c, balance.n_ports, balance.L))
    own = np.arange(c)
    rows[own, own] = heat.power.X
    at = balance.with_normal
    rows[at, c + np.arange(at.size)] = heat.power.Y[at]
    return rows.reshape(c, -1)


def warm_direction(heated: HeatedContacts, heat: HeatedForces, direction: Inputs) -> Inputs:
    """A direction in the inputs, whose mu, kt, kn are the cold values, as one in the parameters at the temperature."""
    T = heat.temperature
    return replace(
        direction, **{name: heated.per_cold(name, T) * getattr(direction, name) for name in ("mu", "kt", "kn")}
    )


def power_along(heat: HeatedForces, direction: Inputs) -> Array:
    """Derivative of the powers along a (warm) direction at fixed temperatures, (n_contacts,)."""
    along = np.einsum("cl,cl->c", heat.power.X, direction.U)
    for name in ("velocity", "gap", "mu", "kt", "kn"):
        along += getattr(heat.power, name) * getattr(direction, name)
    return np.asarray(along, dtype=float)
