"""Matrices that CalculiX and Abaqus write.

CalculiX, ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: job.sti, job.mas (lines "row column value", one half) and job.dof
("node.direction"), without the constrained degrees of freedom. Abaqus, ``*MATRIX OUTPUT``: job_STIF1.mtx, job_MASS1.mtx
with lines "node, direction, node, direction, value" (FORMAT=MATRIX INPUT) or "row column value" (FORMAT=COORDINATE);
for both codes' ``*USER ELEMENT`` form see user_element.py.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.importers.abaqus.user_element import is_user_element, read_user_elements
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
    elements = {name: path for name, path in files.items() if is_user_element(path)}
    if elements:
        if len(elements) < len(files):
            raise InputError(f"{', '.join(path.name for path in files.values())}: only some are a *USER ELEMENT")
        return read_user_elements(elements, dof_map)
    tables = {name: _lines(path) for name, path in files.items()}
    widths = {table.shape[1] for table in tables.values()}
    if len(widths) > 1:
        names = ", ".join(path.name for path in files.values())
        raise InputError(f"{names}: some lines are 'row column value', some name nodes; export them in one format")
    if widths == {5}:
        return _by_label(tables, files)
    size = len(dof_map) if dof_map else None
    return RawModel(matrices={n: _sparse(table, size, files[n]) for n, table in tables.items()}, dof_map=dof_map)


def _lines(path: Path) -> Array:
    """The numbers of one file, 3 or 5 a line."""
    lines = read_bytes(path).decode("latin-1").splitlines()
    data = [line for line in lines if line.strip() and not line.startswith("*")]
    if not data:
        raise InputError(f"{path.name}: holds no matrix entries; the file is damaged or truncated")
    width = len(data[0].replace(",", " ").split())
    if width not in (3, 5):
        raise InputError(
            f"{path.name}: found {width} numbers a line; expected 'node, direction, node, direction, value' "
            "(*MATRIX OUTPUT, FORMAT=MATRIX INPUT) or 'row column value' (FORMAT=COORDINATE)"
        )
    return number_table("\n".join(data).encode("latin-1"), width, path)


def _by_label(tables: dict[str, Array], files: dict[str, Path]) -> RawModel:
    from scipy.sparse import coo_array

    keys = {name: _keys(table, files[name]) for name, table in tables.items()}
    every = np.unique(np.concatenate([part.ravel() for part in keys.values()]))
    matrices = {}
    for name, table in tables.items():
        rows, columns = np.searchsorted(every, keys[name]).T
        matrices[name] = coo_array((table[:, 4], (rows, columns)), shape=(len(every),) * 2)
    nodes, components = every // 8, every % 8
    notes: tuple[str, ...] = ()
    if nodes[0] < 0:
        nodes, components, notes = _internal(nodes, components)
    raw = RawModel(matrices=matrices, dof_map=DofMap(nodes=nodes, components=components), notes=notes)
    return _without_marked(raw) if "K" in matrices else raw


def _internal(nodes: IntArray, components: IntArray) -> tuple[IntArray, IntArray, tuple[str, ...]]:
    """Abaqus' own nodes, of negative numbers, as scalar points above the others: a generalised coordinate each."""
    inner = np.flatnonzero(nodes < 0)
    inner = inner[np.lexsort((components[inner], -nodes[inner]))]
    first = 10 ** len(str(max(int(nodes.max()), 0)))
    nodes, components = nodes.copy(), components.copy()
    nodes[inner], components[inner] = first + 1 + np.arange(len(inner)), 6
    note = f"{len(inner)} dofs of Abaqus' internal nodes are generalised coordinates: n{first + 1}s to n{nodes.max()}s"
    return nodes, components, (note,)


def _keys(table: Array, path: Path) -> IntArray:
    nodes = whole_numbers(table[:, [0, 2]], "node labels", path, low=-(2**50))
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
    return replace(raw, matrices=matrices, nodes=Nodes(held=held))
