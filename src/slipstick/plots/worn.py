"""Wear over cycles of vibration: worn depth and load of contacts, amplitude and frequency; depth on the surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import point_numbers
from slipstick.plots.quantities import (
    NO_POINTS,
    OneBranch,
    chosen,
    dataset_of,
    quantity,
    units_of,
    with_unit,
)
from slipstick.plots.style import label_colour_bar, legend, new_figure, short, show_lengths, styled, titled
from slipstick.results.deflection import contact_nodes, contact_places, nearest_contacts, outward
from slipstick.results.solutions import Solutions
from slipstick.results.view import analysis_of, largest_length, names_of, values_of
from slipstick.typing import Array, IntArray, Names, Points

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

_MOST = 8
"""Contacts drawn where none are named: those worn deepest."""


def wear(branch: OneBranch, contact: Names = None, dof: Names = None) -> tuple[Axes, Axes, Axes, Axes]:
    """Worn depth, normal load, amplitude and frequency over the cycles, in a new figure.

    Parameters
    ----------
    branch
        The branch of ``ss.wear``.
    contact
        Name of a contact, or several; by default those worn deepest, at most 8.
    dof
        Name of the dof whose amplitude is drawn, or several; by default that of the peak, else the first.

    Returns
    -------
    tuple of Axes
        Of the worn depth, the normal load, the amplitude and the frequency.

    Raises
    ------
    InputError
        For what is no wear, and names that are not there.
    """
    data = _worn(branch)
    names = _deepest(data["worn_depth"].to_numpy(), names_of(data, "contact")) if contact is None else None
    contacts = names or chosen(data, "contact", contact)
    dofs = chosen(data, "dof", (str(data.attrs.get("peak_of", "")) or None) if dof is None else dof)
    places = new_figure(9.0, 6.0).subplots(2, 2, sharex=True)
    cycles = data["cycles"].to_numpy()
    drawn = (("worn_depth", "contact", contacts), ("normal_load", "contact", contacts), ("amplitude", "dof", dofs))
    for ax, (name, dim, labels) in zip(places.flat, drawn, strict=False):
        styled(ax, "", quantity(data, name, labels if dim == "dof" else ()))
        show_lengths(ax.yaxis, largest=largest_length(data, name))
        for label in labels:
            ax.plot(cycles, values_of(data, name, dim, label), linewidth=1.6, label=label)
        if len(labels) > 1:
            legend(ax)
    last = styled(places.flat[3], "", quantity(data, "omega"))
    last.plot(cycles, data["omega"].to_numpy(), linewidth=1.6)
    if not np.ptp(data["omega"].to_numpy()):
        last.ticklabel_format(axis="y", useOffset=False)
    for ax in places[1]:
        ax.set_xlabel("Cycles")
    titled(places.flat[0].figure, str(data.attrs.get("title", "")))
    first, second, third, fourth = places.flat
    return first, second, third, fourth


_MOST_NAMED = 30

_PANELS = 4
"""Points drawn where none are named."""


def worn_surface(branch: OneBranch, points: Points = None) -> tuple[Axes, ...]:
    """Worn depth on the surface of a body at some points of wear, side by side with one colour scale.

    Parameters
    ----------
    branch
        The branch of ``ss.wear``.
    points
        Numbers of the points, one or a list; by default the last one and three before it, evenly over the cycles.

    Returns
    -------
    tuple of Axes
        One for each point, seen along the axis of the model closest to the normal of the surface. Triangles round each
        contact have its depth (``axes.collections[0]``), and contacts are dots. Without a surface, or without contacts
        on it, one Axes: a bar for each contact and point.

    Raises
    ------
    InputError
        For what is no wear, and points that are not there.
    """
    from matplotlib.colors import Normalize

    data = _worn(branch)
    at = _spread(data["cycles"].to_numpy()) if points is None else point_numbers("points", points, data.sizes["point"])
    depth = np.nan_to_num(data["worn_depth"].to_numpy()[at])
    seen = _seen(branch)
    if seen is None:
        return (_bars(data, at, depth),)
    columns, rows = min(len(at), _PANELS), -(-len(at) // _PANELS)
    low, top = (seen.flat[:, seen.triangles.ravel()].min(axis=1), seen.flat[:, seen.triangles.ravel()].max(axis=1))
    air = 0.05 * float((top - low).max())
    wide, high = top - low
    figure = new_figure(1.5 + 3.2 * columns, rows * float(np.clip(2.8 * high / wide, 1.0, 4.0)) + 1.2)
    axes = figure.subplots(rows, columns, squeeze=False)
    scale = Normalize(0.0, float(depth.max(initial=0.0)) or 1.0)
    for ax, k, values in zip(axes.flat, at, depth, strict=False):
        ax.tripcolor(*seen.flat, seen.triangles, facecolors=values[seen.contacts], norm=scale, cmap="viridis")
        ax.plot(*seen.dots, linestyle="", marker="o", markersize=3, color="white", markeredgecolor="0.2")
        ax.set(xlim=(low[0] - air, top[0] + air), ylim=(low[1] - air, top[1] + air))
        ax.set(aspect="equal", title=f"{data['cycles'].to_numpy()[k]:.6g} cycles")
        ax.title.set_fontsize("medium")
        styled(ax, *(with_unit(name, units_of(data).label("length")) for name in seen.names)).grid(False)
        ax.label_outer()
    for ax in list(axes.flat)[len(at) :]:
        ax.set_visible(False)
    bar = figure.colorbar(axes.flat[0].collections[0], ax=axes, shrink=0.9)
    label_colour_bar(bar, quantity(data, "worn_depth"), largest_length(data, "worn_depth"))
    titled(figure, str(data.attrs.get("title", "")))
    return tuple(list(axes.flat)[: len(at)])


def _worn(branch: OneBranch) -> xarray.Dataset:
    data = dataset_of(branch)
    if analysis_of(data) != "wear":
        raise InputError("nothing to draw: these results are not of wear over cycles; give those of ss.wear")
    return data


def _spread(cycles: Array) -> list[int]:
    """Numbers of points evenly over the cycles, the last one among them; the first has worn nothing."""
    if not len(cycles):
        raise InputError(NO_POINTS)
    first = min(1, len(cycles) - 1)
    wanted = cycles[0] + (cycles[-1] - cycles[0]) * np.arange(1, _PANELS + 1) / _PANELS
    return sorted({first + int(np.argmin(np.abs(cycles[first:] - value))) for value in wanted})


class _Seen(NamedTuple):
    """Triangles of a surface round its contacts in two coordinates."""

    flat: Array
    """Both coordinates of all nodes, (2, n)."""
    triangles: IntArray
    contacts: IntArray
    """The contact that each triangle shows."""
    dots: Array
    """Places of the contacts, (2, n_contacts)."""
    names: tuple[str, str]


def _seen(branch: OneBranch) -> _Seen | None:
    """The surface mesh, where there is one with contacts on it."""
    problem: Any = branch.problem if isinstance(branch, Solutions) else None
    skin = None if problem is None else problem.structure.skin
    if skin is None:
        return None
    nodes = contact_nodes(problem)
    shown = nearest_contacts(skin, contact_places(problem))[skin.triangles]
    placed = nodes[nodes >= 0]
    normals, mean = outward(problem, nodes)
    if not mean.any():
        return None
    towards = (normals @ mean) > 0.5 * np.linalg.norm(normals, axis=1) * np.linalg.norm(mean)
    kept = towards & (shown >= 0).any(axis=1)
    along = int(np.argmax(np.abs(mean)))
    plane = [axis for axis in range(3) if axis != along]
    first = np.argmax(shown[kept] >= 0, axis=1)
    return _Seen(
        flat=skin.nodes[:, plane].T, triangles=skin.triangles[kept],
        contacts=shown[kept][np.arange(int(kept.sum())), first], dots=skin.nodes[placed][:, plane].T,
        names=("xyz"[plane[0]], "xyz"[plane[1]]),
    )  # fmt: skip


def _bars(data: xarray.Dataset, at: list[int], depth: Array) -> Axes:
    from matplotlib import colormaps

    names, viridis = names_of(data, "contact"), colormaps["viridis"]
    ax = styled(None, "", quantity(data, "worn_depth"))
    show_lengths(ax.yaxis, largest=largest_length(data, "worn_depth"))
    width = 0.8 / len(at)
    for j, (k, values) in enumerate(zip(at, depth, strict=True)):
        where = np.arange(len(names)) + (j - 0.5 * (len(at) - 1)) * width
        label = f"{data['cycles'].to_numpy()[k]:.6g} cycles"
        ax.bar(where, values, width=width, color=viridis(0.9 * (1.0 - j / max(1, len(at) - 1))), label=label)
    some = np.arange(0, len(names), -(-len(names) // _MOST_NAMED))
    turned: dict[str, Any] = {"rotation": 45, "ha": "right"} if len(some) > _MOST else {}
    ax.set_xticks(some, short([names[i] for i in some]), parse_math=False, **turned)
    legend(ax)
    titled(ax.figure, str(data.attrs.get("title", "")))
    return ax


def _deepest(depth: np.ndarray, names: list[str]) -> list[str]:
    """Names of the contacts worn deepest, in the order of the contacts."""
    worn = np.nan_to_num(depth).max(axis=0, initial=0.0)
    order = [int(i) for i in np.argsort(-worn, kind="stable")[:_MOST] if worn[i] > 0.0]
    return [names[i] for i in sorted(order)]
