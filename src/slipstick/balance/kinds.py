"""The one place that chooses in which form the Jacobian of the balance is made."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from slipstick.balance.compliance import Compliance
from slipstick.balance.dense import dense_jacobian
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.thermal.model import Heat

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance, Tangents

Kind = Callable[[Any, Any, Compliance, "Heat | None"], Jacobian]
"""Makes ``I + A dF/dX``, with what heat adds, of a ``Balance``, tangents by batch, the compliance, and heat if any."""


def chosen(balance: Balance, tangents: Tangents, compliance: Compliance, heat: Heat | None = None) -> Jacobian:
    """Of the kind that costs least: the dense one, as yet the only one."""
    return dense_jacobian(balance, tangents, compliance, heat)
