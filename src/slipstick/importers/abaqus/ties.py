"""*TIE and *CYCLIC SYMMETRY MODEL: surfaces tied together, and the two sides of a sector."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from slipstick.errors import Place
from slipstick.fem.axis import Axis
from slipstick.fem.cyclic import CyclicSymmetry, cyclic_equations, rotation, sides, turned
from slipstick.fem.equations import NodalEquation
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.ties import Projection, face_size, nearest, project, tie_equations
from slipstick.importers.abaqus.content import Content, Tie, nodes_of, surface_of
from slipstick.importers.abaqus.keywords import KEYWORDS, Block
from slipstick.importers.deck import Stated
from slipstick.importers.findings import Verdict, refused
from slipstick.importers.text_numbers import fortran_real, whole_number
from slipstick.typing import Array, IntArray

_DEFAULT = 0.05
"""Largest distance of tied nodes where a file says none, over the mean edge of the faces; as Abaqus."""

_SIDES = 0.05
"""The same for the two sides of a sector."""

_WARNED, _MEET = 1e-2, 1e-3
"""Gap over the mean edge of the faces above which tied surfaces, and sides of a sector, are warned of."""


@KEYWORDS.reads("TIE", "ADJUST CYCLICSYMMETRY MULTISTAGE NAME NOROTATION POSITIONTOLERANCE TYPE", stage=2)
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
        tie = Tie(
            name=parameters.get("NAME", ""),
            dependent=row[0].strip('"').upper(),
            independent=row[1].strip('"').upper(),
            adjust=parameters.get("ADJUST", "YES") != "NO" and "CYCLICSYMMETRY" not in parameters,
            tolerance=tolerance,
            cyclic="CYCLICSYMMETRY" in parameters,
            where=content.place(line, block.shown),
            line=line,
        )
        content.ties.append(tie)
        if not tie.cyclic:
            content.stated.append(Stated(where=tie.where, equations=partial(_tied, content, tie), nodewise=False))


def moved_onto(content: Content, mesh: Mesh) -> Mesh:
    """The mesh with nodes moved onto the surfaces to which they are tied, where the file asks for it."""
    for tie in content.ties:
        if not tie.adjust:
            continue
        nodes, projection = _near(content, tie, mesh)
        size = face_size(mesh, surface_of(mesh, tie.independent, tie.where))
        moved = projection.distances > 1e-12 * size
        if moved.any():
            places = mesh.nodes.copy()
            places[nodes[moved]] = projection.places[moved]
            mesh = replace(mesh, nodes=places)
            most = _length(projection.distances, size)
            by = f"moves {moved.sum()} nodes onto the other surface, by {most} at most (ADJUST)"
            if projection.distances.max() > _DEFAULT * size:
                content.own_warnings.append(f"{tie.where} {by}: the elements there change their shape")
            else:
                content.extra.append(f"{tie.where} {by}")
    return mesh


def _length(distances: Array, size: float) -> str:
    return f"{distances.max():.3g}, {distances.max() / size:.2g} of an edge"


def _near(content: Content, tie: Tie, mesh: Mesh) -> tuple[IntArray, Projection]:
    """Dependent nodes that are near enough to be tied, and where they lie on the other surface."""
    onto = surface_of(mesh, tie.independent, tie.where)
    nodes = np.setdiff1d(nodes_of(content, mesh, tie.dependent, tie.where), onto.nodes)
    projection = project(mesh, onto, mesh.nodes[nodes])
    near = projection.distances <= (tie.tolerance or _DEFAULT * face_size(mesh, onto))
    chosen = {name: getattr(projection, name)[near] for name in ("nodes", "weights", "places", "distances")}
    return nodes[near], Projection(**chosen)


def _tied(content: Content, tie: Tie, mesh: Mesh) -> Iterator[NodalEquation]:
    nodes, projection = _near(content, tie, mesh)
    if not len(nodes):
        raise refused(
            tie.where,
            f"no node of {tie.dependent} lies near enough to {tie.independent}",
            remedy="check the surfaces and POSITION TOLERANCE",
        )
    yield from tie_equations(mesh, nodes, projection, tie.where)


def tie_warnings(content: Content, mesh: Mesh) -> Iterator[str]:
    """A sentence for each tie and sector whose surfaces do not meet, or that leaves nodes out."""
    for tie in content.ties:
        if not tie.cyclic:
            yield from _untied(content, tie, mesh)
    for tie, ring, where in content.sectors:
        yield from _unlike(content, tie, ring, where, mesh)


def _untied(content: Content, tie: Tie, mesh: Mesh) -> Iterator[str]:
    onto = surface_of(mesh, tie.independent, tie.where)
    every = np.setdiff1d(nodes_of(content, mesh, tie.dependent, tie.where), onto.nodes)
    nodes, projection = _near(content, tie, mesh)
    far = np.setdiff1d(every, nodes)
    if len(far):
        yield (
            f"{tie.where}: {len(far)} of {len(every)} nodes ({mesh.labels[far[0]]}, ...) are too far from "
            f"{tie.independent} and are not tied"
        )
    size = face_size(mesh, onto)
    if projection.distances.max(initial=0.0) > _WARNED * size:
        yield (
            f"{tie.where} ties nodes that lie up to {_length(projection.distances, size)}, from {tie.independent}: "
            "a rigid rotation strains the joint"
        )


def _unlike(content: Content, tie: Tie, ring: CyclicSymmetry, where: Place, mesh: Mesh) -> Iterator[str]:
    """Sides of a sector that lie apart, whose nodes do not meet, or of which one is larger."""
    dependent, onto, size = _two_sides(content, tie, where, mesh)
    projection, turn = sides(mesh, ring, dependent, onto)
    if projection.distances.max(initial=0.0) > _MEET * size:
        yield f"{where}: the sides lie up to {_length(projection.distances, size)}, apart when turned onto each other"
    between = int((np.abs(projection.weights).max(axis=1) < 1.0 - _MEET).sum())
    if between:
        yield (
            f"{where}: {between} of {len(dependent)} nodes of {tie.dependent} lie between nodes of "
            f"{tie.independent}: sides that do not match are joined by shape functions, where CalculiX joins them more "
            "stiffly"
        )
    other = nodes_of(content, mesh, tie.independent, where)
    places = turned(ring.axis, turn, mesh.nodes[other])
    faces = mesh.surfaces[tie.dependent].faces if tie.dependent in mesh.surfaces else {}
    whole = {kind: part[np.isin(part, dependent).all(axis=1)] for kind, part in faces.items()}
    back = Surface(faces={kind: part for kind, part in whole.items() if len(part)})
    distances = (project(mesh, back, places) if back.faces else nearest(mesh.nodes[dependent], places)).distances
    alone = distances > _SIDES * size
    if alone.any():
        yield (
            f"{where}: {alone.sum()} of {len(other)} nodes of {tie.independent} ({mesh.labels[other[alone][0]]}, ...) "
            f"meet nothing of {tie.dependent}: they are joined to nothing; give both sides whole"
        )


@KEYWORDS.reads("CYCLICSYMMETRYMODEL", "CHECK ELSET N NGRAPH TIE", stage=3)
def on_cyclic(content: Content, block: Block) -> None:
    """Number of sectors, and two points of the axis."""
    parameters = block.parameters
    count = fortran_real(parameters["N"])  # some programs write 36.0
    sectors = int(count) if count == int(count) else 0
    axis = [fortran_real(word) for row in block.rows for word in row if word]
    cyclic = [tie for tie in content.ties if tie.cyclic]
    joined = [tie for tie in cyclic if tie.name == parameters.get("TIE", tie.name)]
    if len(axis) < 6 or sectors < 2 or len({tie.name for tie in joined}) != 1:
        raise ValueError("expected N from 2 up, six numbers of an axis, and one *TIE with CYCLIC SYMMETRY, or its name")
    along = Axis(point=axis[:3], direction=np.array(axis[3:6]) - axis[:3])
    ring = CyclicSymmetry(sectors=sectors, axis=along, low=(), high=())
    for tie in joined:
        where = content.place(block.line, block.shown)
        content.sectors.append((tie, ring, where))
        content.stated.append(
            Stated(where=where, equations=partial(_sides, content, tie, ring, where), nodewise=False, cyclic=True)
        )


def symmetry_of(content: Content, mesh: Mesh) -> CyclicSymmetry | None:
    """The ring that a file is a sector of, its sectors numbered in the turning sense of the axis; None of none."""
    if not content.sectors:
        return None
    low, high = [], []
    for tie, ring, where in content.sectors:
        dependent, onto, _ = _two_sides(content, tie, where, mesh)
        other = nodes_of(content, mesh, tie.independent, where)
        _, turn = sides(mesh, ring, dependent, onto)
        forward = np.allclose(turn, rotation(ring.axis, 2.0 * np.pi / ring.sectors))
        high.append(dependent if forward else other)
        low.append(other if forward else dependent)
    own = [np.unique(mesh.labels[np.concatenate(part)]) for part in (low, high)]
    return replace(content.sectors[0][1], low=own[0], high=own[1])


def _two_sides(content: Content, tie: Tie, where: Place, mesh: Mesh) -> tuple[IntArray, Surface | IntArray, float]:
    """Nodes of one side, the other side (faces where it has some), and the length of its edges."""
    dependent = nodes_of(content, mesh, tie.dependent, where)
    faces = mesh.surfaces.get(tie.independent)
    other = nodes_of(content, mesh, tie.independent, where)
    return dependent, faces or other, face_size(mesh, faces) if faces else _spacing(mesh.nodes[other])


def _sides(content: Content, tie: Tie, ring: CyclicSymmetry, where: Place, mesh: Mesh) -> Iterator[NodalEquation]:
    dependent, onto, size = _two_sides(content, tie, where, mesh)
    tolerance = min(_SIDES * size, tie.tolerance or np.inf)
    yield from cyclic_equations(mesh, ring, dependent, onto, tolerance=tolerance, where=where)


def _spacing(places: Array) -> float:
    """Median distance of points to their next one."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(places).query(places, k=2)[0][:, 1])) if len(places) > 1 else 0.0


@KEYWORDS.reads("SELECTCYCLICSYMMETRYMODES", "NMAX NMIN", stage=2)
def on_diameters(content: Content, block: Block) -> None:
    """Nodal diameters that are asked for."""
    low, high = (whole_number(block.parameters.get(name, "0")) for name in ("NMIN", "NMAX"))
    if not 0 <= low <= high <= 100_000:
        raise ValueError(f"nodal diameters {low} to {high}")
    content.diameters |= set(range(low, high + 1))


def about_diameters(content: Content) -> None:
    """Warnings of a request for other nodal diameters than 0: as a body a sector has the family of 0 alone."""
    lines = [tie for tie in content.ties if tie.cyclic]
    if not lines:
        return
    others = sorted(content.diameters - {0})
    if others or not content.diameters:
        asked = f"asks for {others[0]} to {others[-1]} nodal diameters and " if others else ""
        what = f"{asked}is as a body computed for 0 alone, all sectors alike; ss.reduced_sector computes all of them"
        content.add(Verdict.APPROXIMATED, "*CYCLIC SYMMETRY MODEL", what, lines[0].line)
