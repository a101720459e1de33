"""Results for other programs: CSV files, one table each, Excel with a sheet for each, MATLAB files with all arrays.

A dataset holds one table or several, each with its *rows*: the dimensions without text labels, such as ``point`` or
``period``, or all parameters of a grid, every combination a line. Labelled dimensions (``dof``, ``coefficient``) lie in
the columns, and so do percentiles and harmonics; where there are no others, the first of them is the rows. A table is
called by its rows.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO
from itertools import product
from keyword import iskeyword
from math import isfinite
from pathlib import Path
from re import compile as pattern
from re import sub
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import path as path_of
from slipstick.faults import text, wrong
from slipstick.replacing import ANY, Kind, writing
from slipstick.results.response_functions import OTHER_FILES, write_functions
from slipstick.results.schema import LARGEST
from slipstick.results.view import names_of, unit_of
from slipstick.units import MIXED, unit_of_dof

if TYPE_CHECKING:
    import xarray

    from slipstick.results.solutions import Solutions

_ENDINGS = (".csv", ".mat", ".xlsx")
_UNIVERSAL = (".uff", ".unv")
_KINDS = {
    ".csv": ANY,
    ".mat": Kind("MATLAB 5 file", b"MATLAB 5.0"),
    ".xlsx": Kind("Excel file", b"PK\x03\x04"),
    **dict.fromkeys(_UNIVERSAL, Kind("universal file", b"    -1")),
}
_IN_COLUMNS = ("percentile", "harmonic")
_UNPRINTABLE = pattern(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
"""What no sheet of Excel can hold."""
_LONGEST = 63
"""Characters of a name in MATLAB."""
_MATLAB_WORDS = frozenset(["case", "catch", "end", "function", "otherwise", "parfor", "persistent", "spmd", "switch"])
_MOST_BYTES = 2**31 - 1
"""Of one array in a MATLAB 5 file."""
_MOST_ROWS, _MOST_COLUMNS, _LONGEST_SHEET = 2**20 - 1, 2**14, 31
"""Of a sheet: its rows below the names, its columns, characters of its name."""

Made = Mapping[str, Callable[[], Any]]
"""Datasets by name that are computed on request."""


def write_table(data: xarray.Dataset, path: str | Path, table: str | None = None, made: Made | None = None) -> Path:
    """Write a dataset, or one table of it, and return the path.

    A .csv file has a line for each row and a column for each number, such as ``displacement.x.c1 [m]``. An .xlsx file
    (Excel) has a sheet of this kind for each table. A .mat file
    (MATLAB 5, read by MATLAB, Octave and SciPy) has every array under its name, labels as cell arrays, a struct
    ``dimensions`` that says along which dimensions each lies, and a struct ``about`` with units, meanings, attributes
    and the names as they were: in MATLAB ``damper.mu`` is ``damper_mu``.

    Parameters
    ----------
    table
        Which one: by default the first in a .csv file, all in an .xlsx or a .mat file.
    made
        Further tables, computed on request.

    Raises
    ------
    InputError
        For another ending, a table that is not there, and where the file cannot be written, or there is one that is
        not what its ending says.
    """
    target = _target(path)
    ending = target.suffix.lower()
    if is_universal(target):
        found, expected = f"{target}, of universal files", "the results of a frequency response"
        raise InputError(Fault("table", found=found, expected=expected, remedy=OTHER_FILES))
    made, tables = made or {}, tables_of(data)
    if table is not None:
        table = text("table", table)
        if table in made:
            data, table = made[table](), None
            tables = tables_of(data)
        elif table not in tables:
            known = " or ".join(f'"{name}"' for name in (*tables, *made))
            raise wrong("table", table, known or "none: there are no rows")
    if table is not None:
        data = _alone(data, tables[table])
    elif not tables and ending != ".mat":
        raise InputError(Fault("table", "there are no rows in these results", remedy="write a .mat file"))
    chosen = tables if table is None else {table: tables[table]}
    with writing(target, _KINDS[ending]) as temporary:
        if ending == ".csv":
            _csv(data, next(iter(chosen.values())), temporary)
        elif ending == ".xlsx":
            temporary.write_bytes(_xlsx(data, chosen, target))
        else:
            _mat(data, temporary)
    return target


def _target(path: str | Path) -> Path:
    """The path of a file with an ending that can be written."""
    target = path_of("table", path, "the path of a file such as results.csv or results.mat")
    if target.suffix.lower() not in (*_ENDINGS, *_UNIVERSAL):
        raise wrong("table", str(target), "a name that ends with .csv, .mat, .xlsx or .uff")
    return target


def is_universal(path: str | Path) -> bool:
    """Whether a file is to hold response functions, whose forces the problem has."""
    return Path(path).suffix.lower() in _UNIVERSAL


def tables_of(data: xarray.Dataset) -> dict[str, tuple[str, ...]]:
    """The rows of each table by its name, in the order of the variables."""
    order = [*data.data_vars, *(name for name in data.coords if name not in data.dims)]
    found = dict.fromkeys(_rows(data, name) for name in order)
    return {",".join(rows): rows for rows in found if rows}


def _rows(data: xarray.Dataset, name: Any) -> tuple[str, ...]:
    """The dimensions that are rows of a variable's table; none for a single number."""
    dims = tuple(str(dim) for dim in data.dims if dim in data[name].dims)
    return tuple(dim for dim in dims if not _labels(data, dim)) or tuple(map(str, data[name].dims[:1]))


