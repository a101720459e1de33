"""The results file, netCDF-4, written point by point.

An HDF5 file that is written in place is lost when the process dies during a change. So each point is first appended to
a small journal (one write, nothing to corrupt), and the results file itself is always a complete file
that replaces the one before in a single step. It is renewed as often as costs at most a tenth of the running time
(points that take long: after every point) and at the end, when the journal is removed. After a kill the results file
opens with any netCDF reader, and ``ss.load`` adds what the journal holds beyond it.

Points are not held in memory: the results file is made from the journal, block by block.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.faults import path as path_of
from slipstick.faults import warn
from slipstick.io.journal import Journal, Recorded, journal_of
from slipstick.io.netcdf import UNLIMITED, Further, Group, StoredVariable, read_netcdf, write_netcdf
from slipstick.replacing import HDF5, replacing, writing
from slipstick.results.schema import Layout, make_table
from slipstick.results.table import ResultTable
from slipstick.typing import AnyArray, Array

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions

_SHARE = 10.0
_RETRY = 0.1
"""Seconds, times ``_SHARE``, to the next try where the results file could not be renewed; twice as long each time."""
_BLOCK = 32 * 1024**2
"""Bytes of points that are in memory at a time."""


class ResultStore:
    """Appends points to a results file; use it in a ``with`` block.

    Parameters
    ----------
    path
        The results file; its folder must exist.
    layout
        Variables, labels and attributes. :meth:`append` takes the numbers of a point by variable name; those left
        out are stored as nan.
    problem, without
        The problem, stored with the points; or the reason why there is none.
    about
        Texts and numbers that identify the run to one that continues it, stored in the journal.
    recorded, keep
        The journal of an earlier run to be continued, and how many of its points are kept.

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
        without: str = "it was not stored with the results",
    ) -> None:
        self.path = Path(path)
        self.layout = layout
        self.attributes: dict[str, Any] = dict(layout.attributes)
        self._problem = _described(problem, without)
        kept, places = (0, []) if recorded is None else (recorded.ends[keep], recorded.places[:keep])
        self._journal = Journal(journal_of(self.path), layout, about, kept, places)
        self._values: dict[str, AnyArray] = {}
        self._written, self._cost, self._when = -1, 0.0, 0.0
        try:
            self.write()
        except BaseException:
            self._journal.close(remove=recorded is None)
            raise
        self._cost = 0.0

    def __len__(self) -> int:
        return len(self._journal)

    def append(self, point: Mapping[str, Any], note: Mapping[str, Any] | None = None) -> None:
        """Add one point, ``{variable: value}``, and what a run goes on from there; it survives a kill from here on."""
        row = self.layout.pack(point)
        self._journal.append(row, note)
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
        if self._written == len(self._journal):
            return
        begin = time.perf_counter()
        with replacing(self.path) as temporary:
            blocks = file_blocks(self.layout, self._journal.rows, len(self))
            first = next(blocks)
            others = ({name: variable.values for name, variable in block.items()} for block in blocks)
            further = Further(len(self) - len(first[UNLIMITED].values), others)
            write_netcdf(temporary, Group(variables=first, attributes=self.attributes), self._problem, further)
        self._when = time.perf_counter()
        self._cost, self._written = self._when - begin, len(self._journal)

    def values(self) -> Mapping[str, AnyArray]:
        """Variables of all points so far, (n_points, ...), those of more than a block read on access."""
        if self._values:
            return self._values
        if self._journal.removed:
            stored = read_netcdf(self.path).variables
            return {name: stored[name].values for name in self.layout.variables}
        if 8 * self.layout.size * len(self) <= _BLOCK:
            return self.layout.unpack(self._journal.rows(0, len(self)))
        return _Read(self.layout, self._journal)

    def table(self) -> ResultTable:
        """All points so far, as the results file holds them after ``write``."""
        return make_table(self.layout, self.values(), self.attributes)

    def close(self, attributes: Mapping[str, Any] | None = None, *, finished: bool = True) -> None:
        """Write everything, with final attributes, and remove the journal where nobody will go on with the run.

        Once that is removed there is nothing left to close.
        """
        if self._journal.removed:
            return
        self.attributes.update(attributes or {})
        self._written = -1
        try:
            self.write()
            values = self.values()
            self._values = values if isinstance(values, dict) else {}
        except BaseException:
            self._journal.close(remove=False)
            raise
        self._journal.close(remove=finished)

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


class _Read(Mapping[str, AnyArray]):
    """Variables by name, each read from the journal on access."""

    def __init__(self, layout: Layout, journal: Journal) -> None:
        self._layout, self._journal = layout, journal

    def __getitem__(self, name: str) -> AnyArray:
        return self._layout.unpack_one(name, self._journal.columns(name))

    def __iter__(self) -> Iterator[str]:
        return iter(self._layout.variables)

    def __len__(self) -> int:
        return len(self._layout.variables)


def file_blocks(layout: Layout, rows: Callable[[int, int], Array], count: int) -> Iterator[dict[str, StoredVariable]]:
    """Coordinates and variables of points in the order of the file, block by block; one empty block of no points.

    ``rows`` are those (n_points, size) of the points from one number to before another.
    """
    blocks = max(1, -(-8 * layout.size * count // _BLOCK))
    step = max(1, -(-count // blocks))
    for first in range(0, max(count, 1), step):
        tables = layout.tables(layout.unpack(rows(first, min(first + step, count))), first)
        yield {
            name: StoredVariable(dims=dims, values=values, attributes=about) for name, (dims, values, about) in tables
        }


def _described(problem: Problem | None, without: str) -> dict[str, Group]:
    """A problem as arrays and JSON, or why there is none: the group of the file that holds it."""
    from slipstick.io.problem import GROUP, WITHOUT, describe

    return {GROUP: describe(problem) if problem is not None else Group(variables={}, attributes={WITHOUT: without})}


def save_branch(branch: Solutions, path: str | Path) -> Path:
    """Write a branch with its problem; an existing file is replaced only when the new one is complete.

    Raises
    ------
    InputError
        If the file cannot be written, or there is one that is no netCDF.

    Warns
    -----
    SlipstickWarning
        Where the problem cannot be stored.
    """
    from slipstick.io.problem import GROUP, WITHOUT

    path = path_of("save", path, "the path of a results file such as results.nc")
    groups = _described(branch.problem, branch.without)
    save_dataset(branch.dataset, path, groups)
    without = groups[GROUP].attributes.get(WITHOUT)
    if branch.problem is not None and without:
        warn([f"{path}: saved without the problem: {without}; give it to ss.load again"])
    return path


def save_dataset(dataset: xarray.Dataset, path: str | Path, groups: Mapping[str, Group] | None = None) -> None:
    """Write a whole dataset as netCDF-4; an existing file is replaced only when the new one is complete.

    Raises
    ------
    InputError
        If the file cannot be written, or there is one that is no netCDF.
    """
    variables = {
        str(name): StoredVariable(dims=tuple(map(str, v.dims)), values=v.to_numpy(), attributes=v.attrs)
        for name, v in sorted(dataset.variables.items(), key=lambda item: item[0] not in dataset.coords)
    }
    with writing(Path(path), HDF5) as temporary:
        write_netcdf(temporary, Group(variables=variables, attributes=dataset.attrs), groups)
