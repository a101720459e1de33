"""What users ask of stability; nothing that judges it is loaded for that."""

from __future__ import annotations

from typing import Literal

from slipstick.errors import Fault, InputError
from slipstick.faults import shown

StabilityRequest = bool | Literal["full"]
"""What users ask for."""


def stability_request(given: object) -> StabilityRequest:
    """Whether stability is asked for; InputError for anything but True, False, "full"."""
    if isinstance(given, bool) or (isinstance(given, str) and given == "full"):
        return given  # type: ignore[return-value]
    raise InputError(Fault("stability", found=shown(given), expected='True, False, or "full" (all modes in motion)'))
