"""One point of a branch over its period: hysteresis loops, states, time histories, harmonics.

All take a branch (or its dataset) and the number of a point, and return Axes: ``ax``, else those of a new figure, whose
title names the results and the point. They raise InputError for points and names that are not there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.contact.stator import StatorContact
from slipstick.errors import InputError
from slipstick.faults import shown, truth, whole
from slipstick.faults import text as one_text
from slipstick.plots.quantities import (
    NO_POINTS,
    OneBranch,
    abscissa,
    chosen,
    dataset_of,
    motion_label,
    title_of,
    units_of,
    with_unit,
)
from slipstick.plots.style import (
    GREY,
    STATE_COLOURS,
    legend,
    log_scale,
    new_figure,
    over_decades,
    short,
    show_lengths,
    styled,
    titled,
)
from slipstick.results.contacts import contact_at, force_of, loop_at, planar_contacts, states_at
from slipstick.results.solutions import Solutions
from slipstick.results.view import largest_length, names_of
from slipstick.typing import Array, DrawnAxes, Names
from slipstick.units import after_number, energy_unit

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOP_MOTIONS = {"vibration": ("motion", "Vibration x"), "sliding": ("total", "Sliding motion x + u")}
"""Abscissae of a loop: key in ``Branch.loop`` and name."""


def loop(
    branch: OneBranch,
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
    branch
        A branch, or its dataset.
    point
        Number of the point; negative numbers count from the last.
    contact
        Name of the contact, or several; by default the first.
    over
        "vibration" or "sliding".
    limit
        Whether the friction limit mu fy is drawn, thin and dotted, with both signs.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single loop in the legend.

    Returns
    -------
    Axes
        One line for each contact.

    Raises
    ------
    InputError
        For points, names and a motion that are not there.
    """
    if not isinstance(over, str) or over not in LOOP_MOTIONS:
        raise InputError(f"over: found {shown(over)}; expected 'vibration' or 'sliding'")
    drawn, dataset, new = branch_of(branch), dataset_of(branch), ax is None
    point = point_number(dataset, point)
    names, (key, text) = chosen(dataset, "contact", contact), LOOP_MOTIONS[over]
    unit, limit = units_of(dataset), truth("limit", limit)
    if label is not None:
        one_text("label", label)
    periods = {name: loop_at(drawn, point, name) for name in names}
    force = with_unit(force_text(periods), unit.label("force"))
    ax = styled(ax, with_unit(text, unit.label("length")), force)
    show_lengths(ax.xaxis, largest=largest_length(dataset, "displacement"))
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
    """Name of the force of these loops."""
    return "Friction force" if all("limit" in period for period in periods.values()) else "Contact force"


def loops(branch: OneBranch, point: int, contact: Names = None, *, limit: bool = False) -> tuple[Axes, Axes]:
    """The loop over the vibration x and, beside it, over the sliding motion x + u, whose area is the energy dissipated.

    Of contacts that slide in a plane: the path of the friction force over the period, within the Coulomb circle mu N
    (the smallest and the largest one where N varies), and beside it that of the vibration. Along one of their ports:
    :meth:`Branch.loop`. Arguments as in :func:`loop`; always a new figure.

    Parameters
    ----------
    branch
        A branch, or its dataset.
    point
        Number of the point; negative numbers count from the last.
    contact
        Name of the contact, or several; by default the first.
    limit
        Whether the friction limit mu fy is drawn, thin and dotted, with both signs.

    Returns
    -------
    tuple of Axes
        The left and the right one.

    Raises
    ------
    InputError
        For points and names that are not there.
    """
    dataset, names = dataset_of(branch), chosen(dataset_of(branch), "contact", contact)
    point, planar = point_number(dataset, point), planar_contacts(dataset)
    if all(planar[names_of(dataset, "contact").index(name)] for name in names):
        return _paths(branch_of(branch), dataset, point, names)
    left, right = new_figure(10.0, 4.0).subplots(1, 2, sharey=True)
    for ax, over in ((left, "vibration"), (right, "sliding")):
        loop(branch, point, names, over=over, limit=limit, ax=ax)
        ax.locator_params(axis="x", nbins=6)  # numbers that do not touch
    right.set_ylabel("")
    if len(names) == 1:
        _shade(right, branch_of(branch), point, names[0])
    elif left.get_legend() is not None:
        left.get_legend().remove()
    point_titled(left, dataset, point, names)
    return left, right


