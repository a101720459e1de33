"""``[structure]`` of kind "matrices", "modal" and "free": matrices, as numbers or from a file, modes, free bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from slipstick.case.rotor import ROTATION, RotationTable, rotation_faults, rotation_script, turning
from slipstick.case.script_text import Call, Code, call, file_code, here, literal
from slipstick.case.source import inside
from slipstick.case.structure import Body, Described, StructureKind, Tell, within
from slipstick.case.table import Frequency, MatrixGiven, NotNegative, RawTable, Table
from slipstick.case.validation import ReadTable
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import Gathering

if TYPE_CHECKING:
    from slipstick.fem.model import ImportedModel
    from slipstick.structure.matrices import MatrixStructure


KEYS = {"M": "mass", "C": "damping", "K": "stiffness"}
_TURNING = {"gyroscopic": "gyroscopic", "circulatory": "circulatory"}


class KeptTable(Table):
    """Keys that make a structure with matrices smaller."""

    keep: list[str] | None = Field(default=None, min_length=1, description='a list of dofs to keep such as ["n2x"]')
    modes: int | None = Field(
        default=None, ge=0, le=10_000, description="a whole number >= 0, modes of the other dofs that are kept"
    )

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Both are given, or none."""
        if "keep" in raw and "modes" not in raw:
            return [Fault("modes", IS_MISSING, remedy="give how many modes of the other dofs are kept")]
        if "modes" in raw and "keep" not in raw:
            return [Fault("keep", IS_MISSING, remedy="give the dofs that are loaded, in contact or looked at")]
        return []


def kept(table: Any, structure: MatrixStructure) -> MatrixStructure:
    """The structure, made smaller where that is asked for."""
    smaller: MatrixStructure = structure if table.keep is None else _smaller(table, structure).made()
    return smaller


def _smaller(table: Any, structure: MatrixStructure | None = None) -> Call:
    return Call("ss.models.craig_bampton", (Code("structure", structure), table.keep), {"modes": table.modes})


def kept_script(table: Any, made: Call) -> list[str]:
    """Lines that make the same, ``made`` being the structure as it is."""
    calls = [made] if table.keep is None else [made, _smaller(table)]
    return [f"structure = {one.written()}" for one in calls]


class MatricesTable(KeptTable):
    """``[structure] kind = "matrices"``."""

    kind: Literal["matrices"]
    dofs: list[str] | None = Field(default=None, description='a list of names such as ["x", "y"]')
    count: int | None = Field(
        default=None, ge=1, le=10_000_000, description='a whole number >= 1: the dofs are then named "1", "2", ...'
    )
    mass: MatrixGiven = Field(description="a square list of rows, or the name of an .npz or .mtx file")
    damping: MatrixGiven | None = Field(default=None, description="a square list of rows, or the name of a file")
    stiffness: MatrixGiven = Field(description="a square list of rows, or the name of an .npz or .mtx file")
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")
    gyroscopic: MatrixGiven | None = Field(default=None, description="a square list of rows, or the name of a file")
    circulatory: MatrixGiven | None = Field(default=None, description="a square list of rows, or the name of a file")
    speed: Frequency | None = Field(default=None, description='a speed of rotation such as "3000 rpm"')
    engine_order: int | None = Field(
        default=None, ge=1, le=10_000, description="a whole number >= 1: omega over the speed"
    )

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Dofs or count, not both."""
        both = "dofs" in raw and "count" in raw
        twice = [Fault("count", "is given together with dofs", remedy="keep one of them")] if both else []
        return [*super().cross_check(raw), *twice]


def _matrices(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    from slipstick.structure.matrices import DENSE_LIMIT
    from slipstick.structure.matrix_checks import FREE, system_matrices

    matrices = {
        name: matrix
        for name, key in (KEYS | _TURNING).items()
        if (value := row.get(key)) is not None
        and (matrix := gathering.inside((key,), read_given, value, folder)) is not None
    }
    size = next((matrices[name].shape[0] for name in ("K", "M", "C") if name in matrices), None)
    names = _names(row, size)
    before = len(gathering.faults)
    if size is not None:
        _sizes(row, matrices, size, gathering)
    agree = len(gathering.faults) == before
    if row.complete and agree and {"M", "K"} <= set(matrices) and names is not None:
        whole = _call(row.table, {**matrices, "dofs": names})
        structure = _in_case(gathering, lambda: kept(row.table, whole.made()))
        body = None if structure is None else Body(structure=structure)
        return Described(body=body, dofs=names if structure is None else structure.dofs, made=True)
    if size is not None:
        fitting = {name: m for name, m in matrices.items() if m.shape == (size, size) and name not in _TURNING}
        faults = system_matrices(fitting, size, dense=size <= DENSE_LIMIT)[1]
        gathering.faults += [renamed(fault) for fault in faults if fault != FREE or size > DENSE_LIMIT]
    return Described(dofs=names, made=True)


def _call(table: MatricesTable, given: Mapping[str, Any]) -> Call:
    return Call("ss.MatrixStructure", named={**given, **table.given("loss_factor", "engine_order", "speed")})


def _names(row: ReadTable, size: int | None) -> Sequence[str] | None:
    """Names of the dofs: as written, else numbers; None where they are not known."""
    if not row.right("dofs", "count"):
        return None
    if row.table.dofs is not None:
        return list(row.table.dofs)
    count = row.table.count if row.table.count is not None else size
    return None if count is None else [str(i + 1) for i in range(count)]


def _sizes(row: ReadTable, matrices: Mapping[str, Any], size: int, gathering: Gathering) -> None:
    """Whether the matrices and the names fit together."""
    first = next(name for name in ("K", "M", "C") if name in matrices)
    of = KEYS[first]
    for name, matrix in matrices.items():
        if matrix.shape != (size, size):
            shape = f"{matrix.shape[0]} x {matrix.shape[1]}"
            gathering.faults.append(
                Fault((KEYS | _TURNING)[name], found=shape, expected=f"{size} x {size} as the {of}")
            )
    dofs, count = row.get("dofs"), row.get("count")
    if dofs is not None and len(dofs) != size:
        expected = f"{size}, one for each row of the {of}"
        gathering.faults.append(Fault("dofs", found=f"{len(dofs)} names", expected=expected))
    if count is not None and count != size:
        gathering.faults.append(Fault("count", found=str(count), expected=f"{size}, the rows of the {of}"))


def _in_case(gathering: Gathering, make: Callable[[], MatrixStructure]) -> MatrixStructure | None:
    """A structure of the library, whose arguments have other names in the file."""
    try:
        return make()
    except InputError as error:
        gathering.faults += [renamed(fault) for fault in error.faults]
        return None


def renamed(fault: Fault) -> Fault:
    """A fault of the library's argument at the key of the file."""
    return replace(fault, where=(*(KEYS.get(str(name), name) for name in fault.where[:1]), *fault.where[1:]))


