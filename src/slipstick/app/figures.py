"""The figures a run leaves beside its results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick import plots

if TYPE_CHECKING:
    import xarray

    from slipstick.app.case import Case


def draw_figures(data: xarray.Dataset, case: Case, folder: Path) -> list[Path]:
    """Draw everything that says something about the results; the files written."""
    dof = str(data["dof"].to_numpy()[int(data["amplitude"].max("point").to_numpy().argmax())])
    drawings: dict[str, Callable[[], Any]] = {
        "response": lambda: plots.response(data, dof, references=_references(case)),
        "mean": lambda: plots.mean(data, dof),
    }
    titles = dict.fromkeys(drawings, dof)
    if data.sizes["contact"]:
        added, of = _contact_drawings(data, dof)
        drawings |= added
        titles |= of
    paths = []
    for name, draw in drawings.items():
        ax = draw()
        about = f" ({titles[name]})" if titles.get(name) else ""
        ax.get_figure().suptitle(f"{case.title}{about}", parse_math=False, fontsize="medium")
        paths += plots.save_figure(ax, folder / name)
    return paths


def _contact_drawings(data: xarray.Dataset, dof: str) -> tuple[dict[str, Callable[[], Any]], dict[str, str]]:
    """What shows the contacts, and what to add to the titles; loops and states are those at the largest amplitude."""
    from slipstick.results.branch import Branch

    contact, branch = _busiest(data), Branch.from_dataset(data)
    top = int(data["amplitude"].sel(dof=dof).to_numpy().argmax())
    where = f"at {plots.abscissa_text(data, top)}"
    drawings: dict[str, Callable[[], Any]] = {
        "power": lambda: plots.power(data),
        "fractions": lambda: plots.fractions(data, contact),
        "loop": lambda: branch.plot.loop(top, contact),
        "states": lambda: branch.plot.states(top),
    }
    if np.ptp(data["friction_coefficient"].to_numpy()) > 0:
        drawings["friction"] = lambda: plots.friction(data, contact)
    if "temperature" in data and data["temperature"].notnull().any():
        drawings["temperature"] = lambda: plots.temperature(data, contact)
    titles = dict.fromkeys(drawings, contact)
    return drawings, titles | {"power": "", "loop": f"{contact}, {where}", "states": where}


def _busiest(data: xarray.Dataset) -> str:
    """The contact that dissipates most."""
    return str(data["contact"].to_numpy()[int(data["dissipated_power"].max("point").to_numpy().argmax())])


def _references(case: Case) -> dict[str, Any]:
    """Linear responses without contact and fully stuck, over the range of frequencies."""
    if case.parameter is not None:
        return {}
    from slipstick.app.references import linear_references

    return dict(linear_references(case.problem(), case.omega))
