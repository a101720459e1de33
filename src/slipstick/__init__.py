"""Steady vibration of structures that stick, slip, separate and rub.

Multiharmonic balance with exact analytical friction contact elements. Public names are loaded on first use, so that
``import slipstick`` does no work.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PUBLIC = {
    "Harmonics": "slipstick.trig.harmonics",
    "FrictionContact": "slipstick.contact.parameters",
    "RubbingMotion": "slipstick.contact.rubbing",
    "common_period": "slipstick.contact.rubbing",
    "contact_forces": "slipstick.contact.forces",
    "MatrixStructure": "slipstick.structure.matrices",
    "ModalStructure": "slipstick.structure.modal",
    "reduce": "slipstick.structure.reduction",
    "ContactPair": "slipstick.balance.problem",
    "Load": "slipstick.balance.problem",
    "Problem": "slipstick.balance.problem",
    "FrictionCurve": "slipstick.thermal.friction_curve",
    "ThermalModel": "slipstick.thermal.model",
    "Branch": "slipstick.results.branch",
    "forced_response": "slipstick.analysis.response",
    "parameter_response": "slipstick.analysis.response",
    "linear_response": "slipstick.analysis.response",
    "transient": "slipstick.analysis.transient",
    "InputError": "slipstick.errors",
    "Outcome": "slipstick.errors",
    "SlipstickWarning": "slipstick.errors",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'slipstick' has no attribute '{name}'")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
