"""Nastran models: OUTPUT4 matrices with the bulk data that says what their rows are, and DMIG punch files.

OUTPUT4 is text or binary, dense or sparse (both string headers), of single or double precision. The layout is the one
documented with the OUTPUT4 module: a header (columns, rows, form, type, name), then for each column ``column, first
row, words`` followed by values; first row 0 marks strings, each with its own header; column ``columns + 1`` ends the
matrix. Text counts values in a dense column, words of 4 bytes in a string.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.equations import NodalEquation
from slipstick.importers.deck import Deck, pairs_table
from slipstick.importers.dof_map import read_dof_map
from slipstick.importers.findings import DAMAGED, refused
from slipstick.importers.matrix_model import to_global
from slipstick.importers.nastran.bulk import BulkData, DirectMatrix, read_bulk, sparse
from slipstick.importers.nastran.couplings import Points, coupled_equations
from slipstick.importers.text_numbers import read_bytes, require_plausible
from slipstick.structure.checks import DAMPING_ELSEWHERE
from slipstick.typing import Array, Matrix, Sparse

if TYPE_CHECKING:
    from slipstick.importers.roles import ImportOptions, Roles

_INITIAL = {"K": "K", "M": "M", "C": "B"}
_WORD = {"K": "stiffness", "M": "mass", "C": "damping"}
_OF_A_SET = re.compile(r"[KMB]([AFGX])\1")
"""KAA, MXX, BGG...: other matrices of a superelement's file begin with the same letters (MUG1, MES1)."""


def choose(names: Collection[str], source: str, wanted: Mapping[str, str] | None = None) -> dict[str, str]:
    """Names of K, M, C among the matrices of a file: as given, else the only name that starts with K, M, B.

    Of several, the one that is of a set of degrees of freedom.

    >>> choose(["KAAX", "MAAX", "PAX"], "job.pch")
    {'K': 'KAAX', 'M': 'MAAX'}
    >>> choose(["KXX", "MXX", "BXX1", "MUG1", "MEE1"], "job.op4")
    {'K': 'KXX', 'M': 'MXX', 'C': 'BXX1'}

    Raises
    ------
    InputError
        If a given name is not there, or several names fit.
    """
    chosen, faults = {}, []
    for role, initial in _INITIAL.items():
        stated = (wanted or {}).get(role)
        fitting = (
            [stated] if stated else [name for name in names if name.upper().startswith(initial) and name[1:2] != "4"]
        )
        if len(fitting) > 1:
            fitting = [name for name in fitting if _OF_A_SET.match(name.upper())] or fitting
        if stated and stated not in names:
            faults.append(Fault(Place(source), f"holds no matrix {stated}", remedy=f"it holds {', '.join(names)}"))
        elif len(fitting) == 1:
            chosen[role] = fitting[0]
        elif fitting:
            what = f"several {_WORD[role]} matrices ({', '.join(fitting)})"
            faults.append(Fault(Place(source), what, remedy=f"say which, as {role}={fitting[0]}"))
    if faults:
        raise InputError(faults)
    return chosen


def read_matrices(roles: Roles, options: ImportOptions) -> Deck:
    """The reader of both formats."""
    files, names = list(roles.matrices.values()), options.names
    if roles.first.suffix.lower() == ".pch":
        return read_dmig(files, roles.bulk, names=names)
    return read_op4_model(files, roles.bulk, names=names, dof_map=roles.dof_map, constraints=options.constraints)


def read_op4_model(
    files: Collection[Path],
    bulk: Path | None,
    *,
    names: Mapping[str, str] | None = None,
    dof_map: Path | None = None,
    constraints: int | None = None,
) -> Deck:
    """Matrices from op4 files; rows named by a map file, or by bulk data when the size shows which set they are.

    ``constraints`` is the SPC set in force; not needed where the bulk data has one set only.

    Raises
    ------
    InputError
        If the size fits none of g-set, free set and analysis set.
    """
    source = ", ".join(path.name for path in files)
    stored: dict[str, Sparse] = {}
    for path in files:
        stored |= read_op4(path)
    stored = {name: matrix for name, matrix in stored.items() if matrix.nnz or name in (names or {}).values()}
    matrices = {role: stored[name] for role, name in choose(list(stored), source, names).items()}
    told_rows = dof_map is None and bulk is not None and "K" in matrices
    deck = Deck() if dof_map is None else read_dof_map(dof_map)
    deck.matrices = matrices
    data = read_bulk(bulk) if told_rows and bulk is not None else None
    if data is not None and bulk is not None:
        _tell_rows(deck, data, matrices["K"].shape[0], Place(source, "K"), bulk, constraints)
    _tell_others(deck, stored, source)
    return deck if data is None else to_global(deck, data.directions, source)


def _tell_others(deck: Deck, stored: Mapping[str, Any], source: str) -> None:
    """Other matrices of a file than stiffness, mass and damping: structural damping is warned of, the rest listed."""
    used = {id(matrix) for matrix in deck.matrices.values()}
    others = {name: matrix for name, matrix in stored.items() if id(matrix) not in used}
    structural = [name for name in others if name.upper().startswith("K4")]
    deck.own_warnings += [_structural(name, others[name], deck.matrices.get("K"), source) for name in structural]
    rest = [name for name in others if name not in structural]
    deck.extra += [f"{source}: without effect here: {', '.join(rest)}"] if rest else []


