"""The mesh of an input file (.inp), with its materials and supports, from what was read in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface, node_indices
from slipstick.importers.abaqus.input_file import Content, Section, named, read_content
from slipstick.importers.findings import Verdict
from slipstick.importers.mesh_checks import likely_units, unit_notes
from slipstick.importers.mesh_model import MeshModel, matching_surface, with_surfaces
from slipstick.typing import IntArray

_ELASTIC = {"young", "poisson"}


def read_input(path: Path) -> MeshModel:
    """Mesh of an input file.

    Raises
    ------
    InputError
        For damaged lines (with their number), includes, several parts or instances, sets that are not there, no solid
        element. What couples or holds otherwise is in the model's ``couplings``.
    """
    content = read_content(path)
    if not content.nodes or not content.elements:
        left = f"; it has {_counts(content.skipped)}" if content.skipped else ""
        raise InputError(
            f"{path.name}: has no solid element (C3D4, C3D6, C3D8, C3D10, C3D15, C3D20){left}; "
            "give the file with the mesh"
        )
    rotated = _check_rotated(content)
    mesh = _mesh(content)
    materials, faults = _materials(content)
    findings = content.findings
    skipped = f"{path.name}: {_counts(content.skipped)} are no solids and were left out"
    return MeshModel(
        mesh=mesh,
        materials=materials,
        held=np.array(sorted(content.held), dtype=np.int64).reshape(-1, 2),
        units=likely_units(materials),
        notes=(*([skipped] if content.skipped else []), *findings.notes, *unit_notes(mesh, materials)),
        warnings=findings.warnings,
        couplings=findings.couplings,
        material_faults=faults,
        variants=content.variants,
        rotated=np.array(sorted(rotated), dtype=np.int64),
    )


def _counts(skipped: dict[str, list[int]]) -> str:
    """
    >>> _counts({"S3": [7, 8], "MASS": [9]})
    '2 elements of type S3, 1 of type MASS'
    """
    parts = [f"{len(labels)} of type {kind}" for kind, labels in skipped.items()]
    return ", ".join(parts).replace(" of", " elements of", 1)


def _check_rotated(content: Content) -> set[int]:
    """Rotated nodes. A support along rotated directions is none that we apply; free rotated nodes do not matter."""
    along: dict[int, int] = {}
    for node, _ in content.held:
        along[node] = along.get(node, 0) + 1
    every: set[int] = set()
    for line, name in content.rotated:
        nodes = set(content.node_sets[name])
        every |= nodes
        turned = [node for node in nodes if along.get(node, 3) < 3]
        verdict = Verdict.COUPLING if turned else Verdict.HARMLESS
        what = f"rotates the directions in which node {min(turned)} is held" if turned else ""
        content.findings.add(verdict, "*TRANSFORM", what, line)
    return every


def _mesh(content: Content) -> Mesh:
    name = content.path.name
    labels = np.array(list(content.nodes), dtype=np.int64)
    numbers = {kind: np.array(list(table), dtype=np.int64) for kind, table in content.elements.items()}
    blocks = {
        kind: node_indices(labels, np.array(list(table.values()), dtype=np.int64), f"{name}: an element")
        for kind, table in content.elements.items()
    }
    mesh = Mesh(
        nodes=np.array(list(content.nodes.values()), dtype=float),
        blocks=blocks,
        node_sets={
            s: node_indices(labels, np.unique(np.array(n, dtype=np.int64)), f"{name}: node set {s}")
            for s, n in content.node_sets.items()
        },
        element_sets={s: _positions(numbers, members) for s, members in content.element_sets.items()},
        node_labels=labels,
        element_labels=numbers,
    )
    surfaces = {s: _faces(mesh, content, parts) for s, parts in content.surfaces.items()}
    mesh = replace(mesh, surfaces={s: surface for s, surface in surfaces.items() if surface.n_faces})
    for s in surfaces.keys() - mesh.surfaces.keys():
        what = f"{s} lies on no solid element and is left out"
        content.findings.add(Verdict.APPROXIMATED, "*SURFACE", what, content.surfaces[s][0][0])
    return with_surfaces(mesh, [s for s in mesh.node_sets if s not in mesh.surfaces])


def _positions(numbers: dict[str, IntArray], members: list[int]) -> dict[str, IntArray]:
    return {kind: np.flatnonzero(np.isin(part, members)) for kind, part in numbers.items()}


def _faces(mesh: Mesh, content: Content, parts: list[tuple[int, list[str]]]) -> Surface:
    """Faces "element or set, S<number>", or all outer ones of a set; elements that are no solids have none here."""
    faces: dict[str, list[IntArray]] = {}
    outer: list[IntArray] = []
    for line, row in parts:
        where = content.where(line)
        try:
            members = named(row[0], content.element_sets)
        except KeyError:
            raise InputError(f"{where}: *SURFACE names {row[0]}, which the file does not have") from None
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


def _face_number(word: str, kind: str, where: str) -> int:
    face = word.upper().removeprefix("S")
    count = len(ELEMENTS[kind].faces)
    if not face.isdigit() or not 1 <= int(face) <= count:
        raise InputError(f"{where}: *SURFACE: found face {word}; expected S1 to S{count} of {kind} elements")
    return int(face) - 1


def _materials(content: Content) -> tuple[dict[str, Material], tuple[str, ...]]:
    """Materials by element set, and what is wrong with those that sections use."""
    materials: dict[str, Material] = {}
    faults: list[str] = []
    for section in content.sections:
        if section.elements not in content.element_sets:
            raise InputError(
                f"{content.where(section.line)}: *SOLID SECTION names the element set {section.elements}, "
                "which the file does not have"
            )
        _check_section(content, section)
        known = content.materials.get(section.material, {})
        wrong = content.material_faults.get(section.material, [])
        if wrong or not set(known) >= _ELASTIC:
            where = f"{content.where(section.line)}: *SOLID SECTION"
            faults += wrong or [f"{where} names material {section.material}, which has no *ELASTIC"]
            continue
        try:
            materials[section.elements] = Material(**known)
        except InputError as error:
            faults += [str(fault.inside(content.path.name, section.material)) for fault in error.faults]
    return materials, tuple(dict.fromkeys(faults))


def _check_section(content: Content, section: Section) -> None:
    """Trusses and plane elements have a solid section too: stiffness that is not read."""
    members = set(content.element_sets[section.elements])
    stiff = {kind: [n for n in labels if n in members] for kind, labels in content.skipped.items()}
    stiff = {kind: labels for kind, labels in stiff.items() if labels}
    if stiff:
        what = f"gives stiffness and mass to {_counts(stiff)}, which are not read"
        content.findings.add(Verdict.COUPLING, "*SOLID SECTION", what, section.line)
