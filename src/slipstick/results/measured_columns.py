"""Columns of a CSV file as test rigs export it: lines of their own first, semicolons, decimal commas, units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import enumerated, suggestion, table, text
from slipstick.quantities import FREQUENCIES
from slipstick.typing import Array
from slipstick.units import SIZES, Units

_SPLITS = (";", "\t", ",")
_MAP = 'names of columns by what they are, such as {"x": "Disp ch3"}'
_UNIT = re.compile(r"(.*\S)(?:\s*\[([^\[\]]*)\]|\s+\(([^()]*)\))")
_PLAIN = ("", "1", "-", "rad")
_OMEGAS, _HERTZ = ("omega", "peak_omega"), ("frequency", "peak_frequency")
_KNOWN = (*FREQUENCIES, *(name for size in ("length", "force", "time") for name in SIZES[size]))


class Columns(NamedTuple):
    """Columns of numbers by name, all names in the file, and the units that stand with them."""

    values: dict[str, Array]
    names: tuple[str, ...]
    units: dict[str, str]


def read_columns(file: Path, columns: object = None) -> Columns:
    """The columns of a CSV file.

    The line before the first one of numbers has their names, or the two lines before it names and units. Lines before
    these and lines that begin with "#" are passed over. Commas, semicolons or tabs stand between; a comma is a
    decimal comma where semicolons or tabs do. A unit may stand after a name, "Disp ch3 [mm]". An empty cell is nan.

    Parameters
    ----------
    file
        Its path.
    columns
        By what they are the names of columns, ``{"x": "Disp ch3"}``: these alone are read. None: all as they are named.

    Raises
    ------
    InputError
        For a file that is no such table, and for columns that are not in it.
    """
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(Fault(str(file), "cannot be read as text", remedy=str(error))) from None
    kept = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and line[0] != "#"]
    split, first = _begin([line for _, line in kept])
    head = [word.strip().strip('"').strip() for word in kept[first - 1][1].split(split)] if kept else []
    units = [""] * len(head)
    if first > 1 and head and all(_bare(word) in (*_PLAIN, *_KNOWN) for word in head):
        named = [word.strip().strip('"').strip() for word in kept[first - 2][1].split(split)]
        if len(named) == len(head):
            head, units = named, [_bare(word) for word in head]
    rows = []
    for at, line in kept[first:]:
        cells = line.split(split)
        try:
            rows.append([_number(cell, split) for cell in cells])
        except ValueError as error:
            expected = "numbers, with commas or semicolons between"
            raise InputError(Fault((str(file), f"line {at}"), str(error), expected=expected)) from None
        if len(cells) != len(head):
            raise InputError(Fault((str(file), f"line {at}"), f"{len(cells)} cells", expected=str(len(head))))
    if not rows:
        raise InputError(Fault(str(file), "holds no rows of numbers", expected="a line of names, then numbers"))
    for k, word in enumerate(head):
        match = _UNIT.fullmatch(word)
        if match is not None and not units[k]:
            head[k], units[k] = match[1], _bare(match[2] or match[3] or "")
    values = dict(zip(head, np.array(rows).T, strict=True))
    if len(values) < len(head):
        twice = next(name for name in head if head.count(name) > 1)
        raise InputError(Fault((str(file), twice), "two columns have this name", remedy="rename one"))
    unit_of = dict(zip(head, units, strict=True))
    if columns is None:
        return Columns(values, tuple(head), unit_of)
    chosen = {
        str(key): text(("columns", str(key)), name, _MAP) for key, name in table("columns", columns, _MAP).items()
    }
    faults = []
    for key, name in chosen.items():
        if name not in values:
            hint = suggestion(name, head)
            remedy = hint if hint.startswith("did you") else ""
            said = f"there is no column {name!r} in {file.name}; the columns are {enumerated(head)}"
            faults.append(Fault(("columns", key), said, remedy=remedy))
    if faults:
        raise InputError(faults)
    return Columns(
        {key: values[name] for key, name in chosen.items()}, tuple(head),
        {key: unit_of[name] for key, name in chosen.items()},
    )  # fmt: skip


def in_units(file: Path, found: Columns, units: Units | None) -> dict[str, Array]:
    """The columns in the units of a problem: frequencies in rad/s or Hz as their names say, lengths, forces, times.

    Without units of a problem (None) frequencies alone are converted; lengths and forces stay as they are.

    Raises
    ------
    InputError
        For units that are not known, and those that the problem does not name.
    """
    faults, out = [], {}
    for name, values in found.values.items():
        try:
            out[name] = values * _factor(name, found.units[name], units)
        except InputError as error:
            faults += [fault.inside(str(file)) for fault in error.faults]
    if faults:
        raise InputError(faults)
    return out


def _factor(name: str, unit: str, units: Units | None) -> float:
    if unit in _PLAIN:
        return 1.0
    if name in (*_OMEGAS, *_HERTZ):
        if unit not in FREQUENCIES:
            raise InputError(Fault(name, found=f"the unit {unit!r}", expected=", ".join(FREQUENCIES)))
        return FREQUENCIES[unit] / (1.0 if name in _OMEGAS else 2.0 * np.pi)
    if units is None:
        return 1.0
    for size in ("length", "force", "time"):
        own = getattr(units, size)
        if unit == own:
            return 1.0
        if unit in SIZES[size]:
            if own not in SIZES[size]:
                remedy = f'give the problem its units, such as units = {{ {size} = "{unit}" }}'
                raise InputError(Fault(name, f"is in {unit}, but the problem names no unit of {size}", remedy=remedy))
            return SIZES[size][unit] / SIZES[size][own]
    expected = f"a length, a force or a time: {', '.join(_KNOWN[len(FREQUENCIES) :])}"
    raise InputError(Fault(name, found=f"the unit {unit!r}", expected=expected))


def _bare(word: str) -> str:
    """A unit without its brackets, and with the name it has here."""
    return word.strip().strip("[]()").strip().replace("\N{MICRO SIGN}", "u").replace("\N{GREEK SMALL LETTER MU}", "u")


def _begin(lines: Sequence[str]) -> tuple[str, int]:
    """What stands between cells, and the number of the first line of numbers."""
    for split in _SPLITS:
        for i in range(1, len(lines)):
            above, here = lines[i - 1].split(split), lines[i].split(split)
            if len(here) > 1 and len(above) == len(here) and _are_numbers(here, split) and _are_names(above, split):
                return split, i
    return (";" if lines and ";" in lines[0] else ","), 1


def _are_numbers(cells: Sequence[str], split: str) -> bool:
    try:
        return bool(np.isfinite([_number(cell, split) for cell in cells]).any())
    except ValueError:
        return False


def _are_names(cells: Sequence[str], split: str) -> bool:
    return not any(cell.strip() and _are_numbers([cell], split) for cell in cells)


def _number(cell: str, split: str) -> float:
    word = cell.strip().strip('"').strip()
    return float(word.replace(",", ".") if split != "," and word.count(",") == 1 and "." not in word else word or "nan")
