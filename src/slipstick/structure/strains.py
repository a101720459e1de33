"""Strain and stress at places of a reduced body, by modes and by forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.structure.checks import array_faults, number_faults, real
from slipstick.structure.skin import Recovered, rows_faults, solved_faults
from slipstick.typing import Array, IntArray, Sparse

if TYPE_CHECKING:
    from slipstick.structure.modal import ModalStructure

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
"""Of strain and stress; shear strains are angles (twice those of the tensor)."""

MOST_PLACES = 100_000
"""Places of strains; each has six rows of all modes."""

MOST_NUMBER = 10**18
"""Largest number of an element or a node."""

ELEMENTS, NODES = "elements", "nodes"
"""Kinds of places: centroids of elements, or their nodes."""

CELLS = {"tet4": 4, "pyramid5": 5, "wedge6": 6, "hex8": 8}
"""Corners of the solids that elements are drawn as."""


@dataclass(frozen=True, kw_only=True)
class StrainPlaces:
    """Centroids or nodes of chosen elements.

    Attributes
    ----------
    at
        "elements" or "nodes".
    labels, positions
        Numbers of the elements or nodes (n,), and their positions (n, 3).
    young, poisson
        Of the material there (n,); a node between two materials is a place for each of them.
    nodes, cells
        Corners (m, 3) and, by solid of ``CELLS``, the elements between them (k, corners): elements are the places in
        this order, or the nodes are.
    """

    at: str
    labels: IntArray
    positions: Array
    young: Array
    poisson: Array
    nodes: Array
    cells: Mapping[str, IntArray]

    def __post_init__(self) -> None:
        faults = []
        for name in ("labels", "positions", "young", "poisson", "nodes"):
            value = getattr(self, name)
            faults += number_faults(("strains", name), value)
        if faults:
            raise InputError(faults)
        made = {name: real(getattr(self, name)) for name in ("positions", "young", "poisson", "nodes")}
        labels = real(self.labels)
        n = labels.size
        sizes = {"positions": (n, 3), "young": (n,), "poisson": (n,), "nodes": (np.shape(made["nodes"])[0], 3)}
        for name, size in sizes.items():
            faults += array_faults(("strains", name), made[name], size, positive=name == "young")
        faults += array_faults(("strains", "labels"), labels, (n,))
        if self.at not in (ELEMENTS, NODES):
            faults.append(Fault(("strains", "at"), found=repr(self.at), expected=f'"{ELEMENTS}" or "{NODES}"'))
        if n > MOST_PLACES:
            faults.append(Fault("strains", found=f"{n} places", expected=f"at most {MOST_PLACES}"))
        faults += self._cell_faults(n, len(made["nodes"]))
        if faults:
            raise InputError(faults)
        cells = {kind: np.asarray(block, dtype=np.int64) for kind, block in self.cells.items()}
        for name, value in (made | {"labels": labels.astype(np.int64), "cells": cells}).items():
            object.__setattr__(self, name, value)

    def _cell_faults(self, n: int, m: int) -> list[Fault]:
        faults, count = [], 0
        for kind, block in self.cells.items():
            where, found = ("strains", "cells", str(kind)), np.asarray(block)
            if kind not in CELLS or found.ndim != 2 or found.shape[1] != CELLS[kind] or found.dtype.kind not in "iu":
                faults.append(Fault(where, found=f"shape {found.shape}", expected=f"corners of {', '.join(CELLS)}"))
            elif found.size and not (found.min() >= 0 and found.max() < m):
                faults.append(Fault(where, found=f"nodes {found.min()} to {found.max()} of {m}"))
            count += len(found) if found.ndim else 0
        if not faults and (m if self.at == NODES else count) != n:
            faults.append(Fault("strains", found=f"{n} places, {count} elements and {m} nodes"))
        return faults

    def part(self, kept: IntArray) -> StrainPlaces:
        """Some of the places (n,), ascending: elements, or nodes with the elements all of whose corners are kept."""
        if self.at == NODES:
            new = np.full(len(self.nodes), -1)
            new[kept] = np.arange(len(kept))
            nodes, cells = self.nodes[kept], {kind: new[block] for kind, block in self.cells.items()}
            cells = {kind: block[(block >= 0).all(axis=1)] for kind, block in cells.items()}
        else:
            ends = np.cumsum([0, *map(len, self.cells.values())])
            nodes, cells = (
                self.nodes,
                {
                    kind: block[kept[(kept >= first) & (kept < first + len(block))] - first]
                    for first, (kind, block) in zip(ends, self.cells.items(), strict=False)
                },
            )
        of_places = {name: getattr(self, name)[kept] for name in ("labels", "positions", "young", "poisson")}
        return StrainPlaces(at=self.at, nodes=nodes, cells=cells, **of_places)

    def stress(self, strain: Array, chosen: IntArray) -> Array:
        """Stress (..., n, 6, k) of strains of the same shape at the places chosen (n,), isotropic.

        ``lambda tr(e) + mu gamma`` with shear strains as angles, ``gamma = 2 e``.
        """
        E, nu = self.young[chosen], self.poisson[chosen]
        shear, lame = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        out = shear[:, None, None] * strain
        out[..., :3, :] *= 2.0
        out[..., :3, :] += lame[:, None, None] * strain[..., :3, :].sum(axis=-2, keepdims=True)
        return out


@dataclass(frozen=True, kw_only=True)
class Strains:
    """Strains at places, six rows for each, xx, yy, zz, xy, yz, zx; in seven digits.

    Parameters
    ----------
    places
        Where they are.
    modes
        Of the mass-normalised modes (6 n, n_modes).
    static, second
        Of unit forces on the kept dofs (6 n, n_dofs): exact and static; and what the modes leave out of those by
        ``K^-1 M K^-1``, None where it is not known. Both are None where they are solved for with the full model of the
        structure, for the forces that are asked for.
    loads, second_loads
        The same of each load shape (6 n,).
    rows
        What takes strains out of the motion of the full model, sparse (n_full, 6 n); where ``static`` is None.
    free
        Strain without stress of load shapes (6 n,), as thermal strain; none of others.

    Raises
    ------
    InputError
        With one sentence for each fault.
    """

    places: StrainPlaces
    modes: Array
    static: Array | None
    second: Array | None = None
    loads: Mapping[str, Array] = field(default_factory=dict)
    second_loads: Mapping[str, Array] = field(default_factory=dict)
    rows: Sparse | None = None
    free: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.places, StrainPlaces):
            raise InputError(Fault("strains", found=type(self.places).__name__, expected="places"))
        n = 6 * len(self.places.labels)
        faults = []
        made: dict[str, Any] = {}
        for name in ("modes", "static", "second"):
            value = getattr(self, name)
            if value is None and name != "modes":
                continue
            wrong = number_faults(("strains", name), value)
            faults += wrong or array_faults(("strains", name), real(value), (n, *np.shape(value)[1:2]))
            made[name] = None if wrong else real(value).astype(np.float32)
        faults += solved_faults("strains", self.static, self.rows, n)
        for name in ("loads", "second_loads", "free"):
            for shape, value in getattr(self, name).items():
                wrong = number_faults(("strains", name, shape), value)
                faults += wrong or array_faults(("strains", name, shape), real(value), (n,))
            made[name] = {shape: np.asarray(value, np.float32) for shape, value in getattr(self, name).items()}
        if faults:
            raise InputError(faults)
        for name, value in made.items():
            object.__setattr__(self, name, value)

    @property
    def arguments(self) -> dict[str, Any]:
        """What equal strains are made from; rows and free strains only where there are any."""
        known = {f.name: getattr(self, f.name) for f in fields(self)}
        left_out = ({"rows"} if self.rows is None else set()) | (set() if self.free else {"free"})
        return {name: value for name, value in known.items() if name not in left_out}

    def faults(self, modes: int, dofs: int, shapes: tuple[str, ...], full: int | None = None) -> list[Fault]:
        """Why these are no strains of a structure with so many modes and dofs, and these load shapes.

        ``full`` is the size of the model that it solves with, None where it does not.
        """
        return rows_faults("strains", self, modes, dofs, shapes, full)

    def of(self, structure: ModalStructure, rows: IntArray, forces: Array | None = None) -> Recovered:
        """The structure whose receptance is to some of these strains.

        Where they are solved for, it is so under orthonormal fields of ``forces`` (n_dofs, k) alone.
        """
        modes, static, second = self.modes[rows], self.static, self.second
        if static is None:
            solves: Any = structure
            assert self.rows is not None
            _, static, second = solves.left_out(self.rows.tocsc()[:, rows], modes, forces, second=True)
        else:
            forces, static, second = None, static[rows], None if second is None else second[rows]
        return Recovered(
            structure=structure, modes=modes, static=static, second=second, forces=forces,
            loads={name: load[rows] for name, load in self.loads.items()},
            second_loads={name: load[rows] for name, load in self.second_loads.items()},
        )  # fmt: skip
