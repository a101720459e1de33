"""Columns of files as test rigs export them.

Tables of text have lines of their own first, semicolons, decimal commas, units; MATLAB files variables of any name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import MEASURED, enumerated, no_measured_numbers, suggestion, table, text
from slipstick.quantities import FREQUENCIES
from slipstick.results.matlab_file import matlab_arrays, vector
from slipstick.typing import AnyArray
from slipstick.units import SIZES, Units

_SHEETS = (".xlsx", ".xls", ".ods")
_SPLITS = (";", "\t", ",")
_REPORTS = (".rpt", ".dat")
"""Tables with blanks between their cells, as programs print them among other text."""
_NO_COLUMN = ("FOOT-", "NOTE")
"""Words above tables of Abaqus' .dat under which nothing stands."""
_MAP = 'names of columns by what they are, such as {"x": "Disp ch3"}'
COLUMNS_OF = "a .csv or .mat file"
"""Files whose columns may be chosen by name."""
_UNIT = re.compile(r"(.*\S)(?:\s*\[([^\[\]]*)\]|\s+\(([^()]*)\))")
_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)")
_PLAIN = ("", "1", "-", "rad")
_OMEGAS, _HERTZ = ("omega", "peak_omega"), ("frequency", "peak_frequency")
_GRAVITY = 9.80665
_KNOWN = (*FREQUENCIES, *(name for size in ("length", "force", "time") for name in SIZES[size]))


class Columns(NamedTuple):
    """Columns of numbers by name, all names in the file, and the units that stand with them.

    Numbers of a MATLAB file may be complex. ``lines`` are those of the rows in a file of text, from 1.
    """

    values: dict[str, AnyArray]
    names: tuple[str, ...]
    units: dict[str, str]
    lines: tuple[int, ...] = ()


def read_columns(file: Path, columns: object = None) -> Columns:
    """The columns of a CSV or MATLAB file.

    In a CSV file the line before the first one of numbers has their names, or the two lines before it names and units.
    Lines before these and lines that begin with "#" are passed over. A report (.rpt, .dat) may have blanks between: its
    first table with names above it is read, and those with the same names that follow. Commas, semicolons or tabs
    stand between; a comma is a decimal comma where semicolons or tabs do. A unit may stand after a name, "Disp ch3
    [mm]". An empty cell is nan. Columns of a MATLAB file are its vectors, those of its structs, ``rig.f``, and of its
    matrices, ``H(:,2)``.

    Parameters
    ----------
    file
        Its path; a MATLAB file ends with .mat.
    columns
        By what they are the names of columns, ``{"x": "Disp ch3"}``: these alone are read. None: all as they are named.
        A unit may stand after a name where the file has none, ``{"x": "disp [mm]"}``.

    Raises
    ------
    InputError
        For a file that is no such table, for columns that are not in it, and for infinite numbers in those that are
        read.
    """
    pick: Callable[[str], AnyArray | None]
    if file.suffix.lower() == ".mat":
        arrays = matlab_arrays(file)
        names = tuple(
            name if v.ndim == 1 else f"{name} ({' x '.join(map(str, v.shape))})" for name, v in arrays.items()
        )
        found = Columns({name: v for name, v in arrays.items() if v.ndim == 1}, names, {})
        pick = partial(vector, arrays)
    else:
        found = _of_text(file)
        names, pick = found.names, found.values.get
    if columns is not None:
        found = _chosen(file, found, columns, pick)
    elif len(found.values) < len(names):
        matrix = next(name for name in names if name not in found.values)
        expected = 'vectors, or columns = { "x" = "H(:,2)", ... }'
        raise InputError(Fault(str(file), f"holds a matrix, {matrix}", expected=expected))
    else:
        _require_measured(file, found.values, found.lines)
    lengths = {len(values) for values in found.values.values()}
    if len(lengths) > 1:
        listed = enumerated([f"{len(values)} of {name}" for name, values in found.values.items()])
        remedy = "choose those of one length with columns"
        raise InputError(Fault(str(file), f"columns of different lengths: {listed}", remedy=remedy))
    numbers = {name: v.astype(complex if v.dtype.kind == "c" else float) for name, v in found.values.items()}
    return Columns(numbers, names, {name: found.units.get(name, "") for name in numbers}, found.lines)


def _require_measured(file: Path, values: Mapping[str, AnyArray], lines: Sequence[int]) -> None:
    """Raises InputError for columns with numbers that are infinite or too large, by their names in the file."""
    faults = []
    for name, column in values.items():
        if not (places := no_measured_numbers(column)):
            continue
        first, more = places[0], f" and {len(places) - 1} more" if len(places) > 1 else ""
        where = (f"line {lines[first]}{more}", name) if lines else (name, f"row {first + 1}{more}")
        found = f"{column[first]:g}"
        faults.append(Fault((str(file), *where), found=found, expected=MEASURED))
    if faults:
        raise InputError(faults)


