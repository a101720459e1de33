"""Load steps: pressure on the surfaces of joints, forces of bolts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.faults import shown, text, whole, wrong
from slipstick.plots.style import COLOURS, label_colour_bar, legend, styled, titled
from slipstick.results.table import is_dataset
from slipstick.typing import Array, DrawnAxes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_DOTS = 60.0
"""Area of a point, points squared, where the joint has 40 of them."""


def preload(loaded: xr.Dataset, step: int = -1, joint: str | None = None, *, ax: Axes | None = None) -> DrawnAxes:
    """Draw the ``dataset`` of load steps.

    Of a joint whose points are known: its pressure after a step, seen along its normal; open points are rings, slipping
    ones have a dark edge. Otherwise the sum of normal forces of each joint and bolt over the steps.

    Parameters
    ----------
    loaded
        The ``dataset`` of what ``ss.preload`` returns.
    step
        Number of the step, the last by default.
    joint
        Name of the joint; by default the one with most points.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        With the points of one joint, or a line for each joint and bolt.

    Raises
    ------
    InputError
        For what is no such dataset, and joints that are not there.
    """
    if not is_dataset(loaded) or not {"normal_resultant", "state"} <= set(loaded.variables):
        raise wrong("loaded", shown(loaded), "the dataset of ss.preload(...)")
    joints = [str(name) for name in loaded["joint"].to_numpy()]
    if joint is not None and text("joint", joint, "the name of a joint") not in joints:
        raise wrong("joint", joint, f"one of {', '.join(joints)}")
    count = loaded.sizes["step"]
    step = whole("step", step, -count, count - 1)
    owner = loaded["joint_of"].to_numpy().astype(str)
    placed = np.isfinite(loaded["area"].to_numpy()) if "area" in loaded else np.zeros(len(owner), dtype=bool)
    names, counts = np.unique(owner[placed], return_counts=True)
    if joint is None and len(names):
        joint = str(names[np.argmax(counts)])
    if joint is None or joint not in names:
        return _resultants(loaded, joints, ax)
    return _surface(loaded.isel(step=step, contact=np.flatnonzero(placed & (owner == joint))), joint, ax)


def _resultants(loaded: xr.Dataset, joints: list[str], ax: Axes | None) -> DrawnAxes:
    unit = loaded["normal_resultant"].attrs["units"]
    ax = styled(ax, "load step", f"normal force ({unit})")
    values = loaded["normal_resultant"].to_numpy()
    places = np.arange(len(values))
    for k, name in enumerate(joints):
        ax.plot(places, values[:, k], marker="o", label=name)
    ax.set_xticks(places, [str(name) for name in loaded["step"].to_numpy()], parse_math=False)
    legend(ax)
    return ax


def _surface(data: xr.Dataset, joint: str, ax: Axes | None) -> DrawnAxes:
    position, unit = data["position"].to_numpy(), data["position"].attrs["units"]
    across, labels = _plane(position, data["normal"].to_numpy())
    ax = styled(ax, f"{labels[0]} ({unit})", f"{labels[1]} ({unit})")
    seen, state = position @ across.T, data["state"].to_numpy().astype(str)
    opened, slips = state == "open", state == "slip"
    size = np.clip(_DOTS * 40.0 / len(position), 4.0, 4.0 * _DOTS)
    pressure = data["pressure"].to_numpy()
    x, y = seen.T
    ax.scatter(x[opened], y[opened], s=size, facecolors="none", edgecolors="#999999", label="open")
    dots: Any = ax.scatter(
        x[~opened], y[~opened], s=size, c=pressure[~opened], cmap="viridis", vmin=0.0, linewidths=1.2,
        edgecolors=[COLOURS[1] if slipping else "none" for slipping in slips[~opened]],
    )  # fmt: skip
    if slips.any():
        ax.scatter([], [], s=size, facecolors="none", edgecolors=COLOURS[1], label="at the limit of friction")
    ax.set_aspect("equal", adjustable="box")
    assert ax.figure is not None
    label_colour_bar(ax.figure.colorbar(dots, ax=ax), f"pressure ({data['pressure'].attrs['units']})")
    if opened.any() or slips.any():
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False, fontsize="small")
    titled(ax.get_figure(True), joint, f"after {data['step'].item()}")
    return ax


def _plane(position: Array, normals: Array) -> tuple[Array, list[str]]:
    """Two directions (2, 3) across the mean normal, along axes where it lies along one, and their names."""
    normal = np.abs(normals.mean(axis=0))
    if normal.max() > 0.999:
        kept = [axis for axis in range(3) if axis != int(np.argmax(normal))]
        return np.eye(3)[kept], ["xyz"[axis] for axis in kept]
    centred = position - position.mean(axis=0)
    return np.linalg.svd(centred, full_matrices=False)[2][:2], ["length", "width"]
