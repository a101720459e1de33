"""The structure a case describes, one builder for each ``kind``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.case.body import Body, Tell, silent
from slipstick.case.fe_tables import BladeTable, FeTable, ModelTable
from slipstick.case.paths import inside
from slipstick.case.sentences import toml
from slipstick.case.structure_tables import MatricesTable, ModalTable
from slipstick.case.tables import Table
from slipstick.case.validation import ReadTable, read_table
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import Gathering, suggestion

if TYPE_CHECKING:
    from slipstick.structure.protocol import Structure

_SECTION = "structure"
_KEYS = {"M": "mass", "C": "damping", "K": "stiffness"}


@dataclass(frozen=True, kw_only=True)
class Described:
    """What a ``[structure]`` table says: the body, where nothing is wrong with it, and the dofs as far as known."""

    body: Body | None = None
    dofs: Sequence[str] | None = None
    made: bool = False
    """Whether it is known what the structure is, though not all of it is right."""

    @property
    def structure(self) -> Structure | None:
        """The structure, where nothing is wrong with it."""
        return self.body.structure if self.body is not None else None


def read_structure(raw: Any, folder: Path, tell: Tell = silent) -> tuple[Described, list[Fault]]:
    """What ``[structure]`` describes, and the faults found in it; ``tell`` hears of stages that take time."""
    found = Gathering()
    described = found.take(_described, raw, folder, tell, found)
    return described or Described(), [fault.inside(_SECTION) for fault in found.faults]


def _described(raw: Any, folder: Path, tell: Tell, found: Gathering) -> Described:
    if not isinstance(raw, Mapping):
        raise InputError(Fault(found=toml(raw), expected="one table [structure]"))
    kind = raw.get("kind")
    if kind is None:
        raise InputError(Fault("kind", IS_MISSING, remedy=f"give one of {_kinds()}"))
    if not isinstance(kind, str) or kind not in _BUILDERS:
        guess = suggestion(kind, _BUILDERS)
        known = f"this version knows {_kinds()}"
        raise InputError(Fault("kind", known, found=toml(kind), remedy=guess if guess.startswith("did") else ""))
    model, build = (ModelTable, _model) if kind == "matrices" and "file" in raw else _BUILDERS[kind]
    row, faults = read_table(model, raw, ())
    found.faults += faults
    return build(row, folder, tell, found)


def _kinds() -> str:
    return ", ".join(f'"{kind}"' for kind in _BUILDERS)


def _matrices(row: ReadTable, folder: Path, tell: Tell, found: Gathering) -> Described:
    from slipstick.structure.matrices import DENSE_LIMIT, MatrixStructure
    from slipstick.structure.matrix_checks import system_matrices

    given = {
        name: matrix
        for name, key in _KEYS.items()
        if (value := row.get(key)) is not None and (matrix := found.inside((key,), _matrix, value, folder)) is not None
    }
    size = next((given[name].shape[0] for name in ("K", "M", "C") if name in given), None)
    names = _names(row, size)
    before = len(found.faults)
    if size is not None:
        _sizes(row, given, size, found)
    agree = len(found.faults) == before
    if row.complete and agree and {"M", "K"} <= set(given) and names is not None:
        options = {"loss_factor": row.table.loss_factor, "dofs": names}
        structure = _in_case(found, lambda: MatrixStructure(**given, **options))
        return Described(body=None if structure is None else Body(structure=structure), dofs=names, made=True)
    if size is not None:
        fitting = {name: matrix for name, matrix in given.items() if matrix.shape == (size, size)}
        found.faults += [_renamed(fault) for fault in system_matrices(fitting, size, dense=size <= DENSE_LIMIT)[1]]
    return Described(dofs=names, made=True)


def _model(row: ReadTable, folder: Path, tell: Tell, found: Gathering) -> Described:
    """The matrices of a model file, with its names."""
    from slipstick.case.turning import turning
    from slipstick.io.model_file import load_model
    from slipstick.structure.matrices import MatrixStructure

    name = row.get("file")
    path = None if name is None else found.inside(("file",), inside, folder, name)
    model = None if path is None else found.inside(("file",), partial(load_model, quiet=True), path)
    if model is None or not row.complete:
        return Described(dofs=None if model is None else model.dofs, made=True)
    model = found.inside((), turning, model, row.table.rotation, folder, tell)
    if model is None:
        return Described(made=True)
    given = {"M": model.M, "C": model.C, "K": model.K, "loss_factor": row.table.loss_factor}
    structure = found.inside(("file",), lambda: MatrixStructure(**given, dofs=model.dofs))
    body = None if structure is None else Body(structure=structure, model=model)
    return Described(body=body, dofs=model.dofs, made=True)


def _names(row: ReadTable, size: int | None) -> Sequence[str] | None:
    """Names of the dofs: as written, else numbers; None where they are not known."""
    if not row.right("dofs", "count"):
        return None
    if row.table.dofs is not None:
        return list(row.table.dofs)
    count = row.table.count if row.table.count is not None else size
    return None if count is None else [str(i + 1) for i in range(count)]


def _sizes(row: ReadTable, given: Mapping[str, Any], size: int, found: Gathering) -> None:
    """Whether the matrices and the names fit together."""
    first = next(name for name in ("K", "M", "C") if name in given)
    of = _KEYS[first]
    for name, matrix in given.items():
        if matrix.shape != (size, size):
            shape = f"{matrix.shape[0]} x {matrix.shape[1]}"
            found.faults.append(Fault(_KEYS[name], found=shape, expected=f"{size} x {size} as the {of}"))
    dofs, count = row.get("dofs"), row.get("count")
    if dofs is not None and len(dofs) != size:
        expected = f"{size}, one for each row of the {of}"
        found.faults.append(Fault("dofs", found=f"{len(dofs)} names", expected=expected))
    if count is not None and count != size:
        found.faults.append(Fault("count", found=str(count), expected=f"{size}, the rows of the {of}"))


def _in_case(found: Gathering, make: Callable[[], Structure]) -> Structure | None:
    """A structure of the library, whose arguments have other names in the file."""
    try:
        return make()
    except InputError as error:
        found.faults += [_renamed(fault) for fault in error.faults]
        return None


def _renamed(fault: Fault) -> Fault:
    return replace(fault, where=(*(_KEYS.get(str(name), name) for name in fault.where[:1]), *fault.where[1:]))


def _matrix(value: Any, folder: Path) -> Any:
    import numpy as np

    from slipstick.importers.plain.matrix_file import read_matrix

    return read_matrix(inside(folder, value)) if isinstance(value, str) else np.array(value, dtype=float)


def _modal(row: ReadTable, folder: Path, tell: Tell, found: Gathering) -> Described:
    """The structure of a file; with keys at fault left out, it still tells the dofs."""
    from slipstick.structure.modal import ModalStructure

    name = row.get("file")
    path = None if name is None else found.inside(("file",), inside, folder, name)
    if path is None:
        return Described(dofs=row.get("dofs"), made=True)
    options = {key: row.get(key) for key in ("dofs", "modes", "loss_factor", "damping_ratio")}
    try:
        structure = ModalStructure.load(path, **options)
    except InputError as error:
        found.faults += [_within(fault, tuple(options)) for fault in error.faults]
        return Described(dofs=options["dofs"] or _modal_names(path), made=True)
    body = Body(structure=structure, force=row.table.force) if row.complete else None
    return Described(body=body, dofs=structure.dofs, made=True)


def _modal_names(path: Path) -> Sequence[str] | None:
    """The names of the dofs in a file, where it is readable."""
    from slipstick.structure.modal import modal_arrays, modal_dofs

    try:
        return modal_dofs(modal_arrays(path))
    except InputError:
        return None


def _reduced(make: Callable[[Any, Path, Tell], Body], model: type[Table]) -> _Builder:
    """Builder of a finite element kind, which takes time: nothing is made of a table with faults."""
    keys = tuple(model.model_fields)

    def build(row: ReadTable, folder: Path, tell: Tell, found: Gathering) -> Described:
        if not row.complete:
            return Described()
        try:
            body = make(row.table, folder, tell)
        except InputError as error:
            found.faults += [_within(fault, keys) for fault in error.faults]
            return Described()
        return Described(body=body, dofs=body.structure.dofs)

    return build


def _within(fault: Fault, keys: Sequence[str]) -> Fault:
    """A fault of the model at the key it belongs to, else at its file or the table as a whole."""
    if fault.where and fault.where[0] in keys:
        return fault
    return fault.inside("file") if "file" in keys else fault


def _fe(table: Any, folder: Path, tell: Tell) -> Body:
    from slipstick.case.fe_body import fe_body

    return fe_body(table, folder, tell)


def _blade(table: Any, folder: Path, tell: Tell) -> Body:
    from slipstick.case.blade_body import blade_body

    return blade_body(table, folder, tell)


_Builder = Callable[[ReadTable, Path, Tell, Gathering], Described]

_BUILDERS: dict[str, tuple[type[Table], _Builder]] = {
    "matrices": (MatricesTable, _matrices),
    "modal": (ModalTable, _modal),
    "fe": (FeTable, _reduced(_fe, FeTable)),
    "blade": (BladeTable, _reduced(_blade, BladeTable)),
}