def read_given(value: object, folder: Path) -> Any:
    """A matrix that is given by its rows, or in a file."""
    import numpy as np

    from slipstick.importers.plain.matrix_file import read_matrix

    return read_matrix(inside(folder, value)) if isinstance(value, str) else np.array(value, dtype=float)


def _matrices_script(table: MatricesTable, folder: Path) -> list[str]:
    known = {letter: value for letter, key in (KEYS | _TURNING).items() if (value := getattr(table, key)) is not None}
    lines = [f"{letter} = {matrix_text(value, folder)}" for letter, value in known.items()]
    dofs = table.dofs or Code("[str(i + 1) for i in range(K.shape[0])]")
    return [*lines, *kept_script(table, _call(table, {**{name: Code(name) for name in known}, "dofs": dofs}))]


def matrix_text(value: list[Any] | str, folder: Path) -> str:
    """The same as Python writes it."""
    return file_code(value, folder) if isinstance(value, str) else call("np.array", literal(value))


MATRICES = StructureKind(table=MatricesTable, build=_matrices, script=_matrices_script)


class ModelTable(KeptTable):
    """``[structure] kind = "matrices"`` of an imported model."""

    kind: Literal["matrices"]
    file: str = Field(description="the name of a model.h5 made by 'slipstick import', such as a superelement")
    rotation: RotationTable | None = Field(default=None, description=ROTATION)
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """The rotation is said in one way."""
        return [*super().cross_check(raw), *rotation_faults(raw)]


