"""The structure a case describes, one builder for each ``kind``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.body import Body, Tell, silent
from slipstick.app.fe_tables import BladeTable, FeTable
from slipstick.app.paths import inside
from slipstick.app.sentences import model_faults, shown, suggestion
from slipstick.app.tables import MatricesTable, ModalTable, Table
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.structure.protocol import Structure

_SECTION = "[structure]"
_KEYS = {"M": "mass", "C": "damping", "K": "stiffness"}


def build_structure(raw: Any, folder: Path, tell: Tell = silent) -> tuple[Body | None, list[str]]:
    """What a ``[structure]`` table describes, or the faults found in it; ``tell`` hears of stages that take time."""
    if not isinstance(raw, Mapping):
        return None, [f"{_SECTION}: found {shown(raw)}; expected one table [structure]"]
    kind = raw.get("kind")
    if kind is None:
        return None, [f"{_SECTION} kind is missing; give one of {_kinds()}"]
    if not isinstance(kind, str) or kind not in _BUILDERS:
        guess = suggestion(kind, _BUILDERS)
        hint = f"; {guess}" if guess.startswith("did") else ""
        return None, [f"{_SECTION} kind: found {shown(kind)}; this version knows {_kinds()}{hint}"]
    model, build = _BUILDERS[kind]
    table, faults = model_faults(model, raw, _SECTION)
    faults += [f"{_SECTION}: {fault}" for fault in model.cross_check(raw)]
    if table is None or faults:
        return None, faults
    try:
        return build(table, folder, tell), []
    except InputError as error:
        return None, [_prefixed(problem) for problem in error.problems]


def named_dofs(raw: Any) -> list[str] | None:
    """The dof names written in the file, for messages where the structure itself is faulty."""
    names = raw.get("dofs") if isinstance(raw, Mapping) else None
    return names if isinstance(names, list) and names and all(isinstance(n, str) for n in names) else None


def _prefixed(problem: str) -> str:
    """A fault of the structure's own arguments in the words of the file."""
    name, colon, rest = problem.partition(":")
    return f"{_SECTION} {_KEYS.get(name, name)}{colon}{rest}"


def _kinds() -> str:
    return ", ".join(f'"{kind}"' for kind in _BUILDERS)


def _matrices(table: Any, folder: Path) -> Structure:
    from slipstick.structure.matrices import MatrixStructure

    matrices: dict[str, Any] = {}
    faults: list[str] = []
    for name in ("mass", "damping", "stiffness"):
        try:
            matrices[name] = _matrix(getattr(table, name), folder, name)
        except InputError as error:
            faults += error.problems
    if faults:
        raise InputError(faults)
    size = matrices["stiffness"].shape[0]
    faults = [
        f"{name}: found {m.shape[0]} x {m.shape[1]}; expected {size} x {size} as the stiffness"
        for name, m in matrices.items()
        if m is not None and m.shape != (size, size)
    ]
    dofs = table.dofs if table.dofs is not None else [str(i + 1) for i in range(size)]
    if table.dofs is not None and len(dofs) != size:
        faults.append(f"dofs: found {len(dofs)} names; expected {size}, one for each row of the stiffness")
    if table.count is not None and table.count != size:
        faults.append(f"count: found {table.count}; expected {size}, the rows of the stiffness")
    if faults:
        raise InputError(faults)
    return MatrixStructure(
        M=matrices["mass"], C=matrices["damping"], K=matrices["stiffness"], dofs=dofs, loss_factor=table.loss_factor
    )


def _matrix(value: Any, folder: Path, key: str) -> Any:
    import numpy as np

    from slipstick.importers.plain.matrix_file import read_matrix

    if value is None:
        return None
    if not isinstance(value, str):
        return np.array(value, dtype=float)
    return read_matrix(_file(value, folder, key))


def _file(name: str, folder: Path, key: str) -> Path:
    try:
        return inside(folder, name)
    except ValueError as error:
        raise InputError(f"{key}: found {shown(name)}; {error}") from None


def _modal(table: Any, folder: Path) -> Structure:
    from slipstick.structure.modal import ModalStructure

    return ModalStructure.load(
        _file(table.file, folder, "file"),
        dofs=table.dofs,
        modes=table.modes,
        loss_factor=table.loss_factor,
        damping_ratio=table.damping_ratio,
    )


def _fe(table: Any, folder: Path, tell: Tell) -> Body:
    from slipstick.app.fe_body import fe_body

    return fe_body(table, folder, tell)


def _blade(table: Any, folder: Path, tell: Tell) -> Body:
    from slipstick.app.blade_body import blade_body

    return blade_body(table, folder, tell)


def _plain(make: Callable[[Any, Path], Structure]) -> Callable[[Any, Path, Tell], Body]:
    return lambda table, folder, _tell: Body(structure=make(table, folder), force=getattr(table, "force", False))


_BUILDERS: dict[str, tuple[type[Table], Callable[[Any, Path, Tell], Body]]] = {
    "matrices": (MatricesTable, _plain(_matrices)),
    "modal": (ModalTable, _plain(_modal)),
    "fe": (FeTable, _fe),
    "blade": (BladeTable, _blade),
}
