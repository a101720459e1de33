"""Results by name without xarray, whose import takes longer than computing and writing a curve; datasets of others.

A ``ResultTable`` has those members of an ``xarray.Dataset`` that this package uses, and converts to one on request.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError, first_line
from slipstick.typing import AnyArray

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class ResultColumn:
    """One variable: names of its dimensions, values, attributes."""

    dims: tuple[str, ...]
    values: AnyArray
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def to_numpy(self) -> AnyArray:
        """The values."""
        return self.values


@dataclass(frozen=True, repr=False)
class ResultTable:
    """Variables and coordinates, which are those named as a dimension, with attributes of the whole."""

    variables: Mapping[str, ResultColumn]
    attrs: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, dataset: xarray.Dataset) -> ResultTable:
        """The variables of a dataset, which share its arrays and attributes."""
        known = {
            str(name): ResultColumn(tuple(map(str, v.dims)), v.to_numpy(), v.attrs)
            for name, v in dataset.variables.items()
        }
        return cls(known, dataset.attrs)

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Sizes of the dimensions."""
        return {d: n for v in self.variables.values() for d, n in zip(v.dims, v.values.shape, strict=True)}

    @property
    def dims(self) -> frozenset[str]:
        """Names of the dimensions."""
        return frozenset(self.sizes)

    @property
    def data_vars(self) -> dict[str, ResultColumn]:
        """Variables that are no coordinates."""
        return {name: column for name, column in self.variables.items() if name not in self.sizes}

    def __getitem__(self, name: str) -> ResultColumn:
        return self.variables[name]

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __iter__(self) -> Iterator[str]:
        return iter(self.data_vars)

    def at(self, points: Sequence[int]) -> ResultTable:
        """Some of the points, in the order given."""
        kept = {
            name: ResultColumn(v.dims, np.take(v.values, points, v.dims.index("point")), v.attrs)
            if "point" in v.dims
            else v
            for name, v in self.variables.items()
        }
        return ResultTable(kept, self.attrs)

    def to_dataset(self) -> xarray.Dataset:
        """The same as a dataset, which shares arrays with it."""
        import xarray

        parts: dict[bool, dict[str, Any]] = {True: {}, False: {}}
        for name, column in self.variables.items():
            parts[name in self.sizes][name] = (column.dims, column.values, dict(column.attrs))
        return xarray.Dataset(parts[False], coords=parts[True], attrs=dict(self.attrs))


def is_dataset(value: Any, *variables: str) -> bool:
    """Whether a value is a dataset of xarray with some variables; does not import xarray."""
    return hasattr(value, "data_vars") and set(variables) <= set(value.variables)


def foreign_dataset(file: Path) -> xarray.Dataset:
    """The dataset in a netCDF-4 file of any origin; InputError where it cannot be read."""
    import xarray

    try:
        with xarray.open_dataset(file, engine="h5netcdf") as data:
            return data.load()
    except (OSError, ValueError) as error:
        raise InputError(Fault(str(file), "cannot be read as netCDF-4", remedy=first_line(error))) from None
