"""Point masses, rotary inertias and springs of an input file: *MASS, *ROTARY INERTIA, *SPRING, *DASHPOT."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slipstick.fem.lumped import Lumped, axial_spring, point_mass, spring
from slipstick.importers.abaqus.blocks import Block
from slipstick.importers.abaqus.content import Content
from slipstick.importers.findings import Verdict
from slipstick.importers.text_numbers import fortran_real, whole_number


def _members(content: Content, block: Block) -> Iterator[tuple[str, int, list[int]]]:
    """Type, label and nodes of the elements of a section; they are marked as read."""
    chosen = set(content.element_sets[block.parameters["ELSET"]])
    for kind, table in content.skipped.items():
        for label, nodes in table.items():
            if label in chosen:
                missing = [node for node in nodes if node not in content.nodes]
                if missing:
                    raise KeyError(f"node {missing[0]}")
                content.read.add(label)
                yield kind, label, nodes


def on_mass(content: Content, block: Block) -> None:
    """One mass for each element of the set."""
    if "TYPE" in block.parameters and block.parameters["TYPE"] != "ISOTROPIC":
        content.findings.add(Verdict.COUPLING, block.shown, "gives a mass that depends on the direction", block.line)
        return
    mass = fortran_real(block.rows[0][0])
    for _, _, nodes in _members(content, block):
        content.lumped += point_mass(nodes[0], mass)


def on_inertia(content: Content, block: Block) -> None:
    """I11, I22, I33, I12, I13, I23 about each node of the set."""
    if "ORIENTATION" in block.parameters:
        content.findings.add(Verdict.COUPLING, block.shown, "gives inertia along directions of its own", block.line)
        return
    values = [fortran_real(word) if word else 0.0 for word in block.rows[0]]
    xx, yy, zz, xy, xz, yz = [*values, *[0.0] * 6][:6]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    for _, _, nodes in _members(content, block):
        content.turning.add(nodes[0])
        content.lumped += point_mass(nodes[0], 0.0, inertia)


def on_spring(content: Content, block: Block) -> None:
    """SPRINGA along the line of its nodes, SPRING1 to ground, SPRING2 between two directions; linear ones."""
    if block.parameters.keys() & {"NONLINEAR", "ORIENTATION", "COMPLEXSTIFFNESS"} or len(block.rows) > 2:
        what = "gives springs that are not linear, depend on temperature or have directions of their own"
        content.findings.add(Verdict.COUPLING, block.shown, what, block.line)
        return
    stiffness = fortran_real(block.rows[-1][0])
    directions = [whole_number(word) - 1 for word in block.rows[0] if word] if len(block.rows) > 1 else []
    for kind, _, nodes in _members(content, block):
        if kind == "SPRINGA":
            ends = (nodes[0], nodes[1])
            along = content.position(ends[1]) - content.position(ends[0])
            content.lumped.append(axial_spring(stiffness, ends, along, content.where(block.line)))
        else:
            content.lumped.append(_spring(kind, nodes, directions, stiffness))


def _spring(kind: str, nodes: list[int], directions: list[int], stiffness: float) -> Lumped:
    wanted = {"SPRING1": 1, "SPRING2": 2}.get(kind)
    if wanted is None or len(directions) != wanted or not all(0 <= d < 6 for d in directions):
        raise ValueError(f"elements of type {kind} with {len(directions)} directions")
    pairs = [*zip(nodes, directions, strict=False)]
    return spring(stiffness, *pairs)


def on_dashpot(content: Content, block: Block) -> None:
    """Dashpots are damping, which is the structure's loss_factor or damping_ratio."""
    count = sum(1 for _ in _members(content, block))
    what = f"gives damping to {count} dashpots, which is not read; give the structure's loss_factor or damping_ratio"
    content.findings.add(Verdict.APPROXIMATED, block.shown, what, block.line)
