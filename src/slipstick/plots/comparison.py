"""Branches beside each other: amplitude, mean and power over the same axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes

from slipstick.errors import InputError
from slipstick.faults import names as texts
from slipstick.plots.curves import mean, power, response
from slipstick.plots.quantities import chosen, datasets, held_text, title_of, values_of
from slipstick.plots.style import new_figure, over_decades, titled


def compare(
    branches: Any,
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
    frequency, log
        As for :func:`slipstick.plots.response`.

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


def _labels(overlaid: Sequence[tuple[str | None, Any]], labels: Sequence[str] | None) -> list[str]:
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
