"""The surface of a reduced body, to see how it moves: what modes and forces do at its nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.structure.checks import array_faults, number_faults, real
from slipstick.structure.protocol import Receptance
from slipstick.typing import Array, IntArray, Matrix

if TYPE_CHECKING:
    from slipstick.structure.modal import ModalStructure

MOST_SKIN_NODES = 20_000
"""More are not needed to see a shape."""


@dataclass(frozen=True, kw_only=True)
class Skin:
    """Nodes and triangles of a surface with its motion, three rows for each node: x, y, z; in seven digits.

    Parameters
    ----------
    nodes
        Positions (n, 3).
    triangles
        Places of their corners among the nodes (t, 3), whole numbers.
    modes
        Mass-normalised modes at the nodes (3 n, n_modes).
    static
        Exact static displacement by unit forces on the kept dofs (3 n, n_dofs).
    loads
        Exact static displacement by each load shape (3 n,).

    Raises
    ------
    InputError
        With one sentence for each fault.
    """

    nodes: Array
    triangles: IntArray
    modes: Array
    static: Array
    loads: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        arrays = {name: getattr(self, name) for name in ("nodes", "triangles", "modes", "static")} | dict(self.loads)
        wrong = [fault for name, value in arrays.items() for fault in number_faults(("skin", name), value)]
        if wrong:
            raise InputError(wrong)
        nodes, modes, static = (real(value) for value in (self.nodes, self.modes, self.static))
        count = len(nodes) if nodes.ndim else 0
        faults = array_faults(("skin", "nodes"), nodes, (count, 3))
        if count > MOST_SKIN_NODES:
            faults.append(Fault(("skin", "nodes"), found=str(count), expected=f"at most {MOST_SKIN_NODES}"))
        for name, value in (("modes", modes), ("static", static)):
            faults += array_faults(("skin", name), value, (3 * count, *value.shape[1:2]))
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
        made: dict[str, Any] = {"modes": modes.astype(np.float32), "static": static.astype(np.float32)}
        made |= {"loads": {name: value.astype(np.float32) for name, value in loads.items()}}
        for name, value in (made | {"nodes": nodes, "triangles": triangles.astype(np.int64)}).items():
            object.__setattr__(self, name, value)

    def faults(self, modes: int, dofs: int, shapes: tuple[str, ...]) -> list[Fault]:
        """Why this is no skin of a structure with so many modes and dofs, and these load shapes."""
        return rows_faults("skin", self, modes, dofs, shapes)

    @property
    def basis(self) -> Array:
        """Orthonormal columns (3 n, k) that hold every motion of the skin."""
        columns = [self.modes, self.static, *(np.asarray(load)[:, None] for load in self.loads.values())]
        scaled = [np.asarray(c, dtype=float) / max(float(np.abs(c).max(initial=0.0)), 1e-300) for c in columns]
        return np.asarray(np.linalg.qr(np.hstack(scaled))[0])

    def along(self, basis: Array, structure: ModalStructure) -> Recovered:
        """The structure whose receptance is to the ``k`` columns of a basis (3 n, k) of the motion of the skin.

        How what the modes leave out grows with frequency is not known there.
        """
        loads = {name: basis.T @ load for name, load in self.loads.items()}
        return Recovered(structure=structure, modes=basis.T @ self.modes, static=basis.T @ self.static, loads=loads)


class KnownRows(Protocol):
    """What modes and forces do at rows that are no dofs: (n_rows, n_modes), (n_rows, n_dofs), loads (n_rows,)."""

    @property
    def modes(self) -> Array: ...  # noqa: D102
    @property
    def static(self) -> Array: ...  # noqa: D102
    @property
    def loads(self) -> Mapping[str, Array]: ...  # noqa: D102


R = TypeVar("R", bound=KnownRows)


def rows_faults(name: str, rows: KnownRows, modes: int, dofs: int, shapes: tuple[str, ...]) -> list[Fault]:
    """Why these are no rows of a structure with so many modes and dofs, and these load shapes."""
    sizes = (np.shape(rows.modes)[1], np.shape(rows.static)[1])
    wrong = Fault(name, found=f"modes and dofs {sizes}", expected=f"{(modes, dofs)}")
    missing = [Fault(name, f"it has no load shape '{shape}'") for shape in shapes if shape not in rows.loads]
    return missing if sizes == (modes, dofs) else [wrong, *missing]


def with_more(rows: R | None, more: Array, mode_shapes: Array, participation: Mapping[str, Array]) -> R | None:
    """Rows whose modes at rest give ``more`` (n_modes,) times their squares, as those of other frequencies do."""
    if rows is None:
        return None
    static = rows.static + (rows.modes * more) @ mode_shapes.T
    loads = {name: load + rows.modes @ (more * participation[name]) for name, load in rows.loads.items()}
    return replace(rows, static=static, loads=loads)  # type: ignore[type-var]


@dataclass(frozen=True, kw_only=True)
class Recovered:
    """A structure whose receptance is to rows that are no dofs of it.

    Attributes
    ----------
    modes, static, loads
        Of its modes (n_rows, n_modes), of unit forces on its dofs (n_rows, n_dofs), of its load shapes (n_rows,).
    second, second_loads
        Second residuals of the last two, where they are known.
    """

    structure: ModalStructure
    modes: Array
    static: Array
    loads: Mapping[str, Array]
    second: Array | None = None
    second_loads: Mapping[str, Array] = field(default_factory=dict)
    sparse_directions = True

    def project(self, rows: Matrix, columns: Matrix, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance from directions ``columns`` (n_dofs, n_columns) and loads; ``rows`` do not matter."""
        known: Any = columns  # dense or sparse
        static = np.column_stack([self.static @ known, *(self.loads[name] for name in shapes)])
        second = None
        if self.second is not None:
            second = np.column_stack([self.second @ known, *(self.second_loads[name] for name in shapes)])
        return self.structure.receptance_to(self.modes, static, columns, shapes, second)
