"""Haigh diagram of the stresses of a body at a point of a branch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from slipstick.faults import SMALLEST, Gathering, number, one
from slipstick.plots.points import point_number, point_titled
from slipstick.plots.quantities import dataset_of, with_unit
from slipstick.plots.style import COLOURS, GREY, legend, styled
from slipstick.results.solutions import Solutions
from slipstick.results.stress import stress_of
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_MEGAPASCALS = {"N/m^2": 1e-6, "N/mm^2": 1.0}
"""Units of stress that axes show in MPa, and the factor; data stay in their own."""


def haigh(
    branch: Solutions,
    point: int,
    at: int | Sequence[int] | None = None,
    *,
    endurance: float | None = None,
    strength: float | None = None,
    ax: Axes | None = None,
) -> DrawnAxes:
    """Alternating over mean stress of elements (or nodes) at a point, the worst one named, with the Goodman line.

    Parameters
    ----------
    branch
        A branch of a finite element model, with its problem.
    point
        Number of the point; negative numbers count from the last.
    at
        Elements or nodes, as of ``branch.stress``, whose ``stress_alternating`` and ``stress_mean`` are drawn; by
        default all.
    endurance
        Alternating stress that is endured without a mean (force/length^2). The line from it to the strength is straight
        under tension and level under compression; the worst place is then the nearest to it, else that of the largest
        alternating stress.
    strength
        Tensile strength (force/length^2); given together with ``endurance``.
    ax
        Axes to draw into; by default those of a new figure, which has the title of the results.

    Returns
    -------
    Axes
        ``ax.collections[0]`` has the places, ``ax.texts[0]`` the worst one and, with a line, its reserve: how many
        times both stresses would grow until they reach the line.

    Raises
    ------
    InputError
        As ``branch.stress``; for one of ``endurance`` and ``strength`` alone.
    """
    dataset = dataset_of(one("branch", branch, Solutions, "an ss.Branch"))
    gathering = Gathering()
    limit = gathering.optional(number, "endurance", endurance, "a stress > 0", above=SMALLEST)
    most = gathering.optional(number, "strength", strength, "a stress > 0", above=SMALLEST)
    if not gathering.faults and (limit is None) != (most is None):
        missing = "strength" if most is None else "endurance"
        gathering.take(number, missing, None, "a stress > 0: the line needs both")
    gathering.end()
    point = point_number(dataset, point)
    found, new = stress_of(branch, [point], at).isel(point=0), ax is None
    mean, alternating = found["stress_mean"].to_numpy(), found["stress_alternating"].to_numpy()
    unit = str(found["stress_mean"].attrs["units"])
    factor = _MEGAPASCALS.get(unit, 0.0)
    read = "MPa" if factor else unit
    ax = styled(ax, with_unit("Mean stress", read), with_unit("Alternating stress", read))
    if factor and factor != 1.0:
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(lambda value, _: f"{factor * value:.6g}")
    ax.scatter(mean, alternating, s=14, color=COLOURS[0], linewidths=0)
    used = alternating
    if limit is not None and most is not None:
        used = alternating / limit + np.maximum(mean, 0.0) / most
        highest = max(most if mean.max() > 0.3 * most else 0.0, 1.2 * float(mean.max()))
        ax.plot(
            [min(0.0, float(mean.min())), 0.0, highest],
            [limit, limit, limit * (1.0 - highest / most)],
            color=GREY,
            label="Goodman",
        )
        legend(ax)
    worst = int(np.argmax(used))
    number_of = "element" if "element" in found.coords else "node"
    text = f"{number_of} {int(found[number_of][worst])}"
    if limit is not None and used[worst] > 0.0:
        text += f", reserve {1.0 / used[worst]:.4g}"
    ax.plot(mean[worst], alternating[worst], marker="o", markersize=7, fillstyle="none", color=COLOURS[1], linestyle="")
    where = (mean[worst], alternating[worst])
    left = mean[worst] > 0.5 * (mean.min() + mean.max())
    ax.annotate(
        text, where, xytext=(-9 if left else 9, -3), textcoords="offset points", ha="right" if left else "left",
        fontsize="small", parse_math=False,
    )  # fmt: skip
    ax.set_ylim(bottom=0.0)
    if new:
        point_titled(ax, dataset, point, [])
    return ax
