"""The ``*USER ELEMENT`` form of substructures, as Abaqus and CalculiX write it (``*SUBSTRUCTURE MATRIX OUTPUT``,
``OUTPUT FILE=USER DEFINED``).

The nodes stand in comments after ``** ELEMENT NODES``; then come the directions of the first node, and "position,
directions" wherever they change; each ``*MATRIX, TYPE=...`` holds the lower half by rows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.importers.raw_model import DofMap, RawModel
from slipstick.importers.text_numbers import number_table, read_bytes
from slipstick.typing import Sparse

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


def read_user_elements(files: dict[str, Path], dof_map: DofMap | None = None) -> RawModel:
    """Matrices of one file with several, or of one file for each; the map is that of the first, or ``dof_map``.

    Raises
    ------
    InputError
        If a list or a matrix is damaged, a matrix is given twice, or two files have different nodes.
    """
    matrices: dict[str, Sparse] = {}
    others: list[str] = []
    for name, path in files.items():
        element = _parts(path)
        rows = _map(element, path)
        if dof_map is not None and (len(rows) != len(dof_map)):
            raise InputError(f"{path.name}: has {len(rows)} dofs, the other files {len(dof_map)}; they must agree")
        dof_map = dof_map or rows
        for kind, lines in element.matrices.items():
            role = _TYPES.get(kind)
            if role is None:
                others.append(f"{path.name}: *MATRIX, TYPE={kind} is not used")
                continue
            role = name if len(element.matrices) == 1 else role
            if role in matrices:
                raise InputError(f"{path.name}: brings {kind} again; give each matrix once")
            matrices[role] = _lower_half(lines, len(rows), path)
    return RawModel(matrices=matrices, dof_map=dof_map, warnings=tuple(others))


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
                raise InputError(f"{path.name}: holds several *USER ELEMENT; expected one substructure")
            if section == "MATRIX":
                kind = next((word[5:] for word in words if word.startswith("TYPE=")), "")
                element.matrices.setdefault(kind, [])
        elif section == "USERELEMENT":
            element.directions.append(line.replace(",", " ").split())
        elif section == "MATRIX":
            element.matrices[kind].append(line)
    return element


def _map(element: _Element, path: Path) -> DofMap:
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
        raise InputError(
            f"{path.name}: the node list of its *USER ELEMENT cannot be read; the file is damaged"
        ) from None
    table = np.asarray(entries, dtype=np.int64).reshape(-1, 2)
    return DofMap(nodes=table[:, 0], components=table[:, 1])


def _lower_half(lines: list[str], size: int, path: Path) -> Sparse:
    from scipy.sparse import coo_array

    values = number_table("\n".join(lines).encode("latin-1"), 1, path)[:, 0]
    if len(values) != size * (size + 1) // 2:
        raise InputError(
            f"{path.name}: found {len(values)} entries, expected {size * (size + 1) // 2} for {size} dofs; truncated"
        )
    rows, columns = np.tril_indices(size)
    return coo_array((values, (rows, columns)), shape=(size, size))
