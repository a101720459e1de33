"""Matrices written by CalculiX and Abaqus.

CalculiX, ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: job.sti, job.mas (lines "row column value", one half) and job.dof
("node.direction"), without the constrained degrees of freedom. Abaqus, ``*MATRIX OUTPUT``: job_STIF1.mtx, job_MASS1.mtx
with lines "node, direction, node, direction, value" (FORMAT=MATRIX INPUT) or "row column value" (FORMAT=COORDINATE);
both codes, ``*SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED``: the ``*USER ELEMENT`` form, nodes in comments
after ``** ELEMENT NODES``, then the directions of the first node, and "position, directions" wherever they change; each
``*MATRIX, TYPE=...`` holds the lower half by rows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slipstick.importers.deck import Deck, pairs_table
from slipstick.importers.dof_map import read_dof_map
from slipstick.importers.findings import DAMAGED, refused
from slipstick.importers.text_numbers import number_table, read_bytes, require_plausible, whole_numbers
from slipstick.typing import Array, IntArray, Sparse

if TYPE_CHECKING:
    from slipstick.importers.roles import ImportOptions, Roles

HELD_DIAGONAL = 1e30
"""Abaqus marks a held degree of freedom by 1e36 on the diagonal of the stiffness."""


def read_matrices(roles: Roles, options: ImportOptions) -> Deck:
    """The reader of the format."""
    del options
    return read_matrix_storage(roles.first)


def read_matrix_storage(path: Path) -> Deck:
    """CalculiX's job.sti with job.mas and job.dof beside it.

    Raises
    ------
    InputError
        If one of the three is missing, damaged, or they disagree.
    """
    deck = read_dof_map(_sibling(path, ".dof", "the map of its rows"))
    files = {"K": path, "M": _sibling(path, ".mas", "the mass matrix")}
    deck.matrices = {name: read_coordinates(file, _size(deck.rows)) for name, file in files.items()}
    return deck


def _size(rows: IntArray | None) -> int | None:
    return None if rows is None else len(rows)


def _sibling(path: Path, suffix: str, what: str) -> Path:
    sibling = path.with_suffix(suffix)
    if not sibling.is_file():
        raise refused(path.name, f"{what}, {sibling.name}, is not beside it", remedy="CalculiX writes both together")
    return sibling


def read_coordinates(path: Path, size: int | None = None) -> Sparse:
    """Lines "row column value" as a sparse matrix (size, size); the largest index where no size is given."""
    return _sparse(number_table(read_bytes(path), 3, path), size, path)


def _sparse(table: Array, size: int | None, path: Path) -> Sparse:
    from scipy.sparse import coo_array

    rows, columns = (whole_numbers(table[:, i], "row and column numbers", path) - 1 for i in (0, 1))
    largest = int(max(rows.max(), columns.max())) + 1
    if size is not None and largest > size:
        raise refused(
            path.name, f"has row or column {largest}, the dof map has {size} entries", remedy="they must agree"
        )
    require_plausible(largest, len(table), path)
    return coo_array((table[:, 2], (rows, columns)), shape=(size or largest,) * 2)


def read_abaqus_matrices(files: dict[str, Path], rows: IntArray | None = None) -> Deck:
    """Matrices by name ("K", "M", "C") from .mtx files; the map is theirs, or ``rows`` where they have none."""
    elements = {name: path for name, path in files.items() if is_user_element(path)}
    if elements:
        if len(elements) < len(files):
            raise refused(", ".join(path.name for path in files.values()), "only some are a *USER ELEMENT")
        return read_user_elements(elements, rows)
    tables = {name: _lines(path) for name, path in files.items()}
    widths = {table.shape[1] for table in tables.values()}
    if len(widths) > 1:
        names = ", ".join(path.name for path in files.values())
        raise refused(names, "some lines are 'row column value', some name nodes", remedy="export them in one format")
    if widths == {5}:
        return _by_label(tables, files)
    return Deck(matrices={n: _sparse(table, _size(rows), files[n]) for n, table in tables.items()}, rows=rows)


def _lines(path: Path) -> Array:
    """The numbers of one file, 3 or 5 a line."""
    lines = read_bytes(path).decode("latin-1").splitlines()
    data = [line for line in lines if line.strip() and not line.startswith("*")]
    if not data:
        raise refused(path.name, "holds no matrix entries", remedy=DAMAGED)
    width = len(data[0].replace(",", " ").split())
    if width not in (3, 5):
        raise refused(
            path.name,
            found=f"{width} numbers a line",
            expected="'node, direction, node, direction, value' (*MATRIX OUTPUT, FORMAT=MATRIX INPUT) or "
            "'row column value' (FORMAT=COORDINATE)",
        )
    return number_table("\n".join(data).encode("latin-1"), width, path)


def _by_label(tables: dict[str, Array], files: dict[str, Path]) -> Deck:
    from scipy.sparse import coo_array

    keys = {name: _keys(table, files[name]) for name, table in tables.items()}
    every = np.unique(np.concatenate([part.ravel() for part in keys.values()]))
    matrices = {}
    for name, table in tables.items():
        rows, columns = np.searchsorted(every, keys[name]).T
        matrices[name] = coo_array((table[:, 4], (rows, columns)), shape=(len(every),) * 2)
    nodes, components = every // 8, every % 8
    notes: list[str] = []
    if nodes[0] < 0:
        nodes, components, notes = _internal(nodes, components)
    deck = Deck(matrices=matrices, rows=np.stack([nodes, components], axis=1), extra=notes)
    if "K" in matrices:
        _empty_marked(deck)
    return deck


def _internal(nodes: IntArray, components: IntArray) -> tuple[IntArray, IntArray, list[str]]:
    """Abaqus' internal nodes, of negative numbers, as scalar points above the others: a generalised coordinate each."""
    inner = np.flatnonzero(nodes < 0)
    inner = inner[np.lexsort((components[inner], -nodes[inner]))]
    first = 10 ** len(str(max(int(nodes.max()), 0)))
    nodes, components = nodes.copy(), components.copy()
    nodes[inner], components[inner] = first + 1 + np.arange(len(inner)), 6
    note = f"{len(inner)} dofs of Abaqus' internal nodes are generalised coordinates: n{first + 1}s to n{nodes.max()}s"
    return nodes, components, [note]


