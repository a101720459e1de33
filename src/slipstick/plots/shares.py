"""How a contact shares its period between stick, slip and separation along a branch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.plots.quantities import ROUNDING, abscissa, chosen, dataset_of, held_text, parted, values_of
from slipstick.plots.style import STATE_COLOURS, legend, styled, titled
from slipstick.results.contacts import NO_FRICTION
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STATES = {"stick": "stick", "slip": "slip+", "separation": "separation"}
"""What is summed up, and the state whose colour it has."""


def fractions(
    branch: Any, contact: str | None = None, *, ax: Axes | None = None, frequency: str | None = None
) -> DrawnAxes:
    """Fractions of the period in stick, slip and separation of one contact (by default the first).

    Stacked to 1; a curve that turns back has several values at one frequency, so its parts are drawn as lines. States
    that never occur are left out.
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
