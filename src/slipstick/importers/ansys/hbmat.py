"""Assembled matrices that Ansys' HBMAT writes: Harwell-Boeing files with their mapping.

Format: I. S. Duff, R. G. Grimes, J. G. Lewis, 1992. ``scipy.io.hb_read`` takes only unsymmetric files without
right-hand side; HBMAT writes symmetric ones, often with one.
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
from slipstick.typing import Matrix, Sparse

if TYPE_CHECKING:
    from slipstick.importers.roles import ImportOptions, Roles

_FORMAT = re.compile(r"\(?\s*(?:\d+\s*P\s*,?\s*)?(\d*)\s*[IEDFG]\s*(\d+)", re.IGNORECASE)


def read_matrices(roles: Roles, options: ImportOptions) -> Deck:
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
