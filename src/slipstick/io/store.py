"""The results file, netCDF-4, written point by point.

HDF5 files that are written in place are lost when the process dies in the middle of a change. So each point goes to a
small append-only journal first (one write, nothing to corrupt), and the results file itself is always a complete file
that replaces the one before in a single step. It is renewed as often as costs at most a tenth of the running time
(points that take long: after every point) and at the end, when the journal is removed. After a kill the results file
opens with any netCDF reader, and :func:`load` adds what the journal holds beyond it.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError, SlipstickWarning
from slipstick.io.journal import Journal, Layout, journal_of, read_journal
from slipstick.io.netcdf import Variable, read_netcdf, write_netcdf

if TYPE_CHECKING:
    import xarray

    from slipstick.results.branch import Branch

_SHARE = 10.0
_RETRY = 0.1
"""Seconds, times ``_SHARE``, to the next try where the results file could not be renewed; twice as long each time."""


class ResultStore:
    """Appends points to a results file; use it in a ``with`` block.

    Parameters
    ----------
    path
        The results file; its folder must exist.
    layout
        Variables, labels and attributes. The numbers of a point are given to :meth:`append` by variable name; those
        left out are stored as nan.

    Raises
    ------
    OSError
        If the file cannot be written, already on opening, before anything is computed.
    """

    def __init__(self, path: str | Path, layout: Layout) -> None:
        self.path = Path(path)
        self.layout = layout
        self.attributes: dict[str, str] = dict(layout.attributes)
        self._rows: list[NDArray[np.float64]] = []
        self._journal = Journal(journal_of(self.path), layout)
        self._written, self._cost, self._when = -1, 0.0, 0.0
        try:
            self.write()
        except BaseException:
            self._journal.close(remove=True)
            raise
        self._cost = 0.0

    def __len__(self) -> int:
        return len(self._rows)

    def append(self, point: Mapping[str, Any]) -> None:
        """Add one point, ``{variable: value}``; it survives a kill from here on."""
        row = self.layout.pack(point)
        self._journal.append(row)
        self._rows.append(row)
        if time.perf_counter() - self._when > _SHARE * self._cost:
            self._renew()

    def _renew(self) -> None:
        """Bring the results file up to date if it can be; the journal has the point anyway."""
        begin = time.perf_counter()
        try:
            self.write()
        except OSError:
            self._when = time.perf_counter()
            self._cost = max(2.0 * self._cost, self._when - begin, _RETRY)

    def write(self) -> None:
        """Bring the results file up to date, in one step."""
        if self._written == len(self._rows):
            return
        begin = time.perf_counter()
        with replacing(self.path) as temporary:
            write_netcdf(temporary, _variables(self.layout, self.rows()), self.attributes)
        self._when = time.perf_counter()
        self._cost, self._written = self._when - begin, len(self._rows)

    def rows(self) -> NDArray[np.float64]:
        """All points so far, (n_points, numbers a point)."""
        return np.array(self._rows, dtype=float).reshape(len(self._rows), self.layout.size)

    def close(self, attributes: Mapping[str, str] | None = None) -> None:
        """Write everything, with final attributes, and remove the journal."""
        self.attributes.update(attributes or {})
        self._written = -1
        try:
            self.write()
        except BaseException:
            self._journal.close(remove=False)
            raise
        self._journal.close(remove=True)

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside ``path`` that takes its place at the end; on any failure ``path`` stays as it was."""
    temporary = path.with_name(f"{_part(path)}{os.getpid()}.tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _part(path: Path) -> str:
    return f".{path.name}."


def remove_leftovers(path: Path) -> None:
    """Remove the unfinished parts that killed writers of ``path`` left; only for whom no other writer disturbs."""
    for part in path.parent.iterdir():
        if part.name.startswith(_part(path)) and part.name.endswith(".tmp"):
            part.unlink(missing_ok=True)


def _variables(layout: Layout, rows: NDArray[np.float64]) -> dict[str, Variable]:
    """Coordinates and variables of points, as they stand in the file."""

    def described(name: str, dims: tuple[str, ...], values: NDArray[Any]) -> Variable:
        units, long_name = layout.meanings.get(name, ("1", name.replace("_", " ")))
        return Variable(dims=dims, values=values, attributes={"units": units, "long_name": long_name})

    found = {"point": described("point", ("point",), np.arange(len(rows)))}
    for dim, labels in layout.labels.items():
        found[dim] = described(dim, (dim,), np.array(labels, dtype=object))
    for name, values in layout.unpack(rows).items():
        found[name] = described(name, ("point", *layout.variables[name]), values)
    return found


def save_dataset(dataset: xarray.Dataset, path: str | Path) -> None:
    """Write a whole dataset as netCDF-4; an existing file is replaced only when the new one is complete."""
    variables = {
        str(name): Variable(dims=tuple(map(str, v.dims)), values=v.to_numpy(), attributes=v.attrs)
        for name, v in dataset.variables.items()
    }
    with replacing(Path(path)) as temporary:
        write_netcdf(temporary, variables, dataset.attrs)


def load_dataset(path: str | Path) -> xarray.Dataset:
    """The dataset of a results file, in memory, with the points a killed run left in the journal beside it.

    A journal that is damaged, or none of this results file, is left alone with a SlipstickWarning.

    Raises
    ------
    InputError
        If there is no such file or it is no results file.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; expected a results file such as results.nc")
    try:
        variables, attributes = read_netcdf(path)
        dataset = _as_dataset(variables, attributes)
    except InputError:
        raise
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError, RuntimeError) as error:
        raise InputError(f"{path}: not a results file in netCDF-4 ({error}); give one from 'slipstick run'") from None
    try:
        return _continued(dataset, journal_of(path))
    except InputError as error:
        warnings.warn(f"{error}; {path.name} was read without it", SlipstickWarning, stacklevel=2)
        return dataset


def _continued(dataset: xarray.Dataset, journal: Path) -> xarray.Dataset:
    """The dataset with the points that only its journal holds; raises InputError where that is not its journal."""
    if not journal.is_file():
        return dataset
    layout, rows = read_journal(journal)
    found = _variables(layout, rows)
    if not _begins_alike(dataset, layout, found):
        raise InputError(f"{journal}: not the journal of these results")
    if len(rows) <= dataset.sizes.get("point", 0):
        return dataset
    return _as_dataset(found, layout.attributes)


def _begins_alike(dataset: xarray.Dataset, layout: Layout, found: Mapping[str, Variable]) -> bool:
    """Whether results and journal are of one run: same names, dimensions and attributes, and the same first points."""
    if set(found) != set(map(str, dataset.variables)) or dict(layout.attributes) != dataset.attrs:
        return False
    common = min(dataset.sizes.get("point", 0), len(found["point"].values))
    for name, variable in found.items():
        known = dataset[name]
        if known.dims != variable.dims or known.shape[1:] != variable.values.shape[1:]:
            return False
        a, b = known.to_numpy(), variable.values
        if "point" in variable.dims:
            a, b = a[:common], b[:common]
        if not np.array_equal(a, b, equal_nan=a.dtype.kind == "f"):
            return False
    return True


def _as_dataset(variables: Mapping[str, Variable], attributes: Mapping[str, Any]) -> xarray.Dataset:
    import xarray

    dims = {dim for v in variables.values() for dim in v.dims}
    parts: dict[bool, dict[str, Any]] = {True: {}, False: {}}
    for name, v in variables.items():
        texts = v.values.astype(str) if v.values.dtype == object else v.values
        parts[name in dims][name] = (v.dims, texts, dict(v.attributes))
    return xarray.Dataset(parts[False], coords=parts[True], attrs=dict(attributes))


def load(path: str | Path) -> Branch:
    """The branch in a results file, without its problem (what needs the problem says so)."""
    from slipstick.results.branch import Branch

    return Branch.from_dataset(load_dataset(path))
