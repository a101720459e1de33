"""Nastran bulk data, as much as a matrix needs: points, coordinate systems, constraints, sets, DMIG matrices.

A coordinate system (CORD1R, CORD2R, CORD1C, CORD2C, CORD1S, CORD2S) is rectangular, cylindrical (radius, angle in
degrees, height) or spherical (radius, angle from the axis, angle about it, in degrees). Its origin, a point on its z
axis and one in its x z plane are given in another system (CORD2) or by three grid points (CORD1); system 0 is the basic
one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slipstick.errors import Place
from slipstick.importers.findings import Findings, Verdict, refused
from slipstick.importers.nastran.cards import CARDS, MATRIX_CARDS, SETS, SYSTEMS, cards, classify_card
from slipstick.importers.nastran.couplings import COUPLED, CoupledCard, selected
from slipstick.importers.text_numbers import fortran_real, read_bytes, reading, whole_number
from slipstick.typing import Array, IntArray, Sparse

MOVED = "prescribes a displacement that is not 0"


@dataclass(frozen=True, kw_only=True)
class BulkData:
    """Points, constraints by set number (0: permanent, on the GRID itself), analysis set, and matrices by name.

    ``directions`` holds, as columns (3, 3), the directions of displacements at points where they are not the basic
    ones; ``external`` the rows of an external superelement in the order of its EXTRN card; ``coupled`` the cards that
    tie points together, ``mpc`` the MPC set that the case control asks for; ``combined`` the numbers of sets that an
    SPCADD joins; ``findings`` tells of the cards that are not read; ``frames`` are the coordinate systems; ``moved``
    the displacements other than 0 that SPC prescribes: line, set, point, directions, value.
    """

    nodes: dict[int, Array]
    scalar_points: IntArray
    held: dict[int, set[tuple[int, int]]]
    combined: frozenset[int]
    analysis_set: set[tuple[int, int]]
    external: list[tuple[int, int]]
    coupled: tuple[CoupledCard, ...]
    mpc: int | None
    directions: Mapping[int, Array]
    matrices: dict[str, DirectMatrix]
    findings: Findings
    frames: Frames
    moved: tuple[tuple[int, int, int, str, float], ...] = ()


def read_bulk(path: Path) -> BulkData:
    """Points, constraints and DMIG matrices of a bulk data or punch file.

    Raises
    ------
    InputError
        For damaged cards, coordinate systems without definition, complex matrices, included files, a superelement that
        is not alone in its file.
    """
    reader = _Reader(path)
    text = read_bytes(path).decode("latin-1")
    reader.mpc = selected(text, "MPC")
    readers = {name: entry.read for name, entry in (CARDS | MATRIX_CARDS).items() if entry.read is not None}
    for reader.line, reader.name, fields in cards(text, readers):
        if reader.name not in readers:
            classify_card(reader.findings, reader.name, reader.line)
            continue
        with reading(Place(path.name, f"line {reader.line}", reader.name)):
            readers[reader.name](reader, fields)
    reader.findings.refuse_incomplete()
    return reader.finish()


_LONGEST = 10_000_000
"""Points in one range, at most."""


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.grids: dict[int, tuple[int | None, int | None, tuple[float, float, float]]] = {}
        self.systems: dict[int, Definition] = {}
        self.default_systems = (0, 0)
        self.external: list[tuple[int, int]] = []
        self.moved: list[tuple[int, int, int, str, float]] = []
        self.coupled: list[CoupledCard] = []
        self.points: set[int] = set()
        self.held: dict[int, set[tuple[int, int]]] = {}
        self.analysis: set[tuple[int, int]] = set()
        self.matrices: dict[str, DirectMatrix] = {}
        self.loads: set[str] = set()
        self.sums: dict[int, list[int]] = {}
        self.free_grids: list[int] = []
        self.held_by_default = ""
        self.findings = Findings(source=path.name)
        self.line, self.name = 0, ""
        self.mpc: int | None = None

    @CARDS.reads(COUPLED)
    def on_coupled(self, fields: list[str]) -> None:
        self.coupled.append(CoupledCard(name=self.name, line=self.line, fields=tuple(fields)))

    @CARDS.reads("GRID")
    def on_grid(self, fields: list[str]) -> None:
        fields = fields + [""] * 4  # a card may end after the position
        node = whole_number(fields[0])
        x, y, z = (fortran_real(text) if text else 0.0 for text in fields[2:5])
        point = (_system(fields[1]), _system(fields[5]), (x, y, z))
        if self.grids.setdefault(node, point) != point:
            raise refused(Place(self.path.name, f"line {self.line}", f"GRID {node}"), "is given again at another place")
        self._hold(node, fields[6])
        if not fields[6]:
            self.free_grids.append(node)

    @CARDS.reads("GRDSET")
    def on_grdset(self, fields: list[str]) -> None:
        fields = fields + [""] * 4
        self.default_systems = (_system(fields[1]) or 0, _system(fields[5]) or 0)
        self.held_by_default = fields[6]
        _pairs(0, fields[6])  # ValueError here, with the line

    @CARDS.reads(SYSTEMS)
    def on_system(self, fields: list[str]) -> None:
        """CORD1: a number and three grid points, twice at most; CORD2: a number, its system and three points."""
        form, kind = self.name[4], self.name[5]
        if form == "1":
            for part in (fields[:4], fields[4:8]):
                if any(part):
                    number, *grids = (whole_number(text) for text in part)
                    self._define(number, Definition(kind=kind, points=np.array(grids, dtype=np.int64)))
            return
        values = [fortran_real(text) if text else 0.0 for text in (fields + [""] * 9)[2:11]]
        points = np.array(values).reshape(3, 3)
        within = whole_number(fields[1] or "0")
        self._define(whole_number(fields[0]), Definition(kind=kind, points=points, within=within))

    def _define(self, number: int, definition: Definition) -> None:
        known = self.systems.setdefault(number, definition)
        if (known.kind, known.within, known.points.tolist()) != (
            definition.kind,
            definition.within,
            definition.points.tolist(),
        ):
            raise ValueError(f"coordinate system {number} is defined again in another way")

    @MATRIX_CARDS.reads("EXTRN")
    def on_extrn(self, fields: list[str]) -> None:
        """Pairs "point, directions", or "first, THRU, last, directions"."""
        words = [word for word in fields if word]
        while words:
            through = len(words) > 3 and words[1].upper() == "THRU"
            first, last = whole_number(words[0]), whole_number(words[2 if through else 0])
            if last - first > _LONGEST:
                raise ValueError(f"the range {first} THRU {last} is too long")
            directions = words[3 if through else 1]
            self.external += [key for node in range(first, last + 1) for key in sorted(_pairs(node, directions))]
            words = words[4 if through else 2 :]

    @CARDS.reads("SPOINT")
    def on_spoint(self, fields: list[str]) -> None:
        self.points |= set(labels_of(fields))

    @CARDS.reads("SPC")
    def on_spc(self, fields: list[str]) -> None:
        fields = fields + [""] * 4
        for node, directions, value in (fields[1:4], fields[4:7]):
            if node:
                self._constrain(whole_number(fields[0]), whole_number(node), directions)
            if value and (moved := fortran_real(value)):
                self.findings.add(Verdict.COUPLING, "SPC", MOVED, self.line)
                self.moved.append((self.line, whole_number(fields[0]), whole_number(node), directions, moved))

    @CARDS.reads("SPCADD")
    def on_spcadd(self, fields: list[str]) -> None:
        self.sums[whole_number(fields[0])] = [whole_number(field) for field in fields[1:] if field]

    @CARDS.reads("SPC1")
    def on_spc1(self, fields: list[str]) -> None:
        for node in labels_of(fields[2:]):
            self._constrain(whole_number(fields[0]), node, fields[1])

    @MATRIX_CARDS.reads(SETS)
    def on_set(self, fields: list[str]) -> None:
        for node, directions in zip(fields[::2], fields[1::2], strict=False):
            if node:
                self.analysis |= _pairs(whole_number(node), directions)

    @MATRIX_CARDS.reads(SETS.replace("SET", "SET1"))
    def on_set1(self, fields: list[str]) -> None:
        for node in labels_of(fields[1:]):
            self.analysis |= _pairs(node, fields[0])

    @MATRIX_CARDS.reads("DMIG")
    def on_dmig(self, fields: list[str]) -> None:
        name = fields[0].upper()
        if fields[1] in ("", "0"):
            form, kind = whole_number(fields[2]), whole_number(fields[3] or "2")
            if form in (2, 9):  # loads: no matrix of the structure
                self.findings.add(Verdict.HARMLESS, f"DMIG {name}", "", self.line)
                self.loads.add(name)
                return
            if kind in (3, 4) or form not in (1, 6):
                described = "complex" if kind in (3, 4) else f"of form {form}"
                raise refused(self.path.name, f"DMIG {name} is {described}", expected="a real square or symmetric one")
            self.matrices[name] = DirectMatrix(name=name, symmetric=form == 6)
            return
        if name in self.loads:
            return
        if name not in self.matrices:
            raise ValueError(f"matrix {name} has a column before its header")
        matrix, column = self.matrices[name], pair(fields[1], fields[2])
        for at in range(4, len(fields) - 2, 4):
            if fields[at]:
                matrix.rows.append(pair(fields[at], fields[at + 1]))
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
        frames, coordinates, directions = self._points()
        return BulkData(
            nodes=coordinates,
            scalar_points=np.array(sorted(self.points), dtype=np.int64),
            held=self.held,
            combined=frozenset(part for parts in self.sums.values() for part in parts),
            analysis_set=self.analysis,
            external=self.external,
            coupled=tuple(self.coupled),
            mpc=self.mpc,
            directions=directions,
            matrices=self.matrices,
            findings=self.findings,
            frames=frames,
            moved=tuple(self.moved),
        )

    def _points(self) -> tuple[Frames, dict[int, Array], dict[int, Array]]:
        """Systems, positions in the basic one by label, ascending, and directions where they are not the basic ones."""
        position, displacement = self.default_systems
        placed = {n: (position if p is None else p, at) for n, (p, _, at) in sorted(self.grids.items())}
        frames = Frames(self.systems, placed, self.path.name)
        coordinates = {node: frames.position(node) for node in placed}
        stated = {node: self.grids[node][1] for node in placed}
        numbers = {node: displacement if number is None else number for node, number in stated.items()}
        fluid = [node for node, number in numbers.items() if number < 0]
        if fluid:
            raise refused(self.path.name, f"GRID {fluid[0]} is a point of a fluid", remedy="only structures are read")
        turned = {
            node: frames.frame(number).directions(coordinates[node]) for node, number in numbers.items() if number > 0
        }
        return (
            frames,
            coordinates,
            {node: axes for node, axes in turned.items() if not np.allclose(axes, np.eye(3), atol=1e-12)},
        )


def _system(text: str) -> int | None:
    """Number of a coordinate system; None where nothing is said."""
    return whole_number(text) if text else None


def labels_of(fields: Sequence[str]) -> list[int]:
    """Numbers, and ranges "3 THRU 7", "3 THRU 7 BY 2".

    >>> labels_of(["1", "4", "THRU", "6", ""]), labels_of(["2", "THRU", "6", "BY", "2"])
    ([1, 4, 5, 6], [2, 4, 6])
    """
    words = [word.upper() for word in fields if word]
    labels: list[int] = []
    at = 0
    while at < len(words):
        if words[at + 1 : at + 2] != ["THRU"]:
            labels.append(whole_number(words[at]))
            at += 1
            continue
        first, last = whole_number(words[at]), whole_number(words[at + 2])
        by = whole_number(words[at + 4]) if words[at + 3 : at + 4] == ["BY"] else 1
        if by == 0 or abs(last - first) > _LONGEST:
            raise ValueError(f"the range {first} THRU {last} is too long" if by else "a range BY 0")
        labels += range(first, last + (1 if by > 0 else -1), by)
        at += 5 if words[at + 3 : at + 4] == ["BY"] else 3
    return labels


def _pairs(node: int, directions: str) -> set[tuple[int, int]]:
    return {(node, (whole_number(digit) - 1) % 7) for digit in directions or "0"}


@dataclass(kw_only=True)
class DirectMatrix:
    """A DMIG matrix: entries by (node, direction), one half when ``symmetric``."""

    name: str
    symmetric: bool
    rows: list[tuple[int, int]] = field(default_factory=list)
    columns: list[tuple[int, int]] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


def pair(node: str, direction: str) -> tuple[int, int]:
    """Label and direction 0..6 of a DMIG entry; direction 0 or nothing is a scalar point."""
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


_DEEPEST = 100
"""Systems defined in one another, at most."""


@dataclass(frozen=True, kw_only=True)
class Definition:
    """A card: "R", "C" or "S", and three points, as grid labels (3,) or as coordinates (3, 3) in system ``within``."""

    kind: str
    points: Array
    within: int | None = None


@dataclass(frozen=True, kw_only=True)
class Frame:
    """A coordinate system: its origin and, as columns, its axes in the basic system."""

    kind: str = "R"
    origin: Array = field(default_factory=lambda: np.zeros(3))
    axes: Array = field(default_factory=lambda: np.eye(3))

    def position(self, coordinates: Array) -> Array:
        """Point in the basic system from coordinates in this one, both (3,).

        >>> Frame(kind="C").position(np.array([2.0, 90.0, 1.0])).round(12).tolist()
        [0.0, 2.0, 1.0]
        """
        a, b, c = coordinates
        if self.kind == "C":
            local = np.array([a * np.cos(np.radians(b)), a * np.sin(np.radians(b)), c])
        elif self.kind == "S":
            polar, turn = np.radians(b), np.radians(c)
            local = a * np.array([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
        else:
            local = coordinates
        return self.origin + self.axes @ local

    def directions(self, at: Array) -> Array:
        """Directions 1, 2, 3 of displacements at a point of the basic system, as columns (3, 3).

        On the axis of a system with angles they are those of its rectangular system.
        """
        x, y, z = self.axes.T @ (at - self.origin)
        across = np.hypot(x, y)
        if self.kind == "R" or across <= 1e-12 * (abs(z) + np.linalg.norm(self.origin) + across):
            return self.axes
        around = np.array([-y, x, 0.0]) / across
        if self.kind == "C":
            return self.axes @ np.stack([[x / across, y / across, 0.0], around, [0.0, 0.0, 1.0]], axis=1)
        outward = np.array([x, y, z]) / np.hypot(across, z)
        return self.axes @ np.stack([outward, np.cross(around, outward), around], axis=1)


class Frames:
    """The systems of a file, worked out where they are asked for.

    Parameters
    ----------
    definitions
        Cards by number.
    grids
        System and coordinates of each grid point, by label.
    source
        Name for messages.
    """

    def __init__(
        self, definitions: Mapping[int, Definition], grids: Mapping[int, tuple[int, Sequence[float]]], source: str
    ) -> None:
        self.definitions, self.grids, self.source = definitions, grids, source
        self._known: dict[int, Frame] = {0: Frame()}
        self._open: list[int] = []

    def frame(self, number: int) -> Frame:
        """The system of that number.

        Raises
        ------
        InputError
            If it is not defined, defined by itself, or its points lie on a line.
        """
        if number in self._known:
            return self._known[number]
        if number not in self.definitions:
            raise refused(self.source, f"coordinate system {number} is used, but no CORD card defines it")
        if number in self._open or len(self._open) >= _DEEPEST:
            raise refused(self.source, f"coordinate system {number} is defined by itself")
        self._open.append(number)
        self._known[number] = self._made(number, self.definitions[number])
        self._open.pop()
        return self._known[number]

    def position(self, grid: int) -> Array:
        """Position of a grid point in the basic system, (3,)."""
        if grid not in self.grids:
            raise refused(self.source, f"a coordinate system uses grid point {grid}, which is not in the file")
        number, coordinates = self.grids[grid]
        point = np.asarray(coordinates, dtype=float)
        return self.frame(number).position(point) if number else point

    def _made(self, number: int, card: Definition) -> Frame:
        if card.within is None:
            origin, on_axis, in_plane = (self.position(int(grid)) for grid in card.points)
        else:
            within = self.frame(card.within)
            origin, on_axis, in_plane = (within.position(point) for point in card.points)
        third, across = on_axis - origin, in_plane - origin
        second = np.cross(third, across)
        size = np.linalg.norm(third) * np.linalg.norm(across)
        if not (np.isfinite(size) and np.linalg.norm(second) > 1e-12 * size):
            raise refused(self.source, f"the three points of coordinate system {number} lie on a line")
        third, second = third / np.linalg.norm(third), second / np.linalg.norm(second)
        return Frame(kind=card.kind, origin=origin, axes=np.stack([np.cross(second, third), second, third], axis=1))
