"""Parts, instances and the assembly of an input file, made flat: every label and every name once.

An instance is a copy of its part, moved. Labels of an instance stay unless another one has them: then a round number is
added to all of them. Names of a part stay where they are the only ones of their kind in the deck; else they are called
INSTANCE.NAME, as the assembly calls them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from slipstick.importers.abaqus.keywords import Block, Placement
from slipstick.importers.findings import Findings, refused
from slipstick.importers.text_numbers import fortran_real, whole_number
from slipstick.typing import Array

_INSTANCE = re.compile(r"^\s*\*\s*INSTANCE\b", re.IGNORECASE | re.MULTILINE)

_LARGEST = 50_000_000
"""Data lines of all instances together."""

_ALL = slice(None)
_FIRST = slice(0, 1)
_PAIR = slice(0, 2)

_PLACES: dict[str, slice] = {
    **dict.fromkeys(("ELEMENT", "NSET", "ELSET"), _ALL),
    **dict.fromkeys(("NODE", "SURFACE", "BOUNDARY", "DISTRIBUTINGCOUPLING", "INITIALCONDITIONS"), _FIRST),
    **dict.fromkeys(("CLOAD", "DLOAD", "DSLOAD", "TEMPERATURE", "RETAINEDNODALDOFS"), _FIRST),
    **dict.fromkeys(("TIE", "CONTACTPAIR", "CLEARANCE"), _PAIR),
    "MPC": slice(1, None),
    "EQUATION": slice(0, None, 3),
}
"""Words of a data line that are labels or names."""

_NAMED = ("NSET", "ELSET", "SURFACE", "REFNODE", "ROTNODE", "ORIENTATION", "NODE")
"""Parameters that are labels or names."""


def flat(text: str, blocks: Iterable[Block], findings: Findings) -> Iterator[Block]:
    """The blocks of a deck, those of parts once for each instance.

    Raises
    ------
    InputError
        For instances of parts that are not there, motions that cannot be read, and more lines than fit.
    """
    return _Assembly([*blocks], findings).flat() if _INSTANCE.search(text) else iter(blocks)


@dataclass(kw_only=True)
class _Scope:
    """An instance, or the assembly (without name): what it adds to labels, how it calls its names."""

    name: str = ""
    line: int = 0
    blocks: Sequence[Block] = ()
    placement: Placement | None = None
    offset: int = 0
    names: dict[str, str] = field(default_factory=dict)


class _Assembly:
    def __init__(self, blocks: list[Block], findings: Findings) -> None:
        self.findings = findings
        self.sequence: list[Block | _Scope] = []
        self.scopes: dict[str, _Scope] = {}
        self.assembly = _Scope()
        self._sort(blocks)
        self._number()
        self._name()

    def _sort(self, blocks: list[Block]) -> None:
        """Parts by name, and the rest in its order."""
        parts: dict[str, list[Block]] = {}
        inside: list[Block] | None = None
        instance: _Scope | None = None
        own: list[Block] = []
        count = 0
        for block in blocks:
            if block.keyword == "PART":
                inside = parts.setdefault(block.parameters.get("NAME", ""), [])
                self.sequence.append(block)
            elif block.keyword == "ENDPART":
                inside = None
                self.sequence.append(block)
            elif inside is not None:
                inside.append(block)
            elif block.keyword == "INSTANCE":
                instance = self._instance(block, parts)
                self.sequence += [block, instance]
                count += sum(1 + len(part.rows) for part in instance.blocks)
                if count > _LARGEST:
                    where = self.findings.place(block.line, block.shown)
                    raise refused(where, f"makes more than {_LARGEST} lines of all instances together")
            elif block.keyword == "ENDINSTANCE":
                instance = None
                self.sequence.append(block)
            elif instance is not None:
                instance.blocks = [*instance.blocks, block]
            else:
                own.append(block)
                self.sequence.append(block)
        self.assembly.blocks = own

    def _instance(self, block: Block, parts: Mapping[str, Sequence[Block]]) -> _Scope:
        where = self.findings.place(block.line, block.shown)
        name, part = (block.parameters.get(key, "") for key in ("NAME", "PART"))
        if part not in parts:
            raise refused(where, f"names the part {part or '(none)'}, which the file does not have before it")
        if not name or name in self.scopes:
            raise refused(where, "is given twice" if name else "lacks NAME=", expected="a name of its own")
        try:
            placement = _placement([[fortran_real(word) if word else 0.0 for word in row] for row in block.rows])
        except ValueError as error:
            raise refused(where, f"cannot be read ({error})") from None
        self.scopes[name] = _Scope(name=name, line=block.line, blocks=parts[part], placement=placement)
        return self.scopes[name]

    def _number(self) -> None:
        """Labels that another instance has are raised, by a round number."""
        used: list[tuple[int, int]] = []
        for scope in (*self.scopes.values(), self.assembly):
            try:
                labels = [*_labels(scope.blocks)]
            except ValueError:
                continue  # the reader of the block says which word it is
            if not labels:
                continue
            low, high = min(labels), max(labels)
            if any(low <= last and first <= high for first, last in used):
                step = 10 ** len(str(high))
                scope.offset = (max(last for _, last in used) // step + 1) * step
                what = f"instance {scope.name}" if scope.name else "the assembly"
                self.findings.extra.append(
                    f"{self.findings.source}: labels of {what} are raised by {scope.offset}: other instances have them"
                )
            used.append((low + scope.offset, high + scope.offset))

    def _name(self) -> None:
        """Names of several instances, or of one and the assembly, tell whose they are."""
        owners: dict[str, int] = {}
        given = {id(scope): {*_names(scope.blocks)} for scope in (*self.scopes.values(), self.assembly)}
        for names in given.values():
            for name in names:
                owners[name] = owners.get(name, 0) + 1
        for scope in self.scopes.values():
            for name in given[id(scope)]:
                scope.names[name] = name if owners[name] == 1 else f"{scope.name}.{name}"

    def flat(self) -> Iterator[Block]:
        for entry in self.sequence:
            if isinstance(entry, Block):
                yield self._rewritten(entry, self.assembly)
            else:
                for block in entry.blocks:
                    yield self._rewritten(block, entry)

    def _rewritten(self, block: Block, scope: _Scope) -> Block:
        within = self.scopes.get(block.parameters.get("INSTANCE", ""), scope)
        parameters = {
            key: self._word(value, within if key != block.keyword else scope) if key in _NAMED else value
            for key, value in block.parameters.items()
        }
        if block.keyword in ("SURFACE", "ORIENTATION") and "NAME" in parameters:
            parameters["NAME"] = self._word(parameters["NAME"], scope)
        places = _PLACES.get(block.keyword)
        if places is not None and "GENERATE" in parameters:
            places = _PAIR
        rows = block.rows if places is None else [self._row(row, places, within) for row in block.rows]
        if block.keyword == "EQUATION":
            rows = [old if len(old) == 1 else new for old, new in zip(block.rows, rows, strict=True)]
        return replace(block, parameters=parameters, rows=rows, placement=scope.placement)

    def _row(self, row: list[str], places: slice, scope: _Scope) -> list[str]:
        row = [*row]
        row[places] = [self._word(word, scope) for word in row[places]]
        return row

    def _word(self, word: str, scope: _Scope) -> str:
        """A label or name as the flat deck has it."""
        if word.isdigit():
            return str(int(word) + scope.offset) if scope.offset and int(word) else word
        name = word.replace('"', "").upper()
        owner, dot, rest = name.partition(".")
        if scope is self.assembly and dot and owner in self.scopes:
            within = self.scopes[owner]
            return self._word(rest, within) if rest.isdigit() else within.names.get(rest, name)
        return scope.names.get(name, word)


def _labels(blocks: Sequence[Block]) -> Iterator[int]:
    """Labels of nodes and elements."""
    for block in blocks:
        if block.keyword == "NODE":
            yield from (whole_number(row[0]) for row in block.rows)
        elif block.keyword == "ELEMENT":
            yield from (whole_number(words[0]) for _, words in block.joined() if words)


def _names(blocks: Sequence[Block]) -> Iterator[str]:
    """Names that are given to sets, surfaces and systems."""
    giving = {"NODE": "NSET", "NSET": "NSET", "ELEMENT": "ELSET", "ELSET": "ELSET"}
    giving |= {"SURFACE": "NAME", "ORIENTATION": "NAME"}
    for block in blocks:
        if giving.get(block.keyword) in block.parameters:
            yield block.parameters[giving[block.keyword]].replace('"', "")


def _placement(rows: list[list[float]]) -> Placement | None:
    """A translation, then a rotation by degrees about an axis through two points; None where there is neither."""
    if not rows:
        return None
    shift = np.array([*rows[0], 0.0, 0.0, 0.0][:3])
    if len(rows) < 2:
        return Placement(turn=np.eye(3), shift=shift)
    if len(rows[1]) < 7:
        raise ValueError(f"{len(rows[1])} numbers of a rotation; expected two points and an angle")
    start, end, angle = np.array(rows[1][:3]), np.array(rows[1][3:6]), np.deg2rad(rows[1][6])
    turn = _turn(end - start, angle)
    return Placement(turn=turn, shift=turn @ (shift - start) + start)


def _turn(axis: Array, angle: float) -> Array:
    """Rotation matrix (3, 3) about an axis."""
    from scipy.spatial.transform import Rotation

    length = np.linalg.norm(axis)
    if not 0.0 < length < np.inf:
        raise ValueError("the two points of the axis are the same")
    return np.asarray(Rotation.from_rotvec(angle * axis / length).as_matrix())
