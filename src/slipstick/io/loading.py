"""Results files read again: the numbers, the points that a killed run left in the journal, and the problem."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError, SlipstickWarning
from slipstick.faults import one
from slipstick.faults import path as path_of
from slipstick.io.journal import journal_of, read_journal
from slipstick.io.netcdf import StoredVariable, read_netcdf
from slipstick.io.store import file_variables
from slipstick.results.schema import ENDING, Layout, make_dataset

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.results.branch import Branch


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
    layout, rows, *_ = read_journal(journal)
    found = file_variables(layout, rows)
    if not _begins_alike(dataset, layout, found):
        raise InputError(f"{journal}: not the journal of these results")
    if len(rows) <= dataset.sizes.get("point", 0):
        return dataset
    return make_dataset(layout, layout.unpack(rows), layout.attributes)


def _begins_alike(dataset: xarray.Dataset, layout: Layout, found: Mapping[str, StoredVariable]) -> bool:
    """Whether results and journal are of one run: same names, dimensions and attributes, and the same first points."""
    if set(found) != set(map(str, dataset.variables)):
        return False
    if any(dataset.attrs.get(name) != value for name, value in layout.attributes.items() if name not in ENDING):
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


def _as_dataset(variables: Mapping[str, StoredVariable], attributes: Mapping[str, Any]) -> xarray.Dataset:
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
