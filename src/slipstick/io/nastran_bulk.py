"""Nastran bulk data, as much as a matrix needs: cards, GRID and SPOINT, constraints, DMIG matrices (punch files)."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.io.raw_model import Nodes
from slipstick.io.text_numbers import fortran_real, read_bytes

IntArray = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class BulkData:
    """Points, constraints by set number (0: permanent, on the GRID itself), analysis set, and matrices by name."""

    nodes: Nodes
    scalar_points: IntArray
    held: dict[int, set[tuple[int, int]]]
    analysis_set: set[tuple[int, int]]
    matrices: dict[str, DirectMatrix]


@dataclass(kw_only=True)
class DirectMatrix:
    """A DMIG matrix: entries by (node, direction), one half when ``symmetric``."""

    name: str
    symmetric: bool
    rows: list[tuple[int, int]] = field(default_factory=list)
    columns: list[tuple[int, int]] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


def cards(text: str, wanted: Collection[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Line number, name and fields of each card with a wanted name; small, large and free fields, continuations joined.

    >>> list(cards("GRID,1,,0.,1.5,2.", {"GRID"}))
    [(1, 'GRID', ['1', '', '0.', '1.5', '2.', '', '', ''])]
    """
    name, start, fields = "", 0, []
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.split("$", 1)[0].expandtabs(8).rstrip()
        if not line:
            continue
        if line[0] in "+*, ":
            if name:
                fields += _fields(line, large=line[0] == "*")
            continue
        if name:
            yield start, name, fields
        head = line.split(",", 1)[0][:8].strip().upper()
        name = head.rstrip("*") if head.rstrip("*") in wanted else ""
        if name:
            start, fields = number, _fields(line, large=head.endswith("*"))
    if name:
        yield start, name, fields


def _fields(line: str, *, large: bool) -> list[str]:
    count, width = (4, 16) if large else (8, 8)
    if "," in line:
        parts = [part.strip() for part in line.split(",")][1 : count + 1]
    else:
        parts = [line[8 + width * i : 8 + width * (i + 1)].strip() for i in range(count)]
    return parts + [""] * (count - len(parts))


def read_bulk(path: Path) -> BulkData:
    """Points, constraints and DMIG matrices of a bulk data or punch file.

    Raises
    ------
    InputError
        For points in a coordinate system of their own, damaged cards, complex matrices.
    """
    reader = _Reader(path)
    wanted = {"GRID", "SPOINT", "SPC", "SPC1", "ASET", "ASET1", "DMIG"}
    for number, name, fields in cards(read_bytes(path).decode("latin-1"), wanted):
        try:
            getattr(reader, f"on_{name.lower()}")(fields)
        except InputError:
            raise
        except (ValueError, IndexError) as error:
            raise InputError(f"{path.name}, line {number}: {name} cannot be read ({error})") from None
    return reader.finish()


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.grids: dict[int, tuple[float, float, float]] = {}
        self.points: set[int] = set()
        self.held: dict[int, set[tuple[int, int]]] = {}
        self.analysis: set[tuple[int, int]] = set()
        self.matrices: dict[str, DirectMatrix] = {}

    def on_grid(self, fields: list[str]) -> None:
        node = int(fields[0])
        for text, what in ((fields[1], "position"), (fields[5], "displacement")):
            if text not in ("", "0"):
                raise InputError(
                    f"{self.path.name}: GRID {node} has its {what} in coordinate system {text}; only the basic system "
                    "is read: transform the model to it and export again"
                )
        x, y, z = (fortran_real(text) if text else 0.0 for text in fields[2:5])
        self.grids[node] = (x, y, z)
        self._hold(0, node, fields[6])

    def on_spoint(self, fields: list[str]) -> None:
        self.points |= set(_labels(fields))

    def on_spc(self, fields: list[str]) -> None:
        for node, directions in ((fields[1], fields[2]), (fields[4], fields[5])):
            if node:
                self._hold(int(fields[0]), int(node), directions)

    def on_spc1(self, fields: list[str]) -> None:
        for node in _labels(fields[2:]):
            self._hold(int(fields[0]), node, fields[1])

    def on_aset(self, fields: list[str]) -> None:
        for node, directions in zip(fields[::2], fields[1::2], strict=False):
            if node:
                self.analysis |= _pairs(int(node), directions)

    def on_aset1(self, fields: list[str]) -> None:
        for node in _labels(fields[1:]):
            self.analysis |= _pairs(node, fields[0])

    def on_dmig(self, fields: list[str]) -> None:
        name = fields[0].upper()
        if fields[1] in ("", "0"):
            form, kind = int(fields[2]), int(fields[3] or 2)
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

    def _hold(self, number: int, node: int, directions: str) -> None:
        if directions not in ("", "0"):
            self.held.setdefault(number, set()).update(_pairs(node, directions))

    def finish(self) -> BulkData:
        ids = np.array(sorted(self.grids), dtype=np.int64)
        coordinates = np.array([self.grids[node] for node in ids.tolist()], dtype=float).reshape(-1, 3)
        return BulkData(
            nodes=Nodes(ids=ids, coordinates=coordinates),
            scalar_points=np.array(sorted(self.points), dtype=np.int64),
            held=self.held,
            analysis_set=self.analysis,
            matrices=self.matrices,
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
            first, last = int(words[i - 1]), int(words[i + 1])
            if last - first > 10_000_000:
                raise ValueError(f"the range {first} THRU {last} is too long")
            labels += range(first + 1, last)
        else:
            labels.append(int(word))
    return labels


def _pairs(node: int, directions: str) -> set[tuple[int, int]]:
    return {(node, (int(digit) - 1) % 7) for digit in directions or "0"}


def _pair(node: str, direction: str) -> tuple[int, int]:
    component = int(direction or 0)
    if not 0 <= component <= 6:
        raise ValueError(f"direction {component}; expected 0 to 6")
    return int(node), (component - 1) % 7


def sparse(matrix: DirectMatrix, keys: list[tuple[int, int]]) -> Any:
    """Rows and columns in the order of ``keys``."""
    from scipy.sparse import coo_array

    place = {key: i for i, key in enumerate(keys)}
    rows = [place[key] for key in matrix.rows]
    columns = [place[key] for key in matrix.columns]
    return coo_array((np.array(matrix.values, dtype=float), (rows, columns)), shape=(len(keys),) * 2)
