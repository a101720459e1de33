"""Datasets that other programs wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    import xarray


def is_dataset(value: Any, *variables: str) -> bool:
    """Whether it is a dataset of xarray that has some variables; xarray itself is not needed to tell."""
    return hasattr(value, "data_vars") and set(variables) <= set(value.variables)


def foreign_dataset(file: Path) -> xarray.Dataset:
    """What a netCDF-4 file of any origin holds; InputError where it cannot be read."""
    import xarray

    try:
        with xarray.open_dataset(file, engine="h5netcdf") as data:
            return data.load()
    except (OSError, ValueError) as error:
        raise InputError(Fault(str(file), "cannot be read as netCDF-4", remedy=str(error).splitlines()[0])) from None
