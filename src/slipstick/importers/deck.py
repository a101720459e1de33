"""The content of files of another code: each reader fills a ``Deck``, from which models are made in one way.

A mesh is assembled in ``mesh_model``, matrices are checked in ``matrix_model``. docs/architecture.md says how a code is
added.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from slipstick.errors import Fault, Place, Where
from slipstick.fem.boundary import boundary
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.equations import NodalEquation, NodeAxes, Pair
from slipstick.fem.interfaces import PretensionSection, SurfacePair
from slipstick.fem.load_steps import LoadStep
from slipstick.fem.lumped import Lumped
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface, node_indices
from slipstick.fem.unit_systems import NOT_STATED
from slipstick.importers.findings import Coupling, Findings, refused
from slipstick.importers.midsides import Edges, middle_equations, placed, with_middles
from slipstick.typing import Array, IntArray, Matrix


@dataclass(frozen=True, kw_only=True)
class Stated:
    """A constraint of a file: its place, and its equations between the nodes of the finished mesh.

    ``nodewise``: it names each node, so that nodes which come to a mesh later are not in it. ``cyclic``: it joins the
    faces of a sector, for equal motion of all sectors.
    """

    where: Place
    equations: Callable[[Mesh], Iterable[NodalEquation]]
    nodewise: bool = True
    cyclic: bool = False


def _no_symmetry(_mesh: Mesh) -> CyclicSymmetry | None:
    return None


@dataclass(kw_only=True)
class Deck(Findings):
    """Files of another code as far as they were read: a mesh by labels, or matrices and what their rows are, or both.

    Attributes
    ----------
    nodes, elements
        Position of each node by label; nodes of each element by our kind and its label, in our order.
    node_sets, element_sets
        Labels by name.
    mesh
        Made of them by ``build``, or by a reader of arrays.
    matrices, rows
        Stiffness "K", mass "M", damping "C" as stored, full or one half; node label and direction (0..6, see
        COMPONENTS) of each row, (n, 2).
    materials, material_faults
        By element set; why those of the file cannot be used, which is refused where no other is given.
    held
        Degrees of freedom at zero: node label, direction.
    stated, lumped
        Linear constraints; masses and springs between single dofs. Both are applied to what is assembled here.
    axes
        Own directions (rows) of the nodes that have some, by label: those of the rows of matrices.
    symmetry
        Of the ring that the finished mesh is a sector of.
    contact_pairs, pretension_sections
        Interfaces that only contacts or bolts hold together, by the names of their surfaces.
    load_steps
        Loads of the file by the name of their step, in its order.
    units
        As the file states them.
    variants
        Foreign element types that integrate otherwise than ours, with their counts, by our element.
    own_warnings
        Warnings in addition to those of the verdicts, one sentence each; ``extra`` are notes.
    """

    source: str = ""
    nodes: dict[int, Sequence[float] | Array] = field(default_factory=dict)
    elements: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    mesh: Mesh | None = None
    matrices: dict[str, Matrix] = field(default_factory=dict)
    rows: IntArray | None = None
    materials: Mapping[str, Material] = field(default_factory=dict)
    material_faults: list[Fault] = field(default_factory=list)
    held: set[Pair] = field(default_factory=set)
    stated: list[Stated] = field(default_factory=list)
    lumped: list[Lumped] = field(default_factory=list)
    axes: NodeAxes = field(default_factory=dict)
    symmetry: Callable[[Mesh], CyclicSymmetry | None] = _no_symmetry
    contact_pairs: dict[str, SurfacePair] = field(default_factory=dict)
    pretension_sections: dict[str, PretensionSection] = field(default_factory=dict)
    load_steps: dict[str, LoadStep] = field(default_factory=dict)
    units: str = NOT_STATED
    variants: dict[str, dict[str, int]] = field(default_factory=dict)
    own_warnings: list[str] = field(default_factory=list)
    middles: Edges = field(default_factory=dict)
    flatten: str = ""
    """The remedy for labels given twice."""

    def element(self, kind: str, label: int, nodes: Sequence[int], where: Place, foreign: str = "") -> None:
        """One element, its nodes in our order, 0 for a middle node that is left out.

        ``foreign`` is what its code calls it, where that integrates otherwise than ours.

        Raises
        ------
        InputError
            If the label is given to another one, a corner is missing, or the number of nodes is not that of the kind.
        """
        found = list(nodes)
        if kind in ELEMENTS and len(found) != (count := ELEMENTS[kind].n_nodes):
            raise refused(where, f"element {label} has {len(found)} nodes", expected=f"{count}, as of {kind}")
        if 0 in found:
            self._made_from = self._made_from or max(self.nodes, default=0) + 1
            found = with_middles(kind, found, label, self.middles, self._made_from, self.source)
        table = self.elements.setdefault(kind, {})
        if table.setdefault(label, found) != found or self._kinds.setdefault(label, kind) != kind:
            raise refused(where, f"element {label} is given twice", remedy=self.flatten)
        if foreign:
            counts = self.variants.setdefault(kind, {})
            counts[foreign] = counts.get(foreign, 0) + 1

    _kinds: dict[int, str] = field(default_factory=dict, repr=False)
    _made_from: int = 0

    @property
    def labels(self) -> IntArray:
        """Labels of the nodes, (n,)."""
        return np.fromiter(self.nodes, dtype=np.int64, count=len(self.nodes))

    @property
    def coordinates(self) -> Array:
        """Positions of the nodes, (n, 3)."""
        return np.array(list(self.nodes.values()), dtype=float).reshape(-1, 3)

    @property
    def solid_nodes(self) -> set[int]:
        """Labels of the nodes of elements."""
        return {node for table in self.elements.values() for nodes in table.values() for node in nodes}

    @property
    def held_rows(self) -> IntArray:
        """Held degrees of freedom, ascending, (n, 2)."""
        return pairs_table(sorted(self.held))

    def equate(self, equations: Iterable[NodalEquation]) -> None:
        """Equations between single nodes, by the place that states them."""
        places: dict[Place, list[NodalEquation]] = {}
        for equation in equations:
            places.setdefault(_place(equation.where), []).append(equation)
        self.stated += [Stated(where=at, equations=partial(_same, there)) for at, there in places.items()]

    def equations(self, mesh: Mesh | None, *, cyclic: bool = True) -> list[NodalEquation]:
        """All constraints, or those that do not join the faces of a sector."""
        chosen = [stated for stated in self.stated if cyclic or not stated.cyclic]
        return [equation for stated in chosen for equation in stated.equations(mesh)]  # type: ignore[arg-type]

    def build(self) -> Mesh:
        """The mesh of nodes, elements and sets; middle nodes that are left out are made and tied to their edges."""
        labels, nodes = placed(self.middles, self.labels, self.coordinates, self.source)
        numbers = {kind: np.array(list(table), dtype=np.int64) for kind, table in self.elements.items()}
        at = partial(node_indices, labels)
        self.mesh = Mesh(
            nodes=nodes,
            blocks={
                kind: at(np.array(list(table.values()), dtype=np.int64), "an element")
                for kind, table in self.elements.items()
            },
            node_sets={
                name: at(np.array(part, dtype=np.int64), f"set {name}") for name, part in self.node_sets.items()
            },
            element_sets={
                name: {kind: np.flatnonzero(np.isin(part, members)) for kind, part in numbers.items()}
                for name, members in self.element_sets.items()
            },
            node_labels=labels,
            element_labels=numbers,
        )
        self.equate(middle_equations(self.middles, self.source))
        if self.middles:
            self.extra.append(f"{self.source}: {len(self.middles)} edges have no middle node: they stay straight")
        return self.mesh

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on approximations, on entries not understood, and on doubtful data."""
        return (*super().warnings, *self.own_warnings)

    @property
    def applied(self) -> tuple[Coupling, ...]:
        """Couplings that an assembly here applies, and that matrices given with the mesh must hold."""
        ties = [Coupling(where=stated.where, what="ties degrees of freedom to each other") for stated in self.stated]
        if self.lumped:
            parts = Place(f"{len(self.lumped)} point masses and springs")
            ties.append(Coupling(where=parts, what="add to the matrices"))
        return tuple(dict.fromkeys(ties))


