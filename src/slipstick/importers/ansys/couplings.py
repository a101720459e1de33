"""Constraint equations, coupled dofs, point masses and springs of an Ansys archive (.cdb).

CE and CP as CDWRITE or a person writes them. CDWRITE: ``CE,R5.0,DEFI,terms,number,constant`` and then
``CE,R5.0,NODE,node,label,factor,node,label,factor``; ``CP`` likewise with one label and a list of nodes. By hand:
``CE,number,constant,node,label,factor,...`` and ``CP,number,label,node,node,...``, where a number given again goes on.
MASS21 and COMBIN14 come with their real constants.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipstick.errors import Place
from slipstick.fem.equations import NodalEquation, Pair
from slipstick.fem.lumped import Lumped, axial_spring, point_mass, spring
from slipstick.importers.ansys.commands import COMMANDS, LABELS, commands
from slipstick.importers.deck import Deck
from slipstick.importers.findings import DAMAGED, Findings, Verdict, refused
from slipstick.importers.text_numbers import fortran_real, reading, whole_number
from slipstick.structure.constraints import Dependent

_CONSTANT = "has a constant that is not 0"


@dataclass(kw_only=True)
class _Set:
    """One equation, or one set of coupled dofs, as far as it was read."""

    line: int
    label: str = ""
    constant: float = 0.0
    announced: tuple[int, ...] = ()
    terms: list[tuple[int, str, float]] = field(default_factory=list)


@COMMANDS.reads("CE CP")
def read_equations(findings: Findings, text: str) -> list[NodalEquation]:
    """Equations between displacements and rotations, along the directions of the nodes.

    Raises
    ------
    InputError
        For a line that cannot be read, or an equation that has fewer terms than it announces.
    """
    sets: dict[tuple[str, str], _Set] = {}
    last: dict[str, _Set] = {}
    for line, name, words in commands(text):
        if name in ("CE", "CP"):
            with reading(Place(findings.source, f"line {line}", name)):
                _read(sets, last, line, name, words)
    equations: list[NodalEquation] = []
    for (name, _), entry in sets.items():
        equations += _equations(findings, name, entry)
    return equations


def _read(sets: dict[tuple[str, str], _Set], last: dict[str, _Set], line: int, name: str, words: list[str]) -> None:
    written = words[0][:1].upper() == "R" and words[1].upper() in ("DEFI", "NODE")
    if written and words[1].upper() == "NODE":
        if name not in last:
            raise ValueError("nodes stand before what they belong to")
        _add(last[name], name, words[2:])
        return
    if written:
        numbers = tuple(whole_number(word) for word in words[2:] if word.lstrip("-").isdigit())
        label = next((word.upper() for word in words[2:] if word[:1].isalpha()), "")
        constant = fortran_real(words[4]) if name == "CE" and len(words) > 4 and words[4] else 0.0
        last[name] = _Set(line=line, label=label, announced=numbers, constant=constant)
        sets[name, f"{numbers} {label} {line}"] = last[name]
        return
    key = words[0].upper()
    known = sets.get((name, key)) if key.isdigit() else (last.get(name) if key == "HIGH" else None)
    if known is None:
        known = sets[name, key if key.isdigit() else f"next {line}"] = _Set(line=line)
    last[name] = known
    if name == "CP":
        known.label = words[1].upper() or known.label
    else:
        known.constant += fortran_real(words[1]) if words[1] else 0.0
    _add(known, name, words[2:])


def _add(entry: _Set, name: str, words: list[str]) -> None:
    if name == "CP":
        entry.terms += [(whole_number(word), entry.label, 1.0) for word in words if word]
        return
    for node, label, factor in zip(words[::3], words[1::3], words[2::3], strict=False):
        if node:
            entry.terms.append((whole_number(node), label.upper(), fortran_real(factor)))


def _equations(findings: Findings, name: str, entry: _Set) -> list[NodalEquation]:
    where = Place(findings.source, f"line {entry.line}", name)
    count = len(entry.terms)
    if entry.announced and count != entry.announced[0] and (name == "CE" or count not in entry.announced):
        raise refused(where, f"announces {entry.announced[0]} terms, {len(entry.terms)} are there", remedy=DAMAGED)
    if name == "CP" and entry.label == "ALL":
        moving = [label for label, axis in LABELS.items() if axis < 3]
        nodes = [node for node, _, _ in entry.terms]
        return [e for label in moving for e in _coupled(nodes, LABELS[label], where)]
    labels = {label for _, label, _ in entry.terms}
    if entry.constant:
        findings.add(Verdict.COUPLING, name, _CONSTANT, entry.line)
        return []
    if labels.isdisjoint(LABELS):
        findings.add(Verdict.HARMLESS, name, "", entry.line)
        return []
    if not labels <= LABELS.keys():
        what = f"ties {', '.join(sorted(labels - LABELS.keys()))} to displacements"
        findings.add(Verdict.COUPLING, name, what, entry.line)
        return []
    terms = [(node, LABELS[label], factor) for node, label, factor in entry.terms]
    if name == "CE":
        return [NodalEquation(terms=tuple(terms), where=where, dependent=Dependent.ANY)]
    return _coupled([node for node, _, _ in terms], LABELS[entry.label], where)


def _coupled(nodes: list[int], axis: int, where: Place) -> list[NodalEquation]:
    """Equations of equal motion of nodes in one direction."""
    first, *others = dict.fromkeys(nodes)
    return [
        NodalEquation(terms=((other, axis, 1.0), (first, axis, -1.0)), where=where, dependent=Dependent.ANY)
        for other in others
    ]


LUMP_TYPES = {21: "MASS21", 14: "COMBIN14"}
_TYPE, _REAL, _NUMBER, _HEAD = 1, 2, 8, 10


_MOST = 1000
"""Real constants of a set, more than any element has."""


@COMMANDS.reads("R RMORE RMODIF")
def real_constants(archive: Any, text: str, source: str) -> dict[int, list[float]]:
    """Real constants by set: of the RLBLOCK, and of R, RMORE and RMODIF commands."""
    constants = {
        int(number): [float(value) for value in values]
        for number, values in zip(archive.rlblock_num, archive.rlblock, strict=False)
    }
    last = 0
    for line, name, words in commands(text):
        if name not in ("R", "RMORE", "RMODIF"):
            continue
        with reading(Place(source, f"line {line}", name)):
            values = [fortran_real(word) if word else 0.0 for word in words[name != "RMORE" :]]
            if name == "R" and words and words[0].isdigit():
                last = whole_number(words[0])
                constants[last] = values
            elif name == "RMORE" and last:  # each line has six, those at its end may be left out
                known = constants[last]
                known += [0.0] * (-len(known) % 6 if known else 6) + values
            elif name == "RMODIF" and len(values) > 1 and words[0].isdigit():
                start = int(values[0]) - 1
                if not 0 <= start < _MOST:
                    raise ValueError(f"constant {values[0]:g} of a set")
                known = constants.setdefault(whole_number(words[0]), [])
                known += [0.0] * max(0, start + len(values) - 1 - len(known))
                known[start : start + len(values) - 1] = values[1:]
    return constants


class Lumps:
    """Point masses and springs of the elements of these types.

    Parameters
    ----------
    deck
        Takes what cannot be applied, and knows positions and own directions of nodes.
    archive, text, rows
        The archive as read, its text, and the rows of its elements.
    """

    def __init__(self, deck: Deck, archive: Any, text: str, rows: Sequence[list[int]]) -> None:
        self.findings, self.axes = deck, deck.axes
        self.places = deck.nodes
        self.options: dict[int, dict[int, int]] = {
            int(number): {int(key): int(value) for key, value, *_ in options}
            for number, options in archive.key_option.items()
        }
        self.kinds = {int(number): int(kind) for number, kind in np.asarray(archive.ekey)}
        self.rows = [row for row in rows if self.kinds.get(row[_TYPE]) in LUMP_TYPES]
        self.reals = real_constants(archive, text, deck.source) if self.rows else {}

    def __iter__(self) -> Iterator[Lumped]:
        """The masses and springs; InputError for elements without real constants."""
        for row in self.rows:
            kind, options = self.kinds[row[_TYPE]], self.options.get(row[_TYPE], {})
            where = Place(self.findings.source, f"{LUMP_TYPES[kind]} element {row[_NUMBER]}")
            nodes = [node for node in row[_HEAD:] if node > 0]
            reals = self.reals.get(row[_REAL])
            missing = [node for node in nodes if node not in self.places]
            if reals is None or missing or not nodes:
                what = f"real constants {row[_REAL]}" if reals is None else f"node {[*missing, '?'][0]}"
                raise refused(where, f"needs {what}, which the file does not have")
            yield from (
                self._mass(where, nodes[0], reals, options)
                if kind == 21
                else self._spring(where, nodes, reals, options)
            )

    def turning(self) -> set[int]:
        """Labels of nodes whose rotations a mass gives inertia."""
        return {
            row[_HEAD]
            for row in self.rows
            if self.kinds[row[_TYPE]] == 21 and self.options.get(row[_TYPE], {}).get(3, 0) == 0
        }

    def _refused(self, where: Place, what: str) -> None:
        self.findings.couple(where, what)

    def _mass(self, where: Place, node: int, reals: Sequence[float], options: Mapping[int, int]) -> Iterator[Lumped]:
        form = options.get(3, 0)
        turned = options.get(2, 0) and node in self.axes
        if options.get(1, 0) or form not in (0, 2) or turned:
            self._refused(where, "has options (volumes, two dimensions, own directions) which are not read")
            return
        if form == 2:
            yield from point_mass(node, reals[0])
            return
        x, y, z, xx, yy, zz = [*reals, *[0.0] * 6][:6]
        if x == y == z:
            yield from point_mass(node, x, np.diag([xx, yy, zz]) if any((xx, yy, zz)) else None)
            return
        yield Lumped(matrix="M", pairs=tuple((node, axis) for axis in range(3)), values=np.diag([x, y, z]))
        yield Lumped(matrix="M", pairs=tuple((node, 3 + axis) for axis in range(3)), values=np.diag([xx, yy, zz]))

    def _spring(
        self, where: Place, nodes: Sequence[int], reals: Sequence[float], options: Mapping[int, int]
    ) -> Iterator[Lumped]:
        stiffness, *others = [*reals, 0.0]
        if any(others[:2]):
            what = "damping is not read; give the structure's loss_factor or damping_ratio"
            self.findings.add(Verdict.APPROXIMATED, str(where[-1]), what, 0)
        axis = options.get(2, 0)
        if options.get(1, 0) or axis not in range(7) or (axis == 0 and options.get(3, 0)) or len(nodes) != 2:
            self._refused(where, "is not linear, twists, or is of two dimensions, which is not read")
            return
        first, second = nodes
        if axis == 0:
            along = np.asarray(self.places[second]) - np.asarray(self.places[first])
            yield axial_spring(stiffness, (first, second), along, where)
            return
        if any(node in self.axes for node in nodes):
            self._refused(where, "acts along directions of its nodes that are rotated")
            return
        pairs: tuple[Pair, Pair] = (first, axis - 1), (second, axis - 1)
        yield spring(stiffness, *pairs)
