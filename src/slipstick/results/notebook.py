"""A branch as a notebook shows it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from slipstick.html import MOST_SHOWN, html_table
from slipstick.units import Units, after_number, unit_of_dof

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions


def branch_html(branch: Solutions) -> str:
    """A small table of what was found."""
    title = str(branch.dataset.attrs.get("title", ""))
    return html_table(f"Branch{': ' if title else ''}{title}", _rows(branch))


def _rows(branch: Solutions) -> Iterator[tuple[str, Any]]:
    yield "outcome", branch.message
    data = branch.dataset
    if not len(branch):
        return
    where = data[branch.followed].to_numpy()
    name = str(data.attrs.get("parameter", "")) or "omega"
    yield "points", f"{len(branch)}, {name} from {_at(branch, where[0])} to {_at(branch, where[-1])}"
    for dof in [str(label) for label in data["dof"].to_numpy()][:MOST_SHOWN]:
        unit = after_number(unit_of_dof(str(data["amplitude"].attrs.get("units", "")), dof))
        peaks = sorted(branch.peaks(dof), key=lambda peak: -peak[1])[:3]
        said = "; ".join(f"{size:.5g}{unit} at {_at(branch, value)}" for value, size in peaks)
        yield f"peaks of {dof}", said or f"none; largest {float(data['amplitude'].sel(dof=dof).max()):.5g}{unit}"
    if data.attrs.get("coordinates_of_motion"):
        yield "motion", data.attrs["coordinates_of_motion"]
    if branch.warnings:
        yield "warnings", "\n".join(branch.warnings)


def _at(branch: Solutions, value: float) -> str:
    """A value of what was followed, with its unit where that has a name."""
    data = branch.dataset
    if branch.followed == "omega":
        units = Units.of_results(data.attrs)
        return units.frequency_text(float(value), str(data.attrs.get("frequency_unit") or units.angular))
    return f"{value:.6g}{after_number(str(data['parameter'].attrs.get('units', '')))}"
