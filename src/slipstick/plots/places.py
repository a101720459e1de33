"""A point of a branch that figures are drawn of: the branch, its place along it, the title that tells it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from slipstick.branch import Branch
from slipstick.errors import InputError
from slipstick.faults import whole
from slipstick.plots.quantities import NO_POINTS, abscissa, dataset_of, title_of
from slipstick.plots.style import titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def point_number(dataset: Any, point: Any) -> int:
    """The number of a point; InputError where there is none."""
    count = dataset.sizes["point"]
    if not count:
        raise InputError(NO_POINTS)
    return whole("point", point, -count, count - 1)


def branch_of(branch: Any) -> Branch:
    """The branch, or that of a dataset."""
    return branch if isinstance(branch, Branch) else Branch.from_dataset(dataset_of(branch))


def point_titled(ax: Axes, dataset: Any, point: int, names: list[str]) -> None:
    """Title of a figure of a point; it tells the name of what is drawn alone."""
    figure: Figure = ax.figure  # type: ignore[assignment]
    about = names if len(names) == 1 else []
    titled(figure, title_of([(None, dataset)]), *about, f"at {abscissa(dataset).text(dataset, point)}")
