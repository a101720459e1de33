"""``[structure] kind = "free"``: a body that is not held, by its matrices or from a model file, reduced."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from slipstick.case.matrices import matrix_text, read_given, renamed
from slipstick.case.script_text import Call, Code, here
from slipstick.case.source import inside
from slipstick.case.structure import Body, Described, StructureKind, Tell
from slipstick.case.table import MatrixGiven, NotNegative, RawTable, Table
from slipstick.case.validation import ReadTable
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import Gathering

_MATRICES = {"M": "mass", "K": "stiffness"}


class FreeTable(Table):
    """``[structure] kind = "free"``."""

    kind: Literal["free"]
    file: str | None = Field(default=None, description="the name of a model.h5 made by 'slipstick import'")
    dofs: list[str] | None = Field(default=None, description='a list of names such as ["x", "y"]')
    mass: MatrixGiven | None = Field(default=None, description="a square list of rows, or the name of a file")
    stiffness: MatrixGiven | None = Field(default=None, description="a square list of rows, or the name of a file")
    keep: list[str] = Field(min_length=1, description='a list of dofs that are kept, such as ["n123y"]')
    modes: int = Field(ge=1, le=10_000, description="a whole number >= 1, how many elastic modes to keep")
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")
    damping_ratio: float = Field(default=0.0, description="a number, the ratio to critical damping")

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """A model file holds matrices and names."""
        own = ("dofs", *_MATRICES.values())
        if "file" in raw:
            return [Fault(key, "is given together with file", remedy="keep one") for key in own if key in raw]
        return [Fault(key, IS_MISSING, remedy=f"give {', '.join(own)}, or file") for key in own if key not in raw]


def _free(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    given: Mapping[str, Any] | None = None
    if row.get("file") is not None:
        given = gathering.inside(("file",), _of_file, row.table.file, folder)
    elif all(row.get(key) is not None for key in ("dofs", *_MATRICES.values())):
        before = len(gathering.faults)
        given = {
            letter: gathering.inside((key,), read_given, row.get(key), folder) for letter, key in _MATRICES.items()
        }
        given = {**given, "dofs": row.table.dofs} if len(gathering.faults) == before else None
    names = row.get("keep")
    if names is not None and given is not None and not set(names) <= set(given["dofs"]):
        names = None  # told where they are kept
    if given is None or not row.complete:
        return Described(dofs=names, made=True)
    table = row.table
    tell(f"structure: reducing {len(given['dofs'])} dofs of a body that is not held ...")
    try:
        structure = _call(table, given).made()
    except InputError as error:
        of_file = table.file is not None
        gathering.faults += [
            fault.inside("file") if of_file and fault.where[:1] in (("K",), ("M",)) else renamed(fault)
            for fault in error.faults
        ]
        return Described(dofs=names, made=True)
    return Described(body=Body(structure=structure), dofs=structure.dofs, made=True)


def _of_file(name: str, folder: Path) -> Mapping[str, Any]:
    from slipstick.io.model_file import load_model

    model = partial(load_model, quiet=True)(inside(folder, name))
    return {"K": model.K, "M": model.M, "dofs": model.dofs}


def _call(table: FreeTable, given: Mapping[str, Any]) -> Call:
    more = table.given("keep", "modes", "loss_factor", "damping_ratio")
    return Call("ss.models.free_structure", (given["K"], given["M"]), {"dofs": given["dofs"], **more})


def _script(table: FreeTable, folder: Path) -> list[str]:
    if table.file is None:
        lines = [f"{letter} = {matrix_text(getattr(table, key), folder)}" for letter, key in _MATRICES.items()]
        given = {"K": Code("K"), "M": Code("M"), "dofs": table.dofs}
    else:
        lines = [f"model = {Call('ss.import_model', (here(table.file),)).written()}"]
        given = {name: Code(f"model.{name}") for name in ("K", "M", "dofs")}
    return [*lines, f"structure = {_call(table, given).written()}"]


FREE = StructureKind(table=FreeTable, build=_free, script=_script)
