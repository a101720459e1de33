"""Nastran OUTPUT4 matrices, text and binary, dense and sparse (both string headers), single and double precision.

The layout is the one documented with the OUTPUT4 module: a header (columns, rows, form, type, name), then for each
column ``column, first row, words`` followed by values; first row 0 marks strings, each with its own header; column
``columns + 1`` ends the matrix. Text counts values in a dense column, words of 4 bytes in a string.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.importers.findings import DAMAGED, refused
from slipstick.importers.text_numbers import read_bytes, require_plausible
from slipstick.structure.checks import DAMPING_ELSEWHERE
from slipstick.typing import Array, Sparse

_STRING = 65536


@dataclass(kw_only=True)
class _Matrix:
    """Runs of values down a column, collected while a matrix is read."""

    name: str
    rows: int
    columns: int
    path: Path
    runs: list[tuple[int, int, Array]] = field(default_factory=list)

    def add(self, column: int, row: int, values: Array) -> None:
        if not (1 <= column <= self.columns and row >= 1 and row + len(values) - 1 <= self.rows):
            raise refused(
                self.path.name,
                f"matrix {self.name} has an entry at row {row}, column {column}, outside its {self.rows} x "
                f"{self.columns}",
                remedy=DAMAGED,
            )
        self.runs.append((column, row, values))

    def build(self) -> Sparse:
        from scipy.sparse import coo_array

        lengths = np.array([len(values) for _, _, values in self.runs], dtype=np.int64)
        starts = np.repeat(np.cumsum(lengths) - lengths, lengths)
        first = np.array([row for _, row, _ in self.runs], dtype=np.int64)
        columns = np.repeat(np.array([column for column, _, _ in self.runs], dtype=np.int64) - 1, lengths)
        rows = np.repeat(first - 1, lengths) + np.arange(lengths.sum()) - starts
        values = np.concatenate([values for _, _, values in self.runs]) if self.runs else np.empty(0)
        return coo_array((values, (rows, columns)), shape=(self.rows, self.columns))


def read_op4(path: Path) -> dict[str, Sparse]:
    """Every matrix of the file by name, as stored, scipy sparse (rows, columns).

    Raises
    ------
    InputError
        For complex matrices and for damaged or truncated files.
    """
    data = read_bytes(path)
    matrices = {}
    try:
        for matrix in _binary(data, path) if _is_binary(data) else _text(data, path):
            matrices[matrix.name] = matrix.build()
    except (struct.error, ValueError, IndexError, RuntimeError) as error:  # RuntimeError: lines ended in a generator
        if isinstance(error, InputError):
            raise
        raise refused(path.name, "not a readable op4 file", remedy=DAMAGED) from None
    if not matrices:
        raise refused(path.name, "holds no matrix", expected="an op4 file from OUTPUT4")
    return matrices


def _is_binary(data: bytes) -> bool:
    return b"\0" in data[:64]


def _start(name: str, columns: int, rows: int, kind: int, path: Path) -> _Matrix:
    if kind not in (1, 2):
        described = "complex" if kind in (3, 4) else f"of unknown type {kind}"
        remedy = f": {DAMPING_ELSEWHERE}" if kind in (3, 4) else ""
        raise refused(path.name, f"matrix {name} is {described}", expected=f"a real one{remedy}")
    require_plausible(abs(rows), 0, path)
    require_plausible(columns, 0, path)
    return _Matrix(name=name, rows=abs(rows), columns=columns, path=path)


# text


def _text(data: bytes, path: Path) -> Iterator[_Matrix]:
    lines = iter(data.decode("ascii").splitlines())
    for line in lines:
        if not line.strip():
            continue
        width = 16 if len(line[:32].split()) == 2 else 8
        columns, rows, _, kind = (int(line[width * i : width * (i + 1)]) for i in range(4))
        rest = line[4 * width :]
        matrix = _start(rest[:8].strip(), columns, rows, kind, path)
        match = re.search(r"(\d+)[EDed](\d+)\.", rest[8:])
        per_line, field_width = (int(match.group(1)), int(match.group(2))) if match else (5, 16)
        _text_columns(lines, matrix, (per_line, field_width), double=kind == 2)
        yield matrix


def _text_columns(lines: Iterator[str], matrix: _Matrix, layout: tuple[int, int], *, double: bool) -> None:
    while True:
        column, row, words = (int(word) for word in next(lines).split())
        if column > matrix.columns:
            next(lines, None)
            return
        if row > 0:
            matrix.add(column, row, _text_values(lines, words, layout))
            continue
        while words > 0:
            header = [int(word) for word in next(lines).split()]
            if len(header) == 2:
                length, row, used = header[0] - 1, header[1], header[0] + 1
            else:
                length = header[0] // _STRING - 1
                row, used = header[0] - _STRING * (length + 1), length + 1
            if length <= 0:
                raise ValueError("empty string")
            matrix.add(column, row, _text_values(lines, length // (2 if double else 1), layout))
            words -= used


def _text_values(lines: Iterator[str], count: int, layout: tuple[int, int]) -> Array:
    per_line, width = layout
    values: list[float] = []
    while len(values) < count:
        line = next(lines).rstrip("\r\n").replace("D", "E")
        if "." not in line:
            raise ValueError("a value was expected")
        here = min(per_line, count - len(values))
        values += [float(line[width * i : width * (i + 1)]) for i in range(here)]
    return np.array(values)


# binary


def _binary(data: bytes, path: Path) -> Iterator[_Matrix]:
    order, integer = _byte_order(data)
    position = 0
    while position < len(data):
        header, position = _record(data, position, order)
        columns, rows, _, kind = struct.unpack_from(f"{order}4{integer}", header)
        size = struct.calcsize(integer)
        name = header[4 * size :].decode("ascii").split()[0]
        matrix = _start(name, columns, rows, kind, path)
        position = _binary_columns(data, position, matrix, (order, integer), kind=kind, big=rows < 0)
        yield matrix


def _byte_order(data: bytes) -> tuple[str, str]:
    for order in "<>":
        marker = struct.unpack_from(f"{order}i", data)[0]
        if marker in (24, 48):
            return order, "i" if marker == 24 else "q"
    raise ValueError("first record")


def _record(data: bytes, position: int, order: str) -> tuple[bytes, int]:
    (length,) = struct.unpack_from(f"{order}i", data, position)
    end = position + 4 + length
    if length < 0 or end + 4 > len(data) or struct.unpack_from(f"{order}i", data, end)[0] != length:
        raise ValueError("record markers")
    return data[position + 4 : end], end + 4


def _binary_columns(
    data: bytes, position: int, matrix: _Matrix, layout: tuple[str, str], *, kind: int, big: bool
) -> int:
    order, integer = layout
    size = struct.calcsize(integer)
    real = "d" if kind == 2 or integer == "q" else "f"
    words_each = struct.calcsize(real) // size
    while True:
        record, position = _record(data, position, order)
        column, row, words = struct.unpack_from(f"{order}3{integer}", record)
        if column > matrix.columns:
            return position
        at, end = 3 * size, (3 + words) * size
        if row > 0:
            count = words // words_each
            matrix.add(column, row, np.frombuffer(record, f"{order}{_CODE[real]}", count, at).astype(float))
            continue
        while at < end:
            if big:
                length, row = struct.unpack_from(f"{order}2{integer}", record, at)
                length, at = length - 1, at + 2 * size
            else:
                (packed,) = struct.unpack_from(f"{order}{integer}", record, at)
                length = packed // _STRING - 1
                row, at = packed - _STRING * (length + 1), at + size
            if length <= 0:
                raise ValueError("empty string")
            count = length // words_each
            matrix.add(column, row, np.frombuffer(record, f"{order}{_CODE[real]}", count, at).astype(float))
            at += length * size


_CODE = {"d": "f8", "f": "f4"}
