"""Keywords that tie nodes to each other: *EQUATION, *MPC, *RIGID BODY, *COUPLING; and directions of nodes.

Each leaves an entry of which the finished mesh gets its equations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from slipstick.errors import Place
from slipstick.fem.equations import (
    NodalEquation,
    Reference,
    cylindrical,
    in_global,
    mean_equations,
    rectangular,
    rigid_equations,
    rigid_rows,
)
from slipstick.fem.loads import area_weights
from slipstick.fem.mesh import Mesh
from slipstick.importers.abaqus.content import Axes, Content, named, nodes_of
from slipstick.importers.abaqus.keywords import KEYWORDS, Block, Placement
from slipstick.importers.deck import Stated
from slipstick.importers.findings import Verdict, refused
from slipstick.importers.text_numbers import fortran_real, whole_number
from slipstick.structure.constraints import Dependent
from slipstick.typing import Array, IntArray


@KEYWORDS.reads("EQUATION", "REMOVE REMOVEALL", stage=2)
def on_equation(content: Content, block: Block) -> None:
    """A number of terms, then "node or set, direction, factor" in turn."""
    if block.parameters.keys() & {"REMOVE", "REMOVEALL"}:
        content.note(Verdict.COUPLING, block, "takes equations away")
        return
    count, start = 0, block.line
    words: list[str] = []
    for line, row in zip(block.lines, block.rows, strict=True):
        if not count:
            count, words, start = whole_number(row[0]), [], line
            if not 0 < count <= 3 * len(content.nodes) + 6:
                raise ValueError(f"{count} terms")
            continue
        words += [word for word in row if word]
        if len(words) >= 3 * count:
            _one_equation(content, block, words[: 3 * count], start)
            count = 0
    if count:
        raise ValueError(f"{count} terms are announced, {len(words) // 3} are there")


def _one_equation(content: Content, block: Block, words: list[str], line: int) -> None:
    where = content.place(line, block.shown)
    parts = [
        (named(words[i], content.node_sets), whole_number(words[i + 1]) - 1, fortran_real(words[i + 2]))
        for i in range(0, len(words), 3)
    ]
    if any(not 0 <= axis < 6 for _, axis, _ in parts):
        if all(not 0 <= axis < 6 for _, axis, _ in parts):
            content.add(Verdict.HARMLESS, block.shown, "", line)
            return
        raise ValueError("directions beyond 6 together with motions")
    length = max(len(nodes) for nodes, _, _ in parts)
    if any(len(nodes) not in (1, length) for nodes, _, _ in parts):
        raise ValueError("node sets of different size")
    missing = [node for nodes, _, _ in parts for node in nodes if node not in content.nodes]
    if missing:
        raise KeyError(f"node {missing[0]}")
    equations = [
        NodalEquation(terms=tuple((nodes[i % len(nodes)], axis, value) for nodes, axis, value in parts), where=where)
        for i in range(length)
    ]
    content.stated.append(Stated(where=where, equations=lambda _: in_global(equations, frames(content))))


def frames(content: Content) -> dict[int, Array]:
    """Directions of the nodes that *TRANSFORM names."""
    return {node: axes_at(axes, content.position(node)) for node, axes in content.turned.items()}


def axes_at(axes: Axes, position: Array) -> Array:
    """Unit vectors (rows) of a system at a position."""
    return cylindrical(axes.a, axes.b, position) if axes.cylindrical else rectangular(axes.a, axes.b)


def read_axes(words: list[str], kind: str, placement: Placement | None = None) -> Axes:
    """Six numbers: two vectors from the origin (rectangular), or two points of an axis (cylindrical); moved with the
    instance.
    """
    values = np.array([fortran_real(word) for word in words if word][:6])
    if len(values) < 6:
        raise ValueError(f"{len(values)} numbers; expected six")
    system = Axes(cylindrical=kind.startswith("C"), a=values[:3], b=values[3:])
    if placement is not None:
        moved = placement.place if system.cylindrical else placement.turn.__matmul__
        system = Axes(cylindrical=system.cylindrical, a=moved(system.a), b=moved(system.b))
    axes_at(system, system.a + np.array([0.3, 0.5, 0.7]))  # InputError here where they are none
    return system


@KEYWORDS.reads("ORIENTATION", "DEFINITION NAME SYSTEM", stage=1)
def on_orientation(content: Content, block: Block) -> None:
    """A system of directions by name; without effect on isotropic materials."""
    kind = block.parameters.get("SYSTEM", "RECTANGULAR")
    turned = not _numbers(block.rows[1:]) or any(
        fortran_real(word or "0") for row in block.rows[1:] for word in row[1:2]
    )
    plain = block.parameters.get("DEFINITION", "COORDINATES") == "COORDINATES" and _numbers(block.rows[:1])
    if kind[0] in "RC" and not turned and plain and "NAME" in block.parameters:
        content.orientations[block.parameters["NAME"]] = read_axes(block.rows[0], kind, block.placement)
    content.note(Verdict.HARMLESS, block)


def _numbers(rows: list[list[str]]) -> bool:
    """Whether rows hold numbers, or there are none: not names of distributions."""
    try:
        return bool([fortran_real(word) for row in rows for word in row if word]) or not rows
    except ValueError:
        return False


@KEYWORDS.reads("MPC", "", stage=2)
def on_mpc(content: Content, block: Block) -> None:
    """Each line a type and its nodes; a line may go on in the next one, beginning with 0."""
    lines: list[tuple[int, list[str]]] = []
    for line, row in zip(block.lines, block.rows, strict=True):
        if row[0] == "0" and lines:
            lines[-1] = (lines[-1][0], [*lines[-1][1], *row[1:]])
        else:
            lines.append((line, row))
    for line, words in lines:
        kind = words[0].upper()
        groups = [named(word, content.node_sets) for word in words[1:] if word]
        where = content.place(line, f"{block.shown} {kind}")
        if kind in ("PLANE", "STRAIGHT"):
            nodes = list(dict.fromkeys(node for group in groups for node in group))
            make = _plane if kind == "PLANE" else _straight
            content.stated.append(Stated(where=where, equations=partial(make, content, nodes, where)))
        elif kind == "LINEAR" and len(groups) == 3:
            content.stated.append(Stated(where=where, equations=partial(_between, content, groups, where)))
        elif kind in ("BEAM", "TIE", "PIN") and len(groups) == 2:
            references = {node: content.reference(node) for node in groups[1]} if kind == "BEAM" else {}
            equations = partial(_joined, content, groups, references, where)
            content.stated.append(Stated(where=where, equations=equations))
        else:
            what = "ties degrees of freedom to each other"
            content.add(Verdict.COUPLING, f"{block.shown} {kind}", what, line)


def _joined(
    content: Content, groups: list[list[int]], references: dict[int, Reference], where: Place, mesh: Mesh
) -> Iterator[NodalEquation]:
    """BEAM: the first follow the second, their references, as rigid bodies; TIE and PIN: they move alike.

    Where both nodes have rotations BEAM and TIE hold these too.
    """
    del mesh
    first, second = groups
    for i, node in enumerate(first):
        other = second[i % len(second)]
        turning = node in content.turning and other in content.turning and not str(where[-1]).endswith(" PIN")
        axes = range(6) if turning else range(3)
        if references:
            yield from rigid_equations(references[other], {node: content.position(node)}, where, axes)
        else:
            for axis in axes:
                yield NodalEquation(terms=((node, axis, 1.0), (other, axis, -1.0)), where=where)


def _between(content: Content, groups: list[list[int]], where: Place, mesh: Mesh) -> Iterator[NodalEquation]:
    """LINEAR: each of the first moves as its place between the second and the third, by distance along their line."""
    del mesh
    first, second, third = groups
    for i, node in enumerate(first):
        a, b = second[i % len(second)], third[i % len(third)]
        line = content.position(b) - content.position(a)
        if not line @ line > 0.0:
            raise refused(where, f"nodes {a} and {b} are at the same place")
        share = float((content.position(node) - content.position(a)) @ line / (line @ line))
        for axis in range(3):
            terms = ((node, axis, 1.0), (a, axis, share - 1.0), (b, axis, -share))
            yield NodalEquation(terms=tuple(term for term in terms if term[2]), where=where)


def _plane(content: Content, nodes: list[int], where: Place, mesh: Mesh) -> Iterator[NodalEquation]:
    """All nodes stay in the plane of the first three."""
    del mesh
    a, b, c = (content.position(node) for node in nodes[:3])
    normal = np.cross(b - a, c - a)
    if not np.linalg.norm(normal) > 1e-10 * np.linalg.norm(b - a) * np.linalg.norm(c - a):
        raise refused(where, "its first three nodes lie on a line")
    normal = normal / np.linalg.norm(normal)
    for node in nodes[3:]:
        (s, t), *_ = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), content.position(node) - a, rcond=None)
        parts = ((node, 1.0), (nodes[0], s + t - 1.0), (nodes[1], -s), (nodes[2], -t))
        yield _along(normal, parts, where)


def _straight(content: Content, nodes: list[int], where: Place, mesh: Mesh) -> Iterator[NodalEquation]:
    """All nodes stay on the line of the first two."""
    del mesh
    a, b = (content.position(node) for node in nodes[:2])
    line = (b - a) / np.linalg.norm(b - a)
    side = np.cross(line, np.eye(3)[int(np.argmin(np.abs(line)))])
    side = side / np.linalg.norm(side)
    for node in nodes[2:]:
        t = float((content.position(node) - a) @ line / np.linalg.norm(b - a))
        for normal in (side, np.cross(line, side)):
            yield _along(normal, ((node, 1.0), (nodes[0], t - 1.0), (nodes[1], -t)), where)


def _along(normal: Array, parts: tuple[tuple[int, float], ...], where: Place) -> NodalEquation:
    axes = [(axis, value) for axis, value in enumerate(normal.tolist()) if abs(value) > 1e-14]
    terms = tuple((node, axis, weight * value) for node, weight in parts for axis, value in axes)
    return NodalEquation(terms=terms, where=where, dependent=Dependent.ANY)


@KEYWORDS.reads("RIGIDBODY", "ELSET NSET PINNSET REFNODE ROTNODE TIENSET", stage=2)
def on_rigid_body(content: Content, block: Block) -> None:
    """All nodes of sets follow a reference node; its rotations are directions 4..6, or those of the ROT NODE.

    Those of PIN NSET may turn.
    """
    parameters = block.parameters
    where = content.place(block.line, block.shown)
    if "REFNODE" not in parameters or not parameters.keys() & {"ELSET", *_RIGID_SETS}:
        content.note(Verdict.COUPLING, block, "makes a rigid body without REF NODE, or without NSET or ELSET")
        return
    node = content.one_node(parameters["REFNODE"])
    reference = content.reference(node)
    if "ROTNODE" in parameters:
        rotation = content.one_node(parameters["ROTNODE"])
        x, y, z = ((rotation, axis) for axis in range(3))
        reference = Reference(node=node, position=reference.position, rotations=(x, y, z))
    content.stated.append(
        Stated(where=where, equations=partial(_rigid, content, reference, parameters, where), nodewise=False)
    )


def _rigid(
    content: Content, reference: Reference, parameters: dict[str, str], where: Place, mesh: Mesh
) -> Iterator[NodalEquation]:
    chosen = mesh.element_sets.get(parameters.get("ELSET", ""), {})
    parts = {"": [mesh.blocks[kind][members].ravel() for kind, members in chosen.items()]}
    parts |= {key: [nodes_of(content, mesh, parameters[key], where)] for key in _RIGID_SETS if key in parameters}
    turning = {pair[0] for pair in reference.rotations}
    for key, found in parts.items():
        members = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *found]))
        nodes = {int(mesh.labels[m]): mesh.nodes[m] for m in members.tolist() if int(mesh.labels[m]) not in turning}
        yield from _following(content, reference, nodes, where, range(3 if key == "PINNSET" else 6))


_RIGID_SETS = ("NSET", "PINNSET", "TIENSET")


def _following(
    content: Content, reference: Reference, nodes: dict[int, Array], where: Place, directions: Sequence[int]
) -> Iterator[NodalEquation]:
    """Nodes follow a reference node: their displacements, and rotations where they are reference nodes themselves."""
    for node, position in nodes.items():
        wanted = [d for d in directions if d < 3 or node in content.turning]
        yield from rigid_equations(reference, {node: position}, where, wanted)


@KEYWORDS.reads("COUPLING", "CONSTRAINTNAME INFLUENCERADIUS ORIENTATION REFNODE SURFACE", stage=2)
def on_coupling(content: Content, block: Block) -> None:
    """A reference node and a surface; what couples them stands in the next keyword."""
    unfinished_coupling(content)
    content.coupling = block


def unfinished_coupling(content: Content) -> None:
    """A *COUPLING that is followed by nothing that is read is refused."""
    if content.coupling is not None:
        what = "is followed neither by *KINEMATIC nor by *DISTRIBUTING"
        content.add(Verdict.COUPLING, content.coupling.shown, what, content.coupling.line)


@KEYWORDS.reads("KINEMATIC", "", stage=2)
@KEYWORDS.reads("DISTRIBUTING", "COUPLING CYCLICSYMMETRY WEIGHTINGMETHOD", stage=2)
def on_kind_of_coupling(content: Content, block: Block) -> None:
    """*KINEMATIC: the surface follows the reference node; *DISTRIBUTING: the reference node follows it in the mean."""
    if content.coupling is None:
        raise ValueError("no *COUPLING stands before it")
    head, content.coupling = content.coupling.parameters, None
    where = content.place(block.line, block.shown)
    if not head.keys() >= {"REFNODE", "SURFACE"} or "CYCLICSYMMETRY" in block.parameters:
        content.note(Verdict.COUPLING, block, "couples nodes to a reference node")
        return
    axes = None
    if "ORIENTATION" in head:
        if head["ORIENTATION"] not in content.orientations:
            what = f"couples along the directions of ORIENTATION={head['ORIENTATION']}, which are not read"
            content.note(Verdict.COUPLING, block, what)
            return
        axes = content.orientations[head["ORIENTATION"]]
    directions = sorted({d for row in block.rows for d in _span(row)}) or list(range(6))
    node = content.one_node(head["REFNODE"])
    joint = _Joint(
        reference=content.reference(node),
        surface=head["SURFACE"].strip('"').upper(),
        directions=directions,
        axes=axes,
        radius=fortran_real(head["INFLUENCERADIUS"]) if head.get("INFLUENCERADIUS") else np.inf,
        weighting=_WEIGHTING[block.parameters.get("WEIGHTINGMETHOD", "UNIFORM")],
        where=where,
    )
    make = _kinematic if block.keyword == "KINEMATIC" else _distributing
    content.stated.append(Stated(where=where, equations=partial(make, content, joint), nodewise=False))


@dataclass(frozen=True, kw_only=True)
class _Joint:
    """A *COUPLING: reference node, surface, directions 0..5, along which axes; which nodes count, and how much, by
    their distance from the reference node.
    """

    reference: Reference
    surface: str
    directions: list[int]
    axes: Axes | None
    radius: float
    weighting: Callable[[Array], Array]
    where: Place


_WEIGHTING: dict[str, Callable[[Array], Array]] = {
    "UNIFORM": np.ones_like,
    "LINEAR": lambda s: 1.0 - s,
    "QUADRATIC": lambda s: 1.0 - s**2,
    "CUBIC": lambda s: 1.0 - 3.0 * s**2 + 2.0 * s**3,
}
"""Weights by the distance from the reference node over the largest one; as Abaqus (Coupling constraints)."""


def _members(content: Content, joint: _Joint, mesh: Mesh) -> tuple[IntArray, Array]:
    """Nodes of a coupling (indices), and their weights."""
    members = nodes_of(content, mesh, joint.surface, joint.where)
    distances = np.linalg.norm(mesh.nodes[members] - joint.reference.position, axis=1)
    near = distances <= joint.radius
    if not near.any():
        raise refused(joint.where, f"no node of {joint.surface} lies within INFLUENCE RADIUS of the reference node")
    largest = distances[near].max()
    return members[near], joint.weighting(distances[near] / (largest or 1.0))


def _span(row: list[str]) -> range:
    first = whole_number(row[0])
    last = whole_number(row[1]) if len(row) > 1 and row[1] else first
    if not 1 <= first <= last <= 6:
        raise ValueError(f"directions {first} to {last}")
    return range(first - 1, last)


def _kinematic(content: Content, joint: _Joint, mesh: Mesh) -> Iterator[NodalEquation]:
    members, _ = _members(content, joint, mesh)
    nodes = {int(mesh.labels[m]): mesh.nodes[m] for m in members.tolist()}
    wanted = [d for d in joint.directions if d < 3]
    if joint.axes is None or len(wanted) == 3:
        yield from _following(content, joint.reference, nodes, joint.where, joint.directions)
        return
    for node, position in nodes.items():
        rows = rigid_rows(joint.reference, position)
        for normal in axes_at(joint.axes, position)[wanted].tolist():
            terms = [(node, axis, normal[axis]) for axis in range(3)]
            terms += [(n, c, -v * normal[axis]) for axis in range(3) for n, c, v in rows[axis]]
            yield NodalEquation(terms=tuple(terms), where=joint.where, dependent=Dependent.ANY)


def _distributing(content: Content, joint: _Joint, mesh: Mesh) -> Iterator[NodalEquation]:
    """All three directions of the surface count, whichever way the axes of the coupling are turned."""
    members, weights = _members(content, joint, mesh)
    faces = joint.surface in content.surfaces
    shares = area_weights(mesh, mesh.surfaces[joint.surface]) if faces else np.ones(mesh.n_nodes)
    nodes = {
        int(mesh.labels[m]): (mesh.nodes[m], float(shares[m] * weight), (0, 1, 2))
        for m, weight in zip(members.tolist(), weights.tolist(), strict=True)
    }
    nodes.pop(joint.reference.node, None)
    yield from mean_equations(joint.reference, nodes, joint.where, joint.directions)


@KEYWORDS.reads("DISTRIBUTINGCOUPLING", "ELSET", stage=2)
def on_distributing_coupling(content: Content, block: Block) -> None:
    """CalculiX: the node of a DCOUP3D element moves as the weighted mean of others."""
    elements = set(content.element_sets[block.parameters["ELSET"]])
    coupled = [
        nodes
        for kind, table in content.skipped.items()
        if kind.startswith("DCOUP")
        for label, nodes in table.items()
        if label in elements
    ]
    if len(coupled) != 1:
        content.note(Verdict.COUPLING, block, "couples nodes to a reference node")
        return
    content.read |= elements
    weights: dict[int, float] = {}
    for row in block.rows:
        for node in named(row[0], content.node_sets):
            weights[node] = weights.get(node, 0.0) + (fortran_real(row[1]) if len(row) > 1 and row[1] else 1.0)
    total, node = sum(weights.values()), coupled[0][0]
    where = content.place(block.line, block.shown)
    if not total > 0.0:
        raise ValueError(f"weights whose sum is {total:g}")
    equations = [
        NodalEquation(terms=((node, axis, 1.0), *((n, axis, -w / total) for n, w in weights.items())), where=where)
        for axis in range(3)
    ]
    content.stated.append(Stated(where=where, equations=lambda _: equations))
