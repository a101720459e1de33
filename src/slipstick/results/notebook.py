"""A branch as a notebook shows it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from slipstick.html import MOST_SHOWN, html_table
from slipstick.results.view import after, followed_text, names_of

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
    yield "points", f"{len(branch)}, {name} from {followed_text(data, where[0])} to {followed_text(data, where[-1])}"
    for dof in names_of(data, "dof")[:MOST_SHOWN]:
        unit = after(data, "amplitude", dof)
        peaks = sorted(branch.peaks(dof), key=lambda peak: -peak[1])[:3]
        said = "; ".join(f"{size:.5g}{unit} at {followed_text(data, value)}" for value, size in peaks)
        yield f"peaks of {dof}", said or f"none; largest {float(data['amplitude'].sel(dof=dof).max()):.5g}{unit}"
    if data.attrs.get("coordinates_of_motion"):
        yield "motion", data.attrs["coordinates_of_motion"]
    if branch.warnings:
        yield "warnings", "\n".join(branch.warnings)
