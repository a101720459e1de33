"""Stability in figures: solid and dashed lines, marks where the kind of motion changes, the largest multiplier."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.plots.overlay import Curves
from slipstick.plots.quantities import chosen, quantity, values_of
from slipstick.plots.style import GREY
from slipstick.results.stability import between_known
from slipstick.typing import DrawnAxes, Names

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

MARKS = {
    "turning point": ("fold", "o"),
    "period doubling": ("period doubling", "s"),
    "Neimark-Sacker": ("Neimark-Sacker", "D"),
    "symmetry breaking": ("symmetry breaking", "^"),
    "state change": ("contact states change", "|"),
    "Hopf": ("Hopf", "*"),
}
"""Kinds of points: name in the legend and marker."""


def stability(
    branches: Any, *, ax: Axes | None = None, label: str | None = None, frequency: str | None = None
) -> DrawnAxes:
    """Largest magnitude of a Floquet multiplier along the branch; above 1 the motion is unstable.

    Only for branches followed with ``stability=True``.
    """
    curves = Curves(branches, ax, label, frequency)
    if any("multiplier_max" not in dataset for _, dataset in curves.overlaid):
        raise InputError("there is no stability in these results: follow the branch with stability=True")
    values = {id(dataset): {"": between_known(dataset["multiplier_max"].to_numpy())} for _, dataset in curves.overlaid}
    ax = curves.draw_values(quantity(curves.first, "multiplier_max"), values)
    ax.axhline(1.0, color=GREY, linewidth=0.8, zorder=0)
    for _, dataset in curves.overlaid:
        _mark(ax, dataset, curves.abscissa.values(dataset), dataset["multiplier_max"].to_numpy())
    curves.legend()
    return ax


def mark_special(ax: Axes, curves: Curves, dataset: xarray.Dataset, dof: Names) -> None:
    """Marks on the amplitudes of dofs, where stability is known."""
    if "stable" in dataset:
        for name in chosen(dataset, "dof", dof):
            _mark(ax, dataset, curves.abscissa.values(dataset), values_of(dataset, "amplitude", "dof", name))


def _mark(ax: Axes, dataset: xarray.Dataset, x: np.ndarray, y: np.ndarray) -> None:
    kind = dataset["kind"].to_numpy()
    for name, (text, marker) in MARKS.items():
        at = np.flatnonzero(kind == name)
        if at.size:
            known = ax.get_legend_handles_labels()[1]
            ax.plot(
                x[at], y[at], marker, color="black", ms=7.0 if marker == "|" else 4.5, linestyle="none",
                label="_" if text in known else text,
            )  # fmt: skip
