"""The plan (top view) of the blade mesh: 8-node quadrilaterals of the core and of the ring around it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from slipstick.typing import Array, BoolArray, IntArray


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Nodes and faces of the plan, by parameters; positions follow from the section.

    Attributes
    ----------
    core
        Parameters (u, v) in [0, 1]^2 of every node's foot in the core, (n_nodes, 2): for a node of the ring, the point
        of the outline it starts from.
    ring
        How far out in the ring each node lies, (n_nodes,): 0 in the core, 1 on the block's outline.
    faces
        (n_faces, 8) counter-clockwise, those of the core first (``n_core_faces``).
    is_corner, in_core
        Whether a node is a corner of faces; whether it belongs to the core, (n_nodes,).
    sides
        Nodes of the outline on the side v = 0 ("concave") and v = 1 ("convex"), (n_nodes,).
    """

    core: Array
    ring: Array
    faces: IntArray
    n_core_faces: int
    is_corner: BoolArray
    in_core: BoolArray
    sides: Mapping[str, BoolArray]

    @property
    def n_nodes(self) -> int:
        """Number of nodes of the plan."""
        return len(self.ring)

    def place(self, section: Callable[[Array, Array], Array], block: Callable[[Array, Array], Array]) -> Array:
        """Positions (n_nodes, 2): the section itself, and straight lines from its outline to that of a block around it.

        Both functions map (u, v) in [0, 1]^2 to the plane, (n, 2).
        """
        foot = section(*self.core.T)
        return foot + self.ring[:, None] * (block(*self.core.T) - foot)


def plan_of(along: int, across: int, ring: int) -> Plan:
    """Plan with ``along`` x ``across`` faces in the core and ``ring`` layers of faces around it."""
    lattice = np.arange((2 * along + 1) * (2 * across + 1)).reshape(2 * along + 1, 2 * across + 1)
    u, v = np.meshgrid(np.linspace(0, 1, 2 * along + 1), np.linspace(0, 1, 2 * across + 1), indexing="ij")
    outline = np.concatenate([lattice[:-1, 0], lattice[-1, :-1], lattice[:0:-1, -1], lattice[0, :0:-1]])
    around = np.vstack([outline, lattice.size + np.arange(2 * ring * len(outline)).reshape(2 * ring, -1)])
    closed = np.hstack([around, around[:, :1]])
    core = np.stack([u.ravel(), v.ravel()], axis=1)
    core = np.vstack([core, np.tile(core[outline], (2 * ring, 1))])
    out = np.concatenate([np.zeros(lattice.size), np.repeat(np.arange(1, 2 * ring + 1) / (2 * ring), len(outline))])
    core_faces, ring_faces = _quads(lattice), _quads(closed.T[::-1])
    return _compressed(core, out, np.vstack([core_faces, ring_faces]), len(core_faces), lattice.size)


def _quads(lattice: IntArray) -> IntArray:
    """8-node faces of a lattice with every second node a corner; counter-clockwise for axes to the right and up."""
    i, j = (2 * g.ravel() for g in np.meshgrid(*[np.arange(n // 2) for n in lattice.shape], indexing="ij"))
    steps = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    return np.stack([lattice[i + a, j + b] for a, b in steps], axis=1).astype(np.int64)


def _compressed(core: Array, ring: Array, faces: IntArray, n_core_faces: int, n_lattice: int) -> Plan:
    """Drop the lattice nodes in the middle of faces, which 8-node faces do not have."""
    used = np.unique(faces)
    number = np.full(len(core), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    corner = np.zeros(len(core), dtype=bool)
    corner[faces[:, :4]] = True
    core, ring, in_core = core[used], ring[used], used < n_lattice
    v = core[:, 1]
    return Plan(
        core=core,
        ring=ring,
        faces=number[faces],
        n_core_faces=n_core_faces,
        is_corner=corner[used],
        in_core=in_core,
        sides={"concave": in_core & (v == 0.0), "convex": in_core & (v == 1.0)},
    )
