"""Text files that say which node and direction each matrix row belongs to."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.equations import COMPONENTS
from slipstick.importers.deck import Deck, pairs_table
from slipstick.importers.findings import DAMAGED, refused
from slipstick.importers.text_numbers import read_bytes
from slipstick.typing import Array

_ANSYS = {"UX": 0, "UY": 1, "UZ": 2, "ROTX": 3, "ROTY": 4, "ROTZ": 5}
_NAMED = re.compile(r"^[nN]?(\d+)[.:]?([A-Za-z]{1,4}|\d)$")


def direction(text: str) -> int:
    """Index into COMPONENTS of a direction: 1..6, x .. rz, UX .. ROTZ, or 0 and "s" for a scalar point.

    >>> [direction(text) for text in ("2", "rx", "UZ", "0")]
    [1, 3, 2, 6]
    """
    if text.upper() in _ANSYS:
        return _ANSYS[text.upper()]
    if text.lower() in COMPONENTS:
        return COMPONENTS.index(text.lower())
    if text.isdigit() and 0 <= int(text) <= 6:
        return (int(text) - 1) % 7
    raise ValueError(f"'{text}' is not a direction; known are 1..6, x, y, z, rx, ry, rz, UX, UY, UZ, ROTX, ROTY, ROTZ")


def read_dof_map(path: Path) -> Deck:
    """Rows of matrices and, where the lines carry them, positions of nodes.

    One line a row: ``node.direction`` (CalculiX .dof) or ``n12y``; ``node direction``; ``row node direction`` (HBMAT's
    .mapping); ``node direction x y z``. Blank lines, comments (#, %, !, *) and heading lines are skipped.

    Raises
    ------
    InputError
        For a line that is none of these, or row numbers out of order or missing.
    """
    entries: list[tuple[int, int]] = []
    rows: list[int] = []
    positions: dict[int, Sequence[float] | Array] = {}
    for number, line in enumerate(read_bytes(path).decode("latin-1").splitlines(), 1):
        words = line.replace(",", " ").split()
        if not words or words[0][0] in "#%!*" or (not entries and not any(c.isdigit() for c in line)):
            continue
        try:
            row, node, component, position = _entry(words)
        except ValueError as error:
            raise refused(Place(path.name, f"line {number}"), str(error)) from None
        if abs(node) >= 2**63:
            raise InputError(Fault((path.name, f"line {number}"), found="a node number beyond 64 bits", remedy=DAMAGED))
        entries.append((node, component))
        rows.append(row or len(entries))
        if position:
            positions[node] = position
    if not entries:
        raise refused(path.name, "holds no line 'node direction'", expected="one for each matrix row")
    order = np.argsort(rows)
    if not np.array_equal(np.asarray(rows)[order], np.arange(1, len(rows) + 1)):
        raise refused(path.name, f"row numbers are not 1..{len(rows)}, each once", remedy=DAMAGED)
    return Deck(source=path.name, rows=pairs_table(entries)[order], nodes=positions)


def _entry(words: list[str]) -> tuple[int | None, int, int, tuple[float, ...]]:
    if len(words) == 1:
        match = _NAMED.match(words[0])
        if not match or (words[0].isdigit()):
            raise ValueError(f"found '{words[0]}'; expected 'node direction', 'node.direction' or 'n<node><direction>'")
        return None, int(match.group(1)), direction(match.group(2)), ()
    if len(words) == 3:
        return int(words[0]), int(words[1]), direction(words[2]), ()
    if len(words) in (2, 5):
        return None, int(words[0]), direction(words[1]), tuple(float(word) for word in words[2:])
    raise ValueError(f"found {len(words)} words; expected 'node direction' or 'row node direction'")
