"""*TIE and *CYCLIC SYMMETRY MODEL: surfaces glued together, and the two sides of a sector."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.axis import Axis
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.equations import NodalEquation
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.ties import Projection, Sector, cyclic_equations, face_size, project, sides, tie_equations
from slipstick.importers.abaqus.blocks import Block
from slipstick.importers.abaqus.content import Content, Glue, nodes_of, surface_of
from slipstick.importers.findings import Verdict
from slipstick.importers.mesh_model import Stated
from slipstick.importers.text_numbers import fortran_real, whole_number
from slipstick.typing import Array, IntArray

_DEFAULT = 0.05
"""Largest distance of tied nodes where a file says none, over the mean edge of the faces; as Abaqus."""

_SIDES = 0.05
"""The same for the two sides of a sector."""

_TOLD, _MEET = 1e-2, 1e-3
"""Distance over the mean edge of the faces from which tied surfaces, and sides of a sector, are told to lie apart."""


def on_tie(content: Content, block: Block) -> None:
    """A dependent and an independent surface on each line."""
    parameters = block.parameters
    if "MULTISTAGE" in parameters:
        content.note(Verdict.COUPLING, block, "joins stages with different numbers of sectors")
        return
    tolerance = fortran_real(parameters["POSITIONTOLERANCE"]) if parameters.get("POSITIONTOLERANCE") else None
    for line, row in zip(block.lines, block.rows, strict=True):
        if len(row) < 2 or not row[1]:
            raise ValueError("expected two surfaces on a line")
        glue = Glue(
            name=parameters.get("NAME", ""),
            dependent=row[0].strip('"').upper(),
            independent=row[1].strip('"').upper(),
            adjust=parameters.get("ADJUST", "YES") != "NO" and "CYCLICSYMMETRY" not in parameters,
            tolerance=tolerance,
            cyclic="CYCLICSYMMETRY" in parameters,
            where=content.where(line, block.shown),
            line=line,
        )
        content.glues.append(glue)
        if not glue.cyclic:
            content.stated.append(Stated(where=glue.where, equations=partial(_tied, content, glue), nodewise=False))


def moved_onto(content: Content, mesh: Mesh) -> Mesh:
    """The mesh with nodes moved onto the surfaces to which they are tied, where the file asks for it."""
    for glue in content.glues:
        if not glue.adjust:
            continue
        nodes, projection = _near(content, glue, mesh)
        size = face_size(mesh, surface_of(mesh, glue.independent, glue.where))
        moved = projection.distances > 1e-12 * size
        if moved.any():
            places = mesh.nodes.copy()
            places[nodes[moved]] = projection.places[moved]
            mesh = replace(mesh, nodes=places)
            most = _length(projection.distances, size)
            by = f"moves {moved.sum()} nodes onto the other surface, by {most} at most (ADJUST)"
            if projection.distances.max() > _DEFAULT * size:
                content.doubts.append(f"{glue.where} {by}: the elements there change their shape")
            else:
                content.findings.extra.append(f"{glue.where} {by}")
    return mesh


def _length(distances: Array, size: float) -> str:
    return f"{distances.max():.3g}, {distances.max() / size:.2g} of an edge"


def _near(content: Content, glue: Glue, mesh: Mesh) -> tuple[IntArray, Projection]:
    """Dependent nodes that are near enough to be tied, and where they lie on the other surface."""
    onto = surface_of(mesh, glue.independent, glue.where)
    nodes = np.setdiff1d(nodes_of(content, mesh, glue.dependent, glue.where), onto.nodes)
    projection = project(mesh, onto, mesh.nodes[nodes])
    near = projection.distances <= (glue.tolerance or _DEFAULT * face_size(mesh, onto))
    chosen = {name: getattr(projection, name)[near] for name in ("nodes", "weights", "places", "distances")}
    return nodes[near], Projection(**chosen)


def _tied(content: Content, glue: Glue, mesh: Mesh) -> Iterator[NodalEquation]:
    nodes, projection = _near(content, glue, mesh)
    if not len(nodes):
        raise InputError(
            Fault(
                glue.where,
                f"no node of {glue.dependent} lies near enough to {glue.independent}",
                remedy="check the surfaces and POSITION TOLERANCE",
            )
        )
    yield from tie_equations(mesh, nodes, projection, glue.where)


def glue_warnings(content: Content, mesh: Mesh) -> Iterator[str]:
    """A sentence for each tie and sector whose surfaces do not meet, or that leaves nodes out."""
    for glue in content.glues:
        if not glue.cyclic:
            yield from _untied(content, glue, mesh)
    for glue, sector, where in content.sectors:
        yield from _unlike(content, glue, sector, where, mesh)


def _untied(content: Content, glue: Glue, mesh: Mesh) -> Iterator[str]:
    onto = surface_of(mesh, glue.independent, glue.where)
    every = np.setdiff1d(nodes_of(content, mesh, glue.dependent, glue.where), onto.nodes)
    nodes, projection = _near(content, glue, mesh)
    far = np.setdiff1d(every, nodes)
    if len(far):
        yield (
            f"{glue.where}: {len(far)} of {len(every)} nodes ({mesh.labels[far[0]]}, ...) are too far from "
            f"{glue.independent} and are not tied"
        )
    size = face_size(mesh, onto)
    if projection.distances.max(initial=0.0) > _TOLD * size:
        yield (
            f"{glue.where} ties nodes that lie up to {_length(projection.distances, size)}, from {glue.independent}: "
            "turning as a whole strains the joint"
        )


def _unlike(content: Content, glue: Glue, sector: Sector, where: Place, mesh: Mesh) -> Iterator[str]:
    """Sides of a sector that lie apart, whose nodes do not meet, or of which one is larger."""
    dependent, onto, size = _two_sides(content, glue, where, mesh)
    projection, rotation = sides(mesh, sector, dependent, onto)
    if projection.distances.max(initial=0.0) > _MEET * size:
        yield f"{where}: the sides lie up to {_length(projection.distances, size)}, apart when turned onto each other"
    between = int((np.abs(projection.weights).max(axis=1) < 1.0 - _MEET).sum())
    if between:
        yield (
            f"{where}: {between} of {len(dependent)} nodes of {glue.dependent} lie between nodes of "
            f"{glue.independent}: sides that do not match are joined by shape functions, CalculiX joins them otherwise "
            "and stiffer"
        )
    other = nodes_of(content, mesh, glue.independent, where)
    turned = (mesh.nodes[other] - sector.start) @ rotation.T + sector.start
    faces = mesh.surfaces[glue.dependent].faces if glue.dependent in mesh.surfaces else {}
    whole = {kind: part[np.isin(part, dependent).all(axis=1)] for kind, part in faces.items()}
    back = Surface(faces={kind: part for kind, part in whole.items() if len(part)})
    apart = project(mesh, back, turned).distances if back.faces else _spread(mesh.nodes[dependent], turned)
    alone = apart > _SIDES * size
    if alone.any():
        yield (
            f"{where}: {alone.sum()} of {len(other)} nodes of {glue.independent} ({mesh.labels[other[alone][0]]}, ...) "
            f"meet nothing of {glue.dependent}: they are joined to nothing; give both sides whole"
        )


def _spread(places: Array, points: Array) -> Array:
    """Distance of points to the nearest place."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(places).query(points)[0])


