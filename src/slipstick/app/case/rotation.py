"""``rotation`` of a structure in a case file: a model at speed, from its mesh or between matrices."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator

from slipstick.app.case.body import Tell
from slipstick.app.case.paths import inside
from slipstick.app.case.quantity_texts import read_frequency
from slipstick.app.case.reducing import CACHE, reduction_folder
from slipstick.app.case.rotor import AxisTable, axis_arguments
from slipstick.app.case.sentences import unexpected
from slipstick.app.case.tables import Frequency, Table
from slipstick.errors import IS_MISSING, Fault, InputError

if TYPE_CHECKING:
    from slipstick.fem.imported import ImportedModel


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


def turning(model: ImportedModel, table: RotationTable | None, folder: Path, tell: Tell) -> ImportedModel:
    """The model at the speed of its ``rotation`` table; what looks wrong is in its warnings."""
    from slipstick.fem.at_speed import turned_model
    from slipstick.io.model_file import load_model

    if table is None:
        return model
    tell(f"structure: stiffness at {table.speed:g} rad/s{'' if table.models else f', or reading it from {CACHE}'} ...")
    try:
        if table.models is None:
            return turned_model(model, table.speed, axis=axis_arguments(table.axis), cache=reduction_folder(folder))
        others = {s: load_model(inside(folder, name), quiet=True) for s, name in table.models.items()}
        return turned_model(model, table.speed, others=others)
    except InputError as error:
        raise InputError([fault.inside("rotation") for fault in error.faults]) from None