def _paths(branch: Solutions, dataset: xarray.Dataset, point: int, names: list[str]) -> tuple[Axes, Axes]:
    """Friction forces and vibrations of planar contacts in their planes, in the colours of their states."""
    left, right = new_figure(10.0, 4.8).subplots(1, 2)
    unit, states = units_of(dataset), states_at(branch, point)
    for ax, text, kind in ((left, "Friction force", "force"), (right, "Vibration", "length")):
        styled(ax, *(with_unit(f"{text}, {which} direction", unit.label(kind)) for which in ("first", "second")))
        show_lengths(ax.xaxis, ax.yaxis, largest=largest_length(dataset, "displacement"))
        ax.set_aspect("equal", adjustable="datalim")
    for name in names:
        first, second = (loop_at(branch, point, name, port=port) for port in ("tangential", "second"))
        for ax, key in ((left, "force"), (right, "motion")):
            _state_path(ax, first["tau"], first[key], second[key], states[name])
        low, high = first["limit"].min(), first["limit"].max()
        for radius in (high,) if high - low <= 1e-9 * high else (low, high):
            _circle(left, radius)
    if len(names) > 1:
        for name in names:
            first, second = (loop_at(branch, point, name, port=port) for port in ("tangential", "second"))
            right.annotate(name, (first["motion"][0], second["motion"][0]), fontsize="small", parse_math=False)
    left.set_title("dashed: friction limit μ N, dot: τ = 0", fontsize="small")
    right.set_title("dot: τ = 0", fontsize="small")
    legend(right)
    point_titled(left, dataset, point, names)
    return left, right


def _circle(ax: Axes, radius: float) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    ax.plot(radius * np.cos(turn), radius * np.sin(turn), color=GREY, linewidth=0.9, linestyle=(0, (5, 3)))


def _state_path(ax: Axes, tau: Array, x: Array, y: Array, states: Sequence[tuple[float, float, str]]) -> None:
    """A path over one period, a line for each state, with a dot where it begins."""
    for start, end, name in (piece for span in states for piece in _wrapped(*span)):
        at = np.concatenate([[start], tau[(tau > start) & (tau < end)], [end]])
        ax.plot(np.interp(at, tau, x), np.interp(at, tau, y), color=STATE_COLOURS.get(name, GREY),
                linestyle="-", linewidth=1.8, label=name)  # fmt: skip
    ax.plot(x[0], y[0], "o", color="black", markersize=5)


def orbit(branch: OneBranch, point: int, contact: str | None = None, *, ax: Axes | None = None) -> DrawnAxes:
    """Orbit of a rotor's centre in the circle of its clearance, in the colours of separation and contact ("slip").

    Parameters
    ----------
    branch
        A branch, or its dataset.
    point
        Number of the point; negative numbers count from the last.
    contact
        Name of a contact with a stator (``StatorContact``); by default the first.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.

    Returns
    -------
    Axes
        ``ax.lines`` are the clearance circle, then a line for each interval of a state, and a dot at tau = 0.

    Raises
    ------
    InputError
        For a contact of another or an unknown law.
    """
    drawn, dataset, new = branch_of(branch), dataset_of(branch), ax is None
    point, (name,) = point_number(dataset, point), chosen(dataset, "contact", contact)
    there = contact_at(drawn, point, names_of(dataset, "contact").index(name))
    if not isinstance(there.law, StatorContact):
        raise InputError(f"contact '{name}' is no contact of a rotor with its stator, so it has no orbit to draw")
    tau, unit = np.linspace(0.0, 2.0 * np.pi, 721), units_of(dataset).label("length")
    x, y = (there.motion.harmonics.H_minus(tau) @ Q[0] for Q in there.motion.Q[:2])
    (states,) = there.law.states(there.motion, there.values)
    ax = styled(ax, with_unit("Motion along x", unit), with_unit("Motion along y", unit), height=5.0)
    show_lengths(ax.xaxis, ax.yaxis, largest=largest_length(dataset, "displacement"))
    ax.set_aspect("equal", adjustable="datalim")
    _circle(ax, float(there.values["gap"][0]))
    _state_path(ax, tau, x, y, states)
    share = sum(end - start for start, end, state in states if state != "separation") / (2.0 * np.pi)
    ax.set_title(f"in contact {100.0 * share:.3g} % of the time; dashed: clearance, dot: τ = 0", fontsize="small")
    if new:
        point_titled(ax, dataset, point, [name])
    legend(ax)
    return ax


