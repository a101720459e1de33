"""A model at the speed of its ``rotation`` table, from its mesh or between matrices."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from slipstick.case.body import Tell
from slipstick.case.paths import inside
from slipstick.case.reducing import CACHE, reduction_folder
from slipstick.case.rotation import RotationTable
from slipstick.case.rotor import axis_arguments
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.fem.imported import ImportedModel


def turning(model: ImportedModel, table: RotationTable | None, folder: Path, tell: Tell) -> ImportedModel:
    """The model at the speed of its ``rotation`` table; what is suspicious is in its warnings."""
    from slipstick.fem.rotation import turned_model
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
