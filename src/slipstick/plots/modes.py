"""Figures of modes: backbone and damping of nonlinear ones, Campbell and interference diagrams of linear ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import truth, wrong
from slipstick.plots.overlay import Curves, corners_of, smooth
from slipstick.plots.quantities import Branches, OneBranch, abscissa, chosen, dataset_of, quantity
from slipstick.plots.style import GREY, legend, log_scale, show_lengths, styled, titled
from slipstick.quantities import FREQUENCIES
from slipstick.results.view import analysis_of, largest_length, values_of
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    import xarray
    import xarray as xr
    from matplotlib.axes import Axes


def backbone(
    mode: OneBranch,
    forced: Branches | None = None,
    dof: str | None = None,
    *,
    ax: Axes | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Amplitude of a nonlinear mode over its frequency: the line through the peaks of forced curves of all load levels.

    Parameters
    ----------
    mode
        The branch of ``ss.nonlinear_modes``. Points of requested load factors are marked.
    forced
        Forced responses to be drawn too: a branch, a list of them, or ``{label: branch}``.
    dof
        Name of the dof; by default the first.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        The forced responses, if there are any, then the mode and the marks of the load factors.

    Raises
    ------
    InputError
        For what is no nonlinear mode, and names that are not there.
    """
    data = mode_dataset(mode)
    name = chosen(data, "dof", dof)[0]
    curves = Curves(mode if forced is None else forced, ax, None, frequency)
    ax = curves.draw("amplitude", "dof", name)
    x, y = abscissa(data, curves.abscissa.unit).values(data), values_of(data, "amplitude", "dof", name)
    if forced is not None:
        line = smooth(x, y, corners_of(data))
        ax.plot(*line, color=GREY, linestyle="-.", linewidth=1.3, label="nonlinear mode", zorder=3)
    at = np.flatnonzero(data["kind"].to_numpy() == "requested")
    if at.size:
        label = "predicted peak" if forced is not None else "load factor"
        ax.plot(x[at], y[at], "D", color="black", ms=4.0, markerfacecolor="white", linestyle="none", label=label)
        for k in at if forced is None else ():
            ax.annotate(f" {float(data['load_factor'][k]):.4g}", (x[k], y[k]), fontsize="small")
    ax.set_ylim(0.0, None)
    legend(ax)
    return ax


def damping(mode: OneBranch, *, ax: Axes | None = None) -> DrawnAxes:
    """Damping ratio of a nonlinear mode over its amplitude.

    Parameters
    ----------
    mode
        The branch of ``ss.nonlinear_modes``.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.

    Returns
    -------
    Axes
        One line; over more than a decade of amplitudes the axis is logarithmic.

    Raises
    ------
    InputError
        For what is no nonlinear mode.
    """
    data, new = mode_dataset(mode), ax is None
    ax = styled(ax, quantity(data, "modal_amplitude"), quantity(data, "modal_damping"))
    show_lengths(ax.xaxis, largest=largest_length(data, "modal_amplitude"))
    a, D = data["modal_amplitude"].to_numpy(), data["modal_damping"].to_numpy()
    ax.plot(*smooth(a, D, corners_of(data)), linewidth=1.6)
    if a.size and a.max() > 10.0 * a.min():
        log_scale(ax, "x")
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    if new:
        titled(ax.figure, str(data.attrs.get("title", "")))
    return ax


def mode_dataset(mode: OneBranch) -> xarray.Dataset:
    """The dataset of a nonlinear mode; InputError for another branch."""
    data = dataset_of(mode)
    if analysis_of(data) != "modes":
        raise InputError("nothing to draw: these results are not of a nonlinear mode; give those of ss.nonlinear_modes")
    return data


_SENSES = {1: ("tab:blue", "forward whirl"), -1: ("tab:orange", "backward whirl"), 0: ("0.5", "no whirl")}


