"""Contacts whose parameters come from curves over temperature: their values without heat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from slipstick.errors import Fault
from slipstick.thermal.model import HeatedContacts

if TYPE_CHECKING:
    from slipstick.balance.batches import Batch
    from slipstick.balance.contacts import ContactPair


def cold_pairs(pairs: Sequence[ContactPair], batch: Batch, heated: HeatedContacts) -> tuple[ContactPair, ...]:
    """The contacts with the parameters that their curves give at the background temperature."""
    changed = list(pairs)
    for e, (p, k) in enumerate(batch.members):
        for name, value in heated.nominal.items():
            if heated.follows(name, [e]):
                changed[p] = changed[p].with_value(name, float(value[e]), k)
    return tuple(changed)


def heat_faults(pairs: Sequence[ContactPair], batch: Batch, heated: HeatedContacts) -> list[Fault]:
    """Contacts that cannot be heated."""
    law = batch.law
    ports = [law.ports[i] for i, name in law.stiffness_names.items() if name == "kn"]
    missing = [port for port in ports if port in law.optional_ports]
    return [
        Fault(
            ("contact", heated.names[e]),
            "kn depends on temperature but the contact has no normal direction, so its normal load is constant",
            remedy="give a normal direction, or no table of kn",
        )
        for e, (p, k) in enumerate(batch.members)
        if any(pairs[p].direction(port, k) is None for port in missing) and heated.follows("kn", [e])
    ]