def _chosen(file: Path, found: Columns, columns: object, pick: Callable[[str], AnyArray | None]) -> Columns:
    """Columns by what they are; InputError for those that are not in the file."""
    values, units, faults = dict[str, AnyArray](), dict[str, str](), []
    read = dict[str, AnyArray]()
    for key, given in table("columns", columns, _MAP).items():
        name, unit = text(("columns", key), given, _MAP), ""
        match = _UNIT.fullmatch(name)
        if pick(name) is None and match is not None and match[2] is not None:
            name, unit = match[1], _bare(match[2])
        numbers = pick(name)
        if numbers is None:
            hint = suggestion(name, found.names)
            remedy = hint if hint.startswith("did you") else ""
            said = f"there is no column {name!r} in {file.name}; the columns are {enumerated(found.names)}"
            faults.append(Fault(("columns", key), said, remedy=remedy))
            continue
        own = found.units.get(name, "")
        if unit and own and unit != own:
            faults.append(Fault(("columns", key), f"is given in {unit}", expected=f"{own}, as {file.name} says"))
        values[key], units[key] = numbers, own or unit
        read[name] = numbers
    if faults:
        raise InputError(faults)
    _require_measured(file, read, found.lines)
    return Columns(values, found.names, units, found.lines)


def _of_text(file: Path) -> Columns:
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        remedy = "save it as .csv" if file.suffix.lower() in _SHEETS else reason.lower()
        expected = "a .csv file, or .mat, .unv, .uff, .npz or .nc by their endings"
        raise InputError(Fault(str(file), "cannot be read as text", expected=expected, remedy=remedy)) from None
    kept = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and line[0] != "#"]
    begin = _begin([line for _, line in kept])
    if begin is None and file.suffix.lower() in _REPORTS:
        return _of_report(file, lines)
    split, first = begin or (";" if kept and ";" in kept[0][1] else ",", 1)
    head = [word.strip().strip('"').strip() for word in kept[first - 1][1].split(split)] if kept else []
    units = [""] * len(head)
    if first > 1 and head and all(_is_unit(_bare(word)) for word in head):
        named = [word.strip().strip('"').strip() for word in kept[first - 2][1].split(split)]
        if len(named) == len(head):
            head, units = named, [_bare(word) for word in head]
    rows, lines_of = [], []
    for at, line in kept[first:]:
        cells = line.split(split)
        try:
            rows.append([_number(cell, split) for cell in cells])
        except ValueError as error:
            expected = "numbers, with commas or semicolons between"
            raise InputError(Fault((str(file), f"line {at}"), str(error), expected=expected)) from None
        if len(cells) != len(head):
            raise InputError(Fault((str(file), f"line {at}"), f"{len(cells)} cells", expected=str(len(head))))
        lines_of.append(at)
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
    return Columns(values, tuple(head), dict(zip(head, units, strict=True)), tuple(lines_of))


def _of_report(file: Path, lines: Sequence[str]) -> Columns:
    """Rows of numbers below a line with as many names, and those of later tables with the same names."""
    names: tuple[str, ...] = ()
    here: tuple[str, ...] = ()
    rows: list[list[float]] = []
    lines_of: list[int] = []
    above: list[list[str]] = []
    for at, line in enumerate(lines, 1):
        numbers = _printed(line)
        if numbers is None:
            words = [*re.split(r"\s{2,}|\t", line.strip())], [w for w in line.split() if w.upper() not in _NO_COLUMN]
            above = ([*above, *words] if line.strip(" -=*") else above)[-8:]
            here = ()
            continue
        if not here:
            fitting = [words for words in above if len(words) == len(numbers) > 1 and len({*words}) == len(words)]
            here = tuple(fitting[-1]) if fitting else ("",)
            names = names or (here if fitting else ())
            above = []
        if here == names:
            if len(numbers) != len(names):
                what = f"has a row of {len(numbers)} numbers below {len(names)} names"
                raise InputError(Fault(str(file), what, found=line.strip()[:60]))
            rows.append(numbers)
            lines_of.append(at)
    if not rows:
        expected = "a line of names, one for each column, above rows of numbers"
        raise InputError(Fault(str(file), "holds no table that is understood", expected=expected))
    head, units = list(names), {}
    for k, word in enumerate(names):
        match = _UNIT.fullmatch(word)
        if match is not None:
            head[k] = match[1]
            units[match[1]] = _bare(match[2] or match[3] or "")
    values = dict(zip(head, np.array(rows).T, strict=True))
    return Columns(values, tuple(head), {n: units.get(n, "") for n in head}, tuple(lines_of))


def _printed(line: str) -> list[float] | None:
    """Numbers of a line that has nothing else, more than one; None of others."""
    words = line.replace(",", " ").split()
    if len(words) < 2:
        return None
    try:
        return [float(re.sub(r"(?<=[\d.])[dD](?=[+-]?\d)", "e", word)) for word in words]
    except ValueError:
        return None