def _labels(data: xarray.Dataset, dim: str) -> bool:
    return dim in _IN_COLUMNS or (dim in data.coords and data[dim].dtype.kind in "OUS")


def _alone(data: xarray.Dataset, rows: tuple[str, ...]) -> xarray.Dataset:
    """One table, with the labels of its dimensions."""
    kept = [name for name in data.variables if name not in data.dims and _rows(data, name) == rows]
    return data.drop_vars([name for name in data.variables if name not in data.dims and name not in kept])[kept]


def write_table_of(solutions: Solutions, path: str | Path, table: str | None = None) -> Path:
    """See ``Branch.save_table``."""
    target = _target(path)
    if is_universal(target):
        if table is not None:
            raise InputError(Fault("table", "a universal file holds response functions alone", remedy="leave it out"))
        with writing(target, _KINDS[target.suffix.lower()]) as temporary:
            write_functions(solutions, temporary)
        return target
    return write_table(solutions.dataset, path, table, {"peaks": lambda: _peaks(solutions)})


def _peaks(solutions: Solutions) -> xarray.Dataset:
    """The peaks of all dofs whose peaks were sought, along ``peak``."""
    from xarray import Dataset

    data = solutions.table
    names = names_of(data, "dof")
    if data.attrs.get("peaks_of") == LARGEST and LARGEST not in names:
        names = [LARGEST]
    elif "peaks_of" in data.attrs:
        names = [name for name, sought in zip(names, solutions.sought("peaks_of").tolist(), strict=True) if sought]
    found = [(name, *peak) for name in names for peak in solutions.peaks(name)]
    where, size = data[solutions.followed].attrs, data["amplitude"].attrs
    units = [unit_of(data, "amplitude", name) for name, *_ in found]
    mixed = MIXED in str(size.get("units", "")) and len(found)
    return Dataset(
        {
            "dof": ("peak", np.array([name for name, *_ in found], dtype=np.str_)),
            solutions.followed: ("peak", np.array([at for _, at, _ in found], dtype=float), dict(where)),
            "amplitude": ("peak", np.array([height for *_, height in found], dtype=float), dict(size)),
            **({"unit": ("peak", np.array(units, dtype=np.str_), {"long_name": "of the amplitude"})} if mixed else {}),
        },
        attrs=data.attrs,
    )


def _csv(data: xarray.Dataset, rows: tuple[str, ...], target: Path) -> None:
    columns = _all_columns(data, rows)
    with target.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([name for name, _ in columns])
        writer.writerows(zip(*(values for _, values in columns), strict=True))


def _xlsx(data: xarray.Dataset, tables: Mapping[str, tuple[str, ...]], target: Path) -> bytes:
    """Numbers that are not finite are empty cells; texts are never taken for formulas.

    The whole file: openpyxl leaves its parts open where it cannot write.
    """
    try:
        from openpyxl import Workbook
        from openpyxl.cell import WriteOnlyCell
    except ImportError:
        remedy = "pip install 'slipstick[excel]', or write a .csv file"
        raise InputError(Fault(str(target), "is an Excel file, which openpyxl writes", remedy=remedy)) from None
    book = Workbook(write_only=True)
    for number, (name, rows) in enumerate(tables.items(), 1):
        sheet = book.create_sheet(_sheet_name(name, number, len(tables)))
        columns = _all_columns(data, rows)
        size = len(columns[0][1]), len(columns)
        if size[0] > _MOST_ROWS or size[1] > _MOST_COLUMNS:
            said = f"{size[0]} rows and {size[1]} columns are more than a sheet of Excel has"
            remedy = "write a .csv or a .mat file"
            raise InputError(Fault(f"table, {name}", said, remedy=remedy))

        def cell(value: Any, sheet: Any = sheet) -> Any:
            if isinstance(value, str):
                made = WriteOnlyCell(sheet, _UNPRINTABLE.sub(" ", value))
                made.data_type = "s"
                return made
            return value if not isinstance(value, float) or isfinite(value) else None

        sheet.append([cell(head) for head, _ in columns])
        for row in zip(*(values for _, values in columns), strict=True):
            sheet.append([cell(value) for value in row])
    content = BytesIO()
    book.save(content)
    return content.getvalue()