def _model(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    """The matrices of a model file, with its names."""
    from slipstick.io.model_file import load_model

    name = row.get("file")
    path = None if name is None else gathering.inside(("file",), inside, folder, name)
    model = None if path is None else gathering.inside(("file",), partial(load_model, quiet=True), path)
    if model is None or not row.complete:
        return Described(dofs=None if model is None else model.dofs, made=True)
    model = gathering.inside((), turning, model, row.table.rotation, folder, tell)
    if model is None:
        return Described(made=True)
    whole = gathering.inside(("file",), _model_call(row.table, model).made)
    structure = None if whole is None else gathering.inside((), kept, row.table, whole)
    if structure is None:
        return Described(dofs=model.dofs, made=True)
    return Described(body=Body(structure=structure, model=model), dofs=structure.dofs, made=True)


def _model_call(table: ModelTable, model: ImportedModel | None = None) -> Call:
    parts = {name: Code(f"model.{name}", getattr(model, name, None)) for name in ("M", "C", "K", "dofs")}
    return Call("ss.MatrixStructure", named={**parts, **table.given("loss_factor")})


def _model_script(table: ModelTable, _folder: Path) -> list[str]:
    model = Call("ss.import_model", (here(table.file),))
    lines = [f"model = {model.written()}", *rotation_script(table.rotation)]
    return [*lines, *kept_script(table, _model_call(table))]


MODEL = StructureKind(table=ModelTable, build=_model, script=_model_script)


_MODAL = ("dofs", "modes", "loss_factor", "damping_ratio")


class ModalTable(Table):
    """``[structure] kind = "modal"``."""

    kind: Literal["modal"]
    file: str = Field(description="the name of an .npz file with omega, mode_shapes and static_compliance")
    dofs: list[str] | None = Field(default=None, description='a list of names; by default "n1x", "n1y", "n1z", "n2x"')
    modes: int | None = Field(default=None, ge=1, description="a whole number >= 1, how many modes to use")
    loss_factor: NotNegative | None = Field(default=None, description="a number >= 0, the hysteretic loss factor")
    damping_ratio: float | None = Field(default=None, description="a number, the ratio to critical damping")
    force: bool = Field(default=False, description="true or false: take modes that are too few")


def _modal(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    """The structure of a file; with keys at fault left out, it still tells the dofs."""
    name = row.get("file")
    path = None if name is None else gathering.inside(("file",), inside, folder, name)
    if path is None:
        return Described(dofs=row.get("dofs"), made=True)
    try:
        structure = _modal_call(row.table, path).made()
    except InputError as error:
        gathering.faults += [within(fault, _MODAL) for fault in error.faults]
        return Described(dofs=row.get("dofs") or _modal_names(path), made=True)
    body = Body(structure=structure, force=row.table.force) if row.complete else None
    return Described(body=body, dofs=structure.dofs, made=True)


def _modal_call(table: ModalTable, path: Path | None = None) -> Call:
    """The structure of its file; ``file`` itself may be at fault."""
    return Call("ss.ModalStructure.load", (here(table.file, path),), table.given(*_MODAL))


def _modal_names(path: Path) -> Sequence[str] | None:
    """The names of the dofs in a file, where it is readable."""
    from slipstick.structure.modal import modal_arrays, modal_dofs

    try:
        return modal_dofs(modal_arrays(path))
    except InputError:
        return None


def _modal_script(table: ModalTable, _folder: Path) -> list[str]:
    return [f"structure = {_modal_call(table).written()}"]


MODAL = StructureKind(table=ModalTable, build=_modal, script=_modal_script)


_FREE_MATRICES = {"M": "mass", "K": "stiffness"}


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
        own = ("dofs", *_FREE_MATRICES.values())
        if "file" in raw:
            return [Fault(key, "is given together with file", remedy="keep one") for key in own if key in raw]
        return [Fault(key, IS_MISSING, remedy=f"give {', '.join(own)}, or file") for key in own if key not in raw]


def _free(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    given: Mapping[str, Any] | None = None
    if row.get("file") is not None:
        given = gathering.inside(("file",), _of_file, row.table.file, folder)
    elif all(row.get(key) is not None for key in ("dofs", *_FREE_MATRICES.values())):
        before = len(gathering.faults)
        given = {
            letter: gathering.inside((key,), read_given, row.get(key), folder) for letter, key in _FREE_MATRICES.items()
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
        structure = _free_call(table, given).made()
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


def _free_call(table: FreeTable, given: Mapping[str, Any]) -> Call:
    more = table.given("keep", "modes", "loss_factor", "damping_ratio")
    return Call("ss.models.free_structure", (given["K"], given["M"]), {"dofs": given["dofs"], **more})


def _free_script(table: FreeTable, folder: Path) -> list[str]:
    if table.file is None:
        lines = [f"{letter} = {matrix_text(getattr(table, key), folder)}" for letter, key in _FREE_MATRICES.items()]
        given = {"K": Code("K"), "M": Code("M"), "dofs": table.dofs}
    else:
        lines = [f"model = {Call('ss.import_model', (here(table.file),)).written()}"]
        given = {name: Code(f"model.{name}") for name in ("K", "M", "dofs")}
    return [*lines, f"structure = {_free_call(table, given).written()}"]


FREE = StructureKind(table=FreeTable, build=_free, script=_free_script)
