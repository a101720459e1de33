"""Ansys' binary file of assembled matrices, .full (symbolic assembly, symmetric, consistent mass).

The layout is the documented one (fdfull.inc of Ansys' customisation files): records ``length, flags, data, length`` of
4-byte words; a standard header, the header of the file, the directions used, the nodes in equation order; then, where
the header points, for each equation the columns of the upper half (diagonal last) and their values. The reader
ansys-mapdl-reader agrees (a test) but ends the process on a damaged file; here every length is checked first.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.importers.deck import Deck
from slipstick.importers.findings import refused
from slipstick.typing import IntArray, Sparse

if TYPE_CHECKING:
    from slipstick.importers.roles import ImportOptions, Roles

Words = NDArray[np.int32]

_DAMAGED = "the file is damaged or truncated, or not an Ansys .full file"
_SYMBOLIC = -4
_FULL_FILE = 4
_PLAIN_INTEGERS = -(2**31)
_EQUATIONS, _LUMPED, _UNSYMMETRIC, _CONSTRAINT_EQUATIONS = 1, 10, 13, 20
_STIFFNESS, _MASS, _DAMPING, _DIRECTIONS = (18, 19), (26, 27), (28, 29), (35, 36)
_COMPONENTS = {1: 0, 2: 1, 3: 2, 4: 3, 5: 4, 6: 5}


class _Damaged(Exception):
    """The records do not fit together."""


def read_matrices(roles: Roles, options: ImportOptions) -> Deck:
    """The reader of the format."""
    del options
    return read_full(roles.first)


def read_full(path: Path) -> Deck:
    """Stiffness, mass, map and held degrees of freedom of a .full file from a modal analysis.

    Raises
    ------
    InputError
        If the file is damaged, compressed, lumped, unsymmetric, without mass or not structural.
    """
    try:
        words = _words(path)
        return _read(words, path)
    except _Damaged:
        release = _release(path)
        raise refused(path.name, _newer(release) if release else _DAMAGED) from None


def _release(path: Path) -> str:
    """The release that wrote a .full file as long as it says it is; nothing where it is cut off or no such file."""
    head = np.fromfile(path, dtype="<i4", count=102)
    if len(head) < 102 or head[0] != 100 or head[2] != _FULL_FILE or path.stat().st_size < 4 * int(head[28]):
        return ""
    return head[11:12].tobytes()[::-1].decode("latin-1").strip()


def _newer(release: str) -> str:
    return (
        f"is a whole .full file of Ansys {release}, but its records are compressed or laid out in a way that is not "
        "read; export with HBMAT, or from Python (PyMAPDL: math.stiff, math.mass) as K, M, dof_nodes, dof_components "
        "in one .npz"
    )


def _read(words: Words, path: Path) -> Deck:
    _, at = _record(words, 0)
    header, at = _record(words, at)
    directions, at = _record(words, at)
    nodes, _ = _record(words, at)
    _refuse(header, directions, path)
    equations = int(header[_EQUATIONS])
    if not 0 < equations <= len(words):
        raise _Damaged
    rows, free = _dofs(words, header, directions, nodes)
    deck = Deck(source=path.name, rows=rows, held={(node, axis) for node, axis in rows[~free].tolist()})
    for name, pointer, what in (("K", _STIFFNESS, "stiffness"), ("M", _MASS, "mass")):
        start = _pointer(header, pointer)
        if start <= 0:
            raise refused(path.name, f"holds no {what} matrix", remedy="write it from a modal analysis")
        deck.matrices[name] = _matrix(words, start, equations)
    if _pointer(header, _DAMPING) > 0:
        deck.extra.append("the damping matrix in the file was left out")
    return deck


def _words(path: Path) -> Words:
    if path.stat().st_size < 4 * 206:
        raise _Damaged
    return np.memmap(path, dtype="<i4", mode="r", shape=(path.stat().st_size // 4,))


def _record(words: Words, at: int, *, plain: bool = True) -> tuple[Words, int]:
    """Data of the record at a position, and the position after it; ``plain``: integers, not compressed."""
    if not 0 <= at < len(words) - 2:
        raise _Damaged
    length, end = int(words[at]), at + int(words[at]) + 3
    if length < 0 or end > len(words) or int(words[end - 1]) != length:
        raise _Damaged
    if plain and int(words[at + 1]) != _PLAIN_INTEGERS:
        raise _Damaged
    return np.asarray(words[at + 2 : end - 1]), end


def _pointer(header: Words, low_high: tuple[int, int]) -> int:
    low, high = (int(header[i]) for i in low_high)
    return (low & 0xFFFFFFFF) + (high << 32)


def _refuse(header: Words, directions: Words, path: Path) -> None:
    if len(header) < 40 or int(header[0]) != _SYMBOLIC:
        raise refused(path.name, f"{_DAMAGED}, or of an old frontal solver: export with HBMAT instead")
    if header[_LUMPED] or header[_UNSYMMETRIC]:
        what = "a lumped mass matrix" if header[_LUMPED] else "unsymmetric matrices"
        raise refused(path.name, f"holds {what}", remedy="solve a modal analysis with LUMPM,OFF and symmetric matrices")
    if header[_CONSTRAINT_EQUATIONS] > 0:
        raise refused(
            path.name,
            f"keeps {header[_CONSTRAINT_EQUATIONS]} constraint equations (CE, CP, MPC contacts) apart from its "
            "matrices",
            remedy="join the parts by shared nodes, or export a superelement with HBMAT",
        )
    strange = sorted(set(directions.tolist()) - set(_COMPONENTS))
    if strange:
        raise refused(path.name, f"has dofs {strange}, no motions", remedy="export a structural model")


def _dofs(words: Words, header: Words, directions: Words, nodes: Words) -> tuple[IntArray, NDArray[np.bool_]]:
    """Map of the equations, and which of them are free: a held one carries its direction with a minus sign."""
    per_node, at = _record(words, _pointer(header, _DIRECTIONS))
    signed, _ = _record(words, at)
    equations = int(header[_EQUATIONS])
    if len(nodes) != len(per_node) or per_node.min(initial=0) < 0 or len(signed) < equations:
        raise _Damaged
    if int(per_node.sum(dtype=np.int64)) != equations:
        raise _Damaged
    signed = signed[:equations].astype(np.int64)
    if not np.isin(np.abs(signed), list(_COMPONENTS)).all():
        raise _Damaged
    labels = np.repeat(nodes.astype(np.int64), per_node)
    return np.stack([labels, np.abs(signed) - 1], axis=1), signed > 0


def _matrix(words: Words, at: int, equations: int) -> Sparse:
    """Upper half: for each equation its columns from 1, then as many values of 8 bytes."""
    from scipy.sparse import csr_array

    columns: list[Words] = []
    values: list[NDArray[np.float64]] = []
    for _ in range(equations):
        row, at = _record(words, at)
        data, at = _record(words, at, plain=False)
        if len(data) != 2 * len(row):
            raise _Damaged
        columns.append(row)
        values.append(data.view("<f8"))
    starts = np.concatenate([[0], np.cumsum([len(row) for row in columns])])
    indices = np.concatenate(columns).astype(np.int64) - 1
    if len(indices) and not 0 <= indices.min() <= indices.max() < equations:
        raise _Damaged
    return csr_array((np.concatenate(values), indices, starts), shape=(equations, equations))
