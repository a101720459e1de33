"""The content of an input file (.inp), in its own terms: labels, names in capitals."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import Fault, Place
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.equations import Reference
from slipstick.fem.interfaces import SurfacePair
from slipstick.fem.load_steps import StepLoad
from slipstick.fem.mesh import Mesh, Surface
from slipstick.importers.abaqus.keywords import Block, Placement
from slipstick.importers.deck import Deck
from slipstick.importers.findings import Verdict, refused
from slipstick.importers.text_numbers import whole_number
from slipstick.typing import Array, IntArray


@dataclass(kw_only=True)
class Section:
    """A *SOLID SECTION or another one: which elements, which material."""

    elements: str
    material: str
    line: int
    shown: str


@dataclass(frozen=True, kw_only=True)
class Tie:
    """A *TIE: names of its two sides; whether nodes of the first are moved onto the second; largest distance."""

    name: str
    dependent: str
    independent: str
    adjust: bool
    tolerance: float | None
    cyclic: bool
    where: Place
    line: int


@dataclass(frozen=True, kw_only=True)
class Axes:
    """A system of directions: rectangular by two vectors, or about an axis from one point to the other."""

    cylindrical: bool
    a: Array
    b: Array


@dataclass(kw_only=True)
class Content(Deck):
    """The content read by now; labels as in the file, names in capitals (they are not case sensitive)."""

    path: Path
    skipped: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    read: set[int] = field(default_factory=set)
    surfaces: dict[str, list[tuple[int, list[str]]]] = field(default_factory=dict)
    properties: dict[str, dict[str, Any]] = field(default_factory=dict)
    law_faults: dict[str, list[Fault]] = field(default_factory=dict)
    sections: list[Section] = field(default_factory=list)
    other_sections: list[Section] = field(default_factory=list)
    turning: set[int] = field(default_factory=set)
    turned: dict[int, Axes] = field(default_factory=dict)
    orientations: dict[str, Axes] = field(default_factory=dict)
    ties: list[Tie] = field(default_factory=list)
    sectors: list[tuple[Tie, CyclicSymmetry, Place]] = field(default_factory=list)
    diameters: set[int] = field(default_factory=set)
    coupling: Block | None = None
    interaction: str = ""
    interactions: set[str] = field(default_factory=set)
    friction: dict[str, float] = field(default_factory=dict)
    glued: set[str] = field(default_factory=set)
    pairs: list[tuple[SurfacePair, Place]] = field(default_factory=list)
    material: str = ""
    parts: int = 0
    system: Placement | None = None
    steps: list[dict[str, str]] = field(default_factory=list)
    step_lines: list[int] = field(default_factory=list)
    procedures: dict[int, str] = field(default_factory=dict)
    loads: list[tuple[int, StepLoad]] = field(default_factory=list)
    loaded: bool = False

    def note(self, verdict: Verdict, block: Block, what: str = "") -> None:
        """Note the treatment of a keyword."""
        self.add(verdict, block.shown, what, block.line)

    def step_name(self, number: int) -> str:
        """Name of a step, counted from 1: the one that the file gives, or else "STEP-1" and so on."""
        return self.steps[number - 1].get("NAME", f"STEP-{number}")

    def reference(self, node: int) -> Reference:
        """A node with its position and its rotations."""
        self.turning.add(node)
        return Reference.of(node, self.position(node))

    def position(self, node: int) -> Array:
        """Coordinates (3,) of a node; KeyError where the file has none."""
        return np.array(self.nodes[node])

    def one_node(self, word: str) -> int:
        """The node of a label, or of a set that holds one."""
        nodes = named(word, self.node_sets)
        if len(set(nodes)) != 1:
            raise ValueError(f"{word} has {len(set(nodes))} nodes; expected one")
        if nodes[0] not in self.nodes:
            raise KeyError(f"node {nodes[0]}")
        return nodes[0]


def named(word: str, sets: dict[str, list[int]]) -> list[int]:
    """Labels of "12", "TIP" or "PART-1-1.TIP"; KeyError where there is no such set."""
    name = set_name(word, sets)
    return [whole_number(name)] if name.isdecimal() else sets[name]


def set_name(word: str, sets: Collection[str]) -> str:
    """The name or label that "12", "TIP" or "PART-1-1.TIP" stands for; KeyError where there is no such set.

    Where sets have the name of their instance, the name alone is another one's.
    """
    word = word.replace('"', "").upper()
    if "." in word and word not in sets and not any("." in name for name in sets):
        word = word.split(".")[-1]
    if not word.isdigit() and word not in sets:
        raise KeyError(word)
    return word


def surface_of(mesh: Mesh, name: str, where: Place) -> Surface:
    """The faces of a surface in the mesh; InputError where it has none on solid elements."""
    name = name.strip('"').upper()
    if name not in mesh.surfaces:
        raise refused(where, f"names the surface {name}, which has no faces of solid elements in the file")
    return mesh.surfaces[name]


def nodes_of(content: Content, mesh: Mesh, name: str, where: Place) -> IntArray:
    """Node indices of a surface of faces, or of a node set or nodal surface."""
    name = name.strip('"').upper()
    if name in content.surfaces:
        return surface_of(mesh, name, where).nodes
    if name not in mesh.node_sets:
        raise refused(where, f"names {name}, which the file does not have")
    return mesh.node_sets[name]
