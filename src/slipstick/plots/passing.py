"""Figures of integrations in time: the envelope while a machine passes through, spectra over time, sections."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import one
from slipstick.plots.quantities import with_unit
from slipstick.plots.style import COLOURS, GREY, legend, show_lengths, styled
from slipstick.results.run_up import RunUp, half_range, time_unit
from slipstick.results.solutions import Solutions
from slipstick.results.view import largest_length, unit_of
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def run_up(run: RunUp, dof: str | None = None, *, branch: Solutions | None = None, ax: Axes | None = None) -> DrawnAxes:
    """Amplitude over speed while the machine passes through, beside the steady curve; at one speed over time.

    Parameters
    ----------
    run
        What ``ss.runs.run_up`` returns.
    dof
        Name of the dof; by default the first.
    branch
        The steady curve, drawn beside it.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        The line of the run, and that of the steady curve where it is given.

    Raises
    ------
    InputError
        For what is no run-up, a run without a whole period, and a name that is not there.
    """
    known, name = _known(run, dof)
    unit = unit_of(known.dataset, "amplitude", name)
    time = time_unit(known.dataset)
    label = with_unit(f"Half range of {name}", unit)
    if known.dataset.attrs["rate"]:
        ax = styled(ax, f"Speed of the excitation [rad/{time}]", label)
        ax.plot(*known.envelope(name), color=COLOURS[0], linestyle="-", label="passing through")
    else:
        ax = styled(ax, f"Time [{time}]", label)
    show_lengths(ax.yaxis, largest=largest_length(known.dataset, "amplitude"))
    if not known.dataset.attrs["rate"]:
        size = known.dataset["amplitude"].sel(dof=name).to_numpy()
        ax.plot(known.dataset["time"].to_numpy(), size, color=COLOURS[0], linestyle="-", label="per period")
    if branch is not None:
        steady = one("branch", branch, Solutions, "an ss.Branch, or None")
        size = half_range(steady, name)
        ax.plot(steady.table["omega"].to_numpy(), size, color=GREY, linestyle="-", label="steady")
    legend(ax)
    return ax


def section(run: RunUp, dof: str | None = None, *, last: int = 256, ax: Axes | None = None) -> DrawnAxes:
    """Poincare section: displacement and velocity at the ends of the last periods, each a dot.

    Parameters
    ----------
    run
        What ``ss.runs.run_up`` returns.
    dof
        Name of the dof; by default the first.
    last
        How many periods.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        ``ax.lines[0]`` has the dots in the order of time.

    Raises
    ------
    InputError
        For what is no run-up, a run without a whole period, and a name that is not there.
    """
    known, name = _known(run, dof)
    length, velocity = (unit_of(known.dataset, f"section_{kind}", name) for kind in ("displacement", "velocity"))
    ax = styled(ax, with_unit(f"Displacement of {name}", length), with_unit(f"Velocity of {name}", velocity))
    show_lengths(ax.xaxis, largest=largest_length(known.dataset, "section_displacement"))
    ax.plot(*known.section(name, last), linestyle="none", marker=".", markersize=3.0, color=COLOURS[0])
    return ax


def spectrogram(
    run: RunUp, dof: str | None = None, *, highest: float | None = None, ax: Axes | None = None
) -> DrawnAxes:
    """Spectrogram: amplitude versus frequency and time, in decibels of the largest.

    Parameters
    ----------
    run
        What ``ss.runs.run_up`` returns.
    dof
        Name of the dof; by default the first.
    highest
        The highest frequency drawn, rad/s; by default six times the highest speed.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        ``ax.collections[0]`` has the levels, decibels of the largest amplitude, no less than -80.

    Raises
    ------
    InputError
        For what is no run-up, a run without samples of the motion, and a name that is not there.
    """
    from slipstick.faults import number

    known, name = _known(run, dof)
    image = known.spectrogram(name)
    attrs: Any = known.dataset.attrs
    usual = 6.0 * max(attrs["start"], attrs["stop"])
    top = usual if highest is None else number("highest", highest, "a number > 0", above=1e-300)
    image = image.isel(frequency=image["frequency"].to_numpy() <= top)
    size = image.to_numpy()
    ax = styled(ax, f"Time [{time_unit(known.dataset)}]", f"Frequency [rad/{time_unit(known.dataset)}]")
    ax.grid(False)
    level = 20.0 * np.log10(np.maximum(size, 1e-300) / max(float(size.max(initial=0.0)), 1e-300))
    drawn = ax.pcolormesh(
        image["time"], image["frequency"], np.maximum(level, -80.0), cmap="cividis", shading="nearest"
    )
    figure: Any = ax.get_figure()
    figure.colorbar(drawn, ax=ax).set_label(f"Amplitude of {name} [dB]", parse_math=False)
    return ax


def _known(run: Any, dof: str | None) -> tuple[RunUp, str]:
    known = one("run", run, RunUp, "what ss.runs.run_up returns")
    if not known.dataset.sizes["period"]:
        raise InputError("nothing to draw: no period is integrated")
    known.envelope(dof)  # checks the name
    return known, str(known.dataset["dof"].to_numpy()[0]) if dof is None else dof
