"""Wear over cycles of vibration: worn depth and load of contacts, amplitude and frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import InputError
from slipstick.plots.quantities import OneBranch, chosen, dataset_of, known_names, quantity, values_of
from slipstick.plots.style import legend, new_figure, styled, titled
from slipstick.typing import Names

if TYPE_CHECKING:
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

    Raises
    ------
    InputError
        For what is no wear, and names that are not there.
    """
    data = dataset_of(branch)
    if "cycles" not in data or "worn_depth" not in data:
        raise InputError("nothing to draw: these results are not of wear over cycles; give those of ss.wear")
    names = _deepest(data["worn_depth"].to_numpy(), known_names(data, "contact")) if contact is None else None
    contacts = names or chosen(data, "contact", contact)
    dofs = chosen(data, "dof", (str(data.attrs.get("peak_of", "")) or None) if dof is None else dof)
    places = new_figure(9.0, 6.0).subplots(2, 2, sharex=True)
    cycles = data["cycles"].to_numpy()
    drawn = (("worn_depth", "contact", contacts), ("normal_load", "contact", contacts), ("amplitude", "dof", dofs))
    for ax, (name, dim, labels) in zip(places.flat, drawn, strict=False):
        styled(ax, "", quantity(data, name))
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


def _deepest(depth: np.ndarray, names: list[str]) -> list[str]:
    """Names of the contacts worn deepest, in the order of the contacts."""
    worn = np.nan_to_num(depth).max(axis=0, initial=0.0)
    order = [int(i) for i in np.argsort(-worn, kind="stable")[:_MOST] if worn[i] > 0.0]
    return [names[i] for i in sorted(order)]
