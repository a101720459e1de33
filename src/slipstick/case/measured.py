"""``[structure] kind = "measured"``: modes fitted to measured frequency response functions."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Literal

from pydantic import Field

from slipstick.case.requests import Frequencies
from slipstick.case.script_text import KeysToWrite, call, here
from slipstick.case.source import inside
from slipstick.case.structure import Body, Described, StructureKind, Tell
from slipstick.case.table import Table
from slipstick.case.validation import ReadTable
from slipstick.errors import SlipstickWarning
from slipstick.faults import Gathering


class MeasuredTable(Table):
    """``[structure] kind = "measured"``."""

    kind: Literal["measured"]
    file: str = Field(description="the name of a file of receptances: .unv, .uff, .csv, .npz, .nc")
    modes: int | None = Field(default=None, ge=1, description="a whole number >= 1, how many modes are fitted")
    range: Frequencies | None = Field(
        default=None, description='two frequencies between which they are fitted, such as ["20 Hz", "400 Hz"]'
    )
    quantity: Literal["displacement", "velocity", "acceleration"] | None = Field(
        default=None, description="what was measured, where the file does not say"
    )


def _measured(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    from slipstick.models.modal_test import modal_analysis

    name = row.get("file")
    path = None if name is None else gathering.inside(("file",), inside, folder, name)
    if path is None or not row.complete:
        return Described(made=True)
    table = row.table
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)  # told with the whole case
        fit = gathering.inside(
            ("file",), modal_analysis, path, modes=table.modes, range=table.range, quantity=table.quantity
        )
    if fit is None:
        return Described(made=True)
    tell(f"  {fit.structure.omega.size} modes fitted to {100 * fit.error:.2g} %")
    return Described(body=Body(structure=fit.structure, fit=fit), dofs=fit.structure.dofs, made=True)


def _script(keys: KeysToWrite, _folder: Path) -> list[str]:
    file, arguments = here(keys.take("file")), keys.rest("modes", "quantity")
    span = keys.take("range")
    if span is not None:
        arguments["range"] = repr(tuple(span))
    return [f"structure = {call('ss.models.modal_analysis', file, **arguments)}.structure"]


MEASURED = StructureKind(table=MeasuredTable, build=_measured, script=_script)
