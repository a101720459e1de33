"""The mesh of an input file (.inp), with its materials and supports, from what was read in it."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.equations import supports
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface, node_indices
from slipstick.importers.abaqus.content import Content, named
from slipstick.importers.abaqus.couplings import frames
from slipstick.importers.abaqus.input_file import read_content
from slipstick.importers.abaqus.interfaces import pairs_of, sections_there
from slipstick.importers.abaqus.loads import steps_of
from slipstick.importers.abaqus.ties import moved_onto, symmetry_of, tie_warnings
from slipstick.importers.deck import Deck, Stated, matching_surface, with_surfaces
from slipstick.importers.findings import Verdict, refused
from slipstick.importers.grouped import with_named_places
from slipstick.importers.interfaces import kept_note
from slipstick.importers.mesh_checks import unit_notes
from slipstick.typing import IntArray

_ELASTIC = {"young", "poisson"}
_FLAT = re.compile(r"(S|STRI|M3D|SFM3D|CP[SE]G?|CAX|R3D|DS|C2D|DC2D)\d+[A-Z0-9]*")
_LINES = re.compile(r"(T[23]D|B[23]|R2D|RB[23]D|DC1D)\d+[A-Z]*")
_CORNERS = {3: 3, 6: 3, 4: 4, 8: 4, 9: 4}
"""Corners of a face by the number of its nodes."""

_PLANE = re.compile(r"(CP[SE]G?|CAX|T[23]D)\d+[A-Z]*")
"""Elements as which Gmsh writes faces and lines: without a section, and beside solids, they can be nothing else."""

_WITHOUT_STIFFNESS = ("SFM3D", "DCOUP", "R3D", "DASHPOT")
"""Surface elements, couplings that *DISTRIBUTING COUPLING reads, rigid surfaces, dampers (warned of)."""


def read_input(path: Path) -> Deck:
    """Mesh of an input file.

    Raises
    ------
    InputError
        For damaged lines (with their number), includes, several parts or instances, sets that are not there, no solid
        element. What couples or holds otherwise is in the deck's ``couplings``.
    """
    deck = read_content(path)
    if not deck.nodes or not deck.elements:
        left = f"; it has {_counts(deck.skipped)}" if deck.skipped else ""
        what = f"has no solid element (C3D4, C3D6, C3D8, C3D10, C3D15, C3D20){left}"
        raise refused(path.name, what, remedy="give the file with the mesh")
    mesh = moved_onto(deck, _mesh(deck))
    materials, faults = _materials(deck)
    deck.mesh, notes = _named_places(deck, mesh)
    deck.materials, deck.material_faults, deck.axes = materials, [*faults], frames(deck)
    deck.extra = [*touching(deck), *notes, *deck.extra, *_mass_note(deck.mesh, path), *unit_notes(deck.mesh, materials)]
    meant = {(node, axis) for node, axis in deck.held if axis < 3 or node in deck.turning}
    deck.held, along = supports(meant, deck.axes, Place(path.name, "*BOUNDARY of nodes with *TRANSFORM"))
    if along:
        deck.stated.append(Stated(where=Place(path.name, "*TRANSFORM"), equations=lambda _: along))
    deck.own_warnings += tie_warnings(deck, deck.mesh)
    deck.contact_pairs = pairs_of(deck, deck.mesh)
    sections_there(deck, deck.mesh)
    deck.load_steps = steps_of(deck)
    deck.extra += kept_note(deck)
    deck.symmetry = partial(symmetry_of, deck)
    return deck


def _mass_note(mesh: Mesh, path: Path) -> tuple[str, ...]:
    """Elements whose mass CalculiX integrates with fewer points."""
    names = {"tet10": "C3D10", "wedge15": "C3D15", "hex20r": "C3D20R"}
    types = [name for kind, name in names.items() if len(mesh.blocks.get(kind, ()))]
    what = "is integrated exactly; CalculiX takes the points of the stiffness, and its frequencies differ a little"
    return (f"{path.name}: the mass of {', '.join(types)} {what}",) if types else ()


def _named_places(content: Content, mesh: Mesh) -> tuple[Mesh, list[str]]:
    """The mesh with the sets of faces and lines beside its solids as surfaces and node sets, which is how Gmsh and
    others write the names of places.
    """
    shapes: dict[int, tuple[int, list[int]]] = {}
    for kind, table in content.skipped.items():
        flat = _FLAT.fullmatch(kind)
        if flat or _LINES.fullmatch(kind):
            for label, nodes in table.items():
                known = [node for node in nodes if node in content.nodes]
                shapes[label] = (_CORNERS.get(len(nodes), 0) if flat else 0, known)
    faces: dict[str, list[IntArray]] = {}
    places: dict[str, list[IntArray]] = {}
    where = f"{content.path.name}: an element"
    for name, members in content.element_sets.items():
        shaped = [shapes[label] for label in dict.fromkeys(members) if label in shapes]
        for count in (3, 4):
            rows = [known[:count] for corners, known in shaped if corners == count and len(known) >= count]
            if rows:
                faces.setdefault(name, []).append(node_indices(mesh.labels, np.array(rows, dtype=np.int64), where))
        held = [node for _, known in shaped for node in known]
        if held:
            places[name] = [node_indices(mesh.labels, np.array(held, dtype=np.int64), where)]
    before = {*mesh.surfaces, *mesh.node_sets}
    mesh, notes = with_named_places(content.path.name, mesh, faces, places)
    added = sorted({*mesh.surfaces, *mesh.node_sets} - before)
    if added:
        notes.append(f"{content.path.name}: element sets of faces and lines, read as places: {', '.join(added)}")
    return mesh, notes


def touching(content: Content) -> tuple[str, ...]:
    """Elements that are no solids: refused where their section gives them stiffness and they share nodes with solids.

    Notes name the others.
    """
    solid = content.solid_nodes
    for section in (*content.sections, *content.other_sections):
        members = set(content.element_sets.get(section.elements, ()))
        near = {
            kind: [e for e, nodes in table.items() if e in members and not solid.isdisjoint(nodes)]
            for kind, table in content.skipped.items()
            if not kind.startswith(_WITHOUT_STIFFNESS)
        }
        near = {kind: labels for kind, labels in near.items() if labels}
        if near:
            what = f"gives stiffness and mass to {_counts(near)}, which share nodes with solids and are not read"
            content.add(Verdict.COUPLING, section.shown, what, section.line)
    named = {e for section in content.other_sections for e in content.element_sets.get(section.elements, ())}
    bare = {
        kind: [e for e, nodes in table.items() if e not in content.read | named and not solid.isdisjoint(nodes)]
        for kind, table in content.skipped.items()
        if not (kind.startswith(_WITHOUT_STIFFNESS) or _PLANE.fullmatch(kind))
    }
    bare = {kind: labels for kind, labels in bare.items() if labels}
    if bare:
        content.own_warnings.append(
            f"{content.path.name}: {_counts(bare)} share nodes with solids, and no section that is read says what they "
            "are: left out"
        )
    left = {kind: [e for e in table if e not in content.read] for kind, table in content.skipped.items()}
    left = {kind: labels for kind, labels in left.items() if labels}
    return (f"{content.path.name}: {_counts(left)} are no solids and were left out",) if left else ()


def _counts(skipped: Mapping[str, Collection[int]]) -> str:
    """
    >>> _counts({"S3": [7, 8], "MASS": [9]})
    '2 elements of type S3, 1 of type MASS'
    """
    parts = [f"{len(labels)} of type {kind}" for kind, labels in skipped.items()]
    return ", ".join(parts).replace(" of", " elements of", 1)


def _mesh(content: Content) -> Mesh:
    content.node_sets = {s: _known(content, s, n).tolist() for s, n in content.node_sets.items()}
    mesh = content.build()
    surfaces = {s: _faces(mesh, content, parts) for s, parts in content.surfaces.items()}
    mesh = replace(mesh, surfaces={s: surface for s, surface in surfaces.items() if surface.n_faces})
    for s in surfaces.keys() - mesh.surfaces.keys():
        what = "lies on no solid element and is left out"
        content.add(Verdict.APPROXIMATED, f"*SURFACE {s}", what, content.surfaces[s][0][0])
    return with_surfaces(mesh, [s for s in mesh.node_sets if s not in mesh.surfaces])


def _known(content: Content, name: str, members: list[int]) -> IntArray:
    """Labels of a set for which the file has nodes; a note names the others."""
    labels = np.unique(np.array(members, dtype=np.int64))
    there = np.isin(labels, list(content.nodes))
    if not there.all():
        missing = labels[~there]
        content.extra.append(
            f"{content.path.name}: node set {name} names {len(missing)} nodes that are not in the file "
            f"({missing[0]}, ...)"
        )
    return labels[there]


def _positions(numbers: dict[str, IntArray], members: list[int]) -> dict[str, IntArray]:
    return {kind: np.flatnonzero(np.isin(part, members)) for kind, part in numbers.items()}


def _faces(mesh: Mesh, content: Content, parts: list[tuple[int, list[str]]]) -> Surface:
    """Faces "element or set, S<number>", or all outer ones of a set; elements that are no solids have none here."""
    faces: dict[str, list[IntArray]] = {}
    outer: list[IntArray] = []
    for line, row in parts:
        where = content.place(line)
        try:
            members = named(row[0], content.element_sets)
        except (KeyError, ValueError):
            raise refused(where.at("*SURFACE"), f"names {row[0]}, which the file does not have") from None
        for kind, chosen in _positions(dict(mesh.element_labels or {}), members).items():
            if len(chosen) and len(row) > 1 and row[1]:
                shape, local = ELEMENTS[kind].faces[_face_number(row[1], kind, where)]
                faces.setdefault(shape, []).append(mesh.blocks[kind][chosen][:, list(local)])
            elif len(chosen):
                corners = [local[: FACES[shape].n_corners] for shape, local in ELEMENTS[kind].faces]
                outer += [mesh.blocks[kind][chosen][:, list(local)] for local in corners]
    if outer:
        for shape, part in matching_surface(mesh, outer).faces.items():
            faces.setdefault(shape, []).append(part)
    return Surface(faces={shape: np.concatenate(part) for shape, part in faces.items()})


def _face_number(word: str, kind: str, where: Place) -> int:
    face = word.upper().removeprefix("S")
    count = len(ELEMENTS[kind].faces)
    if not face.isdecimal() or not 1 <= int(face) <= count:
        raise refused(where.at("*SURFACE"), found=f"face {word}", expected=f"S1 to S{count} of {kind} elements")
    return int(face) - 1


def _materials(content: Content) -> tuple[dict[str, Material], tuple[Fault, ...]]:
    """Materials by element set, and what is wrong with those that sections use."""
    materials: dict[str, Material] = {}
    faults: list[Fault] = []
    for section in content.sections:
        if section.elements not in content.element_sets:
            raise refused(
                content.place(section.line, "*SOLID SECTION"),
                f"names the element set {section.elements}, which the file does not have",
            )
        known = content.properties.get(section.material, {})
        wrong = content.law_faults.get(section.material, [])
        if wrong or not set(known) >= _ELASTIC:
            where = content.place(section.line, "*SOLID SECTION")
            faults += wrong or [Fault(where, f"names material {section.material}, which has no *ELASTIC")]
            continue
        try:
            materials[section.elements] = Material(**known)
        except InputError as error:
            faults += [fault.inside(content.path.name, section.material) for fault in error.faults]
    return materials, tuple(dict.fromkeys(faults))
