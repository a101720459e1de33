"""One point of a branch: hysteresis loops and the states over a period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.plots.style import COLOURS, GREY, STATE_COLOURS, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Interval = tuple[float, float, str]


def loop(
    motion: ArrayLike,
    force: ArrayLike,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: str | None = None,
    limit: ArrayLike | None = None,
) -> Axes:
    """Hysteresis loop: friction force over the vibration of the contact.

    Parameters
    ----------
    motion, force
        Relative tangential motion (length) and friction force over one period, (n,); the loop is closed here.
    ax, label, color
        Axes to draw into (by default new ones), name in the legend, colour.
    limit
        Friction limit mu fy over the period (n,), drawn thin with both signs.

    Returns
    -------
    Axes
        The first line added is the loop.
    """
    ax = styled(ax, "Tangential motion x [length]", "Friction force $f_x$ [force]")
    x, f = _closed(motion), _closed(force)
    (line,) = ax.plot(x, f, linewidth=1.6, label=label, linestyle="-")
    if color:
        line.set_color(color)
    if limit is not None:
        b = _closed(limit)
        for sign in (1.0, -1.0):
            ax.plot(x, sign * b, color=line.get_color(), linewidth=0.7, linestyle=":")
    if label:
        ax.legend(frameon=False, fontsize="small")
    return ax


def _closed(values: ArrayLike) -> np.ndarray:
    array = np.asarray(values, dtype=float)
    return np.append(array, array[:1])


def states(intervals: Mapping[str, Sequence[Interval]], *, ax: Axes | None = None) -> Axes:
    """States of contacts over one period, a bar for each contact.

    Parameters
    ----------
    intervals
        For each contact a list of (start, end, "stick" | "slip+" | "slip-" | "separation"), in rad; an interval that
        ends beyond 2 pi is wrapped round.
    ax
        Axes to draw into; by default those of a new figure, high enough for the contacts.

    Returns
    -------
    Axes
        One patch for each interval (two for a wrapped one), contacts from top to bottom.
    """
    if ax is None:
        from slipstick.plots.style import new_axes

        ax = new_axes(height=1.4 + 0.35 * len(intervals))
    ax = styled(ax, r"Phase $\tau = \omega t$ [rad]", "")
    ax.grid(False)
    shown: dict[str, Any] = {}
    for row, spans in enumerate(intervals.values()):
        for start, end, name in (piece for span in spans for piece in _wrapped(*span)):
            bars = ax.barh(row, end - start, left=start, height=0.7, color=STATE_COLOURS.get(name, GREY), linewidth=0)
            shown.setdefault(name, bars)
    _finish_states(ax, list(intervals), shown)
    return ax


def _wrapped(start: float, end: float, name: str) -> list[Interval]:
    period = 2 * np.pi
    shift = np.floor(start / period) * period
    start, end = start - shift, end - shift
    if end <= period + 1e-12:
        return [(start, min(end, period), name)]
    return [(start, period, name), (0.0, end - period, name)]


def _finish_states(ax: Axes, names: list[str], shown: Mapping[str, Any]) -> None:
    ax.set_yticks(range(len(names)), labels=names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlim(0.0, 2 * np.pi)
    ax.set_xticks(np.arange(5) * np.pi / 2, labels=["0", "π/2", "π", "3π/2", "2π"])
    order = [name for name in STATE_COLOURS if name in shown]
    ax.legend(
        [shown[name] for name in order],
        order,
        ncols=4,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        frameon=False,
        fontsize="small",
    )


def history(tau: ArrayLike, values: Mapping[str, ArrayLike], *, ax: Axes | None = None, y_label: str = "") -> Axes:
    """Several quantities over one period, (n,) each, against the phase (n,)."""
    ax = styled(ax, r"Phase $\tau = \omega t$ [rad]", y_label)
    for (label, series), colour in zip(values.items(), COLOURS * len(values), strict=False):
        ax.plot(tau, series, label=label, color=colour, linewidth=1.4)
    ax.legend(frameon=False, fontsize="small")
    return ax
