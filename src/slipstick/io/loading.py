"""Loading results files: the numbers, the points that a killed run left in the journal, and the problem."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError, SlipstickWarning
from slipstick.faults import one, warn
from slipstick.faults import path as path_of
from slipstick.io.journal import Recorded, journal_of, read_journal
from slipstick.io.model_file import is_model
from slipstick.io.netcdf import UNLIMITED, StoredVariable, read_netcdf
from slipstick.io.store import file_blocks
from slipstick.results.schema import ANALYSIS, ENDING, make_table
from slipstick.results.table import ResultColumn, ResultTable
from slipstick.results.view import analysis_of, analysis_of_journal
from slipstick.typing import AnyArray

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.branch import Branch


def load_dataset(path: str | Path) -> xarray.Dataset:
    """The dataset of a results file, in memory; as ``load_table``."""
    return load_table(path).to_dataset()


def load_table(path: str | Path) -> ResultTable:
    """The numbers of a results file, in memory, with the points that a killed run left in its journal.

    A journal of other results is ignored, and so are points behind damage in it, both with a SlipstickWarning.

    Raises
    ------
    InputError
        If there is no such file or it is no results file.
    """
    path = Path(path)
    if path.is_dir():
        inside = next((name for name in ("results.nc", "study.nc") if (path / name).is_file()), None)
        remedy = f"give {path / inside}" if inside else "there is no results.nc in it"
        raise InputError(f"{path}: is a folder; expected a results file such as results.nc: {remedy}")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; expected a results file such as results.nc")
    kind = _no_results(path)
    if kind:
        raise InputError(f"{path}: not a results file: it is {kind}; give a results.nc of 'slipstick run'")
    columns, attributes = _columns(path)
    try:
        return _named(_continued(columns, attributes, journal_of(path)))
    except InputError as error:
        warnings.warn(f"{error}; {path.name} was read without it", SlipstickWarning, stacklevel=2)
        return _named(ResultTable(columns, attributes))


def _named(table: ResultTable) -> ResultTable:
    """The table with the name of its analysis, which older files do not have."""
    if analysis := analysis_of(table):
        table.attrs.setdefault(ANALYSIS, analysis)
    return table


def _columns(path: Path) -> tuple[dict[str, ResultColumn], dict[str, Any]]:
    """Variables and attributes of a results file; raises InputError where it is none."""
    try:
        group = read_netcdf(path)
        return _checked(group.variables), dict(group.attributes)
    except InputError:
        raise
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError, RuntimeError) as error:
        if is_model(path):
            raise InputError(f"{path}: not a results file: it is a model, the structure of a case") from None
        raise InputError(
            f"{path}: damaged, or not a results file in netCDF-4 ({error}); give one from 'slipstick run'"
        ) from None


_OTHERS = {
    b"\x89PNG": "a picture (PNG)",
    b"\xff\xd8\xff": "a picture (JPEG)",
    b"%PDF": "a PDF",
    b"PK\x03\x04": "a zip archive, or arrays of numpy (.npz)",
    b"CDF": "netCDF-3, which slipstick does not write",
}


def _no_results(path: Path) -> str:
    """What a file is by its first bytes, where it cannot be netCDF-4; empty where it may be."""
    try:
        with path.open("rb") as stream:
            begin = stream.read(4096)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()})") from None
    if not begin:
        return "empty"
    for mark, kind in _OTHERS.items():
        if begin.startswith(mark):
            return kind
    if b"\0" in begin:
        return ""
    if begin[9:].startswith(b'{"magic": "slipstick journal'):
        return "a journal, the points of a run that did not end; go on with it by 'slipstick resume', in its folder"
    page = begin.lstrip().lower().startswith((b"<!doctype", b"<html"))
    if page:
        return "a page for a browser"
    return f"text{', such as a case file' if path.suffix.lower() == '.toml' else ''}"


def _continued(columns: dict[str, ResultColumn], attributes: dict[str, Any], journal: Path) -> ResultTable:
    """The table with the points that only its journal holds; raises InputError where that is not its journal.

    Columns are taken out of ``columns`` as they are made longer, so that points are in memory once; none before all is
    read.
    """
    table = ResultTable(columns, attributes)
    if not journal.is_file():
        return table
    recorded = read_journal(journal)
    if analysis_of_journal(recorded.about) == "run_up":
        # of periods, not points: what goes on from it brings them together
        return table
    if recorded.damage:
        warn([recorded.damage])
    if not _begins_alike(table, recorded):
        raise InputError(f"{journal}: not the journal of these results")
    known = table.sizes.get("point", 0)
    if len(recorded) <= known:
        return table
    further = _beyond(recorded, known)
    values = {name: np.concatenate([columns.pop(name).values, further.pop(name)]) for name in list(further)}
    return make_table(recorded.layout, values, recorded.layout.attributes)


def _beyond(recorded: Recorded, first: int) -> dict[str, AnyArray]:
    """Variables of the points from ``first`` on, each in memory of its own."""
    layout, count = recorded.layout, len(recorded) - first
    none = layout.unpack(np.empty((0, layout.size)))
    values = {name: np.empty((count, *like.shape[1:]), like.dtype) for name, like in none.items()}
    for block in file_blocks(layout, lambda begin, end: recorded.part(first + begin, first + end), count):
        at = block[UNLIMITED].values
        for name, whole in values.items():
            whole[at] = block[name].values
    return values


def _begins_alike(table: ResultTable, recorded: Recorded) -> bool:
    """Whether results and journal are of one run: same names, dimensions and attributes, and the same first points."""
    layout, common = recorded.layout, min(table.sizes.get("point", 0), len(recorded))
    if any(table.attrs.get(name) != value for name, value in layout.attributes.items() if name not in ENDING):
        return False
    return all(_alike(table, variables) for variables in file_blocks(layout, recorded.part, common))


def _alike(table: ResultTable, variables: Mapping[str, StoredVariable]) -> bool:
    """Whether results hold the same at the points of some of their variables."""
    if set(variables) != set(table.variables):
        return False
    points = variables[UNLIMITED].values
    for name, variable in variables.items():
        known, b = table[name], variable.values
        if known.dims != variable.dims or known.values.shape[1:] != b.shape[1:]:
            return False
        a = known.values[points] if UNLIMITED in variable.dims else known.values
        if not np.array_equal(a, b, equal_nan=a.dtype.kind == "f"):
            return False
    return True


def _checked(variables: Mapping[str, StoredVariable]) -> dict[str, ResultColumn]:
    """Variables as columns; raises ValueError where they do not agree about the size of a dimension."""
    texts = {name: v.values.astype(str) if v.values.dtype == object else v.values for name, v in variables.items()}
    columns = {name: ResultColumn(v.dims, texts[name], dict(v.attributes)) for name, v in variables.items()}
    sizes = ResultTable(columns).sizes
    for name, v in columns.items():
        if v.values.shape != tuple(sizes[dim] for dim in v.dims):
            raise ValueError(f"'{name}' has another size than the others")
    return columns


def load(path: str | Path, problem: Problem | None = None) -> Branch:
    """The branch in a results file, with its problem: it can be checked in time, drawn and gone on from.

    Parameters
    ----------
    path
        Written by ``Branch.save`` or by ``slipstick run``; points that a killed run left in the journal are read too.
    problem
        The problem, for results that could not store it: laws that are functions, your own structures. It is
        compared with the stored numbers as far as these determine it.

    Returns
    -------
    Branch
        Where the problem is not known, ``problem`` is None and ``without`` says why; the numbers are there anyway.

    Raises
    ------
    InputError
        If there is no such file, it is no results file, or ``problem`` is that of other results.

    Warns
    -----
    SlipstickWarning
        Where the stored problem cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0), harmonics=range(6))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     saved = ss.forced_response(problem, (4.0, 14.0)).save(Path(folder) / "results.nc")
    ...     branch = ss.load(saved)
    >>> [(round(omega, 3), round(amplitude, 3)) for omega, amplitude in branch.peaks("x")]
    [(6.467, 0.533)]
    """
    from slipstick.balance.problem import Problem
    from slipstick.branch import Branch
    from slipstick.io.problem import misfit, read_problem

    path, without = path_of("results", path, "the path of a results file"), ""
    if problem is not None:
        problem = one("problem", problem, Problem, "an ss.Problem or None")
    table = load_table(path)
    require_branch(table, path)
    if problem is not None:
        fault = misfit(problem, table)
        if fault:
            raise InputError(f"{path}: these are results of another problem: {fault}")
    else:
        problem, without = read_problem(path, table)
    return Branch.from_dataset(table, problem, without)


def require_branch(table: ResultTable, path: Path) -> None:
    """Raises InputError for netCDF that holds something else than a branch."""
    analysis = analysis_of(table)
    if analysis == "run_up":
        raise InputError(f"{path}: holds a run-up, motion in time, not a curve; ss.resume of its folder gives it")
    if "omega" in table and "displacement" in table:
        return
    if analysis in ("study", "curves"):
        raise InputError(
            f"{path}: holds a study, not the motion of one run; give the results.nc of a run "
            "(xarray.open_dataset reads a study)"
        )
    held = ", ".join(sorted(map(str, table))[:4]) or "nothing"
    raise InputError(
        f"{path}: is netCDF, but holds no results of slipstick: found {held}; expected omega, displacement, ..."
    )
