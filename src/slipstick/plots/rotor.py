"""Campbell and interference diagrams: frequencies of rotors and discs, engine orders, and where they meet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.faults import truth, wrong
from slipstick.plots.style import legend, styled
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_SENSES = {1: ("tab:blue", "forward whirl"), -1: ("tab:orange", "backward whirl"), 0: ("0.5", "no whirl")}


def campbell(data: xr.Dataset, *, ax: Axes | None = None, rpm: bool = False) -> DrawnAxes:
    """Draw what :func:`slipstick.models.campbell` found; in Hz over rpm, or in rad/s. Crossings are circles."""
    rpm = truth("rpm", rpm)
    labels = (
        ("speed of rotation [rpm]", "damped frequency [Hz]")
        if rpm
        else ("speed of rotation [rad/s]", "damped frequency [rad/s]")
    )
    data = _diagram(data, "whirl", "campbell")
    axes = styled(ax, *labels)
    speed, frequency, sense = (data[name].to_numpy() for name in ("speed", "frequency", "whirl"))
    across, up = (30.0 / np.pi, 0.5 / np.pi) if rpm else (1.0, 1.0)
    for code, (color, label) in _SENSES.items():
        lines = [np.where(_near(sense[:, k] == code), frequency[:, k], np.nan) for k in range(frequency.shape[1])]
        drawn = [line for line in lines if np.any(np.isfinite(line))]
        for i, line in enumerate(drawn):
            axes.plot(across * speed, up * line, color=color, label=label if i == 0 else None)
    top = 1.05 * up * float(np.nanmax(frequency, initial=0.0))
    for n in np.atleast_1d(data.attrs["engine_orders"]).tolist():
        axes.plot(across * speed, up * n * speed, color="0.7", linestyle="--", linewidth=0.8)
        end = min(speed[-1], top / (up * n))
        axes.annotate(f"{n}x", (across * end, up * n * end), color="0.4", ha="right", va="bottom", fontsize="small")
    met: Any = data["crossing_speed"].to_numpy(), data["crossing_frequency"].to_numpy()
    axes.plot(across * met[0], up * met[1], "o", color="k", fillstyle="none", markersize=5)
    axes.set_ylim(0.0, top)
    legend(axes)
    return axes


def interference(data: xr.Dataset, *, ax: Axes | None = None) -> DrawnAxes:
    """Draw what :func:`slipstick.models.interference` found: frequency over nodal diameter, with engine orders.

    Engine order n is the bar from its lowest to its highest frequency at its nodal diameter; resonances within the
    range of speeds are circles with n beside them. The thin line is that of the highest speed, folded at N/2.
    """
    data = _diagram(data, "nodal_diameter", "interference")
    axes = styled(ax, "nodal diameter", "undamped frequency [rad/s]")
    d, found = data["nodal_diameter"].to_numpy(), data["frequency"].to_numpy()
    for k in range(found.shape[1]):
        axes.plot(d, found[:, k], "o-", markersize=3, linewidth=0.8, label=f"mode {k + 1}")
    sectors, (low, high) = int(data.attrs["sectors"]), data.attrs["speed"]
    orders = np.atleast_1d(data.attrs["engine_orders"])
    line = np.arange(int(orders.max(initial=0)) + 1)
    folded = np.minimum(line % sectors, sectors - line % sectors)
    axes.plot(folded, high * line, color="0.8", linewidth=0.8, zorder=0)
    for n in orders.tolist():
        axes.plot([folded[n]] * 2, [low * n, high * n], color="0.6", linewidth=3.0, alpha=0.5, zorder=0)
    met = [data[f"crossing_{name}"].to_numpy() for name in ("nodal_diameter", "frequency", "order")]
    axes.plot(met[0], met[1], "o", color="k", fillstyle="none", markersize=8)
    for at, frequency, n in zip(*met, strict=True):
        axes.annotate(f" {n}x", (at, frequency), fontsize="small")
    axes.set_ylim(0.0, 1.1 * float(np.nanmax(found, initial=0.0)))
    legend(axes)
    return axes


def _diagram(data: object, name: str, function: str) -> xr.Dataset:
    """What a function of ``slipstick.models`` found; InputError for anything else."""
    import xarray as xr

    if not isinstance(data, xr.Dataset) or name not in data:
        raise wrong("data", data, f"what slipstick.models.{function} returns")
    return data


def _near(mask: Any) -> Any:
    """With the neighbours of what is true, so that lines of one sense reach those of another."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    return wide
