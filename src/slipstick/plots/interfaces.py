"""Flat map of the contacts between two surfaces at a point of a branch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import one, shown, text
from slipstick.plots.points import point_number, point_titled
from slipstick.plots.quantities import dataset_of, units_of, with_unit
from slipstick.plots.style import COLOURS, GREY, label_colour_bar, legend, new_figure, show_lengths, styled
from slipstick.results.interface import QUANTITIES, STATES, Interface, interfaces_of
from slipstick.results.solutions import Solutions
from slipstick.typing import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LARGEST = 90.0
"""Size of the symbol of the largest area, in square points."""


def interface(branch: Solutions, point: int, name: str | None = None) -> tuple[Axes, ...]:
    """Pressure, state, slip and dissipated energy of the contacts between two surfaces, side by side, in a new figure.

    Parameters
    ----------
    branch
        A branch with its problem, whose contacts come from ``ss.surface_pair``.
    point
        Number of the point; negative numbers count from the last.
    name
        Of the pair of surfaces; by default the first one.

    Returns
    -------
    tuple of Axes
        One for each quantity that the results have: contacts as points, their areas as sizes of the symbols
        (``axes.collections[0]``; one for each state), bolts as rings.

    Raises
    ------
    InputError
        If no contact has an area and a place, there is no such pair, or no such point.
    """
    data = dataset_of(one("branch", branch, Solutions, "an ss.Branch"))
    at = point_number(data, point)
    joint = _chosen(interfaces_of(branch), name)
    shares = {key: values[at] for key in QUANTITIES if (values := joint.values(branch.table, key)) is not None}
    low, high = joint.flat.min(axis=1), joint.flat.max(axis=1)
    wide, tall = (high - low) + 0.14 * float((high - low).max() or 1.0)
    rows = 2 if wide >= tall else 1
    columns = -(-len(shares) // rows)
    figure = new_figure(min(4.6 * columns, 12.0), float(np.clip(4.0 * tall / wide, 1.6, 5.0)) * rows + 0.8)
    figure.set_layout_engine(
        "compressed", wspace=0.08
    )  # axes of equal scale leave room that colour bars would stand in
    axes = figure.subplots(rows, columns, squeeze=False)
    size = _LARGEST * joint.areas / joint.areas.max()
    for ax, (key, values) in zip(axes.flat, shares.items(), strict=False):
        _draw(ax, joint, key, values, size, data)
    for ax in list(axes.flat)[len(shares) :]:
        ax.set_visible(False)
    point_titled(axes.flat[0], data, at, [joint.name])
    return tuple(list(axes.flat)[: len(shares)])


def _chosen(found: list[Interface], name: str | None) -> Interface:
    if not found:
        raise InputError(
            "no contact lies between two surfaces: give contacts of ss.surface_pair, on a reduced body with its mesh"
        )
    wanted = found[0].name if name is None else text("name", name, "the name of a pair of surfaces")
    for joint in found:
        if joint.name == wanted:
            return joint
    names = ", ".join(joint.name for joint in found)
    raise InputError(f"name: found {shown(name)}; expected one of {names}")


def _draw(ax: Axes, joint: Interface, key: str, values: Array, size: Array, data: Any) -> None:
    said, dimension = QUANTITIES[key]
    unit = units_of(data).label(dimension)
    length = units_of(data).label("length")
    styled(ax, *(with_unit(axis, length) for axis in joint.axes)).grid(False)
    ax.set_aspect("equal")
    ax.set_title(said.capitalize(), fontsize="medium", parse_math=False)
    air = 0.07 * float(np.ptp(joint.flat, axis=1).max())
    for axis, places in zip("xy", joint.flat, strict=True):
        ax.set(**{f"{axis}lim": (places.min() - air, places.max() + air)})
    show_lengths(ax.xaxis, ax.yaxis, largest=float(np.abs(joint.flat).max()))
    if key == "state":
        colours = (GREY, COLOURS[0], COLOURS[1], COLOURS[2], "white")
        for number, (word, colour) in enumerate(zip(STATES, colours, strict=True)):
            here = values == number
            if here.any():
                ax.scatter(
                    joint.flat[0, here],
                    joint.flat[1, here],
                    s=size[here],
                    color=colour,
                    edgecolors="0.3",
                    linewidths=0.4,
                    label=word,
                )
        _rings(ax, joint)
        legend(ax)
        return
    top = float(np.nanmax(values, initial=0.0)) or 1.0
    drawn = ax.scatter(
        joint.flat[0], joint.flat[1], s=size, c=np.nan_to_num(values), vmin=0.0, vmax=top, cmap="viridis",
        edgecolors="0.3", linewidths=0.3,
    )  # fmt: skip
    _rings(ax, joint)
    label_colour_bar(
        ax.figure.colorbar(drawn, ax=ax, shrink=0.9, aspect=12, fraction=0.08), "" if unit == "1" else unit
    )


def _rings(ax: Axes, joint: Interface) -> None:
    """Bolts that stand on the map."""
    numbers, (x, y) = joint.bolts
    if len(numbers):
        rings = ax.scatter(x, y, s=2.2 * _LARGEST, facecolors="none", edgecolors="0.1", linewidths=1.2, label="bolt")
        rings.set_linestyle("--")
