"""The numbers of a branch for other programs: a CSV file with a line for each point, or a MATLAB file of all arrays."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.errors import InputError
from slipstick.faults import path as path_of
from slipstick.faults import wrong
from slipstick.replacing import replacing

if TYPE_CHECKING:
    import xarray

_ENDINGS = (".csv", ".mat")


def write_table(data: xarray.Dataset, path: str | Path, along: Sequence[str] = ("point",)) -> Path:
    """Write the dataset of a branch and return the path.

    A .csv file has a line for each point (for each along all of ``along``) and a column for each number, such as
    ``displacement.x.c1 [m]``. A .mat file
    (MATLAB 5, read by MATLAB, Octave and SciPy) has every array under its name, labels as cell arrays, and a struct
    ``dimensions`` that says along which dimensions each lies.

    Raises
    ------
    InputError
        For another ending, and where the file cannot be written.
    """
    target = path_of("table", path, "the path of a file such as results.csv or results.mat")
    ending = target.suffix.lower()
    if ending not in _ENDINGS:
        raise wrong("table", str(target), "a name that ends with .csv or .mat")
    try:
        with replacing(target) as temporary:
            if ending == ".csv":
                _csv(data, temporary, along)
            else:
                _mat(data, temporary)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"{target}: the table cannot be written ({reason}); choose another place") from None
    return target


def _csv(data: xarray.Dataset, target: Path, along: Sequence[str]) -> None:
    columns = [
        column
        for name in sorted(data.variables, key=lambda name: name not in data.coords)
        if set(along) & set(data[name].dims)
        for column in _columns(data[name], {dim: data.sizes[dim] for dim in along})
    ]
    with target.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([name for name, _ in columns])
        writer.writerows(zip(*(values for _, values in columns), strict=True))


def _columns(variable: xarray.DataArray, lines: Mapping[str, int]) -> Iterator[tuple[str, list[Any]]]:
    """Name with labels and unit, and the values at all lines, which are as many as the product of their sizes."""
    absent = {dim: size for dim, size in lines.items() if dim not in variable.dims}
    variable = variable.drop_vars(absent, errors="ignore").expand_dims(absent).transpose(*lines, ...)
    unit = str(variable.attrs.get("units", ""))
    behind = f" [{unit}]" if unit and unit != "1" else ""
    labels = [
        [str(label) for label in variable[dim].values] if dim in variable.coords else list(map(str, range(size)))
        for dim, size in list(variable.sizes.items())[len(lines) :]
    ]
    flat = variable.values.reshape(prod(lines.values()), -1)
    for k, chosen in enumerate(product(*labels)):
        yield ".".join([str(variable.name), *chosen]) + behind, flat[:, k].tolist()


def _mat(data: xarray.Dataset, target: Path) -> None:
    from scipy.io import savemat

    arrays: dict[str, Any] = {}
    for name in data.variables:
        values = data[name].values
        arrays[str(name)] = values.astype(object) if values.dtype.kind in "OUS" else values
    arrays["dimensions"] = {str(name): " ".join(map(str, data[name].dims)) or "none" for name in data.variables}
    with target.open("wb") as file:
        savemat(file, arrays, long_field_names=True, oned_as="column")