def _keys(table: Array, path: Path) -> IntArray:
    nodes = whole_numbers(table[:, [0, 2]], "node labels", path, low=-(2**50))
    directions = whole_numbers(table[:, [1, 3]], "directions", path, low=0)
    if directions.max() > 6 or nodes.max() > 2**50:
        raise refused(path.name, found=f"direction {directions.max()}", expected="1 to 6 (temperatures are no motion)")
    return nodes * 8 + (directions - 1) % 7


def _empty_marked(deck: Deck) -> None:
    """Held degrees of freedom are those with Abaqus' mark on the diagonal: their rows are emptied and listed."""
    from scipy.sparse import csr_array, diags_array

    assert deck.rows is not None
    marked = csr_array(deck.matrices["K"]).diagonal() >= HELD_DIAGONAL
    keep = diags_array((~marked).astype(float))
    if marked.any():
        deck.matrices = {name: csr_array(keep @ csr_array(matrix) @ keep) for name, matrix in deck.matrices.items()}
        deck.held = {(node, axis) for node, axis in deck.rows[marked].tolist()}


_TYPES = {"STIFFNESS": "K", "MASS": "M", "VISCOUSDAMPING": "C", "DAMPING": "C"}


@dataclass(kw_only=True)
class _Element:
    """The parts of one file as text."""

    nodes: list[str] = field(default_factory=list)
    directions: list[list[str]] = field(default_factory=list)
    matrices: dict[str, list[str]] = field(default_factory=dict)


def is_user_element(path: Path) -> bool:
    """Whether a file has a ``*USER ELEMENT`` line."""
    content = read_bytes(path).upper().replace(b" ", b"")
    return content.startswith(b"*USERELEMENT") or b"\n*USERELEMENT" in content


def read_user_elements(files: dict[str, Path], rows: IntArray | None = None) -> Deck:
    """Matrices of one file with several, or of one file for each; the map is that of the first, or ``rows``.

    Raises
    ------
    InputError
        If a list or a matrix is damaged, a matrix is given twice, or two files have different nodes.
    """
    deck = Deck()
    for name, path in files.items():
        element = _parts(path)
        own = _map(element, path)
        if rows is not None and (len(own) != len(rows)):
            raise refused(path.name, f"has {len(own)} dofs, the other files {len(rows)}", remedy="they must agree")
        rows = own if rows is None else rows
        for kind, lines in element.matrices.items():
            role = _TYPES.get(kind)
            if role is None:
                deck.own_warnings.append(f"{path.name}: *MATRIX, TYPE={kind} is not used")
                continue
            role = name if len(element.matrices) == 1 else role
            if role in deck.matrices:
                raise refused(path.name, f"brings {kind} again", remedy="give each matrix once")
            deck.matrices[role] = _lower_half(lines, len(own), path)
    deck.rows = rows
    return deck


def _parts(path: Path) -> _Element:
    element, section, kind = _Element(), "", ""
    for line in read_bytes(path).decode("latin-1").splitlines():
        if line.startswith("**"):
            text = line.strip("* ")
            if section == "USERELEMENT" and text[:1].isdigit():
                element.nodes += text.replace(",", " ").split()
        elif line.startswith("*"):
            words = line.upper().replace(" ", "").lstrip("*").split(",")
            section = words[0]
            if section == "USERELEMENT" and element.matrices:
                raise refused(path.name, "holds several *USER ELEMENT", expected="one substructure")
            if section == "MATRIX":
                kind = next((word[5:] for word in words if word.startswith("TYPE=")), "")
                element.matrices.setdefault(kind, [])
        elif section == "USERELEMENT":
            element.directions.append(line.replace(",", " ").split())
        elif section == "MATRIX":
            element.matrices[kind].append(line)
    return element


def _map(element: _Element, path: Path) -> IntArray:
    """Directions of each node in turn: those of the first line, until a line "position, directions" changes them."""
    try:
        labels = [int(word) for word in element.nodes]
        first, *changes = [[int(word) for word in words] for words in element.directions if words]
        by_position = {1: first} | {position: directions for position, *directions in changes}
        if min(by_position) < 1 or max(by_position) > len(labels):
            raise ValueError
        entries, here = [], first
        for position, label in enumerate(labels, 1):
            here = by_position.get(position, here)
            entries += [(label, direction - 1) for direction in here]
    except ValueError:
        raise refused(path.name, "the node list of its *USER ELEMENT cannot be read", remedy=DAMAGED) from None
    return pairs_table(entries)


def _lower_half(lines: list[str], size: int, path: Path) -> Sparse:
    from scipy.sparse import coo_array

    values = number_table("\n".join(lines).encode("latin-1"), 1, path)[:, 0]
    if len(values) != size * (size + 1) // 2:
        raise refused(
            path.name, found=f"{len(values)} entries, expected {size * (size + 1) // 2} for {size} dofs", remedy=DAMAGED
        )
    rows, columns = np.tril_indices(size)
    return coo_array((values, (rows, columns)), shape=(size, size))
