"""One point of a branch over its period: states, time histories, harmonics; loops are in ``hysteresis.py``.

All take a branch (or its dataset) and the number of a point, and return Axes: those given as ``ax``, else those of a
new figure, which has the title of the results and tells where the point lies. They raise InputError for points and
names that are not there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import truth
from slipstick.plots.hysteresis import force_text
from slipstick.plots.places import branch_of, point_number, point_titled
from slipstick.plots.quantities import chosen, dataset_of, known_names, motion_label, units_of, with_unit
from slipstick.plots.style import GREY, STATE_COLOURS, legend, over_decades, short, styled
from slipstick.results.contacts import force_of
from slipstick.typing import Array, DrawnAxes, Names

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_MOST_ROWS = 40
"""With more contacts the bars become thinner and not each is named."""

_LEAST = 1e-8
"""Harmonics smaller than this part of the largest are not shown on a logarithmic scale."""


def states(branch: Any, point: int, contact: Names = None, *, ax: Axes | None = None) -> DrawnAxes:
    """States of contacts over one period, a bar for each contact (all by default), from top to bottom.

    A contact whose law does not tell its states is a grey bar, "unknown".
    """
    drawn, dataset, new = branch_of(branch), dataset_of(branch), ax is None
    every = [str(name) for name in dataset["contact"].to_numpy()] if "contact" in dataset.coords else []
    names, point = chosen(dataset, "contact", every if contact is None else contact), point_number(dataset, point)
    intervals = drawn.states(point)
    ax = draw_states({name: intervals[name] for name in names}, ax)
    if new:
        point_titled(ax, dataset, point, names)
    return ax


def draw_states(intervals: Mapping[str, Sequence[tuple[float, float, str]]], ax: Axes | None = None) -> DrawnAxes:
    """Intervals (start, end, state) in rad, by contact; one that ends beyond 2 pi is wrapped round: two patches."""
    ax = styled(ax, "Phase τ = ω t", "", height=1.5 + 0.3 * min(len(intervals), _MOST_ROWS))
    ax.grid(False)
    shown: dict[str, Any] = {}
    for row, spans in enumerate(intervals.values()):
        for start, end, name in (piece for span in spans for piece in _wrapped(*span)):
            bars = ax.barh(row, end - start, left=start, height=0.7, color=STATE_COLOURS.get(name, GREY), linewidth=0)
            shown.setdefault(name, bars)
    every = -(-len(intervals) // _MOST_ROWS)
    ax.set_yticks(range(0, len(intervals), every), labels=short(list(intervals), 24)[::every], parse_math=False)
    ax.set_ylim(len(intervals) - 0.5, -0.5)
    _period_axis(ax)
    order = [*(name for name in STATE_COLOURS if name in shown), *(name for name in shown if name not in STATE_COLOURS)]
    handles = [shown[name] for name in order]
    ax.legend(handles, order, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False, fontsize="small")
    return ax


def _wrapped(start: float, end: float, name: str) -> list[tuple[float, float, str]]:
    period = 2 * np.pi
    shift = np.floor(start / period) * period
    start, end = start - shift, end - shift
    if end <= period + 1e-12:
        return [(start, min(end, period), name)]
    return [(start, period, name), (0.0, end - period, name)]


def _period_axis(ax: Axes) -> None:
    ax.set_xlim(0.0, 2 * np.pi)
    ax.set_xticks(np.arange(5) * np.pi / 2, labels=["0", "π/2", "π", "3π/2", "2π"])


def history(
    branch: Any, point: int, dof: Names = None, *, contact: Names = None, limit: bool = True, ax: Axes | None = None
) -> DrawnAxes:
    """One period in time: the motion of dofs (by default the first), or the force of contacts along their first port.

    The force is that of the law itself, not the truncated series; ``limit`` draws the bounds of a friction force,
    dotted, for one contact.
    """
    dataset, new, limit = dataset_of(branch), ax is None, truth("limit", limit)
    point = point_number(dataset, point)
    names = _names(dataset, dof, contact)
    periods = {name: branch_of(branch).loop(point, name) for name in names} if contact is not None else {}
    text = force_text(periods)
    y_label = with_unit(text, units_of(dataset).label("force")) if periods else motion_label(dataset)
    ax = styled(ax, "Phase τ = ω t", y_label)
    tau = np.linspace(0.0, 2 * np.pi, 721)
    for name in names:
        period = periods.get(name, {})
        series = period["force"] if period else branch_of(branch).harmonics.H_minus(tau) @ _motion(dataset, point, name)
        alone = period and new and len(names) == 1  # the title has its name
        (line,) = ax.plot(tau, series, linewidth=1.6, label=text.lower() if alone else name)
        for sign in (1.0, -1.0) if limit and "limit" in period and len(names) == 1 else ():
            bound = "friction limit" if sign > 0 else None
            ax.plot(tau, sign * period["limit"], color=line.get_color(), linewidth=0.8, linestyle=":", label=bound)
    _period_axis(ax)
    if new:
        point_titled(ax, dataset, point, names)
    legend(ax, least=2 if new else 1)
    return ax


def spectrum(
    branch: Any,
    point: int,
    dof: Names = None,
    *,
    contact: Names = None,
    log: bool | None = None,
    ax: Axes | None = None,
) -> DrawnAxes:
    """Harmonic content: a bar for each harmonic of the motion of dofs (the first), or of the force of contacts along
    their first port.

    Its height is the amplitude ``sqrt(c^2 + s^2)``, of harmonic 0 the size of the mean; on a logarithmic scale where
    they span decades, unless ``log`` says otherwise.
    """
    dataset, new, orders = dataset_of(branch), ax is None, branch_of(branch).harmonics.orders
    point, names = point_number(dataset, point), _names(dataset, dof, contact)
    log = None if log is None else truth("log", log)
    if contact is None:
        text, series = motion_label(dataset), {name: _motion(dataset, point, name) for name in names}
    else:
        text, series = _forces(dataset, point, names)
    y_label = f"Amplitude of the {text[0].lower()}{text[1:]}"
    sizes = {name: _sizes(values) for name, values in series.items()}
    ax = styled(ax, "Harmonic of the fundamental frequency", y_label)
    width = 0.8 / len(names)
    for k, (name, values) in enumerate(sizes.items()):
        places = np.arange(len(orders)) + (k + 0.5) * width - 0.4
        ax.bar(places, values, width=0.94 * width, label=name)
    largest = max(float(values.max()) for values in sizes.values())
    shown = [values[values > _LEAST * largest] for values in sizes.values()]
    if not largest:
        ax.set_ylim(0.0, 1.0)
    elif log or (log is None and over_decades(shown)):
        ax.set_yscale("log")
        ax.set_ylim(0.5 * min(float(v.min(initial=largest)) for v in shown), 2.0 * largest)
    every = max(1, -(-len(orders) // 16))
    ax.set_xticks(range(0, len(orders), every), labels=[str(m) for m in orders[::every]])
    ax.grid(False, axis="x")
    if new:
        point_titled(ax, dataset, point, names)
    if len(names) > 1:
        legend(ax)
    return ax


def _sizes(X: Array) -> Array:
    return np.concatenate([np.abs(X[:1]), np.hypot(X[1::2], X[2::2])])


def _names(dataset: Any, dof: Names, contact: Names) -> list[str]:
    """Dofs or contacts of which something is drawn."""
    if dof is not None and contact is not None:
        raise InputError("both dof and contact are given; their motion and force do not fit in one figure")
    return chosen(dataset, "dof", dof) if contact is None else chosen(dataset, "contact", contact)


def _motion(dataset: Any, point: int, dof: str) -> Array:
    return np.asarray(dataset["displacement"].isel(point=point).sel(dof=dof))


def _forces(dataset: Any, point: int, contacts: Sequence[str]) -> tuple[str, dict[str, Array]]:
    """What the forces along the first port of contacts are called, with their unit, and their coefficients."""
    at, names = dataset.isel(point=point), known_names(dataset, "contact")
    variables = {name: force_of(at, names.index(name)) for name in contacts}
    text = "Friction force" if all(friction for _, friction in variables.values()) else "Contact force"
    forces = {name: np.asarray(at[variable].sel(contact=name)) for name, (variable, _) in variables.items()}
    return with_unit(text, units_of(dataset).label("force")), forces
