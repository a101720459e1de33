"""Sections of bolts cut through: their nodes are doubled, and the two sides are tied but for a shortening.

A node of the section stays with the elements whose faces are the section; the elements on the other side get one of
their own, which moves as ``u' = u - s n`` with the unit normal ``n`` out of the first side. The shortening ``s`` of the
bolt is one more degree of freedom: that of the pre-tension node of the file. A force on it pulls the bolt.

With the elements of the second side that meet the section (stiffness ``k``) and the motion ``d`` of its nodes along the
normal, the matrices get the column ``-k d`` and the diagonal ``d' k d``. The rest stays as it is, to the last digit:
a bolt whose shortening is held is whole.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.sparse import block_array, coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from slipstick.errors import Fault, InputError, Place
from slipstick.faults import suggestion
from slipstick.fem.assembly import assemble
from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.equations import dof_name
from slipstick.fem.geometry import face_geometry
from slipstick.fem.interfaces import WHOLE, PretensionSection
from slipstick.fem.loads import area_vector, shape_integrals
from slipstick.fem.mesh import Mesh, Surface, part_of
from slipstick.fem.model import FiniteElementModel
from slipstick.typing import Array, IntArray

_FLAT = 0.05
"""Distance of nodes from their mean plane, over the size of the section, up to which it is one."""

_ALONG = 0.95
"""Cosine between the normal of the file and that of the faces, at least: 18 degrees."""

_OWN = 1e-6
"""Relative difference of the stiffness at a node from that of its elements, up to which they are the same."""

_COAXIAL = 0.1
"""Two sections are on the same bolt where the line between them is off their normals by less."""

Elements = Mapping[str, IntArray]
"""Positions of elements in their blocks, by type."""


@dataclass(frozen=True, kw_only=True)
class CutSection:
    """A section that is cut.

    Attributes
    ----------
    name
        That of the section in the file.
    dof
        Its shortening: a force on it pulls the bolt.
    normal
        Unit vector out of the elements whose faces are the section, (3,).
    area, centre
        Of the section, and its centroid, (3,).
    stiffness
        Force over shortening where nothing else moves: of the layer of elements beside the section.
    nodes, doubled
        Labels of its nodes and of those of the other side, (n,).
    """

    name: str
    dof: str
    normal: Array
    area: float
    centre: Array
    stiffness: float
    nodes: IntArray
    doubled: IntArray


def cut_sections(model: FiniteElementModel, names: Sequence[str]) -> tuple[FiniteElementModel, list[CutSection]]:
    """The model with sections cut through, and what each of them is.

    Raises
    ------
    InputError
        For sections that are not there or are given twice; whose surface is missing, does not cut the bolt through, or
        is not plane; whose normal points the other way; that share nodes, or leave a piece between them that nothing
        holds; whose node is used elsewhere; for matrices that are not those of the mesh.
    """
    known = model.pretension_sections
    faults = [
        Fault(("sections", name), "is no pre-tension section of the model", remedy=suggestion(name, known))
        for name in names
        if name not in known
    ]
    faults += [
        Fault(("sections", name), "is given twice", remedy="cut each section once")
        for k, name in enumerate(names)
        if name in names[:k]
    ]
    if model.symmetry is not None:
        faults.append(Fault("sections", "are not cut in a sector of a ring", remedy="leave the bolts whole"))
    if faults:
        raise InputError(faults)
    found: list[CutSection] = []
    cut = model
    for name in names:
        where = known[name].place(model.source, name)
        for other in found:
            if known[name].node and known[other.name].node == known[name].node:
                what = f"shares the node {known[name].node} with the section {other.name}"
                faults.append(Fault(where, what, remedy="give each section a node of its own"))
            shared = np.intersect1d(_labels(cut, name, where), [*other.nodes, *other.doubled])
            if len(shared):
                what = f"shares {len(shared)} nodes with the section {other.name}, as node {shared[0]}"
                remedy = "keep one section across it"
                faults.append(Fault(where, f"{what}: the bolt is cut twice there", remedy=remedy))
        if not faults:
            cut, section = _cut(cut, name, known[name], where)
            found.append(section)
    faults += _between(cut, found, model)
    if faults:
        raise InputError(faults)
    if not cut.pretension_sections:
        cut = replace(cut, warnings=tuple(sentence for sentence in cut.warnings if not sentence.endswith(WHOLE)))
    return cut, found


def _labels(model: FiniteElementModel, name: str, where: Place) -> IntArray:
    mesh = model.in_mesh("cuts of bolts")
    return mesh.labels[_surface(mesh, name, where).nodes]


def _surface(mesh: Mesh, name: str, where: Place) -> Surface:
    if name in mesh.surfaces and mesh.surfaces[name].n_faces:
        return mesh.surfaces[name]
    what = f"names {name}, which is no surface of solid elements"
    remedy = "give the faces of the elements on one side; of a bolt that is a beam, give head and nut: ss.bolt"
    raise InputError(Fault(where, what, remedy=remedy))


def _cut(
    model: FiniteElementModel, name: str, section: PretensionSection, where: Place
) -> tuple[FiniteElementModel, CutSection]:
    mesh = model.in_mesh("cuts of bolts")
    surface = _surface(mesh, name, where)
    own, other = _sides(mesh, surface, where)
    normal, area, centre = _normal(mesh, surface, section, where)
    node = _node(model, mesh, section, where)
    at = surface.nodes
    _same_matrices(model, mesh, at, [own, other], where)
    d = np.zeros(3 * mesh.n_nodes)
    d[(3 * at[:, None] + np.arange(3)).ravel()] = np.tile(normal, len(at))
    beyond = assemble(part_of(mesh, other), model.materials)
    matrices = {}
    for key, matrix, part in (("K", model.K, beyond.stiffness), ("M", model.M, beyond.mass)):
        column, diagonal = -model.restrict(part @ d), float(d @ (part @ d))
        side = csr_array(column[:, None])
        matrices[key] = csr_array(block_array([[matrix, side], [side.T, csr_array([[diagonal]])]]))
    if model.C is not None:
        matrices["C"] = csr_array(block_array([[model.C, None], [None, csr_array((1, 1))]]))
    first = int(max(mesh.labels.max(), model.node_ids.max(initial=0), node)) + 1
    doubled = first + np.arange(len(at))
    moved = csr_array(model.motion[(3 * at[:, None] + np.arange(3)).ravel()])
    shortened = csr_array(np.tile(-normal, len(at))[:, None])
    earlier = csr_array((len(model.dependent), model.n_dofs)) if model.dependence is None else model.dependence
    dependence = block_array([[earlier, csr_array((earlier.shape[0], 1))], [moved, shortened]])
    pairs = np.stack([np.repeat(doubled, 3), np.tile(np.arange(3), len(at))], axis=1)
    place = mesh.nodes[mesh.labels == node]
    place = place if len(place) else centre[None]
    cut = replace(
        model,
        **matrices,
        dof_nodes=np.append(model.dof_nodes, node),
        dof_components=np.append(model.dof_components, 0),
        dependent=np.concatenate([model.dependent, pairs]),
        dependence=csr_array(dependence),
        node_ids=np.concatenate([model.node_ids, [node] * (node not in model.node_ids), doubled]).astype(np.int64),
        coordinates=np.concatenate([model.coordinates, place[: int(node not in model.node_ids)], mesh.nodes[at]]),
        mesh=_doubled(mesh, surface, doubled, other, node, centre),
        shortenings=(*model.shortenings, dof_name((node, 0))),
        pretension_sections={key: one for key, one in model.pretension_sections.items() if key != name},
        notes=(
            *model.notes,
            f"{where}: the bolt is cut at {name}: {len(at)} nodes doubled, {dof_name((node, 0))} is its shortening",
        ),
    )
    return cut, CutSection(
        name=name, dof=dof_name((node, 0)), normal=normal, area=area, centre=centre,
        stiffness=float(d @ (beyond.stiffness @ d)), nodes=mesh.labels[at], doubled=doubled,
    )  # fmt: skip


def _sides(mesh: Mesh, surface: Surface, where: Place) -> tuple[Elements, Elements]:
    """Elements at the nodes of a section: on the side whose faces it is, and on the other one."""
    marked = np.zeros(mesh.n_nodes, dtype=bool)
    marked[surface.nodes] = True
    touching = [
        (kind, int(at)) for kind, block in mesh.blocks.items() for at in np.flatnonzero(marked[block].any(axis=1))
    ]
    owners: dict[tuple[int, ...], list[int]] = {}
    for number, (kind, at) in enumerate(touching):
        for key in _keys(kind, mesh.blocks[kind][at][None]):
            owners.setdefault(key, []).append(number)
    middles = np.array([mesh.nodes[mesh.blocks[kind][at]].mean(axis=0) for kind, at in touching]).reshape(-1, 3)
    sides, section = (set[int](), set[int]()), set[tuple[int, ...]]()
    for faces, _, weights, normals in face_geometry(mesh, surface):
        mean = np.einsum("mq,mqa->ma", weights, normals)
        for face, along in zip(faces[:, : _corners(faces.shape[1])], mean, strict=True):
            key = tuple(sorted(face.tolist()))
            section.add(key)
            ahead = {n: bool((middles[n] - mesh.nodes[face].mean(axis=0)) @ along > 0.0) for n in owners.get(key, [])}
            if sorted(ahead.values()) != [False, True]:
                what = f"has a face at node {mesh.labels[face[0]]} with elements on one side alone"
                raise InputError(Fault(where, f"{what}: it does not cut the bolt", remedy="put it inside the bolt"))
            for n, beyond in ahead.items():
                sides[beyond].add(n)
    joined = [pair for key, those in owners.items() if key not in section for pair in combinations(those, 2)]
    i, j = np.array(joined, dtype=np.int64).reshape(-1, 2).T
    _, group = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(len(touching),) * 2), directed=False)
    groups = [{int(group[n]) for n in side} for side in sides]
    if groups[0] & groups[1]:
        both = next(n for n, g in enumerate(group.tolist()) if g in groups[0] & groups[1])
        what = (
            f"does not cut the bolt through: both sides are joined beside it, at element {_label(mesh, touching[both])}"
        )
        raise InputError(Fault(where, what, remedy="give the faces of the whole section, all of them of one side"))
    lone = [n for n, g in enumerate(group.tolist()) if g not in groups[0] | groups[1]]
    if lone:
        what = f"is touched by element {_label(mesh, touching[lone[0]])} along an edge alone, which is on neither side"
        raise InputError(Fault(where, what, remedy="join the meshes by faces, or give the bodies nodes of their own"))
    out = []
    for mine in groups:
        chosen: dict[str, list[int]] = {}
        for (kind, at), g in zip(touching, group.tolist(), strict=True):
            if g in mine:
                chosen.setdefault(kind, []).append(at)
        out.append({kind: np.array(part) for kind, part in chosen.items()})
    return out[0], out[1]


def _corners(n_nodes: int) -> int:
    return next(shape.n_corners for shape in FACES.values() if shape.n_nodes == n_nodes)


def _keys(kind: str, block: IntArray) -> Iterator[tuple[int, ...]]:
    """Corners of the faces of elements, ascending."""
    for shape, local in ELEMENTS[kind].faces:
        yield from map(tuple, np.sort(block[:, list(local[: FACES[shape].n_corners])], axis=1).tolist())


def _label(mesh: Mesh, element: tuple[str, int]) -> int:
    return mesh.element_label(*element)


def _normal(mesh: Mesh, surface: Surface, section: PretensionSection, where: Place) -> tuple[Array, float, Array]:
    """Unit normal, that of the file where it gives one, area and centroid."""
    shares, mean = shape_integrals(mesh, surface), area_vector(mesh, surface)
    area = float(shares.sum())
    centre = shares @ mesh.nodes / area
    mean = mean / max(float(np.linalg.norm(mean)), 1e-300)
    offsets = mesh.nodes[surface.nodes] - centre
    size = 2.0 * float(np.linalg.norm(offsets, axis=1).max())
    off = float(np.abs(offsets @ mean).max())
    if off > _FLAT * size:
        what = f"is not plane: node {mesh.labels[surface.nodes[int(np.abs(offsets @ mean).argmax())]]} lies {off:.3g}"
        remedy = "give faces in one plane across the bolt"
        raise InputError(
            Fault(where, f"{what} beside the mean plane of a section that is {size:.3g} wide", remedy=remedy)
        )
    if section.normal is None:
        return mean, area, centre
    given = np.array(section.normal) / np.linalg.norm(section.normal)
    cosine = float(given @ mean)
    shown = ", ".join(f"{x:.3g}" for x in section.normal)
    if cosine < 0.0:
        what = f"has the normal ({shown}), which points into the elements of its surface"
        raise InputError(Fault(where, what, remedy="turn it round, or give the faces of the other side"))
    if cosine < _ALONG:
        degrees = np.degrees(np.arccos(min(cosine, 1.0)))
        what = f"has the normal ({shown}), {degrees:.0f} degrees off that of its faces"
        raise InputError(Fault(where, what, remedy="give the direction of the bolt"))
    return given, area, centre


def _node(model: FiniteElementModel, mesh: Mesh, section: PretensionSection, where: Place) -> int:
    """Label of the node that carries the shortening: nothing else moves or holds it."""
    node = section.node or int(max(mesh.labels.max(), model.node_ids.max(initial=0), model.dof_nodes.max())) + 1
    uses = (
        (node in mesh.labels[mesh.used_nodes], "belongs to a solid element"),
        (node in model.dof_nodes, "moves as one of an equation, a coupling, a mass or a spring"),
        (node in model.dependent[:, 0], "depends on others by an equation or a coupling"),
        (node in model.constrained[:, 0], "is held by a support"),
    )
    for used, how in uses:
        if used:
            what = f"has the node {node}, which {how}"
            raise InputError(Fault(where, what, remedy="give the load of the bolt a node of its own"))
    return node


def _all_of(sides: Sequence[Elements]) -> Elements:
    """The elements of some sides together."""
    kinds = dict.fromkeys(kind for side in sides for kind in side)
    return {kind: np.concatenate([side[kind] for side in sides if kind in side]) for kind in kinds}


def _same_matrices(
    model: FiniteElementModel, mesh: Mesh, at: IntArray, sides: Sequence[Elements], where: Place
) -> None:
    """InputError where the stiffness at the nodes of a section is not that of their elements."""
    if not model.materials:
        remedy = "give the mesh with its material"
        raise InputError(Fault(where, "cannot be cut: the model has no material", remedy=remedy))
    if model.speed:
        return  # with the stiffening of rotation, which the coupling to the shortening leaves out
    free = np.flatnonzero(np.isin(model.dof_nodes, mesh.labels[at]) & (model.dof_components < 3))
    if not len(free):
        return
    beside = assemble(part_of(mesh, _all_of(sides)), model.materials)
    theirs = beside.stiffness.diagonal()[model.free[free]]
    ours = model.K.diagonal()[free]
    if float(np.abs(ours / theirs - 1.0).min()) > _OWN:
        what = "cannot be cut: the stiffness at its nodes is not that of the elements as assembled here"
        remedy = "where matrices come from another code, cut and tighten there"
        raise InputError(Fault(where, what, remedy=remedy))


def _doubled(mesh: Mesh, section: Surface, doubled: IntArray, other: Elements, node: int, centre: Array) -> Mesh:
    """The mesh with new nodes for the elements beyond the section, and for faces of these."""
    at, new, blocks = section.nodes, np.arange(mesh.n_nodes), dict(mesh.blocks)
    new[at] = mesh.n_nodes + np.arange(len(at))
    beyond = set[tuple[int, ...]]()
    for kind, chosen in other.items():
        blocks[kind] = blocks[kind].copy()
        beyond.update(_keys(kind, blocks[kind][chosen]))
        blocks[kind][chosen] = new[blocks[kind][chosen]]
    for shape, part in section.faces.items():
        beyond -= {*map(tuple, np.sort(part[:, : FACES[shape].n_corners], axis=1).tolist())}
    marked = np.zeros(mesh.n_nodes, dtype=bool)
    marked[at] = True
    surfaces = {}
    for name, surface in mesh.surfaces.items():
        faces = dict(surface.faces)
        for shape, part in faces.items():
            corners = FACES[shape].n_corners
            near = np.flatnonzero(marked[part].any(axis=1))
            rows = [row for row in near if tuple(sorted(part[row, :corners].tolist())) in beyond]
            faces[shape] = part.copy()
            faces[shape][rows] = new[part[rows]]
        surfaces[name] = replace(surface, faces=faces)
    lone = node not in mesh.labels
    T = mesh.temperature
    return replace(
        mesh,
        temperature=None if T is None else np.concatenate([T, T[at], T[at[: int(lone)]]]),
        nodes=np.concatenate([mesh.nodes, mesh.nodes[at], centre[None][: int(lone)]]),
        blocks=blocks,
        surfaces=surfaces,
        node_labels=np.concatenate([mesh.labels, doubled, [node] * lone]).astype(np.int64),
    )


def _between(cut: FiniteElementModel, found: Sequence[CutSection], model: FiniteElementModel) -> Iterator[Fault]:
    """Sections on one bolt, between which a piece is left that nothing else holds."""
    if len(found) < 2:
        return
    mesh = cut.in_mesh("cuts of bolts")
    blocks = [block for block in mesh.blocks.values() if len(block)]
    i = np.concatenate([np.repeat(block[:, 0], block.shape[1]) for block in blocks])
    j = np.concatenate([block.ravel() for block in blocks])
    _, part = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(mesh.n_nodes,) * 2), directed=False)
    place = {int(label): k for k, label in enumerate(mesh.labels.tolist())}
    pairs = [name for pair in model.contact_pairs.values() for name in (pair.dependent, pair.independent)]
    touching = [mesh.labels[mesh.all_sets[name]] for name in pairs if name in mesh.all_sets]
    otherwise = np.concatenate([model.dependent[:, 0], model.constrained[:, 0], *touching])
    others = {int(part[place[int(label)]]) for label in otherwise if int(label) in place}
    for one, other in combinations(found, 2):
        along = other.centre - one.centre
        off = np.linalg.norm(along - (along @ one.normal) * one.normal)
        if off > _COAXIAL * np.linalg.norm(along):
            continue
        ends = [{int(part[place[int(label)]]) for label in (s.nodes[0], s.doubled[0])} for s in (one, other)]
        if (ends[0] & ends[1]) - others:
            what = f"cuts the same bolt as the section {one.name}: nothing holds the piece between them"
            where = model.pretension_sections[other.name].place(model.source, other.name)
            yield Fault(where, f"{what}, the bolt is cut twice", remedy="keep one section across it")
