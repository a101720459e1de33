"""A finite element model, imported or assembled here: sparse matrices, the dofs of their rows, the mesh if any."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array, issparse, vstack

from slipstick.errors import Fault, InputError, Place, SlipstickWarning
from slipstick.faults import suggestion
from slipstick.fem.assembly import assemble, conduction
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.equations import (
    COMPONENTS,
    NodalEquation,
    Pair,
    directions_in,
    dof_name,
    idle_notes,
    names_dofs,
    resolve,
    rows_named,
)
from slipstick.fem.interfaces import PretensionSection, SurfacePair
from slipstick.fem.load_steps import LoadStep
from slipstick.fem.loads import shape_integrals
from slipstick.fem.materials import Material, Materials
from slipstick.fem.mesh import Mesh, user_names
from slipstick.fem.refine import linear_warnings
from slipstick.fem.unit_systems import NOT_STATED, names_of, stated_units
from slipstick.typing import Array, BoolArray, IntArray, Sparse
from slipstick.units import Units

_ROUNDING = 1e-13
"""Sums below this fraction of their terms are rounding: some hundred terms of 1e-16 each."""


class _Mean(NamedTuple):
    """Mean motion of nodes: their labels (n,), the share of each (n,), and along which component."""

    labels: IntArray
    shares: Array
    component: int

    def at(self, nodes: IntArray, components: IntArray) -> Array:
        """Shares (m,) of degrees of freedom."""
        order = np.argsort(self.labels)
        place = order[np.searchsorted(self.labels, nodes, sorter=order).clip(max=len(order) - 1)]
        here = (self.labels[place] == nodes) & (components == self.component)
        return np.where(here, self.shares[place], 0.0)


@dataclass(frozen=True, kw_only=True)
class FiniteElementModel:
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
    dependent, dependence
        Degrees of freedom which were removed because equations give them from the others, (n_dependent, 2): node label,
        direction; and how, sparse (n_dependent, n): their motion is ``dependence @ q``.
    source
        The files read, or what made it.
    units
        Of the numbers, such as "N, mm, t, s"; "not stated" where neither the files nor their user say so.
    notes
        What was left out without effect, one sentence each.
    warnings
        What is approximated or suspicious, one sentence each.
    mesh, materials
        The mesh and its materials (by element set) where the file had one.
    speed
        Of rotation, rad/s, for which the stiffness holds.
    symmetry
        Of the ring that the model is a sector of, where its file says so: what ``ss.reduced_sector`` uses.
    contact_pairs, pretension_sections
        Surfaces that are meant to touch, with their coefficient of friction, and sections of bolts, where the file
        names some: by the names of the surfaces, "A/B" of a pair. Nothing in the matrices holds or cuts them.
    shortenings
        Names of the degrees of freedom that are the shortening of a bolt which is cut; nothing holds them.
    load_steps
        Loads by the name of their step, where the file has some, in its order; "INITIAL" is what holds before the
        first step. They have no effect on the matrices.

    Raises
    ------
    InputError
        If sizes differ, a degree of freedom appears twice or a direction is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import csr_array
    >>> eye = csr_array(np.eye(2))
    >>> model = FiniteElementModel(K=eye, M=eye, dof_nodes=np.array([7, 7]), dof_components=np.array([0, 1]))
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
    dependent: IntArray = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    dependence: csr_array | None = None
    source: str = ""
    units: str = NOT_STATED
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    mesh: Mesh | None = None
    materials: Mapping[str, Material] = field(default_factory=dict)
    speed: float = 0.0
    symmetry: CyclicSymmetry | None = None
    contact_pairs: Mapping[str, SurfacePair] = field(default_factory=dict)
    pretension_sections: Mapping[str, PretensionSection] = field(default_factory=dict)
    shortenings: tuple[str, ...] = ()
    load_steps: Mapping[str, LoadStep] = field(default_factory=dict)

    def __post_init__(self) -> None:
        faults = list(_faults(self))
        if faults:
            raise InputError(faults)

    def announce(self) -> None:
        """Give each of ``warnings`` as SlipstickWarning, in the name of whoever called the caller."""
        for sentence in self.warnings:
            warnings.warn(sentence, SlipstickWarning, stacklevel=3)

    @property
    def unit_names(self) -> Units | None:
        """Names of the units of length, force and time, as results have them; None: they are not known."""
        return names_of(self.units)

    @property
    def units_told(self) -> str:
        """The units for the reader; where they are not stated, what the materials look like."""
        return stated_units(self.units, self.materials)

    @property
    def n_dofs(self) -> int:
        """Number of free degrees of freedom."""
        return len(self.dof_nodes)

    @cached_property
    def dofs(self) -> tuple[str, ...]:
        """Names "n<node><direction>", as in "n123y" or "n5rz"."""
        return tuple(map(dof_name, self._pairs(self.dof_nodes, self.dof_components)))

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.dofs)}

    @cached_property
    def dependent_dofs(self) -> tuple[str, ...]:
        """Names of the dependent degrees of freedom."""
        return tuple(map(dof_name, self._pairs(*self.dependent.T)))

    @cached_property
    def _dependent_rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.dependent_dofs)}

    def index(self, dof: str) -> int:
        """Row of a free degree of freedom.

        Raises
        ------
        InputError
            If there is none of that name; the sentence says whether it is constrained.
        """
        if dof in self._rows:
            return self._rows[dof]
        if dof in self._dependent_rows:
            raise InputError(
                Fault(
                    statement=f"dof '{dof}' depends on others by an equation of the imported model",
                    remedy="it has no row",
                )
            )
        held = {dof_name(_pair(pair)) for pair in self.constrained.tolist()}
        if dof in held:
            raise InputError(
                Fault(
                    statement=f"dof '{dof}' is constrained in the imported model",
                    remedy="it can carry no contact, load or output",
                )
            )
        raise InputError(
            Fault(
                statement=f"dof '{dof}' is not in the imported model",
                remedy=f"names are n<node><direction>, as {self.dofs[0]}",
            )
        )

    def directions(self, dofs: Sequence[str]) -> csc_array:
        """Columns (n, len(dofs)), each a unit force on its dof; ``columns.T @ q`` is the motion of the dofs.

        Dependent ones have the columns of what they depend on. "HEAD z" is the mean motion of the surface or node set
        HEAD along z: over the area of a surface, or of the nodes of a set. A force on it is spread alike: over a
        surface as a uniform traction.

        Raises
        ------
        InputError
            If there is none of that name, or it is constrained.
        """
        parts = []
        for dof in dofs:
            if dof in self._dependent_rows and self.dependence is not None:
                parts.append(self.dependence[[self._dependent_rows[dof]]])
            elif (mean := self._mean_of(dof)) is not None:
                parts.append(self._mean_motion(dof, mean))
            else:
                parts.append(csr_array(([1.0], ([0], [self.index(dof)])), shape=(1, self.n_dofs)))
        return csc_array(vstack(parts).T) if parts else csc_array((self.n_dofs, 0))

    def has_direction(self, dof: str) -> bool:
        """Whether ``directions`` knows a name."""
        return dof in self._rows or dof in self._dependent_rows or self._mean_of(dof) is not None

    def _mean_of(self, dof: str) -> _Mean | None:
        """What "HEAD z" is the mean of; None where no surface or node set is called so."""
        name, _, axis = dof.rpartition(" ")
        if axis not in COMPONENTS[:3] or dof in self._rows:
            return None
        if name not in self._averaged:
            self._averaged[name] = self._shares_of(name)
        labels, shares = self._averaged[name]
        return _Mean(labels, shares, COMPONENTS.index(axis)) if len(labels) else None

    @cached_property
    def _averaged(self) -> dict[str, tuple[IntArray, Array]]:
        """``_shares_of`` the names that were asked for."""
        return {}

    def _shares_of(self, name: str) -> tuple[IntArray, Array]:
        """Labels of the nodes of a surface or a node set (n,), and their shares in its mean; none of other names."""
        if self.mesh is not None and name in self.mesh.surfaces:
            shares = shape_integrals(self.mesh, self.mesh.surfaces[name])
            nodes = np.flatnonzero(shares)
            return self.mesh.labels[nodes], shares[nodes] / shares.sum()
        labels = np.unique(self.node_sets.get(name, np.empty(0, dtype=np.int64)))
        return labels, np.full(len(labels), 1.0 / max(len(labels), 1))

    def _mean_motion(self, dof: str, mean: _Mean) -> csr_array:
        row = csr_array(mean.at(self.dof_nodes, self.dof_components)[None])
        if self.dependence is not None:
            row = row + csr_array(mean.at(*self.dependent.T)[None]) @ self.dependence
        if not row.nnz:
            remedy = "it can carry no contact, load or output"
            raise InputError(Fault(statement=f"dof '{dof}' is the mean of nodes that are all held", remedy=remedy))
        return row

    def dof_positions(self, dofs: Sequence[str]) -> Array:
        """Positions (n, 3) of the nodes of dofs, nan where they have none; raises InputError as ``directions`` does."""
        known = dict(zip(self.node_ids.tolist(), self.coordinates, strict=True))
        places = []
        for dof in dofs:
            mean = self._mean_of(dof) or self._alone(dof)
            nodes = np.array([known.get(int(label), np.full(3, np.nan)) for label in mean.labels])
            places.append(mean.shares @ nodes)
        return np.array(places).reshape(-1, 3)

    def _alone(self, dof: str) -> _Mean:
        """A dof of one node."""
        row = self._dependent_rows.get(dof)
        label, component = self.dependent[row] if row is not None else (self.dof_nodes[self.index(dof)], 0)
        return _Mean(np.array([label]), np.ones(1), int(component))

    def translation(self, axis: str) -> Array:
        """The unit motion (n,) of the whole model along "x", "y" or "z".

        Raises
        ------
        InputError
            If an equation does not let the model move so.
        """
        along = COMPONENTS.index(axis)
        moved = (self.dof_components == along).astype(float)
        if self.dependence is not None:
            wanted = (self.dependent[:, 1] == along).astype(float)
            stays = np.abs(self.dependence @ moved - wanted) > 1e-6
            if stays.any():
                what = f"{dof_name(_pair(self.dependent[stays][0]))} depends on others so that it cannot"
                raise InputError(Fault("base", f"the model cannot move along {axis} as a whole: {what}"))
        return moved

    def nodes_of(self, name: str) -> IntArray:
        """Node labels of a named set; InputError lists the sets."""
        if name not in self.node_sets:
            known = user_names(self.node_sets)
            sentence = f"node set '{name}' is not in the imported model; it has: {', '.join(known) or 'none'}"
            close = suggestion(name, known)
            raise InputError(Fault(statement=sentence, remedy=close if close.startswith("did") else ""))
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
                Fault(
                    statement=f"the position of node {np.asarray(nodes)[~known][0]} is not known",
                    remedy="import the mesh too (slipstick import MATRICES MESH)",
                )
            )
        return self.coordinates[order[place]]

    @property
    def loose_bolts(self) -> list[str]:
        """Those of ``shortenings`` that are free."""
        return [dof for dof in self.shortenings if dof in self._rows]

    def in_mesh(self, what: str) -> Mesh:
        """The mesh, whose nodes are those of the rows; ``what`` needs it, in messages.

        Raises
        ------
        InputError
            If there is no mesh, its nodes are others, or nodes of its elements have rotations.
        """
        if self.mesh is None:
            remedy = "import it too, or name contact nodes"
            raise InputError(Fault(Place(self.source), f"{what} need the mesh", remedy=remedy))
        labels = np.concatenate([self.dof_nodes, self.dependent[:, 0]])
        parts = np.concatenate([self.dof_components, self.dependent[:, 1]])
        place = self._places(labels)
        strange, turns = self.mesh.labels[place] != labels, parts > 2
        if np.any(turns & (strange | np.isin(place, self.mesh.used_nodes))):
            remedy = "the model has rotations"
            raise InputError(Fault(Place(self.source), f"{what} need solid elements", remedy=remedy))
        if np.any(strange):
            statement = f"node {labels[strange][0]} of the matrices is not in the mesh"
            raise InputError(Fault(Place(self.source), statement, remedy="give the mesh they came from"))
        return self.mesh

    def _places(self, labels: IntArray) -> IntArray:
        """Indices of nodes in the mesh; of nodes that are not in it, any index."""
        assert self.mesh is not None
        order = np.argsort(self.mesh.labels)
        return order[np.searchsorted(self.mesh.labels, labels, sorter=order).clip(max=len(order) - 1)]

    def _listed(self, labels: IntArray, components: IntArray) -> IntArray:
        """Index of degrees of freedom in the node-major list ``3 node + axis`` of the mesh; -1 for rotations."""
        return np.where(components > 2, -1, 3 * self._places(labels) + components)

    @cached_property
    def free(self) -> IntArray:
        """Index (n,) of each row in the node-major list ``3 node + axis`` of the mesh; -1 for rotations."""
        return self._listed(self.dof_nodes, self.dof_components)

    @cached_property
    def motion(self) -> csr_array:
        """Motion of all nodes of the mesh, node-major, by that of the rows, sparse (3 n_nodes, n); see ``in_mesh``."""
        mesh = self.in_mesh("motions of nodes")
        kept = np.flatnonzero(self.free >= 0)
        parts = [csr_array((np.ones(len(kept)), (range(len(kept)), kept)), shape=(len(kept), self.n_dofs))]
        rows = [self.free[kept]]
        if self.dependence is not None:
            among = self._listed(*self.dependent.T)
            parts.append(self.dependence[among >= 0])
            rows.append(among[among >= 0])
        every = np.concatenate(rows)
        moved = csr_array((np.ones(len(every)), (every, range(len(every)))), shape=(3 * mesh.n_nodes, len(every)))
        return csr_array(moved @ vstack(parts))

    def restrict(self, full: Sparse) -> csr_array:
        """Forces on the rows by those on all nodes of the mesh (3 n_nodes,), or columns of them, dense or sparse."""
        if not issparse(full):
            return self.motion.T @ full
        found = csr_array(self.motion.T @ full)
        found.sort_indices()
        return found

    def rows_of(self, nodes: IntArray) -> csr_array:
        """Sparse (n, 3 n_nodes): the columns take x, y, z of mesh nodes out of a motion; zero where one is held."""
        return csr_array(self.motion[(3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()].T)

    def indices(self, nodes: IntArray) -> IntArray:
        """Rows (n_nodes, 3) of x, y, z of mesh nodes.

        Raises
        ------
        InputError
            If one of them has no row of its own.
        """
        assert self.mesh is not None
        position = np.full(3 * self.mesh.n_nodes, -1, dtype=np.int64)
        position[self.free[self.free >= 0]] = np.flatnonzero(self.free >= 0)
        rows = position[3 * np.asarray(nodes)[:, None] + np.arange(3)]
        if rows.min() < 0:
            label = self.mesh.labels[np.asarray(nodes)[(rows < 0).any(axis=1)][0]]
            remedy = "it can carry no contact, load or output"
            raise InputError(Fault(statement=f"node {label} is fixed", remedy=remedy))
        return rows

    @cached_property
    def conduction(self) -> csr_array | None:
        """Conduction matrix of all nodes of the mesh, (n_nodes, n_nodes); None where a conductivity is not known."""
        if self.mesh is None or not self.materials or any(m.conductivity <= 0.0 for m in self.materials.values()):
            return None
        return conduction(self.mesh, self.materials)

    def fix(self, where: str | Sequence[str] | IntArray, components: str = "xyz") -> FiniteElementModel:
        """The model with more held: node sets by name or node labels, in the directions named; "n12" is all directions
        of node 12, "n12y" one of them.

        Raises
        ------
        InputError
            One sentence for each unknown set; if nothing is left to hold or to move.
        """
        names = [where] if isinstance(where, str) else where
        single: list[str] = []
        nodes = names
        if not isinstance(names, np.ndarray):
            single = [name for name in names if name not in self.node_sets and names_dofs(name)]
            nodes = self._named([name for name in names if name not in single])
        wanted = [i for i, name in enumerate(COMPONENTS) if name in directions_in(components)]
        places = ((self.dof_nodes, self.dof_components), (self.dependent[:, 0], self.dependent[:, 1]))
        marks = [np.isin(labels, nodes) & np.isin(parts, wanted) for labels, parts in places]
        for name in single:
            named = [rows_named(name, *place) for place in places]
            if not any(mark.any() for mark in named):
                raise InputError(Fault("fixed", f"there is no free dof '{name}' in the model"))
            marks = [mark | more for mark, more in zip(marks, named, strict=True)]
        held, others = marks
        if not (held.any() or others.any()) or held.all():
            raise InputError(
                Fault(statement=f"fixing {len(nodes)} nodes in {components} holds {held.sum()} of {self.n_dofs} dofs")
            )
        if self.dependence is None:
            return self._without(held)
        chosen = [
            pair
            for (labels, parts), mark in zip(places, marks, strict=True)
            for pair in self._pairs(labels[mark], parts[mark])
        ]
        return self.constrain((), held=chosen)

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

    def with_properties(self, **properties: Any) -> FiniteElementModel:
        """The model with these properties in every material: conductivity, expansion, reference."""
        known = self.materials or {"all": Material(young=1.0, poisson=0.0)}
        return replace(self, materials={name: material.but(**properties) for name, material in known.items()})

    def constrain(self, equations: Iterable[NodalEquation], *, held: Iterable[Pair] = ()) -> FiniteElementModel:
        """The model with more linear constraints: dependent degrees of freedom are taken out of K, M, C.

        Parameters
        ----------
        equations
            Between any degrees of freedom of the model. Those that it does not have, such as rotations of a reference
            node, are made, without stiffness or mass of their own.
        held
            Node label and direction (index into ``COMPONENTS``) of what is held at zero, free ones or dependent ones.

        Raises
        ------
        InputError
            As ``slipstick.structure.constraints.eliminate``.
        """
        rows = self._pairs(self.dof_nodes, self.dof_components)
        zero = [*self.constrained.tolist(), *held]
        every, elimination = resolve(rows, list(equations), [*map(_pair, zero)], self._combinations(rows))
        table = np.array(every, dtype=np.int64).reshape(-1, 2)
        basis = csr_array(elimination.T[: len(rows)])
        return replace(
            self,
            **{n: _reduced(basis, m) for n, m in (("K", self.K), ("M", self.M), ("C", self.C)) if m is not None},
            dof_nodes=table[elimination.independent, 0],
            dof_components=table[elimination.independent, 1],
            constrained=np.unique(np.concatenate([self.constrained, table[elimination.zero]]), axis=0),
            dependent=table[elimination.dependent],
            dependence=csr_array(elimination.T[elimination.dependent]) if len(elimination.dependent) else None,
            notes=(*self.notes, *idle_notes(elimination)),
        )

    def _combinations(self, rows: Sequence[Pair]) -> dict[Pair, list[tuple[Pair, float]]]:
        """The dependent degrees of freedom by the others."""
        if self.dependence is None:
            return {}
        parts, sparse = self._pairs(*self.dependent.T), self.dependence
        spans = [slice(a, b) for a, b in pairwise(sparse.indptr.tolist())]
        return {
            pair: [
                (rows[i], value) for i, value in zip(sparse.indices[at].tolist(), sparse.data[at].tolist(), strict=True)
            ]
            for pair, at in zip(parts, spans, strict=True)
        }

    @staticmethod
    def _pairs(nodes: IntArray, components: IntArray) -> list[Pair]:
        return [*zip(nodes.tolist(), components.tolist(), strict=True)]

    def _without(self, held: BoolArray) -> FiniteElementModel:
        """The model without some rows, on which nothing depends."""
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


def _pair(pair: Sequence[int]) -> Pair:
    return int(pair[0]), int(pair[1])


def _reduced(basis: csr_array, matrix: csr_array) -> csr_array:
    """``T' A T``; terms that cancel (a rigid body's own stiffness) leave zero, not rounding."""
    part = csr_array(basis.T @ matrix @ basis)
    part = csr_array((part + part.T) * 0.5)
    size = csr_array(abs(basis).T @ abs(matrix) @ abs(basis))
    left = csr_array(abs(part) > _ROUNDING * size)
    return csr_array(part.multiply(left))


def _faults(model: FiniteElementModel) -> Iterator[Fault]:
    n = len(model.dof_nodes)
    for name in ("K", "M", "C"):
        matrix = getattr(model, name)
        if matrix is not None and matrix.shape != (n, n):
            what = f"is {matrix.shape[0]} x {matrix.shape[1]}, the dof map has {n} entries"
            yield Fault(name, what, remedy="they must agree")
    if len(model.dof_components) != n:
        what = f"has {n} nodes and {len(model.dof_components)} directions"
        yield Fault("the dof map", what, expected="as many")
        return
    if n and not (model.dof_components.min() >= 0 and model.dof_components.max() < len(COMPONENTS)):
        yield Fault(statement=f"the dof map holds a direction outside 1..{len(COMPONENTS)}")
    if (0 if model.dependence is None else model.dependence.shape[0]) != len(model.dependent):
        kind = "no" if model.dependence is None else "other"
        yield Fault(statement=f"{len(model.dependent)} dependent dofs have {kind} equations")
    elif model.dependence is not None and model.dependence.shape[1] != n:
        what = f"has {model.dependence.shape[1]} columns"
        yield Fault("dependence", what, expected=f"{n}, one for each free dof")
    pairs, counts = np.unique(np.stack([model.dof_nodes, model.dof_components], axis=1), axis=0, return_counts=True)
    if n and counts.max() > 1:
        node, component = pairs[np.argmax(counts)]
        yield Fault(statement=f"the dof map names node {node}, direction {component + 1}, more than once")
    if model.coordinates.shape != (len(model.node_ids), 3):
        what = f"coordinates have shape {model.coordinates.shape}"
        yield Fault(statement=what, expected=f"({len(model.node_ids)}, 3)")
    elif not np.all(np.isfinite(model.coordinates)):
        yield Fault(statement="node coordinates are not all finite")


ImportedModel = FiniteElementModel
"""What ``ss.import_model`` returns."""


def elastic_model(mesh: Mesh, materials: Materials, fixed: str | Sequence[str] | IntArray) -> FiniteElementModel:
    """Assemble a mesh and take out the fixed nodes: a node set or surface by name, several, or node indices.

    Linear tetrahedra are far too stiff: SlipstickWarning.

    Raises
    ------
    InputError
        If a set is unknown, empty or holds every node, or the material has no density.
    """
    nodes = _fixed_nodes(mesh, fixed)
    for sentence in linear_warnings(mesh, "mesh", ("tet4",)):
        warnings.warn(sentence, SlipstickWarning, stacklevel=2)
    whole = assemble(mesh, materials)
    kept = np.zeros(mesh.n_nodes, dtype=bool)
    kept[mesh.used_nodes] = True
    kept[nodes] = False
    free = np.flatnonzero(np.repeat(kept, 3))
    if not len(free):
        raise InputError(Fault(statement="every node is fixed", remedy="fix fewer"))
    M = _principal(whole.mass, free)
    if not M.diagonal().min() > 0.0:
        remedy = "give every material a density > 0"
        raise InputError(Fault(statement="the mass matrix is zero somewhere", remedy=remedy))
    held = np.setdiff1d(np.arange(3 * mesh.n_nodes), free)
    model = FiniteElementModel(
        K=_principal(whole.stiffness, free),
        M=M,
        dof_nodes=mesh.labels[free // 3],
        dof_components=free % 3,
        node_ids=mesh.labels,
        coordinates=mesh.nodes,
        node_sets={name: mesh.labels[nodes] for name, nodes in mesh.all_sets.items()},
        constrained=np.stack([mesh.labels[held // 3], held % 3], axis=1),
        mesh=mesh,
        materials={"all": materials} if isinstance(materials, Material) else materials,
    )
    vars(model)["conduction"] = whole.conduction  # known already
    return model


def _principal(A: csr_array, kept: IntArray) -> csr_array:
    """Chosen rows and columns of a matrix; a single range of them is sliced, which is much faster."""
    if kept[-1] - kept[0] + 1 == len(kept):
        part = slice(int(kept[0]), int(kept[-1]) + 1)
        return A[part, part]
    return A[kept][:, kept]


def _fixed_nodes(mesh: Mesh, fixed: str | Sequence[str] | IntArray) -> IntArray:
    if isinstance(fixed, str):
        fixed = [fixed]
    if not isinstance(fixed, np.ndarray):
        fixed = np.concatenate([mesh.node_set(name) for name in fixed]) if len(fixed) else np.empty(0, dtype=np.int64)
    if not len(fixed):
        remedy = "the structure would float: name a node set or surface to fix"
        raise InputError(Fault(statement="no node is fixed", remedy=remedy))
    return np.unique(fixed)
