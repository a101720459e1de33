"""A mesh from another code, assembled with the elements of this package."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.fem import refine
from slipstick.fem.elements import LINEAR_TO_QUADRATIC
from slipstick.fem.equations import names_dofs
from slipstick.fem.expansion import initial_temperature, step_temperature, stiffness_note, tabulated
from slipstick.fem.geometry import hourglass_warnings
from slipstick.fem.load_steps import INITIAL
from slipstick.fem.lumped import with_lumped
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, node_indices
from slipstick.fem.model import ImportedModel
from slipstick.importers.deck import Deck, pairs_table
from slipstick.importers.findings import made_of, refused
from slipstick.importers.interfaces import pair_warnings, section_faults, section_warnings
from slipstick.importers.matrix_model import build_model
from slipstick.importers.mesh_checks import material_warnings, variant_warnings
from slipstick.typing import IntArray

MeshModel = Deck
"""A deck with a mesh and no matrices."""


def assemble_mesh(
    deck: Deck,
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
    deck
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
    assert deck.mesh is not None
    faults = [coupling.refused for coupling in deck.couplings]
    faults += deck.material_faults if material is None else ()
    faults += [*_not_in_between(deck)] if quadratic else ()
    faults += section_faults(deck, deck.mesh)
    if faults:
        raise InputError(faults)
    materials = _materials(deck, deck.mesh, material, source)
    known = {*deck.mesh.node_sets, *deck.mesh.surfaces}
    single = [name for name in fixed if name not in known and names_dofs(name)]
    fixed = [name for name in fixed if name not in single]
    for name in fixed:
        if not len(deck.mesh.node_set(name)):
            raise refused(source, f"the node set '{name}' is empty: nothing is fixed by it", remedy="give its nodes")
    mesh = _with_held_sets(deck, deck.mesh, source)
    if quadratic:
        mesh = refine.quadratic(mesh)
    whole = replace(deck, held={tuple(pair) for pair in _held(mesh, fixed).tolist()})
    whole.held |= {pair for pair in deck.held if pair[1] > 2}
    mesh = replace(mesh, node_sets={name: nodes for name, nodes in mesh.node_sets.items() if name not in _HELD})
    changing = tabulated(materials)
    with made_of(source):
        if changing and initial_temperature(deck.load_steps):
            mesh = replace(mesh, temperature=step_temperature(mesh, deck.load_steps, INITIAL))
        whole.mesh, whole.units = mesh, units or deck.units
        _assemble(whole, mesh, materials)
    whole.extra = [*deck.extra, *_orphans(deck, mesh, source)]
    if mesh.temperature is not None:
        whole.extra.append(f"{source}: {stiffness_note(mesh)} (the initial one of the file)")
    whole.own_warnings = [
        *deck.own_warnings,
        *refine.linear_warnings(mesh, source),
        *variant_warnings(mesh, deck.variants, source),
        *hourglass_warnings(mesh, source),
        *material_warnings(deck.materials, material, source),
        *pair_warnings(deck, mesh),
        *section_warnings(deck, mesh),
        *_table_warnings(source, changing, mesh),
    ]
    symmetry = deck.symmetry(mesh)
    model = build_model(whole, source=source)
    model = model.fix(single) if single else model
    if isinstance(materials, Material):
        everything = {kind: np.arange(len(block)) for kind, block in mesh.blocks.items()}
        mesh = replace(mesh, element_sets={**mesh.element_sets, "all": everything})
        materials = {"all": materials}
    model = replace(
        model,
        mesh=mesh,
        materials=dict(materials),
        symmetry=symmetry,
        contact_pairs=deck.contact_pairs,
        pretension_sections=deck.pretension_sections,
        load_steps=deck.load_steps,
    )
    if symmetry is None or not any(stated.cyclic for stated in deck.stated):
        return model
    alone = build_model(whole, source=source, cyclic=False)
    alone = replace(alone.fix(single) if single else alone, mesh=mesh, materials=dict(materials))
    return replace(model, symmetry=replace(symmetry, alone=alone))


def _table_warnings(source: str, changing: Sequence[str], mesh: Mesh) -> Iterator[str]:
    """The temperature at which tables are read, where the file states none."""
    if changing and mesh.temperature is None:
        yield (
            f"{source}: the elasticity of {', '.join(changing)} depends on temperature, and the file states no initial "
            "one: it is that at the reference of the expansion, or of the first row; ss.models.at_temperature takes "
            "another"
        )


def _orphans(deck: Deck, mesh: Mesh, source: str) -> Iterator[str]:
    """Nodes of no element, mass or spring, such as reference nodes of couplings."""
    lone = np.setdiff1d(mesh.labels, mesh.labels[mesh.used_nodes])
    lone = np.setdiff1d(lone, [node for part in deck.lumped for node, _ in part.pairs])
    if len(lone):
        some = ", ".join(map(str, lone[:8].tolist())) + (", ..." if len(lone) > 8 else "")
        yield f"{source}: {len(lone)} nodes belong to no element: {some}"


def _assemble(deck: Deck, mesh: Mesh, materials: Material | Mapping[str, Material]) -> None:
    """Matrices of the mesh with its point masses and springs, and their rows."""
    from slipstick.fem.assembly import assemble

    whole = assemble(mesh, materials)
    deck.matrices = {"K": whole.stiffness, "M": whole.mass}
    deck.rows = np.stack([np.repeat(mesh.labels, 3), np.tile(np.arange(3), mesh.n_nodes)], axis=1)
    if deck.lumped:
        matrices, rows = with_lumped(deck.matrices, [*map(tuple, deck.rows.tolist())], deck.lumped)
        deck.matrices, deck.rows = dict(matrices), pairs_table(rows)


def _not_in_between(deck: Deck) -> Iterator[Fault]:
    """Constraints that would leave out the nodes put in the middle of edges."""
    if deck.mesh and any(block in LINEAR_TO_QUADRATIC and len(part) for block, part in deck.mesh.blocks.items()):
        for stated in deck.stated:
            if stated.nodewise:
                what = "names nodes one by one: those that quadratic adds would not be tied"
                yield Fault(stated.where, what, remedy="mesh quadratic instead")


_HELD = tuple(f"(held {axis})" for axis in "xyz")


def _with_held_sets(deck: Deck, mesh: Mesh, source: str) -> Mesh:
    """Held directions as node sets, so that they follow the mesh when it becomes quadratic."""
    sets = dict(mesh.node_sets)
    held = deck.held_rows
    for axis, name in enumerate(_HELD):
        labels = held[held[:, 1] == axis, 0]
        sets[name] = (
            node_indices(mesh.labels, labels, f"{source}: a support") if len(labels) else np.empty(0, dtype=np.int64)
        )
    return replace(mesh, node_sets=sets)


def _held(mesh: Mesh, fixed: Sequence[str]) -> IntArray:
    parts = [(mesh.node_set(name), axis) for name in fixed for axis in range(3)]
    parts += [(mesh.node_sets[name], axis) for axis, name in enumerate(_HELD)]
    pairs = [np.stack([mesh.labels[nodes], np.full(len(nodes), axis)], axis=1) for nodes, axis in parts]
    return np.unique(np.concatenate(pairs), axis=0).astype(np.int64)


def _materials(deck: Deck, mesh: Mesh, material: Material | None, source: str) -> Material | Mapping[str, Material]:
    if material is not None:
        return material
    if not deck.materials:
        raise refused(source, "is a mesh without material", remedy="give young, poisson and density")
    without = [name for name, known in deck.materials.items() if not known.density > 0.0]
    if without:
        raise refused(source, f"{', '.join(without)} has no density", remedy="give young, poisson and density")
    if len(deck.materials) == 1 and next(iter(deck.materials)) not in mesh.element_sets:
        return next(iter(deck.materials.values()))
    return deck.materials
