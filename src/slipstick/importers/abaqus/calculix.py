"""Matrices that CalculiX and Abaqus write.

CalculiX, ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: job.sti, job.mas (lines "row column value", one half) and job.dof
("node.direction"), without the constrained degrees of freedom. Abaqus, ``*MATRIX OUTPUT``: job_STIF1.mtx, job_MASS1.mtx
with lines "node, direction, node, direction, value" (FORMAT=MATRIX INPUT), "row column value" (FORMAT=COORDINATE), or
both codes' ``*USER ELEMENT`` form from a substructure (the lower half by rows).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.importers.dof_map import read_dof_map
from slipstick.importers.raw_model import DofMap, RawModel
from slipstick.importers.text_numbers import number_table, read_bytes, require_plausible, whole_numbers
from slipstick.typing import Array, IntArray, Sparse

HELD_DIAGONAL = 1e30
"""Abaqus marks a held degree of freedom by 1e36 on the diagonal of the stiffness."""


def read_matrix_storage(path: Path) -> RawModel:
    """CalculiX's job.sti with job.mas and job.dof beside it.

    Raises
    ------
    InputError
        If one of the three is missing, damaged, or they disagree.
    """
    dof_map, nodes = read_dof_map(_sibling(path, ".dof", "the map of its rows"))
    matrices = {
        "K": read_coordinates(path, len(dof_map)),
        "M": read_coordinates(_sibling(path, ".mas", "the mass matrix"), len(dof_map)),
    }
    return RawModel(matrices=matrices, dof_map=dof_map, nodes=nodes)


def _sibling(path: Path, suffix: str, what: str) -> Path:
    sibling = path.with_suffix(suffix)
    if not sibling.is_file():
        raise InputError(f"{path.name}: {what}, {sibling.name}, is not beside it; CalculiX writes both together")
    return sibling


def read_coordinates(path: Path, size: int | None = None) -> Sparse:
    """Lines "row column value" as a sparse matrix (size, size); the largest index where no size is given."""
    return _sparse(number_table(read_bytes(path), 3, path), size, path)


def _sparse(table: Array, size: int | None, path: Path) -> Sparse:
    from scipy.sparse import coo_array

    rows, columns = (whole_numbers(table[:, i], "row and column numbers", path) - 1 for i in (0, 1))
    largest = int(max(rows.max(), columns.max())) + 1
    if size is not None and largest > size:
        raise InputError(f"{path.name}: has row or column {largest}, the dof map has {size} entries; they must agree")
    require_plausible(largest, len(table), path)
    return coo_array((table[:, 2], (rows, columns)), shape=(size or largest,) * 2)


def read_abaqus_matrices(files: dict[str, Path], dof_map: DofMap | None = None) -> RawModel:
    """Matrices by name ("K", "M", "C") from .mtx files; the map is theirs, or ``dof_map`` where they have none."""
    parts = {name: _lines(path) for name, path in files.items()}
    labelled = {name: table for name, (table, found) in parts.items() if found is None and table.shape[1] == 5}
    if labelled:
        return _by_label(labelled, files)
    matrices = {}
    for name, (table, found) in parts.items():
        if found is not None:
            dof_map = dof_map or found
            matrices[name] = _lower_half(table[:, 0], len(found), files[name])
        else:
            matrices[name] = _sparse(table, len(dof_map) if dof_map else None, files[name])
    return RawModel(matrices=matrices, dof_map=dof_map)


def _lines(path: Path) -> tuple[Array, DofMap | None]:
    """The numbers of one file; with a map when it is a *USER ELEMENT."""
    lines = read_bytes(path).decode("latin-1").splitlines()
    keywords = [line.upper().replace(" ", "") for line in lines if line.startswith("*") and not line.startswith("**")]
    data = [line for line in lines if line.strip() and not line.startswith("*")]
    if any(word.startswith("*USERELEMENT") for word in keywords):
        return _user_element(lines, path)
    if not data:
        raise InputError(f"{path.name}: holds no matrix entries; the file is damaged or truncated")
    width = len(data[0].replace(",", " ").split())
    if width not in (3, 5):
        raise InputError(
            f"{path.name}: found {width} numbers a line; expected 'node, direction, node, direction, value' "
            "(*MATRIX OUTPUT, FORMAT=MATRIX INPUT) or 'row column value' (FORMAT=COORDINATE)"
        )
    return number_table("\n".join(data).encode("latin-1"), width, path), None


def _user_element(lines: list[str], path: Path) -> tuple[Array, DofMap]:
    """A *USER ELEMENT: its nodes in comments, "position, direction" lines, then *MATRIX with the lower half."""
    nodes: list[str] = []
    pairs: list[list[str]] = []
    values: list[str] = []
    section = ""
    for line in lines:
        if line.startswith("**"):
            text = line.strip("* ")
            if section.startswith("*USERELEMENT") and text[:1].isdigit():
                nodes += text.replace(",", " ").split()
        elif line.startswith("*"):
            section = line.upper().replace(" ", "")
        elif section.startswith("*USERELEMENT"):
            pairs.append(line.replace(",", " ").split())
        elif section.startswith("*MATRIX"):
            values.append(line)
    table = number_table("\n".join(values).encode("latin-1"), 1, path)
    return table, _element_map(nodes, pairs, path)


def _element_map(nodes: list[str], pairs: list[list[str]], path: Path) -> DofMap:
    """Directions of each node in turn: "1" starts the first node, "2, 2" is node 2, direction 2."""
    try:
        labels = [int(word) for word in nodes]
        entries = []
        for pair in pairs:
            position, *directions = (int(word) for word in pair)
            wanted = directions or [position]
            entries += [(labels[(position if directions else 1) - 1], d - 1) for d in wanted]
    except (ValueError, IndexError):
        raise InputError(
            f"{path.name}: the node list of its *USER ELEMENT cannot be read; the file is damaged"
        ) from None
    table = np.asarray(entries, dtype=np.int64).reshape(-1, 2)
    return DofMap(nodes=table[:, 0], components=table[:, 1])


def _lower_half(values: Array, size: int, path: Path) -> Sparse:
    from scipy.sparse import coo_array

    if len(values) != size * (size + 1) // 2:
        raise InputError(
            f"{path.name}: found {len(values)} entries, expected {size * (size + 1) // 2} for {size} dofs; truncated"
        )
    rows, columns = np.tril_indices(size)
    return coo_array((values, (rows, columns)), shape=(size, size))


def _by_label(tables: dict[str, Array], files: dict[str, Path]) -> RawModel:
    from scipy.sparse import coo_array

    keys = {name: _keys(table, files[name]) for name, table in tables.items()}
    every = np.unique(np.concatenate([part.ravel() for part in keys.values()]))
    matrices = {}
    for name, table in tables.items():
        rows, columns = np.searchsorted(every, keys[name]).T
        matrices[name] = coo_array((table[:, 4], (rows, columns)), shape=(len(every),) * 2)
    dof_map = DofMap(nodes=every // 8, components=every % 8)
    raw = RawModel(matrices=matrices, dof_map=dof_map)
    return _without_marked(raw) if "K" in matrices else raw


def _keys(table: Array, path: Path) -> IntArray:
    nodes = whole_numbers(table[:, [0, 2]], "node labels", path, low=0)
    directions = whole_numbers(table[:, [1, 3]], "directions", path, low=0)
    if directions.max() > 6 or nodes.max() > 2**50:
        raise InputError(
            f"{path.name}: found direction {directions.max()}; expected 1 to 6 (temperatures are no motion)"
        )
    return nodes * 8 + (directions - 1) % 7


def _without_marked(raw: RawModel) -> RawModel:
    """Held degrees of freedom are those with Abaqus' mark on the diagonal: their rows are emptied and listed."""
    from scipy.sparse import csr_array, diags_array

    from slipstick.importers.raw_model import Nodes

    assert raw.dof_map is not None
    stiffness = csr_array(raw.matrices["K"])
    marked = stiffness.diagonal() >= HELD_DIAGONAL
    if not marked.any():
        return raw
    keep = diags_array((~marked).astype(float))
    matrices = {name: csr_array(keep @ csr_array(matrix) @ keep) for name, matrix in raw.matrices.items()}
    held = np.stack([raw.dof_map.nodes[marked], raw.dof_map.components[marked]], axis=1)
    return RawModel(matrices=matrices, dof_map=raw.dof_map, nodes=Nodes(held=held))
