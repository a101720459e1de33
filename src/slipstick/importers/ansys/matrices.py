"""Assembled matrices of Ansys: the binary file .full, and the text files of HBMAT.

The layout of .full (symbolic assembly, symmetric, consistent mass) is the documented one (fdfull.inc of Ansys'
customisation files): records ``length, flags, data, length`` of 4-byte words; a standard header, the header of the
file, the directions used, the nodes in equation order; then, where the header points, for each equation the columns of
the upper half (diagonal last) and their values. The reader ansys-mapdl-reader agrees (a test) but ends the process on a
damaged file; here every length is checked first.

HBMAT writes Harwell-Boeing files (I. S. Duff, R. G. Grimes, J. G. Lewis, 1992) with their mapping.
``scipy.io.hb_read`` takes only unsymmetric files without right-hand side; HBMAT writes symmetric ones, often with one.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.importers.deck import Deck
from slipstick.importers.dof_map import read_dof_map
from slipstick.importers.findings import DAMAGED, refused
from slipstick.importers.text_numbers import read_bytes, require_plausible
from slipstick.typing import IntArray, Matrix, Sparse

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


def read_full_file(roles: Roles, options: ImportOptions) -> Deck:
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


_FORMAT = re.compile(r"\(?\s*(?:\d+\s*P\s*,?\s*)?(\d*)\s*[IEDFG]\s*(\d+)", re.IGNORECASE)


def read_hbmat_files(roles: Roles, options: ImportOptions) -> Deck:
    """The reader of the format."""
    del options
    return read_hbmat(roles.matrices, roles.dof_map)


def read_hbmat(files: dict[str, Path], mapping: Path | None) -> Deck:
    """HBMAT matrices by name; the mapping is ``mapping`` or the .mapping file beside the first one.

    Raises
    ------
    InputError
        If a file is damaged. A missing map is refused when the model is built.
    """
    matrices: dict[str, Matrix] = {name: read_harwell_boeing(path) for name, path in files.items()}
    map_file = mapping or next(filter(None, (_mapping_beside(path) for path in files.values())), None)
    deck = Deck() if map_file is None else read_dof_map(map_file)
    deck.matrices = matrices
    return deck


def _mapping_beside(path: Path) -> Path | None:
    names = (path.with_suffix(suffix) for suffix in (".mapping", ".MAPPING", ".map"))
    return next((name for name in names if name.is_file()), None)


def read_harwell_boeing(path: Path) -> Sparse:
    """The matrix as stored: one half when the file says symmetric ("RSA").

    Raises
    ------
    InputError
        For complex, elemental or binary files, and for damaged or truncated ones.
    """
    lines = read_bytes(path).split(b"\n")
    try:
        counts = [int(word) for word in lines[1].split()[:4]]
        kind = lines[2][:3].decode("ascii").upper()
        rows, columns, entries = (int(word) for word in lines[2][3:].split()[:3])
        widths = [_layout(text) for text in lines[3].decode("ascii").split(")")[:3]]
        has_right_side = len(lines[1].split()) > 4 and int(lines[1].split()[4]) > 0
    except (ValueError, IndexError, UnicodeDecodeError):
        raise refused(path.name, "not a Harwell-Boeing text file", remedy="export with HBMAT,...,ASCII") from None
    if kind[0] not in "RI" or kind[1] not in "SU" or kind[2] != "A":
        raise refused(path.name, f"holds a matrix of type {kind}", expected="a real assembled one (RSA or RUA)")
    require_plausible(rows, entries, path)
    require_plausible(columns, entries, path)
    start = 5 if has_right_side else 4
    pointers, indices, values = (
        _fields(lines, start + sum(counts[1 : 1 + part]), total, widths[part], path)
        for part, total in enumerate((columns + 1, entries, entries))
    )
    return _compressed(pointers, indices, values, (rows, columns), path)


def _layout(text: str) -> tuple[int, int]:
    match = _FORMAT.search(text)
    if not match:
        raise ValueError(text)
    return int(match.group(1) or 1), int(match.group(2))


def _fields(lines: list[bytes], start: int, total: int, layout: tuple[int, int], path: Path) -> NDArray[np.float64]:
    """Fixed-width fields, ``layout`` = (fields a line, width)."""
    per_line, width = layout
    needed = -(-total // max(per_line, 1))
    block = lines[start : start + needed]
    text = b" ".join(block).translate(bytes.maketrans(b"Dd", b"Ee"))
    words = text.split()
    if len(words) != total:  # touching numbers: cut by the width the header gives
        padded = b"".join(line.rstrip(b"\r").ljust(per_line * width)[: per_line * width] for line in block)
        padded = padded[: total * width].translate(bytes.maketrans(b"Dd", b"Ee"))
        words = [padded[at : at + width] for at in range(0, len(padded), max(width, 1))]
    if len(block) < needed or len(words) != total:
        raise refused(path.name, f"ends before its {total} numbers", remedy=DAMAGED)
    texts = np.array(words)
    try:
        return texts.astype(np.float64)
    except ValueError:
        raise refused(path.name, f"holds something else than numbers near line {start + 1}", remedy=DAMAGED) from None


def _compressed(
    pointers: NDArray[np.float64],
    indices: NDArray[np.float64],
    values: NDArray[np.float64],
    shape: tuple[int, int],
    path: Path,
) -> Sparse:
    from scipy.sparse import csc_array

    try:
        matrix = csc_array((values, indices.astype(np.int64) - 1, pointers.astype(np.int64) - 1), shape=shape)
        matrix.check_format(full_check=True)
    except ValueError as error:
        raise refused(path.name, f"its column pointers or row numbers are damaged ({error})") from None
    return matrix