def campbell(data: xr.Dataset, *, ax: Axes | None = None, rpm: bool = False, frequency: str | None = None) -> DrawnAxes:
    """Campbell diagram: damped frequencies over the speed, with engine orders. Crossings are circles.

    Speeds and frequencies are in the unit ``frequency``, "rad/s" by default; with "rpm", or ``rpm=True``, speeds are in
    rpm and frequencies in Hz. Where there are crossings, frequencies are shown as far as the engine orders reach.

    Parameters
    ----------
    data
        What :func:`slipstick.models.campbell` returns.
    ax
        Axes to draw into; by default those of a new figure.
    rpm
        The same as the unit "rpm".
    frequency
        "rad/s" (default), "Hz", "kHz" or "rpm": the unit of both axes; of speeds alone for "rpm", frequencies are then
        in Hz.

    Returns
    -------
    Axes
        Lines of frequencies by their sense of whirl, then the engine orders, last the crossings.

    Raises
    ------
    InputError
        For what is no such dataset, and an unknown unit.
    """
    unit = "rpm" if truth("rpm", rpm) and frequency is None else _unit(frequency)
    data = _diagram(data, "whirl", "campbell")
    rise = "Hz" if unit == "rpm" else unit
    axes = styled(ax, f"Speed of rotation [{unit}]", f"Damped frequency [{rise}]")
    speed, found, sense = (data[name].to_numpy() for name in ("speed", "frequency", "whirl"))
    across, up = 1.0 / FREQUENCIES[unit], 1.0 / FREQUENCIES[rise]
    if len(speed) > 1 and speed[0] == 0.0:  # nothing whirls at rest: lines begin there as they go on
        sense = np.concatenate([np.where(sense[:1] == 0, sense[1:2], sense[:1]), sense[1:]])
    for code, (color, label) in _SENSES.items():
        lines = [np.where(_near(sense[:, k] == code), found[:, k], np.nan) for k in range(found.shape[1])]
        drawn = [line for line in lines if np.any(np.isfinite(line))]
        for i, line in enumerate(drawn):
            axes.plot(across * speed, up * line, color=color, linestyle="-", label=label if i == 0 else None)
    met: Any = data["crossing_speed"].to_numpy(), data["crossing_frequency"].to_numpy()
    orders = np.atleast_1d(data.attrs["engine_orders"]).tolist()
    top = up * _top(found, met[1], float(speed[-1]) * max(orders, default=0))
    for n in orders:
        axes.plot(across * speed, up * n * speed, color="0.7", linestyle="--", linewidth=0.8)
        inside = up * n * speed[-1] <= top  # ends at the right, else at the top
        end = speed[-1] if inside else top / (up * n)
        place: dict[str, Any] = {"xytext": (0, 2), "ha": "center"}
        if inside:
            place = {"xytext": (3, 0), "ha": "left", "va": "center"}
        axes.annotate(f"{n}x", (across * end, up * n * end), textcoords="offset points", color="0.4",
                      fontsize="small", annotation_clip=False, **place)  # fmt: skip
    axes.plot(across * met[0], up * met[1], "o", color="k", fillstyle="none", markersize=5)
    axes.set_xlim(across * speed[0], across * speed[-1])
    axes.set_ylim(0.0, top)
    _legend_aside(axes)
    return axes


