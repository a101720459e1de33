"""The numbers of a branch for other programs: a CSV file with a line for each point, or a MATLAB file of all arrays."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.errors import InputError
from slipstick.faults import path as path_of
from slipstick.faults import wrong
from slipstick.replacing import replacing

if TYPE_CHECKING:
    import xarray

_ENDINGS = (".csv", ".mat")


def write_table(data: xarray.Dataset, path: str | Path) -> Path:
    """Write the dataset of a branch and return the path.

    A .csv file has a line for each point and a column for each number, such as ``displacement.x.c1 [m]``. A .mat file
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
                _csv(data, temporary)
            else:
                _mat(data, temporary)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"{target}: the table cannot be written ({reason}); choose another place") from None
    return target


def _csv(data: xarray.Dataset, target: Path) -> None:
    columns = [column for name in data.variables if "point" in data[name].dims for column in _columns(data[name])]
    with target.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([name for name, _ in columns])
        writer.writerows(zip(*(values for _, values in columns), strict=True))


def _columns(variable: xarray.DataArray) -> Iterator[tuple[str, list[Any]]]:
    """Name with labels and unit, and the values at all points."""
    variable = variable.transpose("point", ...)
    unit = str(variable.attrs.get("units", ""))
    behind = f" [{unit}]" if unit and unit != "1" else ""
    labels = [
        [str(label) for label in variable[dim].values] if dim in variable.coords else list(map(str, range(size)))
        for dim, size in list(variable.sizes.items())[1:]
    ]
    flat = variable.values.reshape(variable.sizes["point"], -1)
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
