"""Any results as a table for other programs: files, folders and datasets by one road."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.errors import InputError
from slipstick.faults import path as path_of
from slipstick.faults import wrong
from slipstick.io.loading import load, load_dataset, load_table, require_branch
from slipstick.results.run_up import RunUp
from slipstick.results.saved_table import is_universal, write_table, write_table_of
from slipstick.results.solutions import Solutions
from slipstick.results.table import is_dataset
from slipstick.results.view import analysis_of
from slipstick.runs.folder import results_of
from slipstick.studies import CURVES_FILE
from slipstick.studies.table import curves_with_parameters

if TYPE_CHECKING:
    import xarray


def save_table(results: Any, path: str | Path, table: str | None = None) -> Path:
    """Write results for other programs and return the path: a .csv file, one table, or .xlsx and .mat, all of them.

    Of a frequency response also .uff, its response functions: see ``Branch.save_table``.

    Parameters
    ----------
    results
        A results file or its folder (of a run, a study, a run-up, a fit), or a dataset: of ``ss.study``, its curves,
        percentiles, sensitivities, Sobol indices, a diagram. Branches, run-ups, fits and integrations in time have
        ``save_table`` themselves.
    path
        The file to write; its ending says what it becomes.
    table
        Which table: by default the first one in a .csv file, all in others. A table is called by its rows, such as
        "point" or "peaks" of a branch, "period" or "envelope" of a run-up, "parameter" of a fit; a wrong name lists
        them. Of a study in a folder "curves" has all curves, one after another, with the number and the parameters of
        the case in each line.

    Raises
    ------
    InputError
        For what are no results, another ending or table, and where the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.ContactPair(name="damper", contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0),
    ...     tangential="x")
    >>> problem = ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=range(6))
    >>> found = ss.study(problem, {"load.x.amplitude": [50.0, 100.0]}, omega=(5.0, 7.0), workers=1)
    >>> with TemporaryDirectory() as folder:
    ...     file = ss.runs.save_table(found[["peak_amplitude", "outcome"]], f"{folder}/peaks.csv")
    ...     print(file.read_text().splitlines()[0])
    load.x.amplitude [force],peak_amplitude.x [length],outcome
    """
    if isinstance(results, str | PathLike):
        return _of_file(path_of("results", results, "a results file or its folder"), path, table)
    if hasattr(results, "to_dataset") and hasattr(results, "dims"):  # one labelled array, as a spectrogram
        results = results.to_dataset(name=results.name or "value")
    if not is_dataset(results):
        raise wrong("results", results, "a results file or its folder, or an xarray.Dataset")
    return write_table(results, path, table)


def _of_file(given: Path, path: str | Path, table: str | None) -> Path:
    file = results_of(given)
    found = load_table(file)
    analysis = analysis_of(found)
    if analysis not in ("study", "curves", "run_up", "identify"):
        require_branch(found, file)
        return write_table_of(load(file) if is_universal(path) else Solutions.from_dataset(found), path, table)
    data = found.to_dataset()
    if analysis == "run_up":
        return RunUp(data).save_table(path, table)
    return write_table(data, path, table, {"curves": lambda: _curves(file, data)} if analysis == "study" else None)


def _curves(file: Path, study: xarray.Dataset) -> xarray.Dataset:
    beside = file.parent / CURVES_FILE
    if not beside.is_file():
        raise InputError(f"{beside}: there is no such file; the curves of a study stand beside it")
    return curves_with_parameters(load_dataset(beside), study)
