"""Curves over the followed quantity: amplitude, phase, mean, power, friction, temperature, states, stability.

All take a branch or its dataset, a list of them, or ``{label: branch}`` to be overlaid; one name of a dof or contact,
or several; and return Axes. Common arguments:

``ax``
    Axes to draw into; by default those of a new figure, which has the title of the results.
``label``
    Name of a single branch in the legend.
``frequency``
    "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written in.

They raise InputError for names and units that are not there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import names as texts
from slipstick.faults import truth, whole
from slipstick.plots.overlay import Curves
from slipstick.plots.quantities import (
    Branches,
    OneBranch,
    abscissa,
    chosen,
    dataset_of,
    datasets,
    held_text,
    parted,
    quantity,
    title_of,
)
from slipstick.plots.style import GREY, PEAK, STATE_COLOURS, legend, log_scale, new_figure, over_decades, styled, titled
from slipstick.results.contacts import NO_FRICTION
from slipstick.results.peaks import ROUNDING, located_peaks
from slipstick.results.stability import between_known
from slipstick.results.view import names_of, orders_of, phases_at, place_of, values_of
from slipstick.typing import DrawnAxes, Names

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes


def response(
    branches: Branches,
    dof: Names = None,
    *,
    references: Branches | None = None,
    peaks: bool = True,
    log: bool | None = None,
    ax: Axes | None = None,
    label: str | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Amplitude (0-to-peak, without the mean) versus frequency or the followed parameter.

    Where stability is known, unstable motion is dashed, and folds, period doublings and the like are marked.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    dof
        Name of the dof, or several; by default the first.
    references
        Linear responses (without contact, fully stuck) drawn thin and grey: ``{label: dataset}``.
    peaks
        Whether located peaks are marked.
    log
        Logarithmic amplitude; by default where a new figure holds more than two decades.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        One line for each branch and dof, labelled with their names.

    Raises
    ------
    InputError
        For names and units that are not there, and branches that do not fit in one figure.
    """
    curves = Curves(branches, ax, label, frequency)
    ax = curves.draw("amplitude", "dof", dof)
    log = None if log is None else truth("log", log)
    if truth("peaks", peaks):
        for _, dataset in curves.overlaid:
            _mark_peaks(ax, curves, dataset, dof)
    for _, dataset in curves.overlaid:
        mark_special(ax, curves, dataset, dof)
    drawn = [np.asarray(line.get_ydata()) for line in ax.lines]
    limits = _amplitude_scale(ax, drawn, log or (log is None and curves.new and over_decades(drawn)))
    for (name, dataset), dashes in zip(_references(references), _THIN * 20, strict=False):
        y = values_of(dataset, "amplitude", "dof", chosen(dataset, "dof", dof)[0])
        seen = np.any((y >= limits[0]) & (y <= limits[1]))  # what is outside needs no name
        style: dict[str, Any] = {"linestyle": dashes, "label": (name or "linear") if seen else "_"}
        ax.plot(curves.abscissa.values(dataset), y, color=GREY, linewidth=0.9, zorder=1, **style)
        ax.set_ylim(limits)
    curves.legend()
    return ax


_THIN = (":", "-.")


def _amplitude_scale(ax: Axes, drawn: Sequence[np.ndarray], log: bool) -> tuple[float, float]:
    """Set the scale for the curves drawn; the limits that references beside them have to keep to."""
    high = ax.get_ylim()[1]
    if not log:
        return 0.0, high
    log_scale(ax, "y", nonpositive="mask")
    low = min(float(y[y > 0].min(initial=high)) for y in drawn)
    return 0.7 * low, high * (high / low) ** 0.05


def _references(references: Branches | None) -> list[tuple[str | None, xarray.Dataset]]:
    """Linear responses by label; there may be none."""
    return [] if references is None or (isinstance(references, Mapping) and not references) else datasets(references)


