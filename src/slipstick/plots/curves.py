"""Curves over the followed quantity: amplitude, zero harmonic, dissipated power, state fractions, friction."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.plots.style import GREY, STATE_COLOURS, abscissa, datasets, quantity, styled

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

ROUNDING = 1e-11
"""Smaller than this beside the largest motion, a mean is what rounding left of zero."""


def response(
    branches: Any,
    dof: str | None = None,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    references: Any = None,
    peaks: bool = True,
    log: bool = False,
) -> Axes:
    """Amplitude (0-to-peak, without the zero harmonic) over frequency or the followed parameter.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    dof
        Name of the dof; by default the first.
    ax
        Axes to draw into; by default those of a new figure.
    label
        Name of a single branch in the legend.
    references
        Linear responses (without contact, fully stuck) drawn thin and grey: ``{label: dataset}``.
    peaks
        Whether located peaks are marked.
    log
        Logarithmic amplitude.

    Returns
    -------
    Axes
        One line for each branch, labelled with its name.
    """
    ax = _lines(branches, "amplitude", {"dof": dof}, ax, label)
    if peaks:
        for _, dataset in datasets(branches):
            _mark_peaks(ax, dataset, dof)
    limits = ax.get_ylim()
    for (name, dataset), line in zip(datasets(references or {}), (":", (0, (4, 2))) * 20, strict=False):
        x, y = dataset[abscissa(dataset)].to_numpy(), _select(dataset, "amplitude", {"dof": dof})
        ax.plot(x, y, color=GREY, linewidth=0.9, linestyle=line, label=name or "linear", zorder=1)
    if log:
        ax.set_yscale("log")
    elif references:
        ax.set_ylim(0.0, limits[1])
    _legend(ax)
    return ax


def mean(branches: Any, dof: str | None = None, *, ax: Axes | None = None, label: str | None = None) -> Axes:
    """Zero harmonic (mean position) over frequency or the followed parameter; arguments as in :func:`response`.

    A mean below 1e-11 of the largest motion in the results is rounding and drawn as zero.
    """
    ax = _lines(branches, "mean", {"dof": dof}, ax, label)
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    _legend(ax)
    return ax


def power(branches: Any, contact: str | None = None, *, ax: Axes | None = None, label: str | None = None) -> Axes:
    """Dissipated power over frequency: of one contact, or of all together."""
    ax = _lines(branches, "dissipated_power", {"contact": contact}, ax, label, total=contact is None)
    _legend(ax)
    return ax


def friction(branches: Any, contact: str | None = None, *, ax: Axes | None = None, label: str | None = None) -> Axes:
    """Friction coefficient over frequency, of one contact (by default the first)."""
    ax = _lines(branches, "friction_coefficient", {"contact": contact}, ax, label)
    _legend(ax)
    return ax


def temperature(branches: Any, contact: str | None = None, *, ax: Axes | None = None, label: str | None = None) -> Axes:
    """Contact temperature over frequency, of one contact (by default the first); only where friction heats contacts."""
    if any("temperature" not in d or bool(d["temperature"].isnull().all()) for _, d in datasets(branches)):
        raise InputError("there is no temperature in these results: the contacts are not heated")
    ax = _lines(branches, "temperature", {"contact": contact}, ax, label)
    _legend(ax)
    return ax


def fractions(branch: Any, contact: str | None = None, *, ax: Axes | None = None) -> Axes:
    """Parts of the period in stick, slip and separation, stacked to 1, for one contact (by default the first)."""
    ((_, dataset),) = list(datasets(branch))
    names = ("stick_fraction", "slip_fraction", "separation_fraction")
    shares = [_select(dataset, name, {"contact": contact}) for name in names]
    x, *shares = _parted(dataset, dataset[abscissa(dataset)].to_numpy(), *shares)
    ax = styled(ax, quantity(dataset, abscissa(dataset)), "Fraction of the period")
    colours = [STATE_COLOURS[key] for key in ("stick", "slip+", "separation")]
    labels = [name.removesuffix("_fraction") for name in names]
    ax.stackplot(x, np.array(shares), labels=labels, colors=colours, alpha=0.85)
    ax.set_ylim(0.0, 1.0)
    ax.margins(x=0.0)
    ax.legend(frameon=True, framealpha=0.9, loc="best", fontsize="small")
    return ax


def _lines(
    branches: Any,
    name: str,
    where: Mapping[str, str | None],
    ax: Axes | None,
    label: str | None,
    *,
    total: bool = False,
) -> Axes:
    pairs = list(datasets(branches))
    if not pairs:
        raise InputError("nothing to draw: no branch was given")
    first = pairs[0][1]
    ax = styled(ax, quantity(first, abscissa(first)), quantity(first, name))
    for own, dataset in pairs:
        values = dataset[name].sum("contact").to_numpy() if total else _select(dataset, name, where)
        ax.plot(*_parted(dataset, dataset[abscissa(dataset)].to_numpy(), values), linewidth=1.6, label=own or label)
        if values.size and np.ptp(values) < 1e-6 * np.abs(values).max():
            ax.set_ylim(*np.sort(values[0] * np.array([0.8, 1.2])))  # rounding is not to be magnified
    return ax


def _parted(dataset: xarray.Dataset, *series: np.ndarray) -> list[np.ndarray]:
    """Series (point,) with a nan between the parts of a branch: no line is drawn from one to the other."""
    if "part" not in dataset:
        return list(series)
    at = np.flatnonzero(np.diff(dataset["part"].to_numpy())) + 1
    return [np.insert(values.astype(float), at, np.nan) for values in series]


def _select(dataset: xarray.Dataset, name: str, where: Mapping[str, str | None]) -> np.ndarray:
    """The values (point,) of a variable for a named dof or contact; the first where no name is given."""
    values = _without_rounding(dataset) if name == "mean" else dataset[name]
    for dim, label in where.items():
        known = [str(v) for v in dataset[dim].to_numpy()]
        if label is not None and label not in known:
            raise InputError(f"there is no {dim} '{label}' in the results; there are {', '.join(known)}")
        values = values.isel({dim: known.index(label) if label is not None else 0})
    return values.to_numpy()


def _without_rounding(dataset: xarray.Dataset) -> xarray.DataArray:
    """The mean, with zero where it is nothing beside the largest motion of any dof."""
    mean = dataset["mean"]
    size = max(float(abs(dataset[name]).max()) for name in ("amplitude", "mean"))
    return mean.where(~(abs(mean) <= ROUNDING * size), 0.0)


def _mark_peaks(ax: Axes, dataset: xarray.Dataset, dof: str | None) -> None:
    if "kind" not in dataset:
        return
    names = [str(name) for name in dataset["dof"].to_numpy()]
    own = dataset["peak_dof"].to_numpy() == (names.index(dof) if dof is not None else 0)
    at = np.flatnonzero((dataset["kind"].to_numpy() == "peak") & own)
    x, y = dataset[abscissa(dataset)].to_numpy()[at], _select(dataset, "amplitude", {"dof": dof})[at]
    ax.plot(x, y, "o", color="black", markersize=3.5, markerfacecolor="white", linestyle="none", label="_peaks")


def _legend(ax: Axes) -> None:
    handles, labels = ax.get_legend_handles_labels()
    named: Iterable[str] = [label for label in labels if label and not label.startswith("_")]
    if named:
        ax.legend(handles, labels, frameon=False, fontsize="small")
