"""What was measured, and what the parameters that fit make of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.faults import shown, wrong
from slipstick.plots.style import COLOURS, legend, styled
from slipstick.results.table import is_dataset
from slipstick.results.view import frequency_unit, names_of
from slipstick.typing import Array, DrawnAxes, IntArray
from slipstick.units import Units, after_number

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def fit(fitted: xr.Dataset, *, ax: Axes | None = None, frequency: str | None = None) -> DrawnAxes:
    """Draw the ``dataset`` of an identification: circles are measured, lines with dots are fitted.

    Each level, points measured under the same conditions, has a curve of its own. Frequencies are in the unit
    ``frequency``, else in that of the case. Of several coefficients the root of the sum of their squares is drawn,
    without the mean, versus frequency; over the number of the point where that is one. The two numbers of a backbone
    are drawn over its amplitude (peaks: over the number of the point), each over the largest that was measured. A free
    decay is drawn over time, with points where it was measured.

    Parameters
    ----------
    fitted
        The ``dataset`` of what ``ss.identify`` and its like return.
    ax
        Axes to draw into; by default those of a new figure.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        For each level and dof a line of what is fitted, then one of what was measured.

    Raises
    ------
    InputError
        For what is no such dataset, and units that are not there.
    """
    known = set(fitted.variables) if is_dataset(fitted) else set()
    if not {"measured", "fitted"} <= known or not known & {"omega", "time"}:
        raise wrong("fitted", shown(fitted), "the dataset of ss.identify(...)")
    if "time" in fitted.dims:
        return _decay(fitted, ax)
    if "quantity" in fitted.dims:
        return _backbone(fitted, ax)
    measured, found = (_sizes(fitted, name) for name in ("measured", "fitted"))
    omega, units = fitted["omega"].to_numpy(), Units.of_results(fitted.attrs)
    unit = frequency_unit(fitted) if frequency is None else frequency
    omega = omega / units.frequency_factor(unit)
    over, label = (omega, f"Frequency [{unit}]") if np.ptp(omega) > 0.0 else (np.arange(1, omega.size + 1), "Point")
    what = str(fitted["measured"].attrs.get("long_name", "measured")).removeprefix("measured ")
    axes = styled(ax, label, f"{what[:1].upper()}{what[1:]} [{fitted['measured'].attrs.get('units', '1')}]")
    names = names_of(fitted, "dof") or [""]
    curves = [(k, name, level, points) for k, name in enumerate(names) for level, points in _levels(fitted)]
    for i, (k, name, level, points) in enumerate(curves):
        colour, at = COLOURS[i % len(COLOURS)], points[np.argsort(over[points], kind="stable")]
        said = ", ".join(part for part in (name if len(names) > 1 or not level else "", level) if part)
        axes.plot(over[at], found[at, k], ".-", color=colour, linewidth=0.8, markersize=4, label=f"{said} fitted")
        axes.plot(over[at], measured[at, k], "o", color=colour, fillstyle="none", linestyle="none",
                  label=f"{said} measured" if not level else "measured" if i == len(curves) - 1 else None)  # fmt: skip
    legend(axes)
    return axes


def _levels(fitted: xr.Dataset) -> list[tuple[str, IntArray]]:
    """Points measured under the same conditions, with these in words; without a name where there is one level alone."""
    apart = ("omega", "modal_amplitude")
    known = [str(name) for name, values in fitted.variables.items() if values.dims == ("point",) and name not in apart]
    every = np.arange(fitted.sizes["point"])
    if not known:
        return [("", every)]
    rows, of = np.unique(np.column_stack([fitted[name].to_numpy() for name in known]), axis=0, return_inverse=True)
    if len(rows) in (1, every.size):
        return [("", every)]
    after = [after_number(str(fitted[name].attrs.get("units", "1"))) for name in known]
    varied = [i for i in range(len(known)) if np.ptp(rows[:, i]) > 0.0]
    return [
        (", ".join(f"{known[i]} = {row[i]:.4g}{after[i]}" for i in varied), every[of.ravel() == k])
        for k, row in enumerate(rows)
    ]


def _backbone(fitted: xr.Dataset, ax: Axes | None) -> DrawnAxes:
    measured, found = (np.asarray(fitted[name].to_numpy(), dtype=float) for name in ("measured", "fitted"))
    over, label = np.arange(1.0, len(measured) + 1.0), "Point"
    if "modal_amplitude" in fitted.variables:
        over = np.asarray(fitted["modal_amplitude"].to_numpy(), dtype=float)
        label = f"Amplitude of the mode [{fitted['modal_amplitude'].attrs.get('units', '1')}]"
    axes, order = styled(ax, label, "Over the largest measured"), np.argsort(over, kind="stable")
    for k, name in enumerate(fitted["quantity"].to_numpy()):
        if not np.isfinite(measured[:, k]).any():
            continue
        size, colour = float(np.nanmax(np.abs(measured[:, k]))) or 1.0, COLOURS[k % len(COLOURS)]
        axes.plot(over[order], found[order, k] / size, ".-", color=colour, linewidth=0.8, markersize=4,
                  label=f"{name} fitted")  # fmt: skip
        axes.plot(over, measured[:, k] / size, "o", color=colour, fillstyle="none", label=f"{name} measured")
    legend(axes)
    return axes


def _decay(fitted: xr.Dataset, ax: Axes | None) -> DrawnAxes:
    time, unit = fitted["time"].to_numpy(), str(fitted["time"].attrs.get("units", "s"))
    what = str(fitted["measured"].attrs.get("long_name", "measured")).removeprefix("measured ")
    axes = styled(ax, f"Time [{unit}]", f"{what[:1].upper()}{what[1:]} [{fitted['measured'].attrs.get('units', '1')}]")
    axes.plot(time, fitted["measured"].to_numpy(), ".", color=COLOURS[1], markersize=2, label="measured")
    axes.plot(time, fitted["fitted"].to_numpy(), "-", color=COLOURS[0], linewidth=0.8, label="fitted")
    legend(axes)
    return axes


def _sizes(data: Any, name: str) -> Array:
    """One number for each point and dof, of what was measured alone."""
    values = np.where(np.isfinite(data["measured"].to_numpy()), data[name].to_numpy(), np.nan)
    if "coefficient" in data["measured"].dims:
        values = np.sqrt(np.nansum(values[..., 1:] ** 2, axis=-1))
    return np.asarray(values.reshape(len(values), -1), dtype=float)
