"""What tolerances of parameters do: a band round a curve, and which of them matter most at a point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from slipstick.analysis.sensitivity.tolerances import amplitude_band, ranked_bars
from slipstick.errors import InputError
from slipstick.faults import one, whole
from slipstick.plots.overlay import Curves
from slipstick.plots.quantities import abscissa_text, parted, quantity
from slipstick.plots.style import COLOURS, GREY, legend, short, styled, titled
from slipstick.results.solutions import Solutions
from slipstick.results.view import value_text
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_MOST_NAMED = 8
"""Tolerances that the legend of a band names."""


def tolerance_band(
    branch: Solutions,
    tolerances: Mapping[str, float],
    dof: str | None = None,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Amplitude with the band that tolerances of parameters make of it.

    Parameters
    ----------
    branch
        A branch with its problem.
    tolerances
        Shares by name of parameter: ``{"damper.mu": 0.2, "damper.kt": 0.1}`` for 20 % and 10 % up and down. The band is
        to first order, with all of them at their worst together.
    dof
        Name of the dof; by default the first.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        ``ax.lines[0]`` is the amplitude, ``ax.collections[0]`` the band.

    Raises
    ------
    InputError
        For what is no branch with a problem, and names, shares and units that are not right.
    """
    known = one("branch", branch, Solutions, "an ss.Branch with its problem")
    name = _dof(known, dof)
    band = amplitude_band(known, name, tolerances)
    curves = Curves(known, ax, label, frequency)
    ax = curves.draw("amplitude", "dof", name)
    dataset = curves.first
    x, low, high = parted(dataset, curves.abscissa.values(dataset), band.low, band.high)
    parts = [_varied(parameter, share) for parameter, share in tolerances.items()]
    said = "\n".join(parts if len(parts) <= _MOST_NAMED else [*parts[: _MOST_NAMED - 1], f"... ({len(parts)} in all)"])
    colour = ax.lines[-1].get_color()
    ax.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0.0, label=said)
    if curves.new:
        ax.set_ylim(0.0, 1.05 * float(np.nanmax(band.high)))
    legend(ax)
    return ax


def tornado(
    branch: Solutions,
    tolerances: Mapping[str, float] | None = None,
    dof: str | None = None,
    *,
    point: int | None = None,
    most: int = 12,
    ax: Axes | None = None,
) -> DrawnAxes:
    """What matters most at a point: the change of the amplitude for each tolerance, the largest on top.

    Parameters
    ----------
    branch
        A branch with its problem.
    tolerances
        Shares by name of parameter; by default a tenth of every parameter that is not 0.
    dof
        Name of the dof; by default the first.
    point
        Number of a point; by default the highest located peak of the dof, else the point of its largest amplitude.
    most
        How many bars are drawn.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.

    Returns
    -------
    Axes
        Two bars for each parameter, its tolerance raised and lowered.

    Raises
    ------
    InputError
        As of ``tolerance_band``, and for a point that is not there.
    """
    known = one("branch", branch, Solutions, "an ss.Branch with its problem")
    name, most = _dof(known, dof), whole("most", most, 1)
    at = highest(known, name) if point is None else whole("point", point, -len(known), len(known) - 1)
    bars = ranked_bars(known, name, at, tolerances)[:most][::-1]
    new, dataset = ax is None, known.dataset
    label = quantity(dataset, "amplitude", [name]).replace("Amplitude", f"Change of the amplitude of {name}")
    ax = styled(ax, label, "", height=1.4 + 0.3 * max(3, len(bars)))
    places = np.arange(len(bars))
    for sign, colour, text in ((1.0, COLOURS[1], "parameter raised"), (-1.0, COLOURS[0], "parameter lowered")):
        changes = [sign * bar.change for bar in bars]
        ax.barh(places, changes, color=colour, height=0.7, label=text)
    shares = [_varied(n, bar.share) for n, bar in zip(short([b.name for b in bars]), bars, strict=True)]
    ax.set_yticks(places, shares)
    ax.axvline(0.0, color=GREY, linewidth=0.8)
    if new:
        size = float(dataset["amplitude"].to_numpy()[at, known.dof_index(name)])
        about = (
            f"amplitude of {name}: {value_text(dataset, 'amplitude', size, name, 4)} at {abscissa_text(dataset, at)}"
        )
        titled(ax.figure, str(dataset.attrs.get("title", "")), about)
    legend(ax)
    return ax


def _varied(name: str, share: float) -> str:
    return f"{name} \N{PLUS-MINUS SIGN}{100 * share:g} %"


def highest(branch: Solutions, dof: str) -> int:
    """The highest located peak of a dof, else the point of its largest amplitude."""
    d = branch.dof_index(dof)
    size = branch.table["amplitude"].to_numpy()[:, d]
    if not len(size):
        raise InputError(f"the branch has no points; its outcome is: {branch.message}")
    peaks = np.flatnonzero(branch.table["peak_dof"].to_numpy() == d) if "peak_dof" in branch.table else np.zeros(0)
    among = peaks if len(peaks) else np.arange(len(size))
    return int(among[np.nanargmax(size[among])])


def _dof(branch: Solutions, dof: str | None) -> str:
    return str(branch.table["dof"].to_numpy()[branch.dof_index(dof)])
