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
from slipstick.faults import one, warn
from slipstick.faults import path as path_of
from slipstick.io.journal import Journal, journal_of, read_journal
from slipstick.io.netcdf import Group, Variable, read_netcdf, write_netcdf
from slipstick.results.schema import Layout, make_dataset

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.results.branch import Branch

PROBLEM = "problem"
"""The group of a results file that holds what was computed."""

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
    problem
        What is computed, stored with the points.

    Raises
    ------
    OSError
        If the file cannot be written, already on opening, before anything is computed.
    """

    def __init__(self, path: str | Path, layout: Layout, problem: Problem | None = None) -> None:
        self.path = Path(path)
        self.layout = layout
        self.attributes: dict[str, Any] = dict(layout.attributes)
        self._problem = _described(problem)
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
            variables = _variables(self.layout, self.rows())
            write_netcdf(temporary, Group(variables=variables, attributes=self.attributes), {PROBLEM: self._problem})
        self._when = time.perf_counter()
        self._cost, self._written = self._when - begin, len(self._rows)

    def rows(self) -> NDArray[np.float64]:
        """All points so far, (n_points, numbers a point)."""
        return np.array(self._rows, dtype=float).reshape(len(self._rows), self.layout.size)

    def close(self, attributes: Mapping[str, Any] | None = None) -> None:
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
    tables = layout.tables(layout.unpack(rows))
    return {name: Variable(dims=dims, values=values, attributes=about) for name, (dims, values, about) in tables}


def _described(problem: Problem | None, without: str = "it was not stored with the results") -> Group:
    """A problem as arrays and JSON, or why there is none."""
    from slipstick.io.problem import WITHOUT, describe

    return describe(problem) if problem is not None else Group(variables={}, attributes={WITHOUT: without})


def save_branch(branch: Branch, path: str | Path) -> Path:
    """Write a branch with its problem; an existing file is replaced only when the new one is complete.

    Raises
    ------
    InputError
        If the file cannot be written.

    Warns
    -----
    SlipstickWarning
        Where the problem cannot be stored.
    """
    from slipstick.io.problem import WITHOUT

    path, problem = Path(path), _described(branch.problem, branch.without)
    try:
        save_dataset(branch.dataset, path, {PROBLEM: problem})
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: cannot be written ({reason}); choose another place") from None
    if branch.problem is not None and WITHOUT in problem.attributes:
        warn([f"{path}: saved without the problem: {problem.attributes[WITHOUT]}; give it to ss.load again"])
    return path


def save_dataset(dataset: xarray.Dataset, path: str | Path, groups: Mapping[str, Group] | None = None) -> None:
    """Write a whole dataset as netCDF-4; an existing file is replaced only when the new one is complete."""
    variables = {
        str(name): Variable(dims=tuple(map(str, v.dims)), values=v.to_numpy(), attributes=v.attrs)
        for name, v in sorted(dataset.variables.items(), key=lambda item: item[0] not in dataset.coords)
    }
    with replacing(Path(path)) as temporary:
        write_netcdf(temporary, Group(variables=variables, attributes=dataset.attrs), groups)


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
        found = read_netcdf(path)
        dataset = _as_dataset(found.variables, found.attributes)
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
    return make_dataset(layout, layout.unpack(rows), layout.attributes)


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


def load(path: str | Path, problem: Problem | None = None) -> Branch:
    """The branch in a results file, with its problem: it can be checked in time, drawn and gone on from.

    Parameters
    ----------
    path
        Written by ``Branch.save`` or by ``slipstick run``; points that a killed run left in the journal are read too.
    problem
        The problem, for results that could not store it: laws that are functions, structures of your own. Only what
        the numbers tell of it is compared.

    Returns
    -------
    Branch
        Where the problem is not known, ``problem`` is None and ``without`` says why; the numbers are there anyway.

    Raises
    ------
    InputError
        If there is no such file, it is no results file, or the problem given is of other results.

    Warns
    -----
    SlipstickWarning
        Where the stored problem cannot be read.
    """
    from slipstick.balance.problem import Problem
    from slipstick.io.problem import misfit, read_problem
    from slipstick.results.branch import Branch

    path, without = path_of("results", path, "the path of a results file"), ""
    if problem is not None:
        problem = one("problem", problem, Problem, "an ss.Problem or None")
    dataset = load_dataset(path)
    if problem is not None:
        fault = misfit(problem, dataset)
        if fault:
            raise InputError(f"{path}: these are results of another problem: {fault}")
    else:
        problem, without = read_problem(path, dataset)
    return Branch.from_dataset(dataset, problem, without)
