"""Contact pairs and bolts of Nastran bulk data.

Simcenter (NX): regions of faces (BSURFS), or the outer ones of properties (BCPROPS), in pairs with friction (BCTSET),
sets of pairs joined (BCTADD) and chosen by BCSET of the case control. MSC: bodies (BCBODY) of elements (BSURF), whose
outer faces touch as BCTABLE says. A BOLT of solids is a section of grid points across it. BSURF of Simcenter names
shells, which are not read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TypeVar

import numpy as np

from slipstick.errors import Place
from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.interfaces import WHOLE, PretensionSection, SurfacePair
from slipstick.fem.load_steps import LoadStep, StepLoad
from slipstick.fem.mesh import Mesh, Surface
from slipstick.importers.deck import Deck
from slipstick.importers.findings import Verdict, refused
from slipstick.importers.interfaces import (
    APART,
    element_positions,
    outer_faces,
    section_faces,
)
from slipstick.importers.nastran.bulk import BulkData, labels_of
from slipstick.importers.nastran.couplings import selected
from slipstick.importers.text_numbers import fortran_real, reading, whole_number
from slipstick.typing import Array, IntArray

CONTACT_CARDS = "BSURFS BSURF BCPROPS BCTSET BCTADD BCTABLE BCBODY BCBODY1 BCTPARA BOLT BOLTFOR BOLTLD"
_SLIDING, _LISTED = ("SLAVE", "SECNDRY"), ("MASTERS", "PRIMARY")
_WORDS = (*_SLIDING, *_LISTED, "FBSH", "BKGL", "SECTORS", "SEGMENT")
_GLUED = "glues surfaces together"

Card = tuple[str, int, list[str]]
Body = tuple[int, float | None]
"""Region and coefficient of friction."""

Made = TypeVar("Made")


@dataclass(frozen=True, kw_only=True)
class _Stated:
    """Two regions that touch, as a line states it."""

    first: int
    second: int
    mu: float | None
    where: Place
    name: str
    line: int


class Contacts:
    """Regions, pairs and bolts of the cards of a file, put into a deck.

    Parameters
    ----------
    deck
        With its mesh; takes pairs, sections and what is not read.
    data
        Grid points and coordinate systems.
    cards
        Those of ``CONTACT_CARDS``.
    text
        The file, for its case control.
    """

    def __init__(self, deck: Deck, data: BulkData, cards: Sequence[Card], text: str) -> None:
        self.deck, self.data, self.text = deck, data, text
        self.cards = cards

    def placed(self, mesh: Mesh) -> Mesh:
        """The mesh with the surfaces of regions and bolts; pairs and sections go to the deck."""
        regions = self._regions(mesh)
        for stated in self._pairs():
            for number in (stated.first, stated.second):
                if number not in regions:
                    raise refused(
                        stated.where, f"names region {number}, which no BSURFS, BSURF or BCPROPS of solids makes"
                    )
            names = [f"region {number}" for number in (stated.first, stated.second)]
            self.deck.contact_pairs["/".join(names)] = SurfacePair(
                dependent=names[0], independent=names[1], mu=stated.mu, interaction=stated.name
            )
            self.deck.add(Verdict.APPROXIMATED, stated.name.split()[0], APART, stated.line)
        surfaces = {f"region {number}": surface for number, surface in regions.items()}
        surfaces |= dict(self._each(partial(self._bolt, mesh), "BOLT"))
        steps: dict[str, list[StepLoad]] = {}
        for name, load in self._each(self._bolt_load, "BOLTFOR", "BOLTLD"):
            steps.setdefault(name, []).append(load)
        self.deck.load_steps = {name: LoadStep(procedure="static", loads=tuple(part)) for name, part in steps.items()}
        return replace(mesh, surfaces={**mesh.surfaces, **surfaces})

    def _each(self, read: Callable[[Place, int, list[str]], Iterable[Made]], *names: str) -> list[Made]:
        """What a function makes of each card of some names; a card that cannot be read is named with its line."""
        made: list[Made] = []
        for name, line, fields in self.cards:
            if name in names:
                where = Place(self.deck.source, f"line {line}", name)
                with reading(where):
                    made += read(where, line, fields)
        return made

    def _regions(self, mesh: Mesh) -> dict[int, Surface]:
        at = {
            label: (kind, position)
            for kind, labels in (mesh.element_labels or {}).items()
            for position, label in enumerate(labels.tolist())
        }
        found: dict[int, Surface] = {}

        def take(where: Place, line: int, fields: list[str]) -> Iterator[None]:
            number = whole_number(fields[0])
            if number in found:
                raise refused(where, f"gives region {number} twice")
            if where[-1] == "BSURFS":
                found[number] = _faces(mesh, at, fields[4:], where)
                return
            elements = labels_of(fields[1:])
            if where[-1] == "BCPROPS":
                elements = [e for p in elements for e in self.deck.element_sets.get(f"property {p}", ())]
            surface = outer_faces(mesh, element_positions(mesh, elements))
            if surface.n_faces:
                found[number] = surface
            else:
                what = f"names elements ({elements[0] if elements else 'none'}, ...) with no outer face of a solid"
                self.deck.add(Verdict.COUPLING, str(where[-1]), f"{what}: contact of shells is not read", line)
            yield from ()

        self._each(take, "BSURFS", "BSURF", "BCPROPS")
        return found

    def _pairs(self) -> list[_Stated]:
        self._each(self._glued, "BCTPARA")
        sums = dict(self._each(self._sum, "BCTADD"))
        number = selected(self.text, "BCSET")
        chosen = None if number is None else sums.get(number, {number})
        bodies = dict(self._each(self._body, "BCBODY", "BCBODY1"))
        sets = self._each(partial(self._set, chosen), "BCTSET")
        return sets + self._each(partial(self._table, bodies), "BCTABLE")

    def _glued(self, where: Place, line: int, fields: list[str]) -> Iterator[None]:
        words = [word.upper() for word in fields]
        if any(word == "TIED" and value not in ("", "0") for word, value in pairwise(words)):
            self.deck.add(Verdict.COUPLING, str(where[-1]), f"{_GLUED} (TIED)", line)
        yield from ()

    def _sum(self, where: Place, line: int, fields: list[str]) -> Iterator[tuple[int, set[int]]]:
        del where, line
        yield whole_number(fields[0]), {whole_number(word) for word in fields[1:] if word}

    def _set(self, chosen: set[int] | None, where: Place, line: int, fields: list[str]) -> Iterator[_Stated]:
        number = whole_number(fields[0])
        if chosen is not None and number not in chosen:
            self.deck.add(Verdict.HARMLESS, f"BCTSET {number} (not asked for by BCSET)", "", line)
            return
        for row in _rows(fields):
            if row[1]:
                yield _Stated(
                    first=whole_number(row[1]), second=whole_number(row[2]), mu=_coefficient(row[3]), where=where,
                    name=f"BCTSET {number}", line=line,
                )  # fmt: skip

    def _body(self, where: Place, line: int, fields: list[str]) -> Iterator[tuple[int, Body]]:
        """Body, its region and its friction: BCBODY has them in fields 4 and 6, BCBODY1 the region in field 5."""
        name = str(where[-1])
        behaviour, region = fields[2:4] if name == "BCBODY" else fields[3:5]
        if behaviour.upper() not in ("", "DEFORM"):
            self.deck.add(Verdict.COUPLING, name, f"touches with a body that is not meshed ({behaviour})", line)
            return
        yield whole_number(fields[0]), (whole_number(region), _coefficient(fields[5]) if name == "BCBODY" else None)

    def _table(self, bodies: dict[int, Body], where: Place, line: int, fields: list[str]) -> Iterator[_Stated]:
        """Pairs of MSC's BCTABLE: a row with SLAVE and its friction, and the bodies of the rows from MASTERS on."""
        slave, mu, listed = 0, None, False
        for row in _rows(fields):
            word = row[0].upper()
            if word in _SLIDING:
                slave, mu, listed = whole_number(row[1]), _coefficient(row[4]), False
                if row[6] not in ("", "0"):
                    self.deck.add(Verdict.COUPLING, "BCTABLE", f"{_GLUED} (IGLUE)", line)
                continue
            listed = word in _LISTED or (listed and word not in _WORDS)
            for other in row[1 if word in _LISTED else 0 :] if listed else ():
                if other:
                    ends = [_known(bodies, one, where) for one in (slave, whole_number(other))]
                    own = min((friction for _, friction in ends if friction is not None), default=None)
                    yield _Stated(
                        first=ends[0][0], second=ends[1][0], mu=own if mu is None else mu, where=where,
                        name=f"BCTABLE {whole_number(fields[0])}", line=line,
                    )  # fmt: skip

    def _bolt(self, mesh: Mesh, where: Place, line: int, fields: list[str]) -> Iterator[tuple[str, Surface]]:
        """BOLT, number, 2, coordinate system, its axis along the bolt, grid points across it."""
        number, kind = whole_number(fields[0]), fields[1]
        if kind != "2":
            what = "names elements but no section across them: the bolt stays whole and is not kept"
            self.deck.add(Verdict.APPROXIMATED, "BOLT", what, line)
            return
        points = labels_of(fields[4:])
        known = {int(label): i for i, label in enumerate(mesh.labels)}
        missing = [point for point in points if point not in known]
        if missing or not points:
            raise refused(where, f"names grid point {[*missing, 'none'][0]}, which the file does not have")
        at = np.array([known[point] for point in points], dtype=np.int64)
        normal = self._axis(fields[2], whole_number(fields[3]), mesh.nodes[at].mean(axis=0))
        surface = section_faces(mesh, at.tolist(), _ahead(mesh, at, normal))
        if not surface.n_faces:
            raise refused(where, "has grid points that form no face of a solid element: they do not cut the bolt")
        if f"bolt {number}" in self.deck.pretension_sections:
            raise refused(where, f"gives bolt {number} twice")
        x, y, z = normal.tolist()
        card = ": ".join(map(str, where[1:]))
        self.deck.pretension_sections[f"bolt {number}"] = PretensionSection(node=0, normal=(x, y, z), card=card)
        self.deck.add(Verdict.APPROXIMATED, "BOLT", WHOLE, line)
        yield f"bolt {number}", surface

    def _bolt_load(self, where: Place, line: int, fields: list[str]) -> Iterator[tuple[str, StepLoad]]:
        """Set, force and bolts; those that are kept under no name are told of where they stand."""
        self.deck.add(Verdict.HARMLESS, str(where[-1]), "", line)
        value = fortran_real(fields[1])
        for number in labels_of(fields[2:]):
            if f"bolt {number}" in self.deck.pretension_sections:
                load = StepLoad(kind="bolt force", where=f"bolt {number}", value=value)
                yield f"{where[-1]} {whole_number(fields[0])}", load

    def _axis(self, system: str, direction: int, at: Array) -> Array:
        if not 1 <= direction <= 3:
            raise ValueError(f"direction {direction}; expected 1 to 3")
        frame = self.data.frames.frame(whole_number(system or "0"))
        return np.asarray(frame.directions(at)[:, direction - 1])