def _shade(ax: Axes, branch: Solutions, point: int, contact: str) -> None:
    """The area of a loop over the sliding motion, and how much it is."""
    at, period = branch.dataset.isel(point=point), loop_at(branch, point, contact)
    unit, along = after_number(energy_unit(units_of(branch.dataset).label("force length"))), ""
    if "limit" in period:
        area = 2 * np.pi * float(at["dissipated_power"].sel(contact=contact)) / float(at["omega"])
    else:  # of the one port that is drawn: a law may dissipate along others too
        area = float(np.trapezoid(period["force"], period["total"]))
        law = contact_at(branch, point, names_of(branch.dataset, "contact").index(contact)).law
        along = f" along {law.ports[0]}" if law is not None and len(law.ports) > 1 else ""
    energy = f"{area:.4g}{unit}"
    w, force = (np.asarray(values) for values in ax.lines[0].get_data())
    if float(at["rubbing_velocity"].sel(contact=contact)):  # does not close: down to no force and back
        w, force = np.append(w, w[[-1, 0]]), np.append(force, [0.0, 0.0])
    ax.fill(w, force, alpha=0.12, color=ax.lines[0].get_color(), linewidth=0)
    ax.set_title(f"area = energy dissipated a period{along} = {energy}", fontsize="small", parse_math=False)


def point_number(dataset: xarray.Dataset, point: int) -> int:
    """The number of a point; InputError where there is none."""
    count = dataset.sizes["point"]
    if not count:
        raise InputError(NO_POINTS)
    return whole("point", point, -count, count - 1)


def branch_of(branch: OneBranch) -> Solutions:
    """The branch, or that of a dataset."""
    return branch if isinstance(branch, Solutions) else Solutions.from_dataset(dataset_of(branch))


def point_titled(ax: Axes, dataset: xarray.Dataset, point: int, names: list[str]) -> None:
    """Title a figure of a point; a single dof or contact is named in it."""
    figure: Figure = ax.figure  # type: ignore[assignment]
    about = names if len(names) == 1 else []
    titled(figure, title_of([(None, dataset)]), *about, f"at {abscissa(dataset).text(dataset, point)}")


_MOST_ROWS = 40
"""With more contacts the bars become thinner and not each is named."""

_LEAST = 1e-8
"""Harmonics smaller than this part of the largest are not shown on a logarithmic scale."""


