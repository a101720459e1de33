"""A mesh from another code with its materials and supports, and its assembly with our own elements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.fem.boundary import boundary
from slipstick.fem.elements import FACES, LINEAR_TO_QUADRATIC
from slipstick.fem.imported import ImportedModel
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface
from slipstick.io.raw_model import DofMap, Nodes, RawModel, build_model

IntArray = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class MeshModel:
    """Mesh, materials by element set (empty where the file has none), held dofs (node label, direction 0..2), notes."""

    mesh: Mesh
    materials: Mapping[str, Material] = field(default_factory=dict)
    held: IntArray = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    units: str = "not stated"
    notes: tuple[str, ...] = ()


def node_indices(labels: IntArray, wanted: IntArray, what: str) -> IntArray:
    """Indices of node labels.

    Raises
    ------
    InputError
        If a label is not there; ``what`` says who asks for it.
    """
    order = np.argsort(labels, kind="stable")
    place = np.searchsorted(labels, wanted, sorter=order).clip(max=len(labels) - 1)
    found = order[place]
    missing = labels[found] != wanted
    if missing.any():
        raise InputError(f"{what} uses node {np.asarray(wanted)[missing][0]}, which is not in the file")
    return found


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
    to_quadratic: bool = False,
    units: str | None = None,
) -> ImportedModel:
    """Stiffness and mass of an imported mesh by our own elements, supports taken out.

    Parameters
    ----------
    imported
        The mesh as read.
    source
        Name for messages.
    material
        One material for the whole mesh instead of those in the file.
    fixed
        Node sets or surfaces held in x, y and z, besides what the file holds.
    to_quadratic
        Put a node in the middle of every edge first: linear elements are far too stiff in bending.
    units
        What the numbers are in, where the file does not say.

    Raises
    ------
    InputError
        If no material is known, a set is unknown, or an element is inside out.
    """
    from slipstick.fem.assembly import assemble
    from slipstick.fem.refine import quadratic

    materials = _materials(imported, material, source)
    for name in fixed:
        imported.mesh.node_set(name)
    mesh = _with_held_sets(imported)
    if to_quadratic:
        mesh = quadratic(mesh)
    whole = assemble(mesh, materials)
    count = np.arange(3 * mesh.n_nodes)
    held = _held(mesh, fixed)
    mesh = replace(mesh, node_sets={name: nodes for name, nodes in mesh.node_sets.items() if name not in _HELD})
    nodes = Nodes(
        ids=mesh.labels,
        coordinates=mesh.nodes,
        sets={name: mesh.labels[part] for name, part in _all_sets(mesh).items()},
        held=held,
    )
    raw = RawModel(
        matrices={"K": whole.stiffness, "M": whole.mass},
        dof_map=DofMap(nodes=mesh.labels[count // 3], components=count % 3),
        nodes=nodes,
        notes=(*imported.notes, *_notes(mesh)),
    )
    model = build_model(raw, source=source, units=units or imported.units)
    if isinstance(materials, Material):
        everything = {kind: np.arange(len(block)) for kind, block in mesh.blocks.items()}
        mesh = replace(mesh, element_sets={**mesh.element_sets, "all": everything})
        materials = {"all": materials}
    return replace(model, mesh=mesh, materials=dict(materials))


_HELD = tuple(f"(held {axis})" for axis in "xyz")


def _with_held_sets(imported: MeshModel) -> Mesh:
    """Held directions as node sets, so that they follow the mesh when it becomes quadratic."""
    mesh = imported.mesh
    sets = dict(mesh.node_sets)
    for axis, name in enumerate(_HELD):
        labels = imported.held[imported.held[:, 1] == axis, 0]
        sets[name] = node_indices(mesh.labels, labels, "a constraint") if len(labels) else np.empty(0, dtype=np.int64)
    return replace(mesh, node_sets=sets)


def _held(mesh: Mesh, fixed: Sequence[str]) -> IntArray:
    parts = [(mesh.node_set(name), axis) for name in fixed for axis in range(3)]
    parts += [(mesh.node_sets[name], axis) for axis, name in enumerate(_HELD)]
    pairs = [np.stack([mesh.labels[nodes], np.full(len(nodes), axis)], axis=1) for nodes, axis in parts]
    return np.unique(np.concatenate(pairs), axis=0).astype(np.int64)


def _all_sets(mesh: Mesh) -> dict[str, IntArray]:
    return {**{name: surface.nodes for name, surface in mesh.surfaces.items()}, **mesh.node_sets}


def _materials(imported: MeshModel, material: Material | None, source: str) -> Material | Mapping[str, Material]:
    if material is not None:
        return material
    if not imported.materials:
        raise InputError(f"{source}: is a mesh without material; give young, poisson and density")
    without = [name for name, known in imported.materials.items() if not known.density > 0.0]
    if without:
        raise InputError(f"{source}: {', '.join(without)} has no density; give young, poisson and density")
    if len(imported.materials) == 1 and next(iter(imported.materials)) not in imported.mesh.element_sets:
        return next(iter(imported.materials.values()))
    return imported.materials


def _notes(mesh: Mesh) -> Iterable[str]:
    linear = [name for name, block in mesh.blocks.items() if name in LINEAR_TO_QUADRATIC and len(block)]
    if linear:
        yield f"{', '.join(linear)} elements are far too stiff in bending; import with quadratic elements"


def unit_notes(mesh: Mesh, materials: Mapping[str, Material]) -> tuple[str, ...]:
    """What the size of the numbers suggests about the units, as sentences; a suspicion, never an error.

    Metals have E about 1e11 Pa and density 2000 to 20000 kg/m3; in N, mm, tonne 1e5 and 1e-9; in lbf, in 1e7 and 1e-4.
    """
    size = float(np.ptp(mesh.nodes[mesh.used_nodes], axis=0).max())
    notes = [f"the largest dimension is {size:.4g} length units; stiffness and density must be in the same system"]
    for name, material in materials.items():
        system = _system(material)
        if system:
            notes.append(f"{name}: E = {material.young:.4g}, density = {material.density:.4g} look like {system}")
        elif material.density > 0.0:
            notes.append(
                f"{name}: E = {material.young:.4g} and density = {material.density:.4g} fit no common system of units "
                "(Pa and kg/m3; MPa and t/mm3; psi and lbf s2/in4): check them"
            )
    return tuple(notes)


def likely_units(materials: Mapping[str, Material]) -> str:
    """What to write down about units that are not stated."""
    systems = {_system(material) for material in materials.values()} - {""}
    return f"not stated; E and density look like {systems.pop()}" if len(systems) == 1 else "not stated"


_SYSTEMS = (
    ("SI (N, m, kg)", (1e8, 2e12), (500.0, 3e4)),
    ("N, mm, tonne", (1e2, 2e6), (5e-10, 3e-8)),
    ("lbf, inch, s", (1e4, 2e8), (4e-5, 3e-3)),
    ("mN, mm, kg", (1e5, 2e9), (5e-7, 3e-5)),
)


def _system(material: Material) -> str:
    for name, (low, high), (lightest, heaviest) in _SYSTEMS:
        if low <= material.young <= high and lightest <= material.density <= heaviest:
            return name
    return ""
