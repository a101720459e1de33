"""What is said of surfaces that touch and of sections of bolts, and the faces that make them, alike for all codes."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import combinations

import numpy as np

from slipstick.errors import Fault, Place
from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.load_steps import INITIAL
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.ties import face_size
from slipstick.fem.unit_systems import other_units
from slipstick.importers.deck import Deck, matching_surface
from slipstick.typing import IntArray

APART = (
    "is kept as model.contact_pairs: nothing joins its surfaces until contacts are put there ([[joint]] of a case, "
    "ss.surface_pair)"
)


def corners_of(mesh: Mesh, chosen: dict[str, IntArray]) -> list[IntArray]:
    """Corners of all faces of some elements (positions by kind), one array a face of the element."""
    return [
        mesh.blocks[kind][at][:, list(local[: FACES[shape].n_corners])]
        for kind, at in chosen.items()
        if len(at)
        for shape, local in ELEMENTS[kind].faces
    ]


def outer_faces(mesh: Mesh, chosen: dict[str, IntArray]) -> Surface:
    """Faces of some elements (positions by kind) that lie on the boundary."""
    corners = corners_of(mesh, chosen)
    return matching_surface(mesh, corners) if corners else Surface(faces={})


def section_faces(mesh: Mesh, nodes: Collection[int], beside: Collection[int]) -> Surface:
    """Faces all of whose nodes are among some (indices), of elements that have no label among those ``beside``."""
    marked = np.zeros(mesh.n_nodes, dtype=bool)
    marked[np.fromiter(nodes, dtype=np.int64, count=len(nodes))] = True
    faces: dict[str, list[IntArray]] = {}
    for kind, block in mesh.blocks.items():
        labels = (mesh.element_labels or {}).get(kind, np.arange(1, len(block) + 1))
        own = block[~np.isin(labels, list(beside))]
        for shape, local in ELEMENTS[kind].faces:
            part = own[:, list(local)]
            part = part[marked[part].all(axis=1)]
            if len(part):
                faces.setdefault(shape, []).append(part)
    return Surface(faces={shape: np.concatenate(parts) for shape, parts in faces.items()})


def element_positions(mesh: Mesh, labels: Collection[int]) -> dict[str, IntArray]:
    """Positions in their blocks of the elements of some labels."""
    wanted = list(labels)
    return {kind: np.flatnonzero(np.isin(part, wanted)) for kind, part in (mesh.element_labels or {}).items()}


def kept_note(deck: Deck) -> Iterator[str]:
    """A sentence on the loads that are kept."""
    if deck.load_steps:
        steps = ", ".join(f"{name} ({len(step.loads)})" for name, step in deck.load_steps.items())
        yield f"{deck.source}: loads are kept as model.load_steps and have no effect here: {steps}"
        for kind, name in (("temperature", "hot"), ("displacement", "jaw")):
            steps_with = (
                at
                for at, step in deck.load_steps.items()
                if at != INITIAL and any(load.kind == kind for load in step.loads)
            )
            if (first := next(steps_with, None)) is not None:
                given = f'{kind}={{"{name}": "{first}"}}'
                yield f"{deck.source}: ss.reduced_body takes the {kind} of a step by its name, {given}"


_RATHER_PERCENT = 3.0
"""Coefficients of friction above it are no such."""
_APART = 3.0
"""Surfaces that are meant to touch and lie more faces apart than this are suspicious."""


def pair_warnings(deck: Deck, mesh: Mesh) -> Iterator[str]:
    """What is suspicious of the pairs of a deck: friction, surfaces that touch themselves, twice, or lie far apart."""
    for name, pair in deck.contact_pairs.items():
        where = Place(deck.source, f"contact pair {name}")
        if pair.mu is not None and pair.mu > _RATHER_PERCENT:
            yield str(Fault(where, f"has a coefficient of friction of {pair.mu:g}: is it in percent?"))
        if pair.dependent == pair.independent:
            yield str(Fault(where, "is in contact with itself, which no joint can be: name its two sides"))
            continue
        back = f"{pair.independent}/{pair.dependent}"
        if list(deck.contact_pairs).index(name) > [*deck.contact_pairs, back].index(back):
            yield str(Fault(where, f"is {back} with its sides exchanged: put contacts on one of the two"))
            continue
        yield from _far_apart(mesh, pair.dependent, pair.independent, where)


def _far_apart(mesh: Mesh, first: str, second: str, where: Place) -> Iterator[str]:
    from scipy.spatial import cKDTree

    known = [
        mesh.surfaces[name].nodes if name in mesh.surfaces else mesh.node_sets.get(name) for name in (first, second)
    ]
    faces = [face_size(mesh, mesh.surfaces[name]) for name in (first, second) if name in mesh.surfaces]
    nodes = [part for part in known if part is not None and len(part)]
    if not faces or len(nodes) < 2:
        return
    one, other = (mesh.nodes[part] for part in nodes)
    apart, near = cKDTree(other).query(one)
    at = int(apart.argmin())
    if apart[at] > _APART * max(faces):
        labels = f"nodes {mesh.labels[nodes[0][at]]} and {mesh.labels[nodes[1][near[at]]]}"
        what = f"has surfaces that lie {apart[at]:.3g} apart at least ({labels})"
        like = other_units(*(float(np.ptp(part, axis=0).max()) for part in (one, other)))
        yield str(Fault(where, what + (like or ": do they touch in the assembly?")))


def section_faults(deck: Deck, mesh: Mesh) -> Iterator[Fault]:
    """Sections of bolts whose node belongs to a solid: what holds or loads it is no support then."""
    solid = {*mesh.labels[mesh.used_nodes].tolist()}
    for name, section in deck.pretension_sections.items():
        if section.node in solid:
            what = f"has the node {section.node}, which belongs to a solid element"
            yield Fault(_section(deck, name), what, remedy="give the load of the bolt a node of its own")


def section_warnings(deck: Deck, mesh: Mesh) -> Iterator[str]:
    """Sections of bolts that share their node or faces."""
    sections = deck.pretension_sections
    for one, other in combinations(sections, 2):
        node = sections[other].node
        if node and sections[one].node == node:
            what = f"shares the node {node} with the section {one}: give each section a node of its own"
            yield str(Fault(_section(deck, other), what))
        shared = _keys(mesh, one) & _keys(mesh, other)
        if shared:
            what = f"shares {len(shared)} faces with the section {one}, as one at node {mesh.labels[min(min(shared))]}"
            yield str(Fault(_section(deck, other), f"{what}: the bolt is cut twice there, keep one section across it"))


def _section(deck: Deck, name: str) -> Place:
    return Place(deck.source, f"pretension section {name}")


def _keys(mesh: Mesh, name: str) -> set[tuple[int, ...]]:
    faces = mesh.surfaces[name].faces if name in mesh.surfaces else {}
    return {tuple(sorted(face)) for kind, part in faces.items() for face in part[:, : FACES[kind].n_corners].tolist()}
