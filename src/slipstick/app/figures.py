"""The figures a run leaves beside its results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick import plots
from slipstick.errors import InputError

if TYPE_CHECKING:
    import xarray

    from slipstick.app.case import Case

_SAMPLES = 1501


def draw_figures(data: xarray.Dataset, case: Case, folder: Path) -> list[Path]:
    """Draw everything that says something about the results; the files written."""
    dof = str(data["dof"].to_numpy()[int(data["amplitude"].max("point").to_numpy().argmax())])
    drawings: dict[str, Callable[[], Any]] = {
        "response": lambda: plots.response(data, dof, references=_references(case)),
        "mean": lambda: plots.mean(data, dof),
    }
    if data.sizes["contact"]:
        drawings["power"] = lambda: plots.power(data)
        drawings["fractions"] = lambda: plots.fractions(data, _busiest(data))
    if data.sizes["contact"] and np.ptp(data["friction_coefficient"].to_numpy()) > 0:
        drawings["friction"] = lambda: plots.friction(data)
    if "temperature" in data:
        drawings["temperature"] = lambda: plots.temperature(data, _busiest(data))
    paths = []
    for name, draw in drawings.items():
        ax = draw()
        ax.set_title(f"{case.title} ({dof})" if name in ("response", "mean") else case.title, fontsize="medium")
        paths += plots.save_figure(ax, folder / name)
    return paths


def _busiest(data: xarray.Dataset) -> str:
    """The contact that dissipates most."""
    return str(data["contact"].to_numpy()[int(data["dissipated_power"].max("point").to_numpy().argmax())])


def _references(case: Case) -> dict[str, Any]:
    """Linear responses without contact and fully stuck, over the range of frequencies."""
    if case.parameter is not None or not case.problem().contacts:
        return {}
    from slipstick.analysis.response import linear_response

    grid = np.linspace(min(case.omega), max(case.omega), _SAMPLES)
    found: dict[str, Any] = {}
    for state, label in (("free", "without contact"), ("stuck", "stuck")):
        try:
            found[label] = linear_response(case.problem(), omega=grid, state=state)  # type: ignore[arg-type]
        except InputError:
            continue
    return found
