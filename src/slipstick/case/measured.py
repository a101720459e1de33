"""``[structure] kind = "measured"``: measured frequency response functions, modes fitted to them or as they are."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Literal

from pydantic import Field

from slipstick.case.requests import Frequencies
from slipstick.case.script_text import Call, here
from slipstick.case.source import inside
from slipstick.case.structure import Body, Described, StructureKind, Tell, within
from slipstick.case.table import Table
from slipstick.case.validation import ReadTable
from slipstick.errors import Fault, InputError, SlipstickWarning
from slipstick.faults import Gathering


class MeasuredTable(Table):
    """``[structure] kind = "measured"``."""

    kind: Literal["measured"]
    file: str = Field(description="the name of a file of receptances: .unv, .uff, .csv, .mat, .npz, .nc")
    modes: int | None = Field(default=None, ge=1, description="a whole number >= 1, how many modes are fitted")
    range: Frequencies | None = Field(
        default=None, description='two frequencies between which they are fitted, such as ["20 Hz", "400 Hz"]'
    )
    fit: Literal["modes", "tabulated"] = Field(
        default="modes", description='"modes", or "tabulated": splines through the lines of the table'
    )
    static: list[list[float]] | None = Field(
        default=None, description="rows of numbers, the compliance at rest of a tabulated structure"
    )
    beyond: Literal["refuse", "line"] | None = Field(
        default=None, description='"refuse" or "line", what is done about frequencies outside the table'
    )
    smooth: bool | None = Field(default=None, description="true or false, whether noise is taken off the table")
    quantity: Literal["displacement", "velocity", "acceleration"] | None = Field(
        default=None,
        description='"displacement", "velocity" or "acceleration": what was measured, if the file does not say',
    )
    columns: dict[str, str] | None = Field(
        default=None, description='names of the columns of a file such as { "tip/tip.re" = "Re H11" }'
    )


_TABULATED = ("static", "beyond", "smooth")


def _measured(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    from slipstick.structure.tabulated import TabulatedStructure

    name, tabulated = row.get("file"), row.get("fit") == "tabulated"
    path = None if name is None else gathering.inside(("file",), inside, folder, name)
    wrong = [key for key in row.table.given("modes", *_TABULATED) if row.right(key) and (key == "modes") == tabulated]
    other = "modes" if tabulated else "tabulated"
    gathering.faults += [Fault(key, "is given", expected=f'fit = "{other}" beside it') for key in wrong]
    if path is None or wrong or not row.complete:
        return Described(made=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)  # told with the whole case
        fit = None
        try:
            fit = _call(row.table, path).made()
        except InputError as error:
            told = (replace(f, where=f.where[1:]) if f.where[:1] == (str(path),) else f for f in error.faults)
            gathering.faults += [within(fault, tuple(MeasuredTable.model_fields)) for fault in told]
    if fit is None:
        return Described(made=True)
    if isinstance(fit, TabulatedStructure):
        tell(f"  {fit.summary().splitlines()[0]}")
        return Described(body=Body(structure=fit, fit=fit), dofs=fit.dofs, made=True)
    tell(f"  {fit.structure.omega.size} modes fitted to {100 * fit.error:.2g} % (noise {100 * fit.noise:.2g} %)")
    return Described(body=Body(structure=fit.structure, fit=fit), dofs=fit.structure.dofs, made=True)


def _call(table: MeasuredTable, path: Path | None = None) -> Call:
    name = "ss.models.tabulated_structure" if table.fit == "tabulated" else "ss.models.modal_analysis"
    return Call(name, (here(table.file, path),), table.given("modes", "quantity", "columns", *_TABULATED, "range"))


def _script(table: MeasuredTable, _folder: Path) -> list[str]:
    fitted = "" if table.fit == "tabulated" else ".structure"
    return [f"structure = {_call(table).written()}{fitted}"]


MEASURED = StructureKind(table=MeasuredTable, build=_measured, script=_script)