def on_cyclic(content: Content, block: Block) -> None:
    """Number of sectors, and two points of the axis."""
    parameters = block.parameters
    count = fortran_real(parameters["N"])  # some programs write 36.0
    sectors = int(count) if count == int(count) else 0
    axis = [fortran_real(word) for row in block.rows for word in row if word]
    cyclic = [glue for glue in content.glues if glue.cyclic]
    joined = [glue for glue in cyclic if glue.name == parameters.get("TIE", glue.name)]
    if len(axis) < 6 or sectors < 2 or len({glue.name for glue in joined}) != 1:
        raise ValueError("expected N from 2 up, six numbers of an axis, and one *TIE with CYCLIC SYMMETRY, or its name")
    sector = Sector(start=np.array(axis[:3]), end=np.array(axis[3:6]), count=sectors)
    for glue in joined:
        where = content.where(block.line, block.shown)
        content.sectors.append((glue, sector, where))
        content.stated.append(
            Stated(where=where, equations=partial(_sides, content, glue, sector, where), nodewise=False, cyclic=True)
        )


def symmetry_of(content: Content, mesh: Mesh) -> CyclicSymmetry | None:
    """The ring that a file is a sector of, its sectors numbered in the turning sense of the axis; None of none."""
    if not content.sectors:
        return None
    count, low, high = content.sectors[0][1].count, [], []
    for glue, sector, where in content.sectors:
        dependent, onto, _ = _two_sides(content, glue, where, mesh)
        other = nodes_of(content, mesh, glue.independent, where)
        _, rotation = sides(mesh, sector, dependent, onto)
        forward = np.allclose(rotation, sector.rotation(1.0))
        high.append(dependent if forward else other)
        low.append(other if forward else dependent)
    first = content.sectors[0][1]
    return CyclicSymmetry(
        sectors=count, axis=Axis(point=first.start, direction=first.end - first.start),
        low=np.unique(mesh.labels[np.concatenate(low)]), high=np.unique(mesh.labels[np.concatenate(high)]),
    )  # fmt: skip


def _two_sides(content: Content, glue: Glue, where: Place, mesh: Mesh) -> tuple[IntArray, Surface | IntArray, float]:
    """Nodes of one side, the other side (faces where it has some), and the length of its edges."""
    dependent = nodes_of(content, mesh, glue.dependent, where)
    faces = mesh.surfaces.get(glue.independent)
    other = nodes_of(content, mesh, glue.independent, where)
    return dependent, faces or other, face_size(mesh, faces) if faces else _spacing(mesh.nodes[other])


def _sides(content: Content, glue: Glue, sector: Sector, where: Place, mesh: Mesh) -> Iterator[NodalEquation]:
    dependent, onto, size = _two_sides(content, glue, where, mesh)
    tolerance = min(_SIDES * size, glue.tolerance or np.inf)
    yield from cyclic_equations(mesh, sector, dependent, onto, tolerance=tolerance, where=where)


def _spacing(places: Array) -> float:
    """Median distance of points to their next one."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(places).query(places, k=2)[0][:, 1])) if len(places) > 1 else 0.0


def on_diameters(content: Content, block: Block) -> None:
    """Nodal diameters that are asked for."""
    low, high = (whole_number(block.parameters.get(name, "0")) for name in ("NMIN", "NMAX"))
    if not 0 <= low <= high <= 100_000:
        raise ValueError(f"nodal diameters {low} to {high}")
    content.diameters |= set(range(low, high + 1))


def about_diameters(content: Content) -> None:
    """As a body a sector has the family of 0 nodal diameters alone, which is real: a request for others is told."""
    lines = [glue for glue in content.glues if glue.cyclic]
    if not lines:
        return
    others = sorted(content.diameters - {0})
    if others or not content.diameters:
        asked = f"asks for {others[0]} to {others[-1]} nodal diameters and " if others else ""
        what = f"{asked}is as a body computed for 0 alone, all sectors alike; ss.reduced_sector computes all of them"
        content.findings.add(Verdict.APPROXIMATED, "*CYCLIC SYMMETRY MODEL", what, lines[0].line)
