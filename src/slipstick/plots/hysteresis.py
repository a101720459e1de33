"""Hysteresis loops of a point: over the vibration, and over the sliding motion, whose area is the energy dissipated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import shown, truth
from slipstick.faults import text as one_text
from slipstick.plots.places import branch_of, point_number, point_titled
from slipstick.plots.quantities import chosen, dataset_of, units_of, with_unit
from slipstick.plots.style import legend, new_figure, styled
from slipstick.typing import Array, DrawnAxes, Names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from slipstick.branch import Branch

LOOP_MOTIONS = {"vibration": ("motion", "Vibration x"), "sliding": ("total", "Sliding motion x + u")}
"""What a loop is drawn over: its key in ``Branch.loop`` and its name."""


def loop(
    branch: Any,
    point: int,
    contact: Names = None,
    *,
    over: str = "vibration",
    limit: bool = False,
    ax: Axes | None = None,
    label: str | None = None,
) -> DrawnAxes:
    """Hysteresis loop: force over the vibration x of the contact along its first port, or over its motion x + u.

    That of a friction contact is its friction force. The area under the curve over x + u is the energy dissipated in a
    period; with a constant rubbing velocity that curve does not close, it goes on by velocity x period. Over x alone
    the area is the work taken from the structure.

    Parameters
    ----------
    branch, point, contact
        A contact at a point, or several contacts; by default the first.
    over
        "vibration" or "sliding".
    limit
        Whether the friction limit mu fy is drawn, thin and dotted, with both signs.
    ax, label
        Axes to draw into, and name of a single loop in the legend.

    Returns
    -------
    Axes
        One line for each contact.
    """
    if not isinstance(over, str) or over not in LOOP_MOTIONS:
        raise InputError(f"over: found {shown(over)}; expected 'vibration' or 'sliding'")
    drawn, dataset, new = branch_of(branch), dataset_of(branch), ax is None
    point = point_number(dataset, point)
    names, (key, text) = chosen(dataset, "contact", contact), LOOP_MOTIONS[over]
    unit, limit = units_of(dataset), truth("limit", limit)
    if label is not None:
        one_text("label", label)
    periods = {name: drawn.loop(point, name) for name in names}
    force = with_unit(force_text(periods), unit.label("force"))
    ax = styled(ax, with_unit(text, unit.label("length")), force)
    for name, period in periods.items():
        (line,) = ax.plot(period[key], period["force"], linewidth=1.6, label=label if len(names) == 1 else name)
        if not np.ptp(period[key]) and not np.ptp(period["force"]):
            line.set_marker("o")  # at rest: a loop without extent
        for sign in (1.0, -1.0) if limit and "limit" in period else ():
            ax.plot(period[key], sign * period["limit"], color=line.get_color(), linewidth=0.7, linestyle=":")
    if new:
        point_titled(ax, dataset, point, names)
    if not new or label is not None or len(names) > 1:
        legend(ax)
    return ax


def force_text(periods: Mapping[str, Mapping[str, Array]]) -> str:
    """What the force of these loops is called."""
    return "Friction force" if all("limit" in period for period in periods.values()) else "Contact force"


def loops(branch: Any, point: int, contact: Names = None, *, limit: bool = False) -> tuple[Axes, Axes]:
    """The loop over the vibration x and, beside it, over the sliding motion x + u, whose area is the energy dissipated.

    Arguments as in :func:`loop`; always a new figure.
    """
    dataset, names = dataset_of(branch), chosen(dataset_of(branch), "contact", contact)
    point = point_number(dataset, point)
    left, right = new_figure(10.0, 4.0).subplots(1, 2, sharey=True)
    for ax, over in ((left, "vibration"), (right, "sliding")):
        loop(branch, point, names, over=over, limit=limit, ax=ax)
    right.set_ylabel("")
    if len(names) == 1:
        _shade(right, branch_of(branch), point, names[0])
    elif left.get_legend() is not None:
        left.get_legend().remove()
    point_titled(left, dataset, point, names)
    return left, right


def _shade(ax: Axes, branch: Branch, point: int, contact: str) -> None:
    """The area of a loop over the sliding motion, and how much it is."""
    at, period = branch.dataset.isel(point=point), branch.loop(point, contact)
    unit = units_of(branch.dataset).after("force length")
    if "limit" in period:
        area = 2 * np.pi * float(at["dissipated_power"].sel(contact=contact)) / float(at["omega"])
    else:  # of the one port that is drawn: a law may dissipate along others too
        area = float(np.trapezoid(period["force"], period["total"]))
    energy = f"{area:.4g}{unit}"
    w, force = (np.asarray(values) for values in ax.lines[0].get_data())
    if float(at["rubbing_velocity"].sel(contact=contact)):  # does not close: down to no force and back
        w, force = np.append(w, w[[-1, 0]]), np.append(force, [0.0, 0.0])
    ax.fill(w, force, alpha=0.12, color=ax.lines[0].get_color(), linewidth=0)
    ax.set_title(f"area = energy dissipated a period = {energy}", fontsize="small", parse_math=False)
