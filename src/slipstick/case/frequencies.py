"""The frequencies a case file writes and the unit they are shown in; whether they and the blade fit its units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.case.sentences import toml
from slipstick.errors import Fault, Where
from slipstick.quantities import frequency_unit, unit_of_time_fault
from slipstick.units import Units

_SI = {"length": "m", "force": "N", "time": "s"}


def display_unit(raw: Mapping[str, Any], units: Units) -> str:
    """The unit the range of a case is written in, else rad/time."""
    found = (frequency_unit(value) for where, value in _written(raw) if where[0] == "response")
    return next((unit for unit in found if unit is not None), units.angular)


def frequency_faults(raw: Mapping[str, Any], units: Units) -> list[Fault]:
    """Frequencies written in Hz, rpm or rad/s where the unit of time is another than the second."""
    return [
        unit_of_time_fault(where, toml(value), units.time, units.angular)
        for where, value in _written(raw)
        if not units.in_seconds and frequency_unit(value) is not None
    ]


def blade_faults(raw: Mapping[str, Any], units: Units) -> list[Fault]:
    """Names of units that are not those of the parametric blade, which is in SI."""
    structure = raw.get("structure")
    kind = structure.get("kind") if isinstance(structure, Mapping) else None
    why = 'but a structure of kind "blade" is in SI units'
    return [
        Fault(("units", name), found=f"{toml(getattr(units, name))}, {why}", expected=toml(unit))
        for name, unit in _SI.items()
        if kind == "blade" and getattr(units, name) not in (unit, name)
    ]


def _written(raw: Mapping[str, Any]) -> Iterator[tuple[Where, Any]]:
    response, structure = (raw[key] if isinstance(raw.get(key), Mapping) else {} for key in ("response", "structure"))
    for key in ("omega",) if "parameter" in response else ("from", "to"):
        yield ("response", key), response.get(key)
    requested = response.get("at")
    if "parameter" not in response and isinstance(requested, list):
        yield from ((("response", "at", i), value) for i, value in enumerate(requested))
    yield ("structure", "up_to"), structure.get("up_to")
