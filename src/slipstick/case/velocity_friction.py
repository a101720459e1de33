"""``mu = { velocity_table = ... }`` or ``mu = { mu_s = 0.5, mu_d = 0.3, v_s = 0.1 }``: friction over velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

from pydantic import PlainValidator

from slipstick.case.thermal import number_or_table
from slipstick.errors import UNKNOWN_KEY, Fault, InputError
from slipstick.faults import suggestion

TABLE = "velocity_table"
_CURVE = ("mu_s", "mu_d", "v_s", "viscous", "form")


def is_over_velocity(mu: object) -> bool:
    """Whether friction is given over the sliding velocity."""
    return isinstance(mu, Mapping) and not {TABLE, *_CURVE}.isdisjoint(mu)


def velocity_arguments(mu: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of ``ss.models.StribeckContact`` for it."""
    if TABLE in mu:
        return {"mu": [tuple(row) for row in mu[TABLE]]}
    return {key: mu[key] for key in _CURVE if key in mu}


def _friction(value: object) -> Any:
    """A number, a table over temperature, or friction over velocity."""
    if not isinstance(value, dict) or not is_over_velocity(value):
        return number_or_table(value)
    from slipstick.contact.velocity_friction import StribeckContact

    known = (TABLE, *_CURVE)
    faults = [Fault(key, UNKNOWN_KEY, remedy=suggestion(key, known)) for key in value if key not in known]
    if faults:  # what is missing may be what was misspelt
        raise InputError(faults)
    if TABLE in value and (others := [key for key in _CURVE if key in value]):
        faults.append(Fault(TABLE, f"is given together with {', '.join(others)}", remedy="keep one"))
    else:
        curve = {"mu": value[TABLE]} if TABLE in value else velocity_arguments(value)
        try:
            StribeckContact(kt=1.0, normal_load=1.0, **curve)
        except InputError as error:
            faults += [replace(f, where=(TABLE,)) if TABLE in value else f for f in error.faults]
    if faults:
        raise InputError(faults)
    return value


Friction = Annotated[float | dict[str, Any], PlainValidator(_friction)]
