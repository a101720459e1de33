"""netCDF-4 files through h5py alone: a results file is renewed many times in a run, and read from strangers.

A netCDF-4 file is an HDF5 file with conventions: dimensions are dimension scales (numbered by ``_Netcdf4Dimid``), and
variables are attached to theirs. Any netCDF reader opens what is written here. For a curve of 163 points (33 variables,
0.3 MB) this takes 31 ms; h5netcdf takes 160 ms, and xarray with h5netcdf 300 ms, for the same file. Reading takes 48 ms
against 850 ms, and here sizes and links are looked at first. h5netcdf stays what xarray itself opens results with.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import SEEK_END, BytesIO
from itertools import count
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.io.hdf5 import CHECKED, attributes, check_summed, opened, own_node, require_own, sealed, texts
from slipstick.typing import AnyArray

if TYPE_CHECKING:
    import h5py


LARGEST_RESULTS = 16 * 1024**3
"""Bytes one file may unpack to."""

UNLIMITED = "point"
"""The dimension that may grow."""

_INTERNAL = {"CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates"}
_BARE = "This is a netCDF dimension but not a netCDF variable."


@dataclass(frozen=True, kw_only=True)
class StoredVariable:
    """Values with named dimensions and attributes; numbers or texts."""

    dims: tuple[str, ...]
    values: AnyArray
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Group:
    """Variables and attributes of a file, or of a group in it."""

    variables: Mapping[str, StoredVariable]
    attributes: Mapping[str, Any] = field(default_factory=dict)


def write_netcdf(path: Path, root: Group, groups: Mapping[str, Group] | None = None) -> None:
    """Write a new file; variables named as a dimension become its coordinates.

    The file is made in memory and written as a whole: HDF5 itself crashes where a disk fills up under it.
    """
    import h5py

    numbers, image = count(), BytesIO()
    with h5py.File(image, "w", track_order=True, libver=CHECKED) as file:
        _write(file, root, numbers)
        for name, group in (groups or {}).items():
            _write(file.create_group(name, track_order=True), group, numbers)
    with image.getbuffer() as buffer:
        image_end = sealed(buffer)
    image.seek(0, SEEK_END)
    image.write(image_end)
    path.write_bytes(image.getvalue())  # a view would outlive a failure to write in its traceback, and hold the buffer


def _write(place: h5py.Group, group: Group, numbers: Iterator[int]) -> None:
    """One group; ``numbers`` count the dimensions of the whole file."""
    variables = group.variables
    sizes = {dim: n for v in variables.values() for dim, n in zip(v.dims, v.values.shape, strict=True)}
    for dim, size in sizes.items():
        limits: tuple[int | None, ...] | None = (None,) if dim == UNLIMITED else None
        if dim in variables:
            scale = _create(place, dim, variables[dim], limits)
            scale.make_scale(dim)
        else:
            scale = place.create_dataset(dim, (size,), dtype="f4", **check_summed((size,), 4, limits))
            scale.make_scale(f"{_BARE} {size:>10d}")
        scale.attrs["_Netcdf4Dimid"] = np.int32(next(numbers))
    for name, variable in variables.items():
        if name not in sizes:
            shape = zip(variable.dims, variable.values.shape, strict=True)
            limits = tuple(None if d == UNLIMITED else n for d, n in shape)
            dataset = _create(place, name, variable, limits if UNLIMITED in variable.dims else None)
            for axis, dim in enumerate(variable.dims):
                dataset.dims[axis].attach_scale(place[dim])
    place.attrs.update(_storable(group.attributes))


def _create(
    file: h5py.Group, name: str, variable: StoredVariable, limits: tuple[int | None, ...] | None
) -> h5py.Dataset:
    import h5py

    values = variable.values
    options = check_summed(values.shape, values.dtype.itemsize, limits)
    if values.dtype.kind in "OUS":  # HDF5 has no check sum for these
        values, options = values.astype(object), options | {"dtype": h5py.string_dtype(), "fletcher32": False}
    dataset = file.create_dataset(name, data=values, **options)
    dataset.attrs.update(_storable(variable.attributes))
    return dataset


def _storable(attributes: Mapping[str, Any]) -> dict[str, Any]:
    kept = {name: value for name, value in attributes.items() if value is not None}
    return {name: int(value) if isinstance(value, bool | np.bool_) else value for name, value in kept.items()}


def read_netcdf(path: Path, group: str = "", *, limit: int = LARGEST_RESULTS) -> Group:
    """Variables and attributes of a file, or of one of its groups; a group that is not there is empty.

    Raises
    ------
    InputError
        If it would unpack to more than ``limit`` bytes.
    OSError, KeyError, ValueError
        If it is no such file, leads to others, or claims more than it holds.
    """
    import h5py

    with opened(path) as file:
        size = path.stat().st_size
        if group and group not in file:
            return Group(variables={})
        place = own_node(file, group) if group else file
        nodes = {name: own_node(place, name) for name in place}
        kept = {name: node for name, node in nodes.items() if isinstance(node, h5py.Dataset) and not _is_bare(node)}
        total = 0
        for node in kept.values():
            require_own(node)
            total += prod(node.shape) * node.dtype.itemsize
        if total > limit:
            raise InputError(f"{path}: unpacks to more than {limit / 1e9:.3g} GB; expected results of slipstick")
        variables = {
            name: StoredVariable(
                dims=tuple(_dims(file, node)), values=_values(node, size), attributes=_attributes(node)
            )
            for name, node in kept.items()
        }
        attributes = {name: value for name, value in _attributes(place).items() if name != "_NCProperties"}
        return Group(variables=variables, attributes=attributes)


def _is_bare(node: h5py.Dataset) -> bool:
    """Whether it is a dimension without values."""
    return _text(node.attrs.get("NAME", "")).startswith(_BARE)


def _dims(file: h5py.Group, node: h5py.Dataset) -> Iterator[str]:
    for axis in range(node.ndim):
        if node.is_scale:
            yield _last(node.name)
        else:
            yield _last(file[node.attrs["DIMENSION_LIST"][axis][0]].name)


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _values(node: h5py.Dataset, file_size: int) -> AnyArray:
    import h5py

    if h5py.check_string_dtype(node.dtype):
        return texts(node, file_size)
    if node.dtype.kind not in "fiu":
        raise ValueError(f"{node.name}: values of type {node.dtype}")
    return np.asarray(node[...])


def _attributes(node: h5py.Dataset) -> dict[str, Any]:
    return {name: _plain(value) for name, value in attributes(node, _INTERNAL).items()}


def _plain(value: object) -> Any:
    if isinstance(value, bytes):
        return _text(value)
    return value.item() if isinstance(value, np.ndarray) and value.shape == (1,) else value


def _text(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
