"""What was measured, and what the parameters that fit make of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.faults import shown, wrong
from slipstick.plots.style import COLOURS, legend, styled
from slipstick.typing import Array, DrawnAxes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def fit(fitted: xr.Dataset, *, ax: Axes | None = None) -> DrawnAxes:
    """Draw the ``dataset`` of an identification: circles are measured, lines with dots are fitted.

    Of several coefficients the root of the sum of their squares is drawn, without the mean, over the frequency; over
    the number of the point where that is one. The two numbers of a backbone are drawn over its amplitude (peaks: over
    the number of the point), each over the largest that was measured. A free decay is drawn over time, with points
    where it was measured.
    """
    known = set(fitted.variables) if hasattr(fitted, "data_vars") else set()
    if not {"measured", "fitted"} <= known or not known & {"omega", "time"}:
        raise wrong("fitted", shown(fitted), "the dataset of ss.identify(...)")
    if "time" in fitted.dims:
        return _decay(fitted, ax)
    if "quantity" in fitted.dims:
        return _backbone(fitted, ax)
    measured, found = (_sizes(fitted, name) for name in ("measured", "fitted"))
    omega, unit = fitted["omega"].to_numpy(), str(fitted["omega"].attrs.get("units", "rad/s"))
    over, label = (omega, f"frequency [{unit}]") if np.ptp(omega) > 0.0 else (np.arange(1, omega.size + 1), "point")
    what = str(fitted["measured"].attrs.get("long_name", "measured")).removeprefix("measured ")
    axes = styled(ax, label, f"{what} [{fitted['measured'].attrs.get('units', '1')}]")
    names = [str(dof) for dof in fitted["dof"].to_numpy()] if "dof" in fitted.dims else [""]
    order = np.argsort(over, kind="stable")
    for k, name in enumerate(names):
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(over[order], found[order, k], ".-", color=colour, linewidth=0.8, markersize=4, label=f"{name} fitted")
        axes.plot(over, measured[:, k], "o", color=colour, fillstyle="none", label=f"{name} measured")
    legend(axes)
    return axes


def _backbone(fitted: xr.Dataset, ax: Axes | None) -> DrawnAxes:
    measured, found = (np.asarray(fitted[name].to_numpy(), dtype=float) for name in ("measured", "fitted"))
    over, label = np.arange(1.0, len(measured) + 1.0), "point"
    if "modal_amplitude" in fitted.variables:
        over = np.asarray(fitted["modal_amplitude"].to_numpy(), dtype=float)
        label = f"amplitude of the mode [{fitted['modal_amplitude'].attrs.get('units', '1')}]"
    axes, order = styled(ax, label, "over the largest measured"), np.argsort(over, kind="stable")
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
    axes = styled(ax, f"time [{unit}]", f"{what} [{fitted['measured'].attrs.get('units', '1')}]")
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
