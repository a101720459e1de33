"""Surface mesh of a reduced body: its motion by modes and by forces, for deflected shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np
from scipy.sparse import issparse

from slipstick.errors import Fault, InputError
from slipstick.structure.checks import array_faults, number_faults, real
from slipstick.structure.receptance import Receptance
from slipstick.typing import Array, IntArray, Matrix, Sparse

if TYPE_CHECKING:
    from slipstick.structure.modal import ModalStructure

MOST_SKIN_NODES = 50_000
"""Nodes of a surface mesh, at most; more do not improve a picture."""


@dataclass(frozen=True, kw_only=True)
class Skin:
    """Nodes and triangles of a surface mesh with its motion, three rows for each node: x, y, z; in single precision.

    Parameters
    ----------
    nodes
        Positions (n, 3).
    triangles
        Indices of their corners among the nodes (t, 3).
    modes
        Mass-normalised modes at the nodes (3 n, n_modes).
    static
        Exact static displacement by unit forces on the kept dofs (3 n, n_dofs); None: it is solved for with the full
        model of the structure.
    loads
        Exact static displacement by each load shape (3 n,).
    rows
        Rows of the full model, sparse (n_full, 3 n), where ``static`` is None.
    places
        Positions of the dofs (n_dofs, 3), nan where not known; None: no position is known.

    Raises
    ------
    InputError
        With one sentence for each fault.
    """

    nodes: Array
    triangles: IntArray
    modes: Array
    static: Array | None
    loads: Mapping[str, Array] = field(default_factory=dict)
    rows: Sparse | None = None
    places: Array | None = None

    def __post_init__(self) -> None:
        names = ("nodes", "triangles", "modes", *(() if self.static is None else ("static",)))
        arrays = {name: getattr(self, name) for name in names} | dict(self.loads)
        wrong = [fault for name, value in arrays.items() for fault in number_faults(("skin", name), value)]
        if wrong:
            raise InputError(wrong)
        nodes = real(self.nodes)
        moved = {name: real(value) for name, value in arrays.items() if name in ("modes", "static")}
        count = len(nodes) if nodes.ndim else 0
        faults = array_faults(("skin", "nodes"), nodes, (count, 3))
        if count > MOST_SKIN_NODES:
            faults.append(Fault(("skin", "nodes"), found=str(count), expected=f"at most {MOST_SKIN_NODES}"))
        for name, value in moved.items():
            faults += array_faults(("skin", name), value, (3 * count, *value.shape[1:2]))
        faults += solved_faults("skin", self.static, self.rows, 3 * count)
        places = None if self.places is None else np.asarray(self.places)
        if places is not None and (places.shape[1:] != (3,) or places.dtype.kind not in "fiu"):
            found = f"{places.dtype} of shape {places.shape}"
            faults.append(Fault(("skin", "places"), found=found, expected="real numbers (n_dofs, 3)"))
        loads = {str(name): real(value) for name, value in self.loads.items()}
        for name, value in loads.items():
            faults += array_faults(("skin", "loads", name), value, (3 * count,))
        triangles = real(self.triangles)
        faults += array_faults(("skin", "triangles"), triangles, (len(triangles) if triangles.ndim else 0, 3))
        if not faults and triangles.size and not (triangles.min() >= 0 and triangles.max() < count):
            numbers = f"nodes {triangles.min():g} to {triangles.max():g} of {count}"
            faults.append(Fault(("skin", "triangles"), found=numbers))
        if faults:
            raise InputError(faults)
        made: dict[str, Any] = {name: value.astype(np.float32) for name, value in moved.items()}
        made |= {"loads": {name: value.astype(np.float32) for name, value in loads.items()}}
        made |= {} if places is None else {"places": places.astype(float)}
        for name, value in (made | {"nodes": nodes, "triangles": triangles.astype(np.int64)}).items():
            object.__setattr__(self, name, value)

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an equal skin; rows and places only where they are given."""
        known = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in known.items() if name not in ("rows", "places") or value is not None}

    def faults(self, modes: int, dofs: int, shapes: tuple[str, ...], full: int | None = None) -> list[Fault]:
        """Faults as the surface mesh of a structure with so many modes and dofs, and these load shapes.

        ``full`` is the size of the full model for solutions, None where there is none.
        """
        faults = rows_faults("skin", self, modes, dofs, shapes, full)
        if self.places is not None and len(self.places) != dofs:
            faults.append(Fault(("skin", "places"), found=f"shape {self.places.shape}", expected=f"({dofs}, 3)"))
        return faults

    def part(self, nodes: IntArray, triangles: IntArray) -> Skin:
        """Part with some nodes, by index, and triangles (t, 3), by index among these."""
        kept = (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()
        return Skin(
            nodes=self.nodes[nodes], triangles=triangles, modes=self.modes[kept],
            static=None if self.static is None else self.static[kept],
            loads={name: load[kept] for name, load in self.loads.items()},
            rows=None if self.rows is None else self.rows.tocsc()[:, kept], places=self.places,
        )  # fmt: skip

    def basis(self, solved: Array | None = None) -> Array:
        """Orthonormal basis (3 n, k) of all motions of the mesh; ``solved`` (3 n, any) in place of static."""
        static = self.static if solved is None else solved
        assert static is not None
        columns = [self.modes, static, *(np.asarray(load)[:, None] for load in self.loads.values())]
        scaled = [np.asarray(c, dtype=float) / max(float(np.abs(c).max(initial=0.0)), 1e-300) for c in columns]
        return np.asarray(np.linalg.qr(np.hstack(scaled))[0])

    def along(self, basis: Array, structure: ModalStructure, known: SolvedFields | None = None) -> Recovered:
        """The structure with receptances at the ``k`` columns of a basis (3 n, k) of the motion of the mesh.

        ``known`` replaces ``static`` where that is None. There is no second-order residual.
        """
        loads = {name: basis.T @ load for name, load in self.loads.items()}
        static = self.static if known is None else known.static
        assert static is not None
        return Recovered(
            structure=structure, modes=basis.T @ self.modes, static=basis.T @ static, loads=loads,
            forces=None if known is None else known.forces,
        )  # fmt: skip


def solved_faults(name: str, static: object, rows: Sparse | None, count: int) -> list[Fault]:
    """Faults where neither static responses are given, nor ``count`` rows of a full model to solve with."""
    if static is None and rows is None:
        return [Fault((name, "static"), "is missing", remedy="give static, or rows of a full model to solve with")]
    if rows is not None and (not issparse(rows) or rows.shape[1] != count):
        found = f"shape {np.shape(rows)}" if issparse(rows) else type(rows).__name__
        return [Fault((name, "rows"), found=found, expected=f"a sparse matrix (n_full, {count})")]
    return []


class SolvedFields(NamedTuple):
    """Residuals at rows that are no dofs, under some fields of forces on the dofs."""

    forces: Array
    """Orthonormal (n_dofs, k)."""
    static: Array
    """By both residuals (n_rows, k)."""
    second: Array | None = None


class KnownRows(Protocol):
    """Rows that are no dofs, with their motion: modes (n_rows, n_modes), static (n_rows, n_dofs), loads (n_rows,)."""

    @property
    def modes(self) -> Array: ...  # noqa: D102
    @property
    def static(self) -> Array | None: ...  # noqa: D102
    @property
    def loads(self) -> Mapping[str, Array]: ...  # noqa: D102
    @property
    def rows(self) -> Sparse | None: ...  # noqa: D102


R = TypeVar("R", bound=KnownRows)


def rows_faults(
    name: str, rows: KnownRows, modes: int, dofs: int, shapes: tuple[str, ...], full: int | None
) -> list[Fault]:
    """Faults as rows of a structure with so many modes and dofs, and these load shapes.

    ``full`` is the size of the full model for solutions, None where there is none.
    """
    faults = [Fault(name, f"it has no load shape '{shape}'") for shape in shapes if shape not in rows.loads]
    sizes = (np.shape(rows.modes)[1], dofs if rows.static is None else np.shape(rows.static)[1])
    if sizes != (modes, dofs):
        faults.insert(0, Fault(name, found=f"modes and dofs {sizes}", expected=f"{(modes, dofs)}"))
    if rows.static is None and rows.rows is not None and rows.rows.shape[0] != full:
        expected = "static responses" if full is None else f"{full}, those of the full model"
        faults.append(Fault((name, "rows"), found=f"{rows.rows.shape[0]} dofs", expected=expected))
    return faults


def with_more(rows: R | None, more: Array, mode_shapes: Array, participation: Mapping[str, Array]) -> R | None:
    """Rows for other natural frequencies: the static response grows by ``more`` (n_modes,) times squares of modes."""
    if rows is None:
        return None
    static = None if rows.static is None else rows.static + (rows.modes * more) @ mode_shapes.T
    loads = {name: load + rows.modes @ (more * participation[name]) for name, load in rows.loads.items()}
    return replace(rows, static=static, loads=loads)  # type: ignore[type-var]


@dataclass(frozen=True, kw_only=True)
class Recovered:
    """A structure with receptances at rows that are no dofs of it.

    Attributes
    ----------
    modes, static, loads
        Motion by its modes (n_rows, n_modes), by unit forces on its dofs (n_rows, n_dofs), by its load shapes
        (n_rows,).
    second, second_loads
        Second-order residuals of the last two, where they are known.
    forces
        Orthonormal fields of forces on the dofs (n_dofs, k): ``static`` and ``second`` (n_rows, k) are then the
        residuals under these alone, and all others are zero; None: ``static`` is by unit forces.
    """

    structure: ModalStructure
    modes: Array
    static: Array
    loads: Mapping[str, Array]
    second: Array | None = None
    second_loads: Mapping[str, Array] = field(default_factory=dict)
    forces: Array | None = None
    sparse_directions = True

    def project(self, rows: Matrix, columns: Matrix, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance from directions ``columns`` (n_dofs, n_columns) and loads; ``rows`` do not matter."""
        known: Any = columns  # dense or sparse
        of_modes: Any = 0.0
        if self.forces is not None:
            of_modes = (self.modes / self.structure.omega**2) @ (self.structure.mode_shapes.T @ known)
            known = self.forces.T @ known
        static = np.column_stack([self.static @ known + of_modes, *(self.loads[name] for name in shapes)])
        second = None
        if self.second is not None:
            second = np.column_stack([self.second @ known, *(self.second_loads[name] for name in shapes)])
        return self.structure.receptance_to(self.modes, static, columns, shapes, second)
