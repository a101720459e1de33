"""Contact pairs (CONTA173 to 175 with TARGE170) and pretension sections (PRETS179) of an Ansys archive (.cdb).

Contact and target elements with the same set of real constants are one pair. A pretension section cuts the mesh: each
of its elements joins a node I on one side and a node J at the same place on the other one, and node K carries the load.
Here J becomes I, so that the bolt is whole as that of other codes, and the faces of the first side are a surface.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.interfaces import WHOLE, PretensionSection, SurfacePair
from slipstick.fem.load_steps import LoadStep, StepLoad
from slipstick.fem.mesh import Mesh, Surface, node_indices
from slipstick.importers.ansys.commands import COMMANDS, commands
from slipstick.importers.ansys.couplings import real_constants
from slipstick.importers.deck import Deck, matching_surface, with_surfaces
from slipstick.importers.findings import Verdict, refused, with_more
from slipstick.importers.interfaces import APART, section_faces
from slipstick.importers.text_numbers import fortran_real, reading, whole_number
from slipstick.typing import IntArray

_MATERIAL, _TYPE, _REAL, _SECTION, _NUMBER, _HEAD = 0, 1, 2, 3, 8, 10
_CONTACTS, _TARGET, _PRETENSION = (173, 174, 175), 170, 179
INTERFACES = frozenset((*_CONTACTS, _TARGET, _PRETENSION))
"""Numbers of the element types that are read here."""

_GLUED = {3: "bonded", 5: "bonded (always)", 6: "bonded (initial contact)"}
_HELD = {2: "no separation", 4: "no separation (always)"}
_ROUGH = 1
_SAME_PLACE = 1e-6
"""Nodes this close to each other, over the size of the model, lie at the same place."""

_WARM = "depends on temperature; its first value is kept"

_CNOF = 9
"""Which real constant moves the contact surface."""

_LIMITS = {8: ("TAUMAX", 1e20), 12: ("COHE", 0.0), 20: ("FACT", 1.0), 21: ("DC", 0.0)}
"""Real constants that change friction: a limit of its stress, cohesion, the coefficient at rest over that of sliding,
and the decay between both; with the values that have no effect."""


Friction = tuple[float | None, str]
"""A coefficient, None where the file gives no number, and the command that gives it."""


class Interfaces:
    """Rows of the archive's elements with cut bolts joined, and what is made of contacts and sections.

    Parameters
    ----------
    deck
        Takes what was found; its nodes are those of the file.
    archive, text
        The archive as read, and its text.
    """

    def __init__(self, deck: Deck, archive: Any, text: str) -> None:
        self.deck, self.archive, self.text = deck, archive, text
        self.kinds = {int(number): int(kind) for number, kind in np.asarray(archive.ekey)}
        self.options: dict[int, dict[int, int]] = {
            int(number): {int(key): int(value) for key, value, *_ in options}
            for number, options in archive.key_option.items()
        }
        rows = [[int(value) for value in row] for row in archive.elem]
        self._sections = _by(_SECTION, (row for row in rows if self.kinds.get(row[_TYPE]) == _PRETENSION))
        self._joined = self._same_nodes()
        solid = [row for row in rows if self.kinds.get(row[_TYPE]) not in INTERFACES]
        others = {number: {row[_HEAD + 1] for row in part} for number, part in self._sections.items()}
        self._beside = {
            number: {row[_NUMBER] for row in solid if not nodes.isdisjoint(row[_HEAD:])}
            for number, nodes in others.items()
        }
        self.rows = [[*row[:_HEAD], *map(self.follow, row[_HEAD:])] for row in rows]
        deck.nodes = {node: place for node, place in deck.nodes.items() if node not in self._joined}

    def _same_nodes(self) -> dict[int, int]:
        """Node J of each element of a section and the node I whose place it has; both must lie there."""
        joined: dict[int, int] = {}
        kept: set[int] = set()
        places = self.deck.nodes
        span = np.ptp(self.deck.coordinates, axis=0).max() if places else 0.0
        faults: list[Fault] = []
        for part in self._sections.values():
            for row in part:
                where = Place(self.deck.source, f"PRETS179 element {row[_NUMBER]}")
                nodes = row[_HEAD:]
                missing = [node for node in nodes if node not in places]
                if len(nodes) != 3 or missing:
                    needs = f"names node {missing[0]}, which the file does not have" if missing else "has not 3 nodes"
                    faults.append(Fault(where, needs, remedy="write the archive with all nodes selected (CDWRITE,DB)"))
                    continue
                first, second, _ = nodes
                apart = float(np.linalg.norm(np.asarray(places[first]) - np.asarray(places[second])))
                if apart > _SAME_PLACE * span:
                    what = f"joins the nodes {first} and {second}, which lie {apart:.3g} apart"
                    faults.append(Fault(where, what, remedy="cut the bolt by PSMESH, which puts them at one place"))
                kept.add(first)
                if joined.setdefault(second, first) != first or second in kept or first in joined:
                    what = f"cuts the bolt at node {second}, where another one cuts it"
                    faults.append(Fault(where, what, remedy="keep one pretension section across a bolt"))
        if faults:
            raise InputError(faults[:8])
        return joined

    def follow(self, node: int) -> int:
        """The node that stands for another one."""
        return self._joined.get(node, node)

    @COMMANDS.reads("SECTYPE SECDATA SLOAD")
    def sections(self) -> None:
        """Keep pretension sections as those of other codes: node, normal, and the faces of one side as a surface."""
        normals = dict(self._normals())
        for number, part in self._sections.items():
            where = Place(self.deck.source, f"PRETS179 of section {number}")
            loaded = {row[_HEAD + 2] for row in part}
            if len(loaded) != 1:
                nodes = ", ".join(map(str, sorted(loaded)[:3]))
                raise refused(where, f"has {len(loaded)} pretension nodes ({nodes})", expected="one a section")
            self.deck.pretension_sections[f"pretension {number}"] = PretensionSection(
                node=loaded.pop(), normal=normals.get(number), card=str(where[1])
            )
        self._tell("PRETS179 of section", [*self._sections], WHOLE)
        steps: dict[int, list[StepLoad]] = {}
        for step, load in self._loads():
            steps.setdefault(step, []).append(load)
        for step, loads in sorted(steps.items()):
            self.deck.load_steps[f"STEP-{step}"] = LoadStep(procedure="static", loads=tuple(loads))

    def _loads(self) -> Iterator[tuple[int, StepLoad]]:
        """Loads of bolts and the steps they begin in: of SLOAD, and of F and D on the node of a section."""
        names = {section.node: name for name, section in self.deck.pretension_sections.items()}
        for line, name, words in commands(self.text):
            with reading(Place(self.deck.source, f"line {line}", name)):
                words = [*words, *[""] * 7]
                if name == "SLOAD" and (section := f"pretension {words[0]}") in self.deck.pretension_sections:
                    kind = "bolt shortening" if words[3].upper().startswith("DISP") else "bolt force"
                    value = fortran_real(words[4]) if words[4] else 0.0
                    yield max(whole_number(words[5] or "1"), 1), StepLoad(kind=kind, where=section, value=value)
                    if words[6] and whole_number(words[6]):
                        yield whole_number(words[6]), StepLoad(kind="bolt locked", where=section)
                elif name in ("F", "D") and words[0].isdigit() and int(words[0]) in names and words[2]:
                    kind = "bolt force" if name == "F" else "bolt shortening"
                    yield 1, StepLoad(kind=kind, where=names[int(words[0])], value=fortran_real(words[2]))

    def _tell(self, numbered: str, numbers: Sequence[int], what: str) -> None:
        """One warning for all pairs, or for all sections."""
        if numbers:
            where = with_more(Place(self.deck.source, f"{numbered} {numbers[0]}"), len(numbers) - 1)
            self.deck.own_warnings.append(str(Fault(where, what)))

    def _normals(self) -> Iterator[tuple[int, tuple[float, float, float]]]:
        """SECTYPE, number, PRETENSION and then SECDATA, node, nx, ny, nz."""
        number = 0
        for line, name, words in commands(self.text):
            if name == "SECTYPE":
                kind = words[1].upper() if len(words) > 1 else ""
                number = int(words[0]) if kind.startswith("PRET") and words[0].isdigit() else 0
            elif name == "SECDATA" and number:
                with reading(Place(self.deck.source, f"line {line}", name)):
                    x, y, z = ([fortran_real(word) if word else 0.0 for word in words[1:4]] + [0.0] * 3)[:3]
                    if not 0.0 < np.linalg.norm([x, y, z]) < np.inf:
                        raise ValueError("a normal without length")
                    yield number, (x, y, z)

    def placed(self, mesh: Mesh, friction: Mapping[int, Friction]) -> Mesh:
        """The mesh with surfaces of sections and pairs; the pairs go to the deck, those that glue are refused there.

        ``friction`` is the coefficient of each material that has one, and the command that gives it.
        """
        found: dict[str, Surface | IntArray] = {}
        for number, part in self._sections.items():
            cut = node_indices(mesh.labels, np.array(sorted({row[_HEAD] for row in part})), f"section {number}")
            faces = section_faces(mesh, cut.tolist(), self._beside[number])
            if not faces.n_faces:
                where = Place(self.deck.source, f"PRETS179 of section {number}")
                raise refused(where, "has nodes that form no face of a solid element: they do not cut the bolt")
            found[f"pretension {number}"] = faces
        found |= self._pairs(mesh, friction)
        surfaces = {name: faces for name, faces in found.items() if isinstance(faces, Surface)}
        nodes = {name: at for name, at in found.items() if not isinstance(at, Surface)}
        mesh = replace(mesh, surfaces={**mesh.surfaces, **surfaces}, node_sets={**mesh.node_sets, **nodes})
        return with_surfaces(mesh, nodes)

    def _pairs(self, mesh: Mesh, friction: Mapping[int, Friction]) -> dict[str, Surface | IntArray]:
        contacts = _by(_REAL, (row for row in self.rows if self.kinds.get(row[_TYPE]) in _CONTACTS))
        targets = _by(_REAL, (row for row in self.rows if self.kinds.get(row[_TYPE]) == _TARGET))
        lone = sum(len(part) for real, part in targets.items() if real not in contacts)
        if lone:
            what = f"{lone} elements of type TARGE170 have no contact element with their real constants: left out"
            self.deck.extra.append(f"{self.deck.source}: {what}")
        constants = real_constants(self.archive, self.text, self.deck.source) if contacts else {}
        found: dict[str, Surface | IntArray] = {}
        kept: list[int] = []
        for real, part in contacts.items():
            where = Place(self.deck.source, f"{self._name(part)} of real constants {real}")
            if real not in targets:
                what = "has no TARGE170 with the same real constants, and touches nothing: left out"
                self.deck.own_warnings.append(str(Fault(where, what)))
                continue
            if self._refused(where, part, targets[real]):
                continue
            sides = {}
            for side, rows in (("contact", part), ("target", targets[real])):
                faces = self._faces(mesh, rows)
                if faces is None:
                    what = f"has {side} element {rows[0][_NUMBER]} on no outer face of a solid element"
                    self.deck.couple(where, f"{what}, as rigid targets and shells have")
                    break
                sides[f"{side} {real}"] = faces
            if len(sides) < 2 or self._turned_over(where, sides, found):
                continue
            self._keep(where, part, [*sides], friction)
            found |= sides
            kept.append(real)
            if constants.get(real, [])[_CNOF : _CNOF + 1] not in ([], [0.0]):
                what = f"offsets its surface by CNOF = {constants[real][_CNOF]:g}, which is left out: give it as gap"
                self.deck.own_warnings.append(str(Fault(where, what)))
            values = dict(enumerate(constants.get(real, [])))
            for at, (name, idle) in _LIMITS.items():
                if values.get(at, 0.0) not in (0.0, idle):
                    what = f"changes friction by {name} = {values[at]:g}, which is left out: MU alone is kept"
                    self.deck.own_warnings.append(str(Fault(where, what)))
        if kept:
            self._tell(f"{self._name(contacts[kept[0]])} of real constants", kept, APART)
        return found

    def _name(self, rows: Sequence[Sequence[int]]) -> str:
        return f"CONTA{self.kinds[rows[0][_TYPE]]}"

    def _refused(self, where: Place, part: Sequence[Sequence[int]], targets: Sequence[Sequence[int]]) -> bool:
        """Whether the contact glues surfaces, or ties one to a node."""
        options = self.options.get(part[0][_TYPE], {})
        behaviour = options.get(12, 0)
        if behaviour in _GLUED:
            self.deck.couple(where, f"glues surfaces together: KEYOPT(12) = {behaviour}, {_GLUED[behaviour]}")
            return True
        if all(len(row) == _HEAD + 1 for row in targets):
            self.deck.couple(where, f"ties a surface to the pilot node {targets[0][_HEAD]}")
            return True
        if behaviour in _HELD:
            what = f"never separates (KEYOPT(12) = {behaviour}, {_HELD[behaviour]}); contacts here may open"
            self.deck.own_warnings.append(str(Fault(where, what)))
        if options.get(9, 0) == 1:
            what = 'ignores gaps and overlaps of the mesh (KEYOPT(9) = 1), as touching = true (gap="touching") does'
            self.deck.extra.append(str(Fault(where, what)))
        return False

    def _faces(self, mesh: Mesh, rows: Sequence[Sequence[int]]) -> Surface | IntArray | None:
        """Outer faces of solids that elements lie on, or their single nodes; None where there are none."""
        corners = {count: [c for row in rows if len(c := _corners(row[_HEAD:])) == count] for count in (1, 3, 4)}
        where = f"a contact or target element of real constants {rows[0][_REAL]}"
        at = {count: node_indices(mesh.labels, np.array(part), where) for count, part in corners.items() if part}
        if 1 in at:
            return np.unique(at[1])
        surface = matching_surface(mesh, list(at.values()))
        return surface if surface.n_faces else None

    def _turned_over(
        self, where: Place, sides: Mapping[str, Surface | IntArray], found: Mapping[str, Surface | IntArray]
    ) -> bool:
        """Whether a pair is another one with its sides exchanged, as symmetric contact has."""
        own = [_nodes(faces) for faces in sides.values()]
        for name, pair in self.deck.contact_pairs.items():
            if own == [_nodes(found[other]) for other in (pair.independent, pair.dependent)]:
                what = f"is the pair {name} with its sides exchanged (symmetric contact), which is kept once"
                self.deck.extra.append(str(Fault(where, what)))
                return True
        return False

    def _keep(
        self, where: Place, part: Sequence[Sequence[int]], names: Sequence[str], friction: Mapping[int, Friction]
    ) -> None:
        material = part[0][_MATERIAL]
        rough = self.options.get(part[0][_TYPE], {}).get(12, 0) == _ROUGH
        if rough:
            what = "gives no coefficient of friction (KEYOPT(12) = 1, rough): the contact pair has none"
            self.deck.own_warnings.append(str(Fault(where, what)))
        mu, card = (None, "") if rough else friction.get(material, (None, ""))
        self.deck.contact_pairs["/".join(names)] = SurfacePair(
            dependent=names[0], independent=names[1], mu=mu, interaction=f"material {material}", card=card
        )


def _by(column: int, rows: Iterator[list[int]]) -> dict[int, list[list[int]]]:
    """Rows by the number in one of their columns, ascending."""
    found: dict[int, list[list[int]]] = {}
    for row in rows:
        found.setdefault(row[column], []).append(row)
    return dict(sorted(found.items()))


def _corners(nodes: Sequence[int]) -> Sequence[int]:
    """Corners of a contact or target element; triangles may be quadrilaterals with their third node twice."""
    if len(nodes) in (1, 3, 6):
        return nodes[: min(3, len(nodes))]
    return [*dict.fromkeys(node for node in nodes[:4] if node)]


def _nodes(faces: Surface | IntArray) -> list[int]:
    return (faces.nodes if isinstance(faces, Surface) else faces).tolist()


@COMMANDS.reads("TBDATA TBDAT TBTEMP TBTEM")
def read_friction(deck: Deck, text: str) -> dict[int, Friction]:
    """Coefficient of friction by material, of MP or MPDATA with MU, or of TB,FRIC, which comes before these.

    None: the file has none that is one number. With it the command that gives it.
    """
    values: dict[int, list[float]] = {}
    tables: dict[int, list[float]] = {}
    open_table = 0
    for line, name, words in commands(text):
        with reading(Place(deck.source, f"line {line}", name)):
            if name == "MP" and words[0].upper() == "MU":
                numbers = [fortran_real(word) for word in words[2:] if word]
                values[whole_number(words[1])] = numbers if any(numbers[1:]) else numbers[:1]
            elif name == "MPDATA" and (rest := words[1:] if words[0][:1].isalpha() else words)[1].upper() == "MU":
                numbers = [fortran_real(word) for word in rest[4:] if word]
                values.setdefault(whole_number(rest[2]), []).extend(numbers)
            elif name == "TB":
                open_table = whole_number(words[1]) if words[0].upper().startswith("FRIC") else 0
                if open_table:
                    tables[open_table] = []
                    if (option := (words[4:5] or [""])[0].upper()) not in ("", "ISO", "1"):
                        what = f"gives friction by {option}, not by one coefficient: the contact pairs have none"
                        deck.add(Verdict.APPROXIMATED, f"TB, FRIC of material {open_table}", what, line)
                        open_table = 0
            elif name in ("TBDATA", "TBDAT") and open_table and words[0] in ("", "1"):
                tables[open_table] += [fortran_real(word) for word in words[1:2] if word]
    return {
        number: (_coefficient(deck, number, found), "TB,FRIC" if number in tables else "MU")
        for number, found in {**values, **tables}.items()
    }


def _coefficient(deck: Deck, material: int, values: Sequence[float]) -> float | None:
    if not values:
        return None
    if not 0.0 <= values[0] < np.inf:
        raise refused(Place(deck.source, f"material {material}", "MU"), found=f"{values[0]:g}", expected="0 or more")
    if len(set(values)) > 1:
        deck.add(Verdict.APPROXIMATED, f"MU of material {material}", _WARM, 0)
    return values[0]
