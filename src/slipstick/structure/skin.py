"""The surface of a reduced body, to see how it moves: what modes and forces do at its nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

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
        sizes = (np.shape(self.modes)[1], np.shape(self.static)[1])
        wrong = Fault("skin", found=f"modes and dofs {sizes}", expected=f"{(modes, dofs)}")
        missing = [Fault("skin", f"it has no load shape '{name}'") for name in shapes if name not in self.loads]
        return missing if sizes == (modes, dofs) else [wrong, *missing]

    @property
    def basis(self) -> Array:
        """Orthonormal columns (3 n, k) that hold every motion of the skin."""
        columns = [self.modes, self.static, *(np.asarray(load)[:, None] for load in self.loads.values())]
        scaled = [np.asarray(c, dtype=float) / max(float(np.abs(c).max(initial=0.0)), 1e-300) for c in columns]
        return np.asarray(np.linalg.qr(np.hstack(scaled))[0])


@dataclass(frozen=True)
class AtSkin:
    """A structure whose receptance is to the ``k`` columns of a basis (3 n, k) of the motion of its skin."""

    structure: ModalStructure
    skin: Skin
    basis: Array
    sparse_directions = True

    def project(self, rows: Matrix, columns: Matrix, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance from directions ``columns`` (n_dofs, n_columns) and loads to the basis; ``rows`` do not matter.

        How what the modes leave out grows with frequency is not known at the skin.
        """
        known: Any = columns  # dense or sparse
        static = np.column_stack([self.skin.static @ known, *(self.skin.loads[name] for name in shapes)])
        left = self.basis.T @ self.skin.modes
        return self.structure.receptance_to(left, self.basis.T @ static, columns, shapes)