def interference(data: xr.Dataset, *, ax: Axes | None = None, frequency: str | None = None) -> DrawnAxes:
    """Interference diagram: frequencies over the nodal diameter, with engine orders.

    Engine order n is the bar from its lowest to its highest frequency at its nodal diameter; resonances within the
    range of speeds are circles with n beside them. The thin line is that of the highest speed, folded at N/2.
    Frequencies are in the unit ``frequency``, "rad/s" by default; in Hz for "rpm".

    Parameters
    ----------
    data
        What :func:`slipstick.models.interference` returns.
    ax
        Axes to draw into; by default those of a new figure.
    frequency
        "rad/s" (default), "Hz" or "kHz": the unit of the frequencies; for "rpm" they are in Hz.

    Returns
    -------
    Axes
        A line for each mode, that of the highest speed, the bars of the engine orders, and the resonances.

    Raises
    ------
    InputError
        For what is no such dataset, and an unknown unit.
    """
    from matplotlib.ticker import MaxNLocator

    data, unit = _diagram(data, "nodal_diameter", "interference"), _unit(frequency)
    unit = "Hz" if unit == "rpm" else unit
    axes, up = styled(ax, "Nodal diameter", f"Undamped frequency [{unit}]"), 1.0 / FREQUENCIES[unit]
    d, found = data["nodal_diameter"].to_numpy(), data["frequency"].to_numpy()
    for k in np.flatnonzero(np.isfinite(found).any(axis=0)):
        axes.plot(d, up * found[:, k], "o-", markersize=3, linewidth=0.8, label=f"mode {k + 1}")
    sectors, (low, high) = int(data.attrs["sectors"]), data.attrs["speed"]
    orders = np.atleast_1d(data.attrs["engine_orders"])
    line = np.arange(int(orders.max(initial=0)) + 1)
    folded = np.minimum(line % sectors, sectors - line % sectors)
    axes.plot(folded, up * high * line, color="0.8", linestyle="-", linewidth=0.8, zorder=0)
    for n in orders.tolist():
        axes.plot(
            [folded[n]] * 2,
            [up * low * n, up * high * n],
            color="0.6",
            linestyle="-",
            linewidth=3.0,
            alpha=0.5,
            zorder=0,
        )
    met = [data[f"crossing_{name}"].to_numpy() for name in ("nodal_diameter", "frequency", "order")]
    top = up * _top(found, met[1], high * float(orders.max(initial=0)))
    axes.plot(met[0], up * met[1], "o", color="k", fillstyle="none", markersize=8)
    for at, height, named in _together(met, 0.04 * top / up):
        axes.annotate(
            named, (at, up * height), xytext=(4, 5), textcoords="offset points", va="bottom", fontsize="small",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5},
        )  # fmt: skip
    axes.set_ylim(0.0, top)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _legend_aside(axes)
    return axes


def _unit(frequency: str | None) -> str:
    unit = "rad/s" if frequency is None else frequency
    if not isinstance(unit, str) or unit not in FREQUENCIES:
        raise wrong("frequency", unit, f"one of {', '.join(FREQUENCIES)}")
    return unit


def _top(found: Any, met: Any, reach: float) -> float:
    """The highest frequency shown: up to the highest engine order where there are crossings, else all."""
    every = 1.05 * float(np.nanmax(found, initial=0.0))
    return min(every, 1.05 * max(reach, float(met.max()))) if met.size else every


def _together(met: Sequence[Any], near: float) -> list[tuple[float, float, str]]:
    """Place and name of crossings; those closer than ``near`` share a name, "4x, 20x"."""
    diameters, frequencies, orders = met
    places: list[tuple[float, float, str]] = []
    for k in np.lexsort((frequencies, diameters)):
        d, w, named = float(diameters[k]), float(frequencies[k]), f"{orders[k]}x"
        if places and places[-1][0] == d and w - places[-1][1] < near:
            known = places.pop()
            d, w, named = d, known[1], known[2] if named in known[2].split(", ") else f"{known[2]}, {named}"
        places.append((d, w, named))
    return places


def _legend_aside(axes: Axes) -> None:
    """Beside the axes, where it hides nothing."""
    legend(axes)
    made = axes.get_legend()
    if made is not None:
        made.set_loc("upper left")
        made.set_bbox_to_anchor((1.06, 1.0))


def _diagram(data: object, name: str, function: str) -> xr.Dataset:
    """The dataset of a function of ``slipstick.models``; InputError for anything else."""
    import xarray as xr

    if not isinstance(data, xr.Dataset) or name not in data:
        raise wrong("data", data, f"what slipstick.models.{function} returns")
    return data


def _near(mask: Any) -> Any:
    """The mask with the neighbours of its true entries, so that lines of different senses join."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    return wide
