"""The results file, netCDF-4, written point by point.

HDF5 files that are written in place are lost when the process dies in the middle of a change. So each point goes to a
small append-only journal first (one write, nothing to corrupt), and the results file itself is always a complete file
that replaces the one before in a single step. It is renewed as often as costs at most a tenth of the running time
(points that take long: after every point) and at the end, when the journal is removed. After a kill the results file
opens with any netCDF reader, and ``ss.load`` adds what the journal holds beyond it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.faults import path as path_of
from slipstick.faults import warn
from slipstick.io.journal import Journal, Recorded, journal_of
from slipstick.io.netcdf import Group, StoredVariable, write_netcdf
from slipstick.replacing import replacing
from slipstick.results.schema import Layout, make_table
from slipstick.results.table import ResultTable

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.branch import Branch

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
        Variables, labels and attributes. :meth:`append` takes the numbers of a point by variable name; those left
        out are stored as nan.
    problem
        What is computed, stored with the points.
    about
        What identifies the run, for whoever goes on with it: texts and numbers, kept in the journal.
    recorded, keep
        The journal of an earlier run to go on with, and how many of its points are kept.

    Raises
    ------
    OSError
        If the file cannot be written, already on opening, before anything is computed.
    """

    def __init__(
        self,
        path: str | Path,
        layout: Layout,
        problem: Problem | None = None,
        *,
        about: Mapping[str, Any] | None = None,
        recorded: Recorded | None = None,
        keep: int = 0,
    ) -> None:
        self.path = Path(path)
        self.layout = layout
        self.attributes: dict[str, Any] = dict(layout.attributes)
        self._problem = _described(problem)
        self._rows: list[NDArray[np.float64]] = [] if recorded is None else list(recorded.rows[:keep])
        kept = 0 if recorded is None else recorded.ends[keep]
        self._journal = Journal(journal_of(self.path), layout, about, kept)
        self._written, self._cost, self._when = -1, 0.0, 0.0
        try:
            self.write()
        except BaseException:
            self._journal.close(remove=recorded is None)
            raise
        self._cost = 0.0

    def __len__(self) -> int:
        return len(self._rows)

    def append(self, point: Mapping[str, Any], note: Mapping[str, Any] | None = None) -> None:
        """Add one point, ``{variable: value}``, and what a run goes on from there; it survives a kill from here on."""
        row = self.layout.pack(point)
        self._journal.append(row, note)
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
            variables = file_variables(self.layout, self.rows())
            write_netcdf(temporary, Group(variables=variables, attributes=self.attributes), self._problem)
        self._when = time.perf_counter()
        self._cost, self._written = self._when - begin, len(self._rows)

    def rows(self) -> NDArray[np.float64]:
        """All points so far, (n_points, numbers a point)."""
        return np.array(self._rows, dtype=float).reshape(len(self._rows), self.layout.size)

    def table(self) -> ResultTable:
        """All points so far, as the results file holds them after ``write``."""
        return make_table(self.layout, self.layout.unpack(self.rows()), self.attributes)

    def close(self, attributes: Mapping[str, Any] | None = None, *, finished: bool = True) -> None:
        """Write everything, with final attributes, and remove the journal where nobody will go on with the run."""
        self.attributes.update(attributes or {})
        self._written = -1
        try:
            self.write()
        except BaseException:
            self._journal.close(remove=False)
            raise
        self._journal.close(remove=finished)

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def file_variables(layout: Layout, rows: NDArray[np.float64]) -> dict[str, StoredVariable]:
    """Coordinates and variables of points, as they stand in the file."""
    tables = layout.tables(layout.unpack(rows))
    return {name: StoredVariable(dims=dims, values=values, attributes=about) for name, (dims, values, about) in tables}


def _described(problem: Problem | None, without: str = "it was not stored with the results") -> dict[str, Group]:
    """A problem as arrays and JSON, or why there is none: the group of the file that holds it."""
    from slipstick.io.problem import GROUP, WITHOUT, describe

    return {GROUP: describe(problem) if problem is not None else Group(variables={}, attributes={WITHOUT: without})}


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
    from slipstick.io.problem import GROUP, WITHOUT

    path = path_of("save", path, "the path of a results file such as results.nc")
    groups = _described(branch.problem, branch.without)
    try:
        save_dataset(branch.dataset, path, groups)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: cannot be written ({reason}); choose another place") from None
    without = groups[GROUP].attributes.get(WITHOUT)
    if branch.problem is not None and without:
        warn([f"{path}: saved without the problem: {without}; give it to ss.load again"])
    return path


def save_dataset(dataset: xarray.Dataset, path: str | Path, groups: Mapping[str, Group] | None = None) -> None:
    """Write a whole dataset as netCDF-4; an existing file is replaced only when the new one is complete."""
    variables = {
        str(name): StoredVariable(dims=tuple(map(str, v.dims)), values=v.to_numpy(), attributes=v.attrs)
        for name, v in sorted(dataset.variables.items(), key=lambda item: item[0] not in dataset.coords)
    }
    with replacing(Path(path)) as temporary:
        write_netcdf(temporary, Group(variables=variables, attributes=dataset.attrs), groups)
