"""Front view of a disc: the colour of a blade is its amplitude, its length the motion at an instant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import number, one
from slipstick.plots.points import point_number, point_titled
from slipstick.plots.quantities import NO_POINTS, abscissa, dataset_of, parted, units_of, with_unit
from slipstick.plots.style import COLOURS, GREY, label_colour_bar, legend, show_lengths, styled, titled
from slipstick.results.disc import amplitude_on_disc, disc_of
from slipstick.results.solutions import Solutions
from slipstick.results.view import largest_length
from slipstick.typing import Array, DrawnAxes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HUB, _REST, _SWING, _NAMES = 0.4, 1.0, 0.22, 1.32
_MOST_NAMED = 30


def disc(
    branch: Solutions, point: int, dof: str | None = None, *, tau: float = 0.0, ax: Axes | None = None
) -> DrawnAxes:
    """Draw the blades of a disc at a point, coloured by the amplitude of a dof, as long as its motion at an instant.

    Parameters
    ----------
    branch
        Results of a travelling wave or of a whole disc, with their problem.
    point
        Number of the point; negative numbers count from the last.
    dof
        A dof of a sector, by default the first that all sectors have.
    tau
        Phase omega t of the instant in rad: dashed is the rest position, longer is positive. Means are left out, and
        the largest swing of any blade has one length at all points.
    ax
        Axes to draw into.

    Returns
    -------
    Axes
        Blades numbered counter-clockwise, number 0 at the right; ``ax.collections[0]`` has the amplitudes.

    Raises
    ------
    InputError
        Where the results are of no disc, or not every sector has the dof.
    """
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle, Wedge

    found, dataset, new = disc_of(one("branch", branch, Solutions, "an ss.Branch")), dataset_of(branch), ax is None
    if found is None or not found.dofs:
        raise InputError("disc: the results are not of a travelling wave or a disc, or without their problem")
    point, tau, dof = point_number(dataset, point), number("tau", tau), next(iter(found.dofs)) if dof is None else dof
    amplitude = amplitude_on_disc(branch, dof).to_numpy()[point]
    X = np.array(dataset["displacement"].to_numpy()[point, found.dofs[dof]])
    reach = _REST + _SWING * _swing(branch, X, tau - found.delays)
    ax = styled(ax, "", "", height=4.6)
    angle, half = np.arange(found.sectors) * 360.0 / found.sectors, 0.42 * 360.0 / found.sectors
    blades = [Wedge((0, 0), r, a - half, a + half, width=r - _HUB) for r, a in zip(reach, angle, strict=True)]
    drawn = PatchCollection(blades, cmap="viridis")
    drawn.set_array(amplitude)
    drawn.set_clim(0.0, float(amplitude.max()) or 1.0)
    ax.add_collection(drawn)
    ax.add_patch(Circle((0, 0), _HUB, facecolor="#EEEEEE", edgecolor="none"))
    ax.add_patch(Circle((0, 0), _REST, fill=False, edgecolor="0.5", linestyle="--", linewidth=0.8))
    for s in range(0, found.sectors, -(-found.sectors // _MOST_NAMED)):
        place = _NAMES * np.cos(np.radians(angle[s])), _NAMES * np.sin(np.radians(angle[s]))
        ax.text(*place, str(s), ha="center", va="center", fontsize="small", color="0.35")
    ax.set(xlim=(-1.42, 1.42), ylim=(-1.42, 1.42), aspect="equal")
    ax.set_axis_off()
    label = with_unit(f"Amplitude of {dof}", units_of(dataset).label("length"))
    bar = ax.figure.colorbar(drawn, ax=ax, shrink=0.8)
    label_colour_bar(bar, label, largest_length(dataset, "amplitude"))
    if new:
        point_titled(ax, dataset, point, [])
    return ax


def blades(
    branch: Solutions, dof: str | None = None, *, frequency: str | None = None, ax: Axes | None = None
) -> DrawnAxes:
    """Amplitudes of a dof of every blade of a disc versus frequency or the followed parameter, and their largest.

    Parameters
    ----------
    branch
        Results of a travelling wave or of a whole disc, with their problem; those of a wave are one curve.
    dof
        A dof of a sector, by default the first that all sectors have.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.
    ax
        Axes to draw into.

    Returns
    -------
    Axes
        ``ax.lines`` are the blades in their order, thin, the one that reaches the largest amplitude thick and named;
        dotted above them the largest of all at each point, where no blade stays the worst.

    Raises
    ------
    InputError
        As :func:`disc`.
    """
    found, dataset, new = disc_of(one("branch", branch, Solutions, "an ss.Branch")), dataset_of(branch), ax is None
    if found is None or not found.dofs:
        raise InputError("blades: the results are not of a travelling wave or a disc, or without their problem")
    if not dataset.sizes["point"]:
        raise InputError(NO_POINTS)
    dof = next(iter(found.dofs)) if dof is None else dof
    amplitude, along = amplitude_on_disc(branch, dof).to_numpy(), abscissa(dataset, frequency)
    x, largest, *each = parted(dataset, along.values(dataset), amplitude.max(axis=1), *amplitude.T)
    label = with_unit(f"Amplitude of {dof}", units_of(dataset).label("length"))
    ax = styled(ax, along.label, label)
    show_lengths(ax.yaxis, largest=largest_length(dataset, "amplitude"))
    if not found.whole:
        ax.plot(x, largest, linewidth=1.6, label="every blade")
    else:
        worst = int(np.argmax(amplitude.max(axis=0)))
        lines = [ax.plot(x, y, color=COLOURS[0], linestyle="-", linewidth=0.7, alpha=0.6)[0] for y in each]
        lines[0 if worst else -1].set_label("others")
        said = f"blade {worst} (of 0 to {found.sectors - 1}), the largest"
        lines[worst].set(color=COLOURS[1], linewidth=1.8, alpha=1.0, zorder=3, label=said)
        if (amplitude.max(axis=1) > amplitude[:, worst]).any():
            ax.plot(x, largest, color=GREY, linewidth=1.0, linestyle=":", label="largest of all")
    legend(ax)
    if new:
        titled(ax.figure, str(dataset.attrs.get("title", "")))
    return ax


def _swing(branch: Solutions, X: Array, tau: Array) -> Array:
    """Motion (sectors,) of each about its mean at its own phase, over a bound of the largest."""
    moving = X.copy()
    moving[:, 0] = 0.0
    most = np.hypot(X[:, 1::2], X[:, 2::2]).sum(axis=1).max() or 1.0
    return np.array([branch.harmonics.H_minus(t) @ x for x, t in zip(moving, tau, strict=True)]) / most