def states(branch: OneBranch, point: int, contact: Names = None, *, ax: Axes | None = None) -> DrawnAxes:
    """States of contacts over one period, a bar for each contact (all by default), from top to bottom.

    A contact whose law has no states is a grey bar, "unknown".

    Parameters
    ----------
    branch
        A branch, or its dataset.
    point
        Number of the point; negative numbers count from the last.
    contact
        Name of the contact, or several; by default all.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.

    Returns
    -------
    Axes
        ``ax.patches`` are the bars, from top to bottom in the order of the contacts.

    Raises
    ------
    InputError
        For points and names that are not there.
    """
    drawn, dataset, new = branch_of(branch), dataset_of(branch), ax is None
    every = names_of(dataset, "contact")
    names, point = chosen(dataset, "contact", every if contact is None else contact), point_number(dataset, point)
    intervals = states_at(drawn, point)
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
    branch: OneBranch,
    point: int,
    dof: Names = None,
    *,
    contact: Names = None,
    limit: bool = True,
    ax: Axes | None = None,
) -> DrawnAxes:
    """One period in time: the motion of dofs (by default the first), or the force of contacts along their first port.

    The force is that of the law itself, not the truncated series; ``limit`` draws the bounds of a friction force,
    dotted, for one contact.

    Parameters
    ----------
    branch
        A branch, or its dataset.
    point
        Number of the point; negative numbers count from the last.
    dof
        Name of the dof, or several; by default the first.
    contact
        Name of the contact, or several, whose force is drawn in place of the motion.
    limit
        Whether the bounds of a friction force are drawn.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.

    Returns
    -------
    Axes
        One line for each dof or contact over the phase tau = omega t, 0 to 2 pi.

    Raises
    ------
    InputError
        For points and names that are not there, both dof and contact, and dofs of different units.
    """
    dataset, new, limit = dataset_of(branch), ax is None, truth("limit", limit)
    point = point_number(dataset, point)
    names = _names(dataset, dof, contact)
    periods = {name: loop_at(branch_of(branch), point, name) for name in names} if contact is not None else {}
    text = force_text(periods)
    y_label = with_unit(text, units_of(dataset).label("force")) if periods else motion_label(dataset, names)
    ax = styled(ax, "Phase τ = ω t", y_label)
    show_lengths(ax.yaxis, largest=largest_length(dataset, "displacement"))
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
    branch: OneBranch,
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

    Parameters
    ----------
    branch
        A branch, or its dataset.
    point
        Number of the point; negative numbers count from the last.
    dof
        Name of the dof, or several; by default the first.
    contact
        Name of the contact, or several, whose force is drawn in place of the motion.
    log
        Logarithmic scale; by default where the harmonics span two decades or more.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.

    Returns
    -------
    Axes
        ``ax.patches`` are the bars: all harmonics of the first name, then those of the next.

    Raises
    ------
    InputError
        For points and names that are not there, both dof and contact, and dofs of different units.
    """
    dataset, new, orders = dataset_of(branch), ax is None, branch_of(branch).harmonics.orders
    point, names = point_number(dataset, point), _names(dataset, dof, contact)
    log = None if log is None else truth("log", log)
    if contact is None:
        text, series = motion_label(dataset, names), {name: _motion(dataset, point, name) for name in names}
    else:
        text, series = _forces(dataset, point, names)
    y_label = f"Amplitude of the {text[0].lower()}{text[1:]}"
    sizes = {name: _sizes(values) for name, values in series.items()}
    ax = styled(ax, "Harmonic of the fundamental frequency", y_label)
    show_lengths(ax.yaxis, largest=largest_length(dataset, "displacement"))
    width = 0.8 / len(names)
    for k, (name, values) in enumerate(sizes.items()):
        places = np.arange(len(orders)) + (k + 0.5) * width - 0.4
        ax.bar(places, values, width=0.94 * width, label=name)
    largest = max(float(values.max()) for values in sizes.values())
    shown = [values[values > _LEAST * largest] for values in sizes.values()]
    if not largest:
        ax.set_ylim(0.0, 1.0)
    elif log or (log is None and over_decades(shown)):
        log_scale(ax, "y")
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


def _names(dataset: xarray.Dataset, dof: Names, contact: Names) -> list[str]:
    """Dofs or contacts of which something is drawn."""
    if dof is not None and contact is not None:
        raise InputError("both dof and contact are given; their motion and force do not fit in one figure")
    return chosen(dataset, "dof", dof) if contact is None else chosen(dataset, "contact", contact)


def _motion(dataset: xarray.Dataset, point: int, dof: str) -> Array:
    return np.asarray(dataset["displacement"].isel(point=point).sel(dof=dof))


def _forces(dataset: xarray.Dataset, point: int, contacts: Sequence[str]) -> tuple[str, dict[str, Array]]:
    """What the forces along the first port of contacts are called, with their unit, and their coefficients."""
    at, names = dataset.isel(point=point), names_of(dataset, "contact")
    variables = {name: force_of(at, names.index(name)) for name in contacts}
    text = "Friction force" if all(friction for _, friction in variables.values()) else "Contact force"
    forces = {name: np.asarray(at[variable].sel(contact=name)) for name, (variable, _) in variables.items()}
    return with_unit(text, units_of(dataset).label("force")), forces