def in_units(file: Path, found: Columns, units: Units | None) -> dict[str, AnyArray]:
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
    return 1.0 if units is None else unit_factor(name, unit, units)


def unit_factor(name: str, unit: str, units: Units) -> float:
    """Factor from a unit such as "um", "mm/s^2", "g" or "m/N" to that in the base units of a problem.

    A time that the problem does not name is the second.

    Raises
    ------
    InputError
        For a unit that is not understood, and one that the problem does not name.

    >>> unit_factor("x", "um", Units(length="mm")), unit_factor("x", "(m/s^2)/N", Units(length="mm", force="kN"))
    (0.001, 1000000.0)
    """
    factor, parts = (_GRAVITY, (("m", 1), ("s", -2), *_parts(unit)[1:])) if of_gravity(unit) else (1.0, _parts(unit))
    for word, power in parts:
        if word == "rad":
            continue
        size = next((s for s in ("length", "force", "time") if word in SIZES[s] or word == getattr(units, s)), None)
        if size is None:
            expected = f"a length, a force or a time: {', '.join(_KNOWN[len(FREQUENCIES) :])}"
            raise InputError(Fault(name, found=f"the unit {unit!r}", expected=f"{expected}, or such as mm/s^2, m/N"))
        own = getattr(units, size)
        own = "s" if own == "time" else own
        if word != own:
            if own not in SIZES[size]:
                remedy = f'give the problem its units, such as units = {{ {size} = "{word}" }}'
                raise InputError(Fault(name, f"is in {unit}, but the problem names no unit of {size}", remedy=remedy))
            factor *= (SIZES[size][word] / SIZES[size][own]) ** power
    return factor


def quantity_of(unit: str) -> str:
    """What moves, by its unit: "displacement", "velocity", "acceleration"; empty where that does not say.

    >>> quantity_of("m/s^2/N"), quantity_of("g"), quantity_of("mm"), quantity_of("V")
    ('acceleration', 'acceleration', 'displacement', '')
    """
    parts = dict(_parts(unit))
    if of_gravity(unit):
        return "acceleration"
    if _parts(unit)[0][0] not in SIZES["length"]:
        return ""
    return {0: "displacement", -1: "velocity", -2: "acceleration"}.get(parts.get("s", 0), "")


def require_quantity(file: Path, found: Columns, quantity: str | None) -> None:
    """Raises InputError for columns whose unit is that of another quantity."""
    faults = [fault for name, unit in found.units.items() if (fault := quantity_fault(name, unit, quantity))]
    if faults:
        raise InputError([fault.inside(str(file)) for fault in faults])


def quantity_fault(name: str, unit: str, quantity: str | None) -> Fault | None:
    """The fault of numbers whose unit is that of another quantity than is said, or than displacements."""
    own, said = quantity_of(unit), quantity or "displacement"
    if own in ("", said):
        return None
    return Fault(name, f"is in {unit}, which is {own}", expected=said, remedy=f'say quantity = "{own}"')


def length_and_force(unit: str) -> tuple[tuple[str, int], ...]:
    """What a unit has beside times, by which velocities and accelerations differ from displacements.

    >>> length_and_force("mm/s^2/N") == length_and_force("mm/N")
    True
    """
    return tuple(part for part in _parts(unit) if part[0] not in SIZES["time"])


def of_gravity(unit: str) -> bool:
    """Whether a unit is g, or g over something: an acceleration in no unit of length.

    >>> of_gravity("g/N"), of_gravity("mm/s^2")
    (True, False)
    """
    return _parts(unit)[0] == ("g", 1)


def _parts(unit: str) -> tuple[tuple[str, int], ...]:
    """Base units and their powers.

    >>> _parts("(mm/s²)/N")
    (('mm', 1), ('s', -2), ('N', -1))
    """
    plain = unit.replace("(", "").replace(")", "").replace("²", "^2").replace("s2", "s^2")
    found = []
    for k, words in enumerate(plain.split("/")):
        for word in words.split() or [words]:
            name, _, power = word.partition("^")
            found.append((name, (int(power) if power.isdigit() else 1) * (-1 if k else 1)))
    return tuple(found)


def _is_unit(word: str) -> bool:
    return word in _PLAIN or all(name in (*_KNOWN, "g") for name, _ in _parts(word))


def _bare(word: str) -> str:
    """A unit without its brackets, and with the name it has here."""
    word = word.strip()
    if match := _BRACKETS.fullmatch(word):
        word = match[1] or match[2] or ""
    return word.strip().replace("\N{MICRO SIGN}", "u").replace("\N{GREEK SMALL LETTER MU}", "u")


def _begin(lines: Sequence[str]) -> tuple[str, int] | None:
    """What stands between cells, and the number of the first line of numbers below as many names; None without."""
    for split in _SPLITS:
        for i in range(1, len(lines)):
            above, here = lines[i - 1].split(split), lines[i].split(split)
            if len(here) > 1 and len(above) == len(here) and _are_numbers(here, split) and _are_names(above, split):
                return split, i
    return None


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
