"""Nonlinear modes: the line through the peaks of all load levels, drawn over forced curves, and their damping."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import InputError
from slipstick.plots.overlay import Curves, corners_of, smooth
from slipstick.plots.quantities import Branches, OneBranch, abscissa, chosen, dataset_of, quantity
from slipstick.plots.style import GREY, legend, log_scale, styled, titled
from slipstick.results.view import analysis_of, values_of
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    import xarray
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
        The branch of ``ss.nonlinear_modes``. Points of the load factors that were asked for are marked.
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