def _structural(name: str, damping: Any, stiffness: Any, source: str) -> str:
    """A sentence on structural damping, with the loss factor where there is one for all of the stiffness."""
    head = f"{source}: the structural damping {name} is not used"
    if stiffness is not None and stiffness.shape == damping.shape:
        k, d = stiffness.tocsr(), damping.tocsr()
        factor = float(k.multiply(d).sum() / k.multiply(k).sum())
        if abs(d - factor * k).max() <= 1e-6 * abs(d).max():
            return f"{head}: it is {factor:.6g} times the stiffness, so give loss_factor = {factor:.6g}"
    return f"{head}: it is no multiple of the stiffness; give the loss_factor that comes nearest"


def _tell_rows(deck: Deck, data: BulkData, size: int, what: Place, bulk: Path, constraints: int | None) -> None:
    """Rows of a matrix of this size, and where its nodes are."""
    pairs = [(node, component) for node in data.nodes for component in range(6)]
    every = sorted(pairs + [(point, 6) for point in data.scalar_points.tolist()])
    held = chosen_supports(data, constraints, bulk)
    free = [pair for pair in every if pair not in held]
    sets = {"superelement (EXTRN)": data.external, "g-set": every, "free set": free}
    sets["analysis set"] = sorted(data.analysis_set)
    equations = list(coupled_equations(data.coupled, points_of(data, bulk.name), data.mpc))
    dependent = {equation.pairs[0] for equation in equations}
    if dependent:
        sets["free set without dependent dofs"] = [pair for pair in free if pair not in dependent]
    fitting = next((pairs for pairs in sets.values() if len(pairs) == size), None)
    if fitting is None:
        sizes = ", ".join(f"the {name} {len(pairs)}" for name, pairs in sets.items() if pairs)
        raise refused(
            what,
            f"has {size} rows; by the bulk data {bulk.name} {sizes} (without multipoint constraints)",
            remedy="export KGG and MGG, or give a map file",
        )
    couplings, whole = data.findings.couplings, fitting is every
    if couplings and fitting not in (sets["analysis set"], data.external):
        raise InputError(
            [Fault(c.where, f"{c.what}, which {what} does not hold", remedy="export KAA and MAA") for c in couplings]
        )
    if whole:
        _refuse_turned(equations, data, held, bulk)
    deck.nodes, deck.held, deck.rows = dict(data.nodes), held, pairs_table(fitting)
    tell(deck, data, applied=whole)
    deck.equate(equations if whole else ())
    if fitting is data.external and data.external != sorted(data.external):
        deck.own_warnings.append(
            f"{bulk.name}: the rows of {what} are taken in the order of its EXTRN card, which does not ascend by point"
        )


def points_of(data: BulkData, source: str) -> Points:
    """Positions and directions of the points of bulk data."""
    return Points(places=data.nodes, directions=data.directions, source=source)


def _refuse_turned(
    equations: Collection[NodalEquation], data: BulkData, held: Collection[tuple[int, int]], bulk: Path
) -> None:
    """Equations are in global directions, to which rows of a point held in part along its own cannot be turned."""
    named = {node for equation in equations for node, _ in equation.pairs} & set(data.directions)
    partly = [n for n in sorted(named) if 0 < sum((n, axis) in held for axis in range(3)) < 3]
    if partly:
        raise refused(
            bulk.name,
            f"point {partly[0]} is held in part along its own directions and stands in MPC, RBE or RBAR cards",
            remedy="export KAA and MAA",
        )


def tell(deck: Deck, data: BulkData, *, applied: bool = False) -> None:
    """Notes and warnings of bulk data whose constraints are in the matrices, or ``applied`` to them."""
    findings = data.findings
    ties = () if applied else tuple(card.coupling(findings.source) for card in data.coupled if card.name != "MPCADD")
    deck.extra += findings.notes
    deck.own_warnings += (*findings.warnings, *(coupling.beside_matrices for coupling in (*findings.couplings, *ties)))


def chosen_supports(data: BulkData, constraints: int | None, bulk: Path) -> set[tuple[int, int]]:
    """Supports of the set in force, and those of the points themselves."""
    chosen = sorted(number for number in data.held if number and number not in data.combined)
    if constraints is None and len(chosen) > 1:
        raise refused(
            bulk.name, f"holds the constraint sets {chosen}", remedy="say which one is in force (constraints=...)"
        )
    if constraints is not None and constraints not in data.held:
        raise refused(bulk.name, f"has no constraint set {constraints}", remedy=f"it has {chosen or 'none'}")
    number = constraints if constraints is not None else (chosen[0] if chosen else 0)
    return data.held.get(0, set()) | data.held.get(number, set())


def read_dmig(files: Collection[Path], bulk: Path | None = None, *, names: Mapping[str, str] | None = None) -> Deck:
    """DMIG matrices of punch files; the map is in their entries, positions in GRID cards there or in ``bulk``.

    Raises
    ------
    InputError
        If no DMIG is there, or a symmetric one holds both halves of an entry with different values.
    """
    data = [read_bulk(path) for path in files]
    points = read_bulk(bulk) if bulk else next((part for part in data if part.nodes), data[0])
    stored: dict[str, DirectMatrix] = {}
    for part in data:
        stored |= part.matrices
    source = ", ".join(path.name for path in files)
    if not stored:
        raise refused(
            source, "holds no DMIG matrix", remedy="punch them with PARAM,EXTOUT,DMIGPCH or EXTSEOUT(DMIGPCH)"
        )
    chosen = choose(list(stored), source, names)
    keys = sorted({pair for matrix in stored.values() for pair in (*matrix.rows, *matrix.columns)})
    every = {name: sparse(matrix, keys) for name, matrix in stored.items()}
    matrices: dict[str, Matrix] = {role: every[name] for role, name in chosen.items()}
    deck = Deck(source=source, matrices=matrices, rows=pairs_table(keys), nodes=dict(points.nodes))
    tell(deck, points)
    _tell_others(deck, every, source)
    return to_global(deck, points.directions, source)


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