def pairs_table(pairs: Iterable[Any]) -> IntArray:
    """Pairs of node and direction as they come, (n, 2)."""
    return np.array(list(pairs), dtype=np.int64).reshape(-1, 2)


def _place(where: str | Where) -> Place:
    return Place(where) if isinstance(where, str) else Place(*where)


def _same(equations: list[NodalEquation], mesh: Mesh) -> Iterator[NodalEquation]:
    del mesh
    yield from equations


def with_surfaces(mesh: Mesh, names: Iterable[str]) -> Mesh:
    """The mesh with a surface for each of these node sets that holds whole boundary faces."""
    skin = boundary(mesh).faces
    surfaces = dict(mesh.surfaces)
    for name in names:
        marked = np.zeros(mesh.n_nodes, dtype=bool)
        marked[mesh.node_sets[name]] = True
        faces = {kind: part[marked[part[:, : FACES[kind].n_corners]].all(axis=1)] for kind, part in skin.items()}
        faces = {kind: part for kind, part in faces.items() if len(part)}
        if faces:
            surfaces[name] = Surface(faces=faces)
    return replace(mesh, surfaces=surfaces)


def matching_surface(mesh: Mesh, corners: Sequence[IntArray]) -> Surface:
    """Boundary faces with the same corners as these faces, each (n, 3) or (n, 4), outward whatever their order."""
    wanted = {tuple(sorted(face)) for part in corners for face in part.tolist()}
    faces = {}
    for kind, part in boundary(mesh).faces.items():
        keys = np.sort(part[:, : FACES[kind].n_corners], axis=1).tolist()
        chosen = np.fromiter((tuple(key) in wanted for key in keys), dtype=bool, count=len(keys))
        if chosen.any():
            faces[kind] = part[chosen]
    return Surface(faces=faces)
