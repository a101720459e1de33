"""How far the modes of a finite element model have to reach where a case does not say how many it wants."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, log10
from typing import Any

from slipstick.case.response_table import ResponseTable, frequencies_met

_KINDS = ("fe", "blade")
_SAID = ("modes", "accuracy", "up_to")
_HARMONICS = 5.0
"""Of what is excited, those that friction makes: beyond, they count less than 1/25."""
_STEPS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0)
"""A range moved a little has the same reduction, which need not be made again."""


def reaching(raw: Mapping[str, Any]) -> Any:
    """The ``[structure]`` of a case; one to be reduced says ``up_to`` where it leaves the number of modes open.

    That is the end of ``[response]`` with the harmonics that matter, rounded up. Nothing is added beside faults, which
    are told elsewhere.
    """
    structure, response = raw["structure"], raw.get("response")
    if not isinstance(structure, Mapping) or structure.get("kind") not in _KINDS or set(_SAID) & set(structure):
        return structure
    if not isinstance(response, Mapping) or ResponseTable.cross_check(response):
        return structure
    try:
        highest = max(frequencies_met(ResponseTable.model_validate(response)))
        orders = [int(load.get("harmonic", 1)) for load in raw.get("load", [])]
    except (AttributeError, TypeError, ValueError):  # ValidationError is one
        return structure
    return {**structure, "up_to": _rounded_up(_HARMONICS * max([1, *orders]) * highest)}


def _rounded_up(value: float) -> float:
    power = 10.0 ** floor(log10(value))
    return next((step * power for step in _STEPS if step * power >= value), 10.0 * power)
