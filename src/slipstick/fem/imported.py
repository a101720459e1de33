"""The model that comes from another finite element code: sparse matrices and what node and direction each row is."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import Fault, InputError, SlipstickWarning
from slipstick.faults import suggestion
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, user_names
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_SINGLE = re.compile(r"n(\d{1,18})(x|y|z|rx|ry|rz|s)?$")
"""A node or a degree of freedom by name."""

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz", "s")
"""Directions by number: three displacements, three rotations, and a scalar (a point without direction)."""


@dataclass(frozen=True, kw_only=True)
class ImportedModel:
    """Matrices of the free degrees of freedom and what each row means.

    Attributes
    ----------
    K, M, C
        Sparse, symmetric, both halves stored, (n, n); C (viscous damping) may be None.
    dof_nodes, dof_components
        Node label and direction (index into ``COMPONENTS``) of each row, (n,).
    node_ids, coordinates
        Labels (n_nodes,) and positions (n_nodes, 3) of the nodes whose position is known.
    node_sets
        Node labels of each named set or component.
    constrained
        Degrees of freedom which were removed because they are held, (n_constrained, 2): node label, direction.
    source, units, notes, warnings
        The files read; what is known of the units; what was left out without effect; what is approximated or looks
        wrong, one sentence each.
    mesh, materials
        The mesh and its materials (by element set) where the file had one.

    Raises
    ------
    InputError
        If sizes differ, a degree of freedom appears twice or a direction is unknown.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> eye = csr_array(np.eye(2))
    >>> model = ImportedModel(K=eye, M=eye, dof_nodes=np.array([7, 7]), dof_components=np.array([0, 1]))
    >>> model.dofs, model.index("n7y")
    (('n7x', 'n7y'), 1)
    """

    K: csr_array
    M: csr_array
    C: csr_array | None = None
    dof_nodes: IntArray
    dof_components: IntArray
    node_ids: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    coordinates: Array = field(default_factory=lambda: np.empty((0, 3)))
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    constrained: IntArray = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    source: str = ""
    units: str = "not stated"
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    mesh: Mesh | None = None
    materials: Mapping[str, Material] = field(default_factory=dict)

    def __post_init__(self) -> None:
        faults = list(_faults(self))
        if faults:
            raise InputError(faults)

    def announce(self) -> None:
        """Give each of ``warnings`` as SlipstickWarning, in the name of whoever called the caller."""
        for sentence in self.warnings:
            warnings.warn(sentence, SlipstickWarning, stacklevel=3)

    @property
    def n_dofs(self) -> int:
        """Number of free degrees of freedom."""
        return len(self.dof_nodes)

    @cached_property
    def dofs(self) -> tuple[str, ...]:
        """Names "n<node><direction>", as in "n123y" or "n5rz"."""
        pairs = zip(self.dof_nodes.tolist(), self.dof_components.tolist(), strict=True)
        return tuple(f"n{node}{COMPONENTS[component]}" for node, component in pairs)

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.dofs)}

    def index(self, dof: str) -> int:
        """Row of a degree of freedom.

        Raises
        ------
        InputError
            If there is none of that name; the sentence says whether it is constrained.
        """
        if dof in self._rows:
            return self._rows[dof]
        held = {f"n{node}{COMPONENTS[component]}" for node, component in self.constrained.tolist()}
        if dof in held:
            raise InputError(
                f"dof '{dof}' is constrained in the imported model; it can carry no contact, load or output"
            )
        raise InputError(f"dof '{dof}' is not in the imported model; names are n<node><direction>, as {self.dofs[0]}")

    def nodes_of(self, name: str) -> IntArray:
        """Node labels of a named set; InputError says which there are."""
        if name not in self.node_sets:
            known = ", ".join(user_names(self.node_sets)) or "none"
            raise InputError(f"node set '{name}' is not in the imported model; it has: {known}")
        return self.node_sets[name]

    def positions(self, nodes: IntArray) -> Array:
        """Coordinates (n, 3) of nodes by label.

        Raises
        ------
        InputError
            If the position of one is not known.
        """
        order = np.argsort(self.node_ids)
        place = np.searchsorted(self.node_ids, nodes, sorter=order).clip(max=max(len(order) - 1, 0))
        known = np.isin(nodes, self.node_ids)
        if not np.all(known):
            raise InputError(
                f"the position of node {np.asarray(nodes)[~known][0]} is not known; "
                "import the mesh too (slipstick import MATRICES MESH)"
            )
        return self.coordinates[order[place]]

    def fix(self, where: str | Sequence[str] | IntArray, components: str = "xyz") -> ImportedModel:
        """The model with more held: node sets by name or node labels, in the directions named; "n12" is all directions
        of node 12, "n12y" one of them.

        Raises
        ------
        InputError
            One sentence for each unknown set; if nothing is left to hold or to move.
        """
        names = [where] if isinstance(where, str) else where
        rows = np.zeros(self.n_dofs, dtype=bool)
        nodes = names
        if not isinstance(names, np.ndarray):
            single = [name for name in names if name not in self.node_sets and names_dofs(name)]
            for name in single:
                rows |= self._single(name)
            nodes = self._named([name for name in names if name not in single])
        wanted = [i for i, name in enumerate(COMPONENTS) if name in _directions(components)]
        held = rows | (np.isin(self.dof_nodes, nodes) & np.isin(self.dof_components, wanted))
        if not held.any() or held.all():
            raise InputError(f"fixing {len(nodes)} nodes in {components} holds {held.sum()} of {self.n_dofs} dofs")
        return self._without(held)

    def _single(self, name: str) -> NDArray[np.bool_]:
        """Rows of "n12" or "n12y"."""
        node, component = _SINGLE.match(name).groups()  # type: ignore[union-attr]
        rows = self.dof_nodes == int(node)
        if component:
            rows = rows & (self.dof_components == COMPONENTS.index(component))
        if not rows.any():
            raise InputError(Fault("fixed", f"there is no free dof '{name}' in the model"))
        return rows

    def _named(self, sets: Sequence[str]) -> IntArray:
        """Node labels of several named sets."""
        known = user_names(self.node_sets)
        unknown = [
            Fault("fixed", f"there is no node set '{name}' in the model", remedy=suggestion(name, known))
            for name in sets
            if name not in self.node_sets
        ]
        if unknown:
            raise InputError(unknown)
        return np.concatenate([np.empty(0, dtype=np.int64), *(self.node_sets[name] for name in sets)])

    def conducting(self, conductivity: float) -> ImportedModel:
        """The model with this conductivity in every material, power/(length temperature)."""
        known = self.materials or {"all": Material(young=1.0, poisson=0.0)}
        return replace(self, materials={n: replace(m, conductivity=conductivity) for n, m in known.items()})

    def _without(self, held: NDArray[np.bool_]) -> ImportedModel:
        kept = np.flatnonzero(~held)
        removed = np.stack([self.dof_nodes[held], self.dof_components[held]], axis=1)
        return replace(
            self,
            K=self.K[kept][:, kept],
            M=self.M[kept][:, kept],
            C=None if self.C is None else self.C[kept][:, kept],
            dof_nodes=self.dof_nodes[kept],
            dof_components=self.dof_components[kept],
            constrained=np.concatenate([self.constrained, removed]),
        )


def names_dofs(name: str) -> bool:
    """Whether a name is that of a node or of one of its degrees of freedom.

    >>> [names_dofs(name) for name in ("n12", "n12ry", "NOZZLE", "n12w")]
    [True, True, False, False]
    """
    return _SINGLE.match(name) is not None


def _directions(components: str) -> set[str]:
    """Directions in a text such as "xyz", "x ry" or "x,y".

    >>> sorted(_directions("xz")), sorted(_directions("x, ry"))
    (['x', 'z'], ['ry', 'x'])
    """
    words = components.replace(",", " ").split()
    return {part for word in words for part in ([word] if word in COMPONENTS else list(word))}


def _faults(model: ImportedModel) -> Iterator[str]:
    n = len(model.dof_nodes)
    for name in ("K", "M", "C"):
        matrix = getattr(model, name)
        if matrix is not None and matrix.shape != (n, n):
            yield f"{name} is {matrix.shape[0]} x {matrix.shape[1]}, the dof map has {n} entries; they must agree"
    if len(model.dof_components) != n:
        yield f"the dof map has {n} nodes and {len(model.dof_components)} directions; expected as many"
        return
    if n and not (model.dof_components.min() >= 0 and model.dof_components.max() < len(COMPONENTS)):
        yield f"the dof map holds a direction outside 1..{len(COMPONENTS)}"
    pairs, counts = np.unique(np.stack([model.dof_nodes, model.dof_components], axis=1), axis=0, return_counts=True)
    if n and counts.max() > 1:
        node, component = pairs[np.argmax(counts)]
        yield f"the dof map names node {node}, direction {component + 1}, more than once"
    if model.coordinates.shape != (len(model.node_ids), 3):
        yield f"coordinates have shape {model.coordinates.shape}; expected ({len(model.node_ids)}, 3)"
    elif not np.all(np.isfinite(model.coordinates)):
        yield "node coordinates are not all finite"