def _known(bodies: dict[int, Body], number: int, where: Place) -> Body:
    if number not in bodies:
        raise refused(where, f"names body {number}, which no BCBODY of solids makes")
    return bodies[number]


def _rows(fields: Sequence[str]) -> Iterator[list[str]]:
    """The lines of a card, eight fields each."""
    for at in range(0, len(fields), 8):
        yield [*fields[at : at + 8], *[""] * 8][:8]


def _coefficient(word: str) -> float | None:
    if not word:
        return None
    mu = fortran_real(word)
    if not 0.0 <= mu < np.inf:
        raise ValueError(f"a coefficient of friction of {mu:g}")
    return mu


def _faces(mesh: Mesh, at: dict[int, tuple[str, int]], fields: Sequence[str], where: Place) -> Surface:
    """Faces by an element and three of their corners each."""
    found: dict[str, list[IntArray]] = {}
    for start in range(0, len(fields), 4):
        words = [*fields[start : start + 4], *[""] * 4][:4]
        if not any(words):
            continue
        element, *corners = map(whole_number, words)
        if element not in at:
            raise refused(where, f"names element {element}, which is no solid of the file")
        kind, position = at[element]
        row = mesh.blocks[kind][position]
        labels = mesh.labels[row]
        for shape, local in ELEMENTS[kind].faces:
            if {*corners} <= {*labels[list(local[: FACES[shape].n_corners])].tolist()}:
                found.setdefault(shape, []).append(row[list(local)])
                break
        else:
            points = ", ".join(map(str, corners))
            raise refused(where, f"names the grid points {points}, which are no corners of a face of element {element}")
    if not found:
        raise refused(where, "names no face")
    return Surface(faces={shape: np.array(rows, dtype=np.int64) for shape, rows in found.items()})


def _ahead(mesh: Mesh, cut: IntArray, normal: Array) -> set[int]:
    """Labels of the elements at some nodes that lie on the side to which a normal points."""
    marked = np.zeros(mesh.n_nodes, dtype=bool)
    marked[cut] = True
    middle = mesh.nodes[cut].mean(axis=0)
    beside: set[int] = set()
    for kind, block in mesh.blocks.items():
        near = np.flatnonzero(marked[block].any(axis=1))
        ahead = (mesh.nodes[block[near]].mean(axis=1) - middle) @ normal > 0.0
        labels = (mesh.element_labels or {}).get(kind)
        beside |= set((near + 1 if labels is None else labels[near])[ahead].tolist())
    return beside
