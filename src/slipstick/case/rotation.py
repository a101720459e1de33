"""The table ``rotation`` of a structure in a case file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, PlainValidator

from slipstick.case.rotor import AxisTable
from slipstick.case.sentences import unexpected
from slipstick.case.tables import Frequency, Table
from slipstick.errors import IS_MISSING, Fault
from slipstick.quantities import read_frequency


def _by_speed(value: Any) -> dict[float, str]:
    """Speeds as keys: ``{ "3000 rpm" = "model_3000.h5" }``."""
    files = isinstance(value, dict) and value and all(isinstance(name, str) and name for name in value.values())
    if not files:
        raise unexpected('a table of model files by speed, such as { "3000 rpm" = "model_3000.h5" }')
    speeds = {read_frequency(_as_number(key)): name for key, name in value.items()}
    if min(speeds) <= 0.0 or len(speeds) < len(value):
        raise unexpected("speeds > 0, each once")
    return speeds


def _as_number(key: str) -> Any:
    """A key of digits is a number, rad/s."""
    try:
        return float(key)
    except ValueError:
        return key


class RotationTable(Table):
    """``rotation = { speed = "3000 rpm", axis = { point = [0, 0, 0], direction = [0, 0, 1] } }``."""

    speed: Frequency = Field(description='a speed > 0 such as "3000 rpm", fixed for the run')
    axis: AxisTable | None = Field(
        default=None, description="a table such as { point = [0, 0, 0], direction = [0, 0, 1] }"
    )
    models: Annotated[dict[float, str], PlainValidator(_by_speed)] | None = Field(
        default=None, description='a table of model files by speed, such as { "3000 rpm" = "model_3000.h5" }'
    )


def rotation_faults(raw: Mapping[str, Any]) -> list[Fault]:
    """Either the axis is given, or matrices that hold it."""
    given = raw.get("rotation")
    if not isinstance(given, dict):
        return []
    if "models" in given and "axis" in given:
        return [Fault(("rotation", "axis"), "is given together with models", remedy="they hold it: leave it out")]
    if not {"models", "axis"} & set(given):
        remedy = "give axis = { point = [0, 0, 0], direction = [0, 0, 1] }, or models by speed"
        return [Fault(("rotation", "axis"), IS_MISSING, remedy=remedy)]
    return []
