"""Constraint equations and coupled dofs of an Ansys archive (.cdb): CE and CP, as CDWRITE or a person writes them.

CDWRITE: ``CE,R5.0,DEFI,terms,number,constant`` and then ``CE,R5.0,NODE,node,label,factor,node,label,factor``; ``CP``
likewise with one label and a list of nodes. By hand: ``CE,number,constant,node,label,factor,...`` and
``CP,number,label,node,node,...``, where a number given again goes on.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from slipstick.errors import Place
from slipstick.fem.equations import NodalEquation
from slipstick.importers.ansys.commands import COMMANDS, LABELS, commands
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
    """All move alike in one direction."""
    first, *others = dict.fromkeys(nodes)
    return [
        NodalEquation(terms=((other, axis, 1.0), (first, axis, -1.0)), where=where, dependent=Dependent.ANY)
        for other in others
    ]
