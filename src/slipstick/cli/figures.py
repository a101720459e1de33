"""The figures a run leaves beside its results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick import plots
from slipstick.cli.run_options import Wanted
from slipstick.plots import style as plots_style

if TYPE_CHECKING:
    import xarray

    from slipstick.case.case import Case

Drawings = dict[str, Callable[[], Any]]


def draw_figures(data: xarray.Dataset, case: Case, folder: Path, wanted: Wanted) -> list[str]:
    """Draw what is wanted; the names of what cannot be drawn from these results, where they were asked for."""
    dof = str(data["dof"].to_numpy()[int(data["amplitude"].max("point").to_numpy().argmax())])
    top = int(data["amplitude"].sel(dof=dof).to_numpy().argmax())
    drawings: Drawings = {
        "response": lambda: plots.response(data, dof, references=_references(case)),
        "mean": lambda: plots.mean(data, dof),
        "phase": lambda: plots.phase(data, dof),
        "spectrum": lambda: plots.spectrum(data, top, dof),
        "history": lambda: plots.history(data, top, dof),
    }
    if data.sizes["contact"]:
        drawings |= _contact_drawings(data, top)
    for name in [name for name in wanted.names if name in drawings]:
        plots.save_figure(drawings[name](), folder / name, formats=wanted.formats)
    return [] if wanted.all_there else [name for name in wanted.names if name not in drawings]


def _contact_drawings(data: xarray.Dataset, top: int) -> Drawings:
    """What shows the contacts; loops and states are those at the point ``top``, of the largest amplitude."""
    contact = _busiest(data)
    drawings: Drawings = {
        "power": lambda: plots.power(data),
        "fractions": lambda: plots.fractions(data, contact),
        "loop": lambda: plots.loops(data, top, contact)[0],
        "states": lambda: plots.states(data, top),
    }
    if np.ptp(data["friction_coefficient"].to_numpy()) > 0:
        drawings["friction"] = lambda: plots.friction(data, contact)
    if "temperature" in data and data["temperature"].notnull().any():
        drawings["temperature"] = lambda: plots.temperature(data, contact)
    return drawings


def _busiest(data: xarray.Dataset) -> str:
    """The contact that dissipates most."""
    return str(data["contact"].to_numpy()[int(data["dissipated_power"].max("point").to_numpy().argmax())])


def _references(case: Case) -> dict[str, Any]:
    """Linear responses without contact and fully stuck, over the range of frequencies."""
    if case.parameter is not None:
        return {}
    from slipstick.analysis.curve.linear import linear_references

    return dict(linear_references(case.balance, case.omega))


def draw_study(data: xarray.Dataset, folder: Path) -> list[Path]:
    """Map of the peaks of a study over its first parameters, and its curves by the first; the files written."""
    from slipstick.io.loading import load_dataset
    from slipstick.studies.folder import CURVES_FILE

    if not bool(data["peak_amplitude"].notnull().any()):
        return []
    dof = str(data["dof"].to_numpy()[int(np.nanargmax(data["peak_amplitude"].max(data["case"].dims).to_numpy()))])
    paths = []
    for name, ax in {
        "map": plots.study_map(data, dof),
        "curves": plots.study_curves(load_dataset(folder / CURVES_FILE), data, dof),
    }.items():
        plots_style.titled(ax.get_figure(root=True), str(data.attrs["title"]))
        paths += plots.save_figure(ax, folder / name)
    return paths
