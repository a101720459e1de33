"""A mesh from another code with its materials and supports, and its assembly with the elements of this package."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import Fault, InputError, Place, Where
from slipstick.fem import refine
from slipstick.fem.boundary import boundary
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.elements import FACES, LINEAR_TO_QUADRATIC
from slipstick.fem.equations import NodalEquation, names_dofs
from slipstick.fem.frames import NodeAxes
from slipstick.fem.geometry import hourglass_warnings
from slipstick.fem.imported import ImportedModel
from slipstick.fem.lumped import Lumped, with_lumped
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface, node_indices
from slipstick.fem.unit_systems import NOT_STATED
from slipstick.importers.findings import Coupling
from slipstick.importers.mesh_checks import Variants, material_warnings, variant_warnings
from slipstick.importers.raw_model import DofMap, Nodes, RawModel, build_model
from slipstick.typing import IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array


@dataclass(frozen=True, kw_only=True)
class Stated:
    """A constraint of a file: where it stands, and its equations between the nodes of the finished mesh.

    ``nodewise``: it names each node, so that nodes which come to a mesh later are not in it. ``cyclic``: it joins the
    faces of a sector, for equal motion of all sectors.
    """

    where: Place
    equations: Callable[[Mesh], Iterable[NodalEquation]]
    nodewise: bool = True
    cyclic: bool = False


def stated_each(equations: Sequence[NodalEquation]) -> Iterator[Stated]:
    """Equations by the place that states them."""
    places: dict[Place, list[NodalEquation]] = {}
    for equation in equations:
        places.setdefault(_place(equation.where), []).append(equation)
    for where, equations_there in places.items():
        yield Stated(where=where, equations=partial(_same, equations_there))


def _place(where: str | Where) -> Place:
    return Place(where) if isinstance(where, str) else Place(*where)


def _same(equations: list[NodalEquation], mesh: Mesh) -> list[NodalEquation]:
    del mesh
    return equations


def _no_symmetry(_mesh: Mesh) -> CyclicSymmetry | None:
    return None


@dataclass(frozen=True, kw_only=True)
class MeshModel:
    """A mesh as a file has it.

    Attributes
    ----------
    mesh, materials, held, units
        Materials by element set (empty where the file has none); held dofs as (node label, direction 0..2).
    notes, warnings
        What was left out without effect; what is approximated or not understood. One sentence each.
    couplings
        What an assembly of the mesh would leave out: refused there.
    constraints, lumped
        Linear constraints; masses and springs between single dofs. Both are applied in an assembly.
    material_faults
        Why the materials of the file cannot be used: refused where no other is given.
    variants
        Foreign element types that integrate otherwise than ours, with their counts, by our element.
    axes
        Own directions (rows) of the nodes that have some, by label: those of the rows of matrices beside the mesh.
    symmetry
        Of the ring that the finished mesh is a sector of.
    """

    mesh: Mesh
    materials: Mapping[str, Material] = field(default_factory=dict)
    held: IntArray = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    units: str = NOT_STATED
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    constraints: tuple[Stated, ...] = ()
    lumped: tuple[Lumped, ...] = ()
    material_faults: tuple[Fault, ...] = ()
    variants: Variants = field(default_factory=dict)
    axes: NodeAxes = field(default_factory=dict)
    symmetry: Callable[[Mesh], CyclicSymmetry | None] = _no_symmetry

    @property
    def applied(self) -> tuple[Coupling, ...]:
        """What an assembly here applies, and matrices beside the mesh must hold."""
        ties = [
            Coupling(where=stated.where, what="ties degrees of freedom to each other") for stated in self.constraints
        ]
        if self.lumped:
            ties.append(
                Coupling(where=Place(f"{len(self.lumped)} point masses and springs"), what="add to the matrices")
            )
        return tuple(dict.fromkeys(ties))


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


def assemble_mesh(
    imported: MeshModel,
    *,
    source: str,
    material: Material | None = None,
    fixed: Sequence[str] = (),
    quadratic: bool = False,
    units: str | None = None,
) -> ImportedModel:
    """Stiffness and mass of an imported mesh by the elements of this package, supports taken out.

    Parameters
    ----------
    imported
        The mesh as read.
    source
        Name for messages.
    material
        One material for the whole mesh instead of those in the file.
    fixed
        Node sets or surfaces held in x, y and z, nodes ("n12") or dofs ("n12y"), besides what the file holds.
    quadratic
        Put a node in the middle of every edge first: linear elements are far too stiff in bending.
    units
        What the numbers are in, where the file does not say.

    Raises
    ------
    InputError
        If the file couples or holds what we do not apply, no material is known, a set is unknown, or an element is
        inside out.
    """
    faults = [coupling.refused for coupling in imported.couplings]
    faults += imported.material_faults if material is None else ()
    faults += [*_not_in_between(imported)] if quadratic else ()
    if faults:
        raise InputError(faults)
    materials = _materials(imported, material, source)
    known = {*imported.mesh.node_sets, *imported.mesh.surfaces}
    single = [name for name in fixed if name not in known and names_dofs(name)]
    fixed = [name for name in fixed if name not in single]
    for name in fixed:
        if not len(imported.mesh.node_set(name)):
            raise InputError(
                Fault(Place(source), f"the node set '{name}' is empty: nothing is fixed by it", remedy="give its nodes")
            )
    mesh = _with_held_sets(imported, source)
    if quadratic:
        mesh = refine.quadratic(mesh)
    matrices, dof_map = _with_lumped(imported, mesh, materials)
    rotations = imported.held[imported.held[:, 1] > 2]
    held = np.concatenate([_held(mesh, fixed), rotations])
    mesh = replace(mesh, node_sets={name: nodes for name, nodes in mesh.node_sets.items() if name not in _HELD})
    nodes = Nodes(
        ids=mesh.labels,
        coordinates=mesh.nodes,
        sets={name: mesh.labels[part] for name, part in all_sets(mesh).items()},
        held=held,
    )
    raw = RawModel(
        matrices=matrices,
        dof_map=dof_map,
        nodes=nodes,
        equations=_equations(imported, mesh, cyclic=True),
        notes=(*imported.notes, *_orphans(imported, mesh, source)),
        warnings=(
            *imported.warnings,
            *refine.linear_warnings(mesh, source),
            *variant_warnings(mesh, imported.variants, source),
            *hourglass_warnings(mesh, source),
            *material_warnings(imported.materials, material, source),
        ),
    )
    symmetry = imported.symmetry(mesh)
    model = build_model(raw, source=source, units=units or imported.units)
    model = model.fix(single) if single else model
    if isinstance(materials, Material):
        everything = {kind: np.arange(len(block)) for kind, block in mesh.blocks.items()}
        mesh = replace(mesh, element_sets={**mesh.element_sets, "all": everything})
        materials = {"all": materials}
    model = replace(model, mesh=mesh, materials=dict(materials), symmetry=symmetry)
    if symmetry is None or not any(stated.cyclic for stated in imported.constraints):
        return model
    free = replace(raw, equations=_equations(imported, mesh, cyclic=False))
    alone = build_model(free, source=source, units=units or imported.units)
    alone = replace(alone.fix(single) if single else alone, mesh=mesh, materials=dict(materials))
    return replace(model, symmetry=replace(symmetry, alone=alone))


def _equations(imported: MeshModel, mesh: Mesh, *, cyclic: bool) -> tuple[NodalEquation, ...]:
    """All constraints, or those that do not join the faces of a sector."""
    chosen = [stated for stated in imported.constraints if cyclic or not stated.cyclic]
    return tuple(equation for stated in chosen for equation in stated.equations(mesh))


def _orphans(imported: MeshModel, mesh: Mesh, source: str) -> Iterator[str]:
    """Nodes that belong to no element, and that no mass or spring uses; references of couplings are among them."""
    lone = np.setdiff1d(mesh.labels, mesh.labels[mesh.used_nodes])
    lone = np.setdiff1d(lone, [node for part in imported.lumped for node, _ in part.pairs])
    if len(lone):
        some = ", ".join(map(str, lone[:8].tolist())) + (", ..." if len(lone) > 8 else "")
        yield f"{source}: {len(lone)} nodes belong to no element: {some}"


def _with_lumped(
    imported: MeshModel, mesh: Mesh, materials: Material | Mapping[str, Material]
) -> tuple[dict[str, csr_array], DofMap]:
    """Matrices of the mesh with its point masses and springs, and their rows."""
    from slipstick.fem.assembly import assemble

    whole = assemble(mesh, materials)
    matrices = {"K": whole.stiffness, "M": whole.mass}
    count = np.arange(3 * mesh.n_nodes)
    nodes, components = mesh.labels[count // 3], count % 3
    if imported.lumped:
        rows = [*zip(nodes.tolist(), components.tolist(), strict=True)]
        matrices, rows = with_lumped(matrices, rows, imported.lumped)
        nodes, components = np.array(rows, dtype=np.int64).T
    return matrices, DofMap(nodes=nodes, components=components)


def _not_in_between(imported: MeshModel) -> Iterator[Fault]:
    """Constraints that would leave out the nodes put in the middle of edges."""
    if any(block in LINEAR_TO_QUADRATIC and len(part) for block, part in imported.mesh.blocks.items()):
        for stated in imported.constraints:
            if stated.nodewise:
                what = "names nodes one by one: those that quadratic adds would not be tied"
                yield Fault(stated.where, what, remedy="mesh quadratic instead")


_HELD = tuple(f"(held {axis})" for axis in "xyz")


def _with_held_sets(imported: MeshModel, source: str) -> Mesh:
    """Held directions as node sets, so that they follow the mesh when it becomes quadratic."""
    mesh = imported.mesh
    sets = dict(mesh.node_sets)
    for axis, name in enumerate(_HELD):
        labels = imported.held[imported.held[:, 1] == axis, 0]
        sets[name] = (
            node_indices(mesh.labels, labels, f"{source}: a support") if len(labels) else np.empty(0, dtype=np.int64)
        )
    return replace(mesh, node_sets=sets)


def _held(mesh: Mesh, fixed: Sequence[str]) -> IntArray:
    parts = [(mesh.node_set(name), axis) for name in fixed for axis in range(3)]
    parts += [(mesh.node_sets[name], axis) for axis, name in enumerate(_HELD)]
    pairs = [np.stack([mesh.labels[nodes], np.full(len(nodes), axis)], axis=1) for nodes, axis in parts]
    return np.unique(np.concatenate(pairs), axis=0).astype(np.int64)


def all_sets(mesh: Mesh) -> dict[str, IntArray]:
    """Node indices of every node set and surface, by name."""
    return {**{name: surface.nodes for name, surface in mesh.surfaces.items()}, **mesh.node_sets}


def _materials(imported: MeshModel, material: Material | None, source: str) -> Material | Mapping[str, Material]:
    if material is not None:
        return material
    if not imported.materials:
        raise InputError(Fault(Place(source), "is a mesh without material", remedy="give young, poisson and density"))
    without = [name for name, known in imported.materials.items() if not known.density > 0.0]
    if without:
        raise InputError(
            Fault(Place(source), f"{', '.join(without)} has no density", remedy="give young, poisson and density")
        )
    if len(imported.materials) == 1 and next(iter(imported.materials)) not in imported.mesh.element_sets:
        return next(iter(imported.materials.values()))
    return imported.materials