def phase(
    branches: Branches,
    dof: Names = None,
    *,
    harmonic: int = 1,
    ax: Axes | None = None,
    label: str | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Phase of a harmonic of the motion, degrees: of ``amplitude * cos(harmonic tau + phase)``, as of loads.

    It goes on without jumps along a branch; where the harmonic is nothing but rounding there is none.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    dof
        Name of the dof, or several; by default the first.
    harmonic
        Order of the harmonic, from 1; the results have to hold it.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        One line for each branch and dof, labelled with their names.

    Raises
    ------
    InputError
        For a harmonic, names and units that are not there, and branches that do not fit in one figure.
    """
    curves = Curves(branches, ax, label, frequency)
    order = whole("harmonic", harmonic, 1)
    values = {id(d): {n: _phase(d, n, order) for n in chosen(d, "dof", dof)} for _, d in curves.overlaid}
    ax = curves.draw_values(f"Phase of harmonic {order} [deg]", values)
    curves.legend()
    return ax


def _phase(dataset: xarray.Dataset, dof: str, order: int) -> np.ndarray:
    orders = orders_of(dataset)
    if order not in orders:
        raise InputError(f"harmonic: found {order}; the results hold {', '.join(str(m) for m in orders[1:])}")
    return phases_at(dataset, [place_of(dataset, "dof", dof)], orders.index(order))[:, 0]


def mean(
    branches: Branches,
    dof: Names = None,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Mean of the motion (harmonic 0) versus frequency or the followed parameter.

    A mean below 1e-11 of the largest motion in the results is rounding and drawn as zero.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    dof
        Name of the dof, or several; by default the first.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        One line for each branch and dof, labelled with their names.

    Raises
    ------
    InputError
        For names and units that are not there, and branches that do not fit in one figure.
    """
    curves = Curves(branches, ax, label, frequency)
    ax = curves.draw("mean", "dof", dof)
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    curves.legend()
    return ax


def power(
    branches: Branches,
    contact: Names = None,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Dissipated power: of one contact, of several, or of all together.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    contact
        Name of the contact, or several; by default the sum of all.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        One line for each branch and contact, labelled with their names.

    Raises
    ------
    InputError
        For names and units that are not there, and branches that do not fit in one figure.
    """
    curves = Curves(branches, ax, label, frequency)
    ax = curves.draw("dissipated_power", "contact", contact) if contact is not None else _total_power(curves)
    curves.legend()
    return ax


def _total_power(curves: Curves) -> DrawnAxes:
    def total(dataset: xarray.Dataset) -> np.ndarray:
        names = chosen(dataset, "contact", names_of(dataset, "contact"))
        return np.sum([values_of(dataset, "dissipated_power", "contact", name) for name in names], axis=0)

    values = {id(dataset): {"": total(dataset)} for _, dataset in curves.overlaid}
    return curves.draw_values(quantity(curves.first, "dissipated_power"), values)


def friction(
    branches: Branches,
    contact: Names = None,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Friction coefficient of one contact (by default the first), or of several.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    contact
        Name of the contact, or several; by default the first.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        One line for each branch and contact, labelled with their names.

    Raises
    ------
    InputError
        For names and units that are not there, and branches that do not fit in one figure.
    """
    curves = Curves(branches, ax, label, frequency)
    ax = curves.draw("friction_coefficient", "contact", contact)
    curves.legend()
    return ax


def temperature(
    branches: Branches,
    contact: Names = None,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    frequency: str | None = None,
) -> DrawnAxes:
    """Contact temperature of one contact (by default the first), or of several; only where friction heats contacts.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    contact
        Name of the contact, or several; by default the first.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        One line for each branch and contact, labelled with their names.

    Raises
    ------
    InputError
        Where contacts are not heated; for names and units that are not there.
    """
    curves = Curves(branches, ax, label, frequency)
    if any("temperature" not in d or bool(d["temperature"].isnull().all()) for _, d in curves.overlaid):
        raise InputError("there is no temperature in these results: the contacts are not heated")
    ax = curves.draw("temperature", "contact", contact)
    curves.legend()
    return ax


def _mark_peaks(ax: Axes, curves: Curves, dataset: xarray.Dataset, dof: Names) -> None:
    if "kind" not in dataset:
        return
    known = names_of(dataset, "dof")
    x = curves.abscissa.values(dataset)
    for name in chosen(dataset, "dof", dof):
        at = located_peaks(dataset, known.index(name))
        y = values_of(dataset, "amplitude", "dof", name)
        label = "_" if PEAK in ax.get_legend_handles_labels()[1] else PEAK  # once in a legend
        if at.size:
            ax.plot(x[at], y[at], "o", color="black", ms=3.5, markerfacecolor="white", linestyle="none", label=label)


def compare(
    branches: Branches,
    labels: Sequence[str] | None = None,
    *,
    dof: str | None = None,
    frequency: str | None = None,
    log: bool | None = None,
) -> list[Axes]:
    """Several branches in one figure: amplitude, mean where there is one, and dissipated power.

    Parameters
    ----------
    branches
        Branches or datasets over the same quantity and in the same units, or ``{label: branch}``.
    labels
        A name for each; by default their titles where these differ, else their numbers.
    dof
        The dof compared, by default the first.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.
    log
        Logarithmic amplitude; by default where the branches together span two decades or more.

    Returns
    -------
    list of Axes
        From top to bottom.

    Raises
    ------
    InputError
        For labels that are not as many as the branches, other names, or branches that do not fit in one figure.
    """
    overlaid = datasets(branches)
    pairs = dict(zip(_labels(overlaid, labels), (dataset for _, dataset in overlaid), strict=True))
    (name,) = chosen(overlaid[0][1], "dof", dof)
    moved = any(values_of(d, "mean", "dof", chosen(d, "dof", name)[0]).any() for d in pairs.values())
    rubbed = all("dissipated_power" in d and d.sizes.get("contact", 0) for d in pairs.values())
    kinds = ["amplitude", *(["mean"] if moved else []), *(["power"] if rubbed else [])]
    figure = new_figure(7.2, 1.4 + 2.3 * len(kinds))
    axes = dict(zip(kinds, figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0], strict=True))
    if log is None:  # of all branches together
        log = over_decades(values_of(d, "amplitude", "dof", name) for d in pairs.values())
    response(pairs, name, ax=axes["amplitude"], frequency=frequency, log=log)
    if "mean" in axes:
        mean(pairs, name, ax=axes["mean"], frequency=frequency)
    if "power" in axes:
        power(pairs, ax=axes["power"], frequency=frequency)
    for kind, ax in axes.items():
        if kind != "amplitude" and ax.get_legend() is not None:
            ax.get_legend().remove()
        ax.label_outer()
    titled(figure, title_of(overlaid), name, held_text(overlaid[0][1]))
    return list(axes.values())


def _labels(overlaid: Sequence[tuple[str | None, xarray.Dataset]], labels: Sequence[str] | None) -> list[str]:
    if labels is None:
        titles = [label or str(dataset.attrs.get("title", "")) for label, dataset in overlaid]
        distinct = len(set(titles)) == len(titles) and all(titles)
        return titles if distinct else [f"branch {k}" for k in range(1, len(overlaid) + 1)]
    texts_of = texts("labels", labels, "a name for each branch")
    if len(texts_of) != len(overlaid) or len(set(texts_of)) < len(texts_of):
        raise InputError(
            f"labels: found {len(texts_of)} for {len(overlaid)} branches; expected a different name for each"
        )
    return list(texts_of)


_STATES = {"stick": "stick", "slip": "slip+", "separation": "separation"}
"""What is summed up, and the state whose colour it has."""


def fractions(
    branch: OneBranch, contact: str | None = None, *, ax: Axes | None = None, frequency: str | None = None
) -> DrawnAxes:
    """Fractions of the period in stick, slip and separation of one contact (by default the first).

    Stacked to 1; a curve that turns back has several values at one frequency, so its parts are drawn as lines. States
    that never occur are left out.

    Parameters
    ----------
    branch
        A branch, or its dataset.
    contact
        Name of the contact; by default the first.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        ``ax.collections`` are the states from the bottom up, or ``ax.lines`` where the curve turns back.

    Raises
    ------
    InputError
        For a contact without friction, and names and units that are not there.
    """
    dataset = dataset_of(branch)
    (name,) = chosen(dataset, "contact", contact)
    if "stick_fraction" not in dataset:
        raise InputError(NO_FRICTION)
    along, new = abscissa(dataset, frequency), ax is None
    x = along.values(dataset)
    shares = {state: values_of(dataset, f"{state}_fraction", "contact", name) for state in _STATES}
    if len(x) and all(np.isnan(share).all() for share in shares.values()):
        raise InputError(f"contact '{name}' is no friction contact; laws of another kind have no such states")
    shares = {state: share for state, share in shares.items() if share.max(initial=0.0) > ROUNDING}
    ax = styled(ax, along.label, "Fraction of the period")
    steps = np.diff(x)
    if len(x) > 1 and (np.all(steps >= 0) or np.all(steps <= 0)):
        colours = [STATE_COLOURS[_STATES[state]] for state in shares]
        ax.stackplot(x, list(shares.values()), labels=list(shares), colors=colours, alpha=0.85)
        ax.set_ylim(0.0, 1.0)
    else:
        marker = "o" if len(x) == 1 else None
        for state, share in shares.items():
            colour = {"separation": "#777777"}.get(state, STATE_COLOURS[_STATES[state]])
            ax.plot(*parted(dataset, x, share), color=colour, linestyle="-", linewidth=1.6, marker=marker, label=state)
        ax.set_ylim(-0.02, 1.02)
    ax.margins(x=0.0)
    if new:
        titled(ax.figure, str(dataset.attrs.get("title", "")), name, held_text(dataset))
    legend(ax)
    return ax


MARKS = {
    "turning point": ("fold", "o"),
    "period doubling": ("period doubling", "s"),
    "Neimark-Sacker": ("Neimark-Sacker", "D"),
    "symmetry breaking": ("symmetry breaking", "^"),
    "state change": ("contact states change", "|"),
    "Hopf": ("Hopf", "*"),
}
"""Kinds of points: name in the legend and marker."""


def stability(
    branches: Branches, *, ax: Axes | None = None, label: str | None = None, frequency: str | None = None
) -> DrawnAxes:
    """Largest magnitude of a Floquet multiplier along the branch; above 1 the motion is unstable.

    Only for branches followed with ``stability=True``.

    Parameters
    ----------
    branches
        A branch or dataset, a list of them, or ``{label: branch}`` to be overlaid.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.
    label
        Name of a single branch in the legend.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    Axes
        One line for each branch; the limit 1 is grey, and bifurcations are marked.

    Raises
    ------
    InputError
        For a branch followed without ``stability=True``, and units that are not there.
    """
    curves = Curves(branches, ax, label, frequency)
    if any("multiplier_max" not in dataset for _, dataset in curves.overlaid):
        raise InputError("there is no stability in these results: follow the branch with stability=True")
    values = {id(dataset): {"": between_known(dataset["multiplier_max"].to_numpy())} for _, dataset in curves.overlaid}
    ax = curves.draw_values(quantity(curves.first, "multiplier_max"), values)
    ax.axhline(1.0, color=GREY, linewidth=0.8, zorder=0)
    for _, dataset in curves.overlaid:
        _mark(ax, dataset, curves.abscissa.values(dataset), dataset["multiplier_max"].to_numpy())
    legend(ax)
    return ax


def mark_special(ax: Axes, curves: Curves, dataset: xarray.Dataset, dof: Names) -> None:
    """Marks on the amplitudes of dofs, where stability is known."""
    if "stable" in dataset:
        for name in chosen(dataset, "dof", dof):
            _mark(ax, dataset, curves.abscissa.values(dataset), values_of(dataset, "amplitude", "dof", name))


def _mark(ax: Axes, dataset: xarray.Dataset, x: np.ndarray, y: np.ndarray) -> None:
    kind = dataset["kind"].to_numpy()
    for name, (text, marker) in MARKS.items():
        at = np.flatnonzero(kind == name)
        if at.size:
            label = "_" if text in ax.get_legend_handles_labels()[1] else text  # once in a legend
            size = 7.0 if marker == "|" else 4.5
            ax.plot(x[at], y[at], marker, color="black", ms=size, linestyle="none", label=label)
