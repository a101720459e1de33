"""Nastran bulk data, as much as a matrix needs: GRID and SPOINT, constraints, DMIG matrices (punch files)."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.importers.findings import Findings, Verdict
from slipstick.importers.nastran.cards import cards, classify_card
from slipstick.importers.raw_model import Nodes
from slipstick.importers.text_numbers import fortran_real, read_bytes, whole_number
from slipstick.typing import IntArray, Sparse


@dataclass(frozen=True, kw_only=True)
class BulkData:
    """Points, constraints by set number (0: permanent, on the GRID itself), analysis set, and matrices by name.

    ``combined`` holds the numbers of sets that an SPCADD joins; ``findings`` tells of the cards that are not read.
    """

    nodes: Nodes
    scalar_points: IntArray
    held: dict[int, set[tuple[int, int]]]
    combined: frozenset[int]
    analysis_set: set[tuple[int, int]]
    matrices: dict[str, DirectMatrix]
    findings: Findings


@dataclass(kw_only=True)
class DirectMatrix:
    """A DMIG matrix: entries by (node, direction), one half when ``symmetric``."""

    name: str
    symmetric: bool
    rows: list[tuple[int, int]] = field(default_factory=list)
    columns: list[tuple[int, int]] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


def read_bulk(path: Path) -> BulkData:
    """Points, constraints and DMIG matrices of a bulk data or punch file.

    Raises
    ------
    InputError
        For points in a coordinate system of their own, damaged cards, complex matrices, included files, superelements.
    """
    reader = _Reader(path)
    for number, name, fields in cards(read_bytes(path).decode("latin-1"), _READ):
        if name not in _READ:
            classify_card(reader.findings, name, number)
            continue
        try:
            reader.line = number
            getattr(reader, f"on_{name.lower()}")(fields)
        except InputError:
            raise
        except (ValueError, IndexError) as error:
            raise InputError(f"{path.name}, line {number}: {name} cannot be read ({error})") from None
    reader.findings.refuse_incomplete()
    return reader.finish()


_READ = {"GRID", "GRDSET", "SPOINT", "SPC", "SPC1", "SPCADD", "ASET", "ASET1", "DMIG"}


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.grids: dict[int, tuple[float, float, float]] = {}
        self.points: set[int] = set()
        self.held: dict[int, set[tuple[int, int]]] = {}
        self.analysis: set[tuple[int, int]] = set()
        self.matrices: dict[str, DirectMatrix] = {}
        self.sums: dict[int, list[int]] = {}
        self.free_grids: list[int] = []
        self.held_by_default = ""
        self.findings = Findings(source=path.name)
        self.line = 0

    def on_grid(self, fields: list[str]) -> None:
        fields = fields + [""] * 4  # a card may end after the position
        node = whole_number(fields[0])
        self._basic(f"GRID {node}", fields)
        x, y, z = (fortran_real(text) if text else 0.0 for text in fields[2:5])
        if self.grids.setdefault(node, (x, y, z)) != (x, y, z):
            raise InputError(f"{self.path.name}, line {self.line}: GRID {node} is given again at another place")
        self._hold(node, fields[6])
        if not fields[6]:
            self.free_grids.append(node)

    def on_grdset(self, fields: list[str]) -> None:
        fields = fields + [""] * 4
        self._basic("GRDSET", fields)
        self.held_by_default = fields[6]
        _pairs(0, fields[6])  # ValueError here, with the line

    def _basic(self, who: str, fields: list[str]) -> None:
        for text, what in ((fields[1], "position"), (fields[5], "displacement")):
            if text not in ("", "0"):
                raise InputError(
                    f"{self.path.name}: {who} has its {what} in coordinate system {text}; only the basic system "
                    "is read: transform the model to it and export again"
                )

    def on_spoint(self, fields: list[str]) -> None:
        self.points |= set(_labels(fields))

    def on_spc(self, fields: list[str]) -> None:
        fields = fields + [""] * 4
        for node, directions, value in (fields[1:4], fields[4:7]):
            if node:
                self._constrain(whole_number(fields[0]), whole_number(node), directions)
            if value and fortran_real(value):
                self.findings.add(Verdict.COUPLING, "SPC", "prescribes a displacement that is not 0", self.line)

    def on_spcadd(self, fields: list[str]) -> None:
        self.sums[whole_number(fields[0])] = [whole_number(field) for field in fields[1:] if field]

    def on_spc1(self, fields: list[str]) -> None:
        for node in _labels(fields[2:]):
            self._constrain(whole_number(fields[0]), node, fields[1])

    def on_aset(self, fields: list[str]) -> None:
        for node, directions in zip(fields[::2], fields[1::2], strict=False):
            if node:
                self.analysis |= _pairs(whole_number(node), directions)

    def on_aset1(self, fields: list[str]) -> None:
        for node in _labels(fields[1:]):
            self.analysis |= _pairs(node, fields[0])

    def on_dmig(self, fields: list[str]) -> None:
        name = fields[0].upper()
        if fields[1] in ("", "0"):
            form, kind = whole_number(fields[2]), whole_number(fields[3] or "2")
            if kind in (3, 4) or form not in (1, 6):
                found = "complex" if kind in (3, 4) else f"of form {form}"
                raise InputError(f"{self.path.name}: DMIG {name} is {found}; expected a real square or symmetric one")
            self.matrices[name] = DirectMatrix(name=name, symmetric=form == 6)
            return
        if name not in self.matrices:
            raise ValueError(f"matrix {name} has a column before its header")
        matrix, column = self.matrices[name], _pair(fields[1], fields[2])
        for at in range(4, len(fields) - 2, 4):
            if fields[at]:
                matrix.rows.append(_pair(fields[at], fields[at + 1]))
                matrix.columns.append(column)
                matrix.values.append(fortran_real(fields[at + 2]))

    def _hold(self, node: int, directions: str) -> None:
        """Permanent supports of a GRID: none where nothing is said."""
        if directions not in ("", "0"):
            self._constrain(0, node, directions)

    def _constrain(self, number: int, node: int, directions: str) -> None:
        """Supports of a set; direction 0 or nothing is a scalar point."""
        self.held.setdefault(number, set()).update(_pairs(node, directions))

    def finish(self) -> BulkData:
        for node in self.free_grids:
            self._hold(node, self.held_by_default)
        for number, parts in self.sums.items():
            self.held[number] = set().union(*(self.held.get(part, set()) for part in parts))
        ids = np.array(sorted(self.grids), dtype=np.int64)
        coordinates = np.array([self.grids[node] for node in ids.tolist()], dtype=float).reshape(-1, 3)
        return BulkData(
            nodes=Nodes(ids=ids, coordinates=coordinates),
            scalar_points=np.array(sorted(self.points), dtype=np.int64),
            held=self.held,
            combined=frozenset(part for parts in self.sums.values() for part in parts),
            analysis_set=self.analysis,
            matrices=self.matrices,
            findings=self.findings,
        )


def _labels(fields: list[str]) -> list[int]:
    """Numbers, and ranges "3 THRU 7".

    >>> _labels(["1", "4", "THRU", "6", ""])
    [1, 4, 5, 6]
    """
    words = [word for word in fields if word]
    labels: list[int] = []
    for i, word in enumerate(words):
        if word.upper() == "THRU":
            first, last = whole_number(words[i - 1]), whole_number(words[i + 1])
            if last - first > 10_000_000:
                raise ValueError(f"the range {first} THRU {last} is too long")
            labels += range(first + 1, last)
        else:
            labels.append(whole_number(word))
    return labels


def _pairs(node: int, directions: str) -> set[tuple[int, int]]:
    return {(node, (whole_number(digit) - 1) % 7) for digit in directions or "0"}


def _pair(node: str, direction: str) -> tuple[int, int]:
    component = whole_number(direction or "0")
    if not 0 <= component <= 6:
        raise ValueError(f"direction {component}; expected 0 to 6")
    return whole_number(node), (component - 1) % 7


def sparse(matrix: DirectMatrix, keys: list[tuple[int, int]]) -> Sparse:
    """Rows and columns in the order of ``keys``."""
    from scipy.sparse import coo_array

    place = {key: i for i, key in enumerate(keys)}
    rows = [place[key] for key in matrix.rows]
    columns = [place[key] for key in matrix.columns]
    return coo_array((np.array(matrix.values, dtype=float), (rows, columns)), shape=(len(keys),) * 2)