def _sheet_name(name: str, number: int, count: int) -> str:
    """A name that Excel takes: at most 31 characters, none of []:*?/ and backslash, no two alike."""
    plain = sub(r"[\[\]:*?/\\']", "_", name)
    behind = f" {number}" if count > 1 and len(plain) > _LONGEST_SHEET else ""
    return plain[: _LONGEST_SHEET - len(behind)] + behind


def _all_columns(data: xarray.Dataset, rows: tuple[str, ...]) -> list[tuple[str, list[Any]]]:
    """Name with unit, and values, of every column of a table."""
    columns: list[tuple[str, list[Any]]] = []
    sizes = {dim: data.sizes[dim] for dim in rows}
    for dim in rows:
        if dim in data.coords:
            known = data[dim].expand_dims({d: n for d, n in sizes.items() if d != dim}).transpose(*rows)
            columns.append((f"{dim}{_unit(data[dim])}", known.values.reshape(-1).tolist()))
    for name in data.variables:
        if name not in data.dims and (not data[name].dims or _rows(data, name) == rows):
            variable = data[name] if data[name].dims else data[name].expand_dims(sizes)
            columns += _columns(variable.transpose(*rows, ...), len(rows))
    return columns


def _columns(variable: xarray.DataArray, rows: int) -> Iterator[tuple[str, list[Any]]]:
    """Name with labels and unit, and the values in all rows, which are the first dimensions."""
    labels = [
        [str(label) for label in variable[dim].values.tolist()] if dim in variable.coords else list(map(str, range(n)))
        for dim, n in list(variable.sizes.items())[rows:]
    ]
    chosen = list(product(*labels))
    flat = variable.values.reshape(-1, len(chosen))
    for k, own in enumerate(chosen):
        dof = own[variable.dims[rows:].index("dof")] if "dof" in variable.dims[rows:] else ""
        yield ".".join([str(variable.name), *own]) + _unit(variable, dof), flat[:, k].tolist()


def _unit(variable: xarray.DataArray, dof: str = "") -> str:
    unit = str(variable.attrs.get("units", ""))
    unit = unit_of_dof(unit, dof) if dof and MIXED in unit else unit
    return f" [{unit}]" if unit and unit != "1" else ""


def _mat(data: xarray.Dataset, target: Path) -> None:
    from scipy.io import savemat

    called = matlab_names([str(name) for name in data.variables])
    dims = matlab_names([str(dim) for dim in data.dims], called)
    arrays: dict[str, Any] = {}
    said: dict[str, dict[str, str]] = {"names": {}, "units": {}, "meaning": {}}
    for name, variable in data.variables.items():
        own, values = called[str(name)], variable.values
        arrays[own] = values.astype(object) if values.dtype.kind in "OUS" else values
        if values.nbytes > _MOST_BYTES:
            raise InputError(
                Fault(f"table, {name}", f"{values.nbytes / 1e9:.1f} GB are more than a .mat file can hold in one array",
                      remedy="write a .csv file, or read the .nc file")
            )  # fmt: skip
        told = name, variable.attrs.get("units", "1"), variable.attrs.get("long_name", "")
        for about, sentence in zip(said.values(), told, strict=True):
            about[own] = str(sentence)
    lie = {str(name): [dims[str(dim)] for dim in variable.dims] for name, variable in data.variables.items()}
    arrays["dimensions"] = {called[name]: " ".join(along) or "none" for name, along in lie.items()}
    attributes = matlab_names([str(name) for name in data.attrs])
    arrays["about"] = {**said, "attributes": {attributes[str(name)]: value for name, value in data.attrs.items()}}
    with target.open("wb") as file:
        savemat(file, arrays, long_field_names=True, oned_as="column")


def matlab_names(names: list[str], known: Mapping[str, str] | None = None) -> dict[str, str]:
    """What names are called in MATLAB: letters, digits and underscores, at most 63, no two alike.

    >>> matlab_names(["damper.mu", "damper mu", "2nd", "end", "dimensions"])
    {'damper.mu': 'damper_mu', 'damper mu': 'damper_mu_2', '2nd': 'v_2nd', 'end': 'v_end', 'dimensions': 'dimensions_2'}
    """
    out: dict[str, str] = {name: known[name] for name in names if name in known} if known else {}
    used = {"dimensions", "about", *out.values()}
    for name in names:
        if name in out:
            continue
        plain = sub(r"[^0-9A-Za-z_]", "_", name)
        if not plain[:1].isalpha() or plain in _MATLAB_WORDS or iskeyword(plain):
            plain = f"v_{plain}"
        own, k = plain[:_LONGEST], 1
        while own in used:
            k += 1
            behind = f"_{k}"
            own = plain[: _LONGEST - len(behind)] + behind
        used.add(own)
        out[name] = own
    return out
