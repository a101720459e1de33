"""A mesh: nodes, blocks of elements of one type, named node sets, element sets and surfaces; checked when made."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import suggestion
from slipstick.fem.elements import ELEMENTS, FACES, Element
from slipstick.typing import Array, IntArray


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Faces by type, ``{"quad8": (n_faces, 8)}``: node indices from 0, counter-clockwise seen from outside the body."""

    faces: Mapping[str, IntArray]

    @cached_property
    def nodes(self) -> IntArray:
        """Indices of the nodes on the surface, ascending."""
        parts = [np.ravel(faces) for faces in self.faces.values()]
        return np.unique(np.concatenate(parts)) if parts else np.empty(0, dtype=np.int64)

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return sum(len(faces) for faces in self.faces.values())


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Solid mesh in one consistent length unit; indices count from 0.

    Parameters
    ----------
    nodes
        Coordinates, (n_nodes, 3).
    blocks
        Connectivity by element type (``slipstick.fem.elements.ELEMENTS``), (n_elements, nodes of the type).
    node_sets, element_sets, surfaces
        Named groups: node indices; element indices by type; faces.
    node_labels, element_labels
        Numbers the nodes and elements carry outside (an imported file); 1, 2, ... when not given.
    temperature
        Of the nodes (n_nodes,), at which tables of materials are read; None: materials are as at their reference.

    Raises
    ------
    InputError
        For unknown element types, wrong shapes, indices out of range, repeated nodes, labels that are not unique.

    Examples
    --------
    >>> from slipstick.fem.box import box
    >>> mesh = box((1.0, 1.0, 1.0), (2, 1, 1), "hex20")
    >>> mesh.n_nodes, mesh.n_elements, sorted(mesh.surfaces)
    (32, 2, ['x0', 'x1', 'y0', 'y1', 'z0', 'z1'])
    """

    nodes: Array
    blocks: Mapping[str, IntArray]
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    element_sets: Mapping[str, Mapping[str, IntArray]] = field(default_factory=dict)
    surfaces: Mapping[str, Surface] = field(default_factory=dict)
    node_labels: IntArray | None = None
    element_labels: Mapping[str, IntArray] | None = None
    temperature: Array | None = None

    def __post_init__(self) -> None:
        faults = list(_faults(self))
        if faults:
            raise InputError(faults)

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.nodes)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return sum(len(block) for block in self.blocks.values())

    @cached_property
    def labels(self) -> IntArray:
        """Label of each node, (n_nodes,)."""
        return np.arange(1, self.n_nodes + 1) if self.node_labels is None else np.asarray(self.node_labels)

    @cached_property
    def used_nodes(self) -> IntArray:
        """Indices of nodes which belong to an element, ascending."""
        return np.unique(np.concatenate([block.ravel() for block in self.blocks.values()]))

    @property
    def all_sets(self) -> dict[str, IntArray]:
        """Node indices of every node set and surface, by name."""
        return {**{name: surface.nodes for name, surface in self.surfaces.items()}, **self.node_sets}

    def element_label(self, kind: str, index: int) -> int:
        """Label of one element."""
        return index + 1 if self.element_labels is None else int(self.element_labels[kind][index])

    def items(self) -> Iterator[tuple[Element, IntArray]]:
        """Element and connectivity of each block which is not empty."""
        for kind, block in self.blocks.items():
            if len(block):
                yield ELEMENTS[kind], block

    def surface(self, name: str) -> Surface:
        """The surface of that name; InputError says which there are."""
        if name not in self.surfaces:
            raise self._unknown("surface", name, self.surfaces)
        return self.surfaces[name]

    def node_set(self, name: str) -> IntArray:
        """Nodes of the node set of that name, or of the surface of that name; InputError says which there are."""
        if name not in self.node_sets and name in self.surfaces:
            return self.surfaces[name].nodes
        if name not in self.node_sets:
            raise self._unknown("node set", name, {*self.node_sets, *self.surfaces})
        return self.node_sets[name]

    def _unknown(self, what: str, name: str, known: Collection[str]) -> InputError:
        """The exception of an unknown name, with the names there are."""
        sentence = f"{what} '{name}' is not in the mesh; it has: {', '.join(user_names(known)) or 'none'}"
        if name in self.node_sets:
            return InputError(
                Fault(statement=f"{sentence} ('{name}' is a node set that holds no face of the boundary)")
            )
        if name in self.element_sets:
            return InputError(Fault(statement=f"{sentence} ('{name}' is a set of solid elements)"))
        close = suggestion(name, known)
        return InputError(Fault(statement=sentence, remedy=close if close.startswith("did") else ""))


def user_names(names: Iterable[str]) -> list[str]:
    """Names in order, without those a preprocessor makes for itself ("_PickedSet4"); all if there are no others.

    >>> user_names(["TIP", "_PickedSet4", "ROOT"])
    ['ROOT', 'TIP']
    """
    known = sorted(set(names))
    return [name for name in known if not name.startswith("_")] or known


def _faults(mesh: Mesh) -> Iterator[str]:
    nodes = np.asarray(mesh.nodes)
    if nodes.ndim != 2 or nodes.shape[1] != 3 or not len(nodes):
        yield f"mesh nodes have shape {nodes.shape}; expected (n_nodes, 3)"
        return
    if not np.all(np.isfinite(nodes)):
        yield f"node {int(np.flatnonzero(~np.isfinite(nodes).all(axis=1))[0]) + 1} has coordinates that are not finite"
    if not any(len(block) for block in mesh.blocks.values()):
        yield "the mesh has no elements"
    for kind, block in mesh.blocks.items():
        labels = np.arange(1, len(block) + 1) if mesh.element_labels is None else mesh.element_labels.get(kind, ())
        names = (f"{kind} elements", f"{kind} element")
        yield from _connectivity_faults(names, ELEMENTS.get(kind), np.asarray(block), len(nodes), labels)
        yield from _repeated(mesh, kind, np.asarray(block))
    for name, surface in mesh.surfaces.items():
        for kind, faces in surface.faces.items():
            names = (f"surface '{name}', {kind}", f"surface '{name}', {kind}: number")
            numbers = np.arange(1, len(faces) + 1)
            yield from _connectivity_faults(names, FACES.get(kind), np.asarray(faces), len(nodes), numbers)
    for name, group in mesh.node_sets.items():
        if len(group) and (np.min(group) < 0 or np.max(group) >= len(nodes)):
            yield f"node set '{name}' holds an index outside 0..{len(nodes) - 1}"
    if mesh.node_labels is not None and (
        len(mesh.node_labels) != len(nodes) or len(np.unique(mesh.node_labels)) != len(nodes)
    ):
        yield f"node labels: expected {len(nodes)} different numbers, one a node"
    if mesh.temperature is not None and (
        np.shape(mesh.temperature) != (len(nodes),) or not np.all(np.isfinite(mesh.temperature))
    ):
        yield f"temperature: expected {len(nodes)} finite numbers, one a node"


def _connectivity_faults(
    names: tuple[str, str], element: Element | None, block: IntArray, n_nodes: int, labels: Sequence[int] | IntArray
) -> Iterator[str]:
    """``names`` of all of them, and of one before its label."""
    what, one = names
    if element is None:
        yield f"{what}: this type is not known; known are {', '.join([*ELEMENTS, *FACES])}"
    elif block.ndim != 2 or block.shape[1] != element.n_nodes:
        yield f"{what}: connectivity has shape {block.shape}; expected (n, {element.n_nodes})"
    elif not np.issubdtype(block.dtype, np.integer):
        yield f"{what}: connectivity is of type {block.dtype}; expected integers"
    elif len(block) and (block.min() < 0 or block.max() >= n_nodes):
        row = int(np.flatnonzero(((block < 0) | (block >= n_nodes)).any(axis=1))[0])
        yield f"{one} {labels[row]} refers to a node outside 0..{n_nodes - 1}"
    elif len(block):
        ordered = np.sort(block, axis=1)
        repeated = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
        if len(repeated):
            yield f"{one} {labels[int(repeated[0])]} uses a node twice ({len(repeated)} such in all)"


def _repeated(mesh: Mesh, kind: str, block: IntArray) -> Iterator[str]:
    """Elements that have the nodes of another one: they would count twice."""
    if block.ndim != 2 or len(block) < 2 or not np.issubdtype(block.dtype, np.integer):
        return
    ordered = np.sort(block, axis=1)
    order = np.lexsort(ordered.T)
    same = np.flatnonzero((ordered[order[1:]] == ordered[order[:-1]]).all(axis=1))
    if len(same):
        first, second = sorted(mesh.element_label(kind, int(order[same[0] + at])) for at in (0, 1))
        yield f"{kind} elements {first} and {second} have the same nodes ({len(same)} such in all): one is given twice"


def node_indices(labels: IntArray, wanted: IntArray, what: str) -> IntArray:
    """Indices of node labels.

    Raises
    ------
    InputError
        If a label is not there; ``what`` says who asks for it.
    """
    if not len(labels) and len(wanted):
        raise InputError(Fault(statement=f"{what} uses node {np.ravel(wanted)[0]}, and the mesh has no nodes"))
    order = np.argsort(labels, kind="stable")
    place = np.searchsorted(labels, wanted, sorter=order).clip(max=len(labels) - 1)
    nodes = order[place]
    missing = labels[nodes] != wanted
    if missing.any():
        node = np.asarray(wanted)[missing][0]
        raise InputError(Fault(statement=f"{what} uses node {node}, which is not in the mesh"))
    return nodes


def part_of(mesh: Mesh, chosen: Mapping[str, IntArray]) -> Mesh:
    """A mesh of all nodes and some elements, with what of its element sets is among them; no surfaces."""
    return Mesh(
        nodes=mesh.nodes,
        blocks={kind: mesh.blocks[kind][at] for kind, at in chosen.items() if len(at)},
        element_sets={
            name: {kind: np.flatnonzero(np.isin(at, own.get(kind, ()))) for kind, at in chosen.items() if len(at)}
            for name, own in mesh.element_sets.items()
        },
        temperature=mesh.temperature,
    )


def together(parts: Mapping[str, Mesh]) -> Mesh:
    """One mesh of several bodies that share no nodes; sets and surfaces of each have its name before their own, and its
    name alone is the set of its elements.

    >>> from slipstick.fem.box import box
    >>> mesh = together({"lower": box((1.0, 1.0, 1.0), (1, 1, 1)), "upper": box((1.0, 1.0, 1.0), (1, 1, 1))})
    >>> mesh.n_nodes, sorted(mesh.surfaces)[:3]
    (40, ['lower.x0', 'lower.x1', 'lower.y0'])
    """
    nodes, blocks = 0, dict[str, list[IntArray]]()
    sets, elements, surfaces = dict[str, IntArray](), dict[str, dict[str, IntArray]](), dict[str, Surface]()
    for part, mesh in parts.items():
        before = {kind: sum(map(len, blocks.get(kind, ()))) for kind in mesh.blocks}
        for name, faces in mesh.surfaces.items():
            surfaces[f"{part}.{name}"] = Surface(faces={kind: block + nodes for kind, block in faces.faces.items()})
        sets |= {f"{part}.{name}": group + nodes for name, group in mesh.node_sets.items()}
        every = {kind: np.arange(len(block)) for kind, block in mesh.blocks.items()}
        named = {part: every} | {f"{part}.{name}": group for name, group in mesh.element_sets.items()}
        for name, group in named.items():
            elements[name] = {kind: at + before[kind] for kind, at in group.items()}
        for kind, block in mesh.blocks.items():
            blocks.setdefault(kind, []).append(block + nodes)
        nodes += mesh.n_nodes
    return Mesh(
        nodes=np.concatenate([mesh.nodes for mesh in parts.values()]),
        blocks={kind: np.concatenate(every) for kind, every in blocks.items()},
        node_sets=sets,
        element_sets=elements,
        surfaces=surfaces,
    )
