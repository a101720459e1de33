"""The frequencies a case file writes: the unit they are shown in, and whether they fit its unit of time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.app.sentences import shown
from slipstick.app.units import frequency_unit
from slipstick.units import Units


def display_unit(raw: Mapping[str, Any], units: Units) -> str:
    """The unit the range of a case is written in, else rad/time."""
    found = (frequency_unit(value) for where, value in _written(raw) if where.startswith("[response]"))
    return next((unit for unit in found if unit is not None), units.angular)


def frequency_faults(raw: Mapping[str, Any], units: Units) -> list[str]:
    """Frequencies written in Hz, rpm or rad/s where the unit of time is another than the second."""
    return [
        f"{where}: found {shown(value)}, which counts in seconds, but the unit of time is {shown(units.time)}; "
        f"give a plain number in {units.angular}"
        for where, value in _written(raw)
        if not units.in_seconds and frequency_unit(value) is not None
    ]


def _written(raw: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    response, structure = (raw[key] if isinstance(raw.get(key), Mapping) else {} for key in ("response", "structure"))
    for key in ("omega",) if "parameter" in response else ("from", "to"):
        yield f"[response] {key}", response.get(key)
    requested = response.get("at")
    if "parameter" not in response and isinstance(requested, list):
        yield from ((f"[response] at, value {i}", value) for i, value in enumerate(requested, start=1))
    yield "[structure] up_to", structure.get("up_to")
