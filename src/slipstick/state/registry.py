"""Contact states of the package: their results variables, and how files store their models."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from slipstick.state.contact_state import StateVariable
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.model import TEMPERATURE, ThermalModel
from slipstick.state.wear import WearModel

STATE_VARIABLES: tuple[StateVariable, ...] = (TEMPERATURE,)
"""Results variables of every problem, whether its contacts have the state or not."""

STORED_STATES: dict[str, tuple[type, Any]] = {
    "thermal": (ThermalModel, lambda model: {f.name: getattr(model, f.name) for f in fields(model)}),
    "wear": (WearModel, lambda model: {"kappa": model.kappa}),
    "friction curve": (FrictionCurve, lambda curve: {**curve.tables, "interpolation": curve.interpolation}),
}
"""By name in results files: the class of a part of their models, and a function for the arguments of an equal one."""
