"""Contacts that wear: friction opens their gap, slowly beside the vibration [Archard 1953; Fouvry et al. 2003].

The worn depth z of a contact grows with the energy it dissipates, ``dz/dt = kappa P``, and opens its gap:
``gap(z) = gap + z``, so that the normal force is ``kn max(y - gap - z, 0)``. With a worn volume ``alpha N |ds|``,
a contact area A and constant friction, ``kappa = alpha / (mu A)``. A contact that sticks all period dissipates
nothing and never wears; its mean friction force is the middle of the interval of admissible ones, as everywhere.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipstick.contact.law import Law
from slipstick.contact.names import block_of, pair_of, standing_for
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, numbers, shown, suggestion, table, wrong
from slipstick.state.contact_state import ContactState, Rate, Sampled, StateModel, StateVariable
from slipstick.typing import Array, Reals

WORN_DEPTH = StateVariable("worn_depth", "length", "worn depth")
GAP, STIFFNESS = "gap", "kn"
"""Parameters that a law must have: wear opens the gap, and the stiffness relates that to the lost load."""


@dataclass(frozen=True, kw_only=True)
class WearModel(StateModel):
    """How fast the contacts of a problem wear.

    Parameters
    ----------
    kappa
        Gap opened per dissipated energy, length / (force x length), >= 0: one number for every contact, or by name of
        a contact pair (one number, or one for each of its contacts) or of a contact. Those not named do not wear.

    Raises
    ------
    InputError
        For values of another kind.
    """

    kappa: Reals | Mapping[str, Reals]

    def __post_init__(self) -> None:
        checks = Gathering()
        by_name = isinstance(self.kappa, Mapping)
        given = checks.take(table, "kappa", self.kappa, _EXPECTED) if isinstance(self.kappa, Mapping) else None
        values: Any = {name: checks.take(_kappa, ("kappa", name), value) for name, value in (given or {}).items()}
        if not by_name:
            values = checks.take(_kappa, ("kappa",), self.kappa)
            if values is not None and np.ndim(values):
                checks.faults.append(Fault("kappa", found=shown(self.kappa), expected=_EXPECTED))
        elif not checks.faults and not values:
            checks.faults.append(Fault("kappa", found="nothing", expected=_EXPECTED))
        checks.end()
        object.__setattr__(self, "kappa", values)

    def of(self, laws: Sequence[Law], names: Sequence[Sequence[str]]) -> list[WornContacts]:
        """The contacts of every law of which one wears; the others of the law have kappa = 0."""
        rates = by_contact("kappa", self.kappa, [name for of_law in names for name in of_law])
        states, first = list[WornContacts](), 0
        for k, of_law in enumerate(names):
            kappa = rates[first : first + len(of_law)]
            first += len(of_law)
            if np.any(kappa > 0.0):
                states.append(WornContacts(batch=k, names=tuple(of_law), kappa=kappa))
        return states


_EXPECTED = 'numbers >= 0 by the names of contacts, such as {"tip": 1e-9}, or one for all'


def _kappa(where: tuple[str, ...], value: Any) -> Any:
    kappa = numbers(where, value, "a number >= 0, or one for each contact of the pair")
    if kappa.ndim > 1 or kappa.size == 0 or not np.all(kappa >= 0.0):
        raise wrong(where, value, "a number >= 0, or one for each contact of the pair")
    return float(kappa) if kappa.ndim == 0 else kappa


def by_contact(what: str, given: Any, names: Sequence[str], missing: float = 0.0) -> Array:
    """Numbers (n,) of contacts, given for all or by name of contact, pair or block; InputError with all faults.

    >>> by_contact("kappa", {"foot": [1.0, 2.0], "tip": 3.0}, ["foot.1", "foot.2", "tip", "stop"]).tolist()
    [1.0, 2.0, 3.0, 0.0]
    """
    if not isinstance(given, Mapping):
        return np.full(len(names), float(given))
    out, faults = np.full(len(names), missing), list[Fault]()
    for name, value in given.items():
        rows = standing_for(name, names)
        if not rows:
            known = list(dict.fromkeys(called(own) for called in (block_of, pair_of, str) for own in names))
            faults.append(Fault((what,), f"there is no contact {shown(name)}", remedy=suggestion(name, known)))
        elif np.ndim(value) and np.size(value) != len(rows):
            faults.append(Fault((what, name), found=f"{np.size(value)} numbers", expected=f"one, or {len(rows)}"))
        else:
            out[rows] = value
    if faults:
        raise InputError(faults)
    return out


@dataclass(frozen=True, kw_only=True)
class WornContacts(ContactState):
    """Worn depths of the contacts of one law; ``kappa`` (n,) is the gap opened per dissipated energy."""

    variable = WORN_DEPTH
    has = "wearing"

    batch: int
    names: tuple[str, ...]
    kappa: Array
    slow: bool = True

    @property
    def start(self) -> Array:
        """Unworn."""
        return np.zeros(len(self.names))

    def parameters(self, z: Array, given: Mapping[str, Array]) -> dict[str, Sampled]:
        """The gap, opened."""
        return {GAP: Sampled(given[GAP] + z, np.ones(z.size))}

    def by_given(self, name: str, z: Array) -> Array:
        """1: worn depth and gap add up."""
        return np.ones(z.size)

    def rate(self, z: Array, power: Array) -> Rate:
        """``kappa P``, length/time, at least zero: rounding of the power of a stuck contact does not close its gap."""
        return Rate(self.kappa * np.maximum(power, 0.0), np.zeros(z.size), self.kappa)

    def faults(self, law: Law, ports: Sequence[Container[str]]) -> Iterator[Fault]:
        """Laws without a gap or a normal stiffness."""
        for name, kappa in zip(self.names, self.kappa, strict=True):
            if kappa > 0.0 and not {GAP, STIFFNESS} <= set(law.values):
                missing = " and ".join(p for p in (GAP, STIFFNESS) if p not in law.values)
                statement = f"its law has no {missing}, which wear acts on"
                yield Fault(("contact", name), statement, remedy="leave it out of wear")
                return
