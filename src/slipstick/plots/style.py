"""Look of the figures: sizes, colours told apart by colour-blind readers, labels with units. No pyplot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cycler import cycler

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Okabe and Ito's palette."""
DASHES = ("-", "--", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (3, 1)), (0, (1, 1)), "-")
STATE_COLOURS = {"stick": "#0072B2", "slip+": "#E69F00", "slip-": "#D55E00", "separation": "#BBBBBB"}
GREY = "#666666"


def new_axes(width: float = 6.4, height: float = 4.0) -> Axes:
    """Axes of a figure of its own, not known to pyplot."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def styled(ax: Axes | None, x_label: str, y_label: str) -> Axes:
    """The given or new axes with labels, a light grid and the palette."""
    ax = new_axes() if ax is None else ax
    if not ax.lines:
        ax.set_prop_cycle(cycler(color=COLOURS) + cycler(linestyle=DASHES))
    ax.set_xlabel(x_label)
    ax.set_ylabel(y_label)
    ax.grid(True, color="#DDDDDD", linewidth=0.6)
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return ax


def datasets(branches: Any) -> Iterator[tuple[str | None, xarray.Dataset]]:
    """Label and dataset of one branch, of a list, or of a table ``{label: branch}``; datasets are taken as they are."""
    if hasattr(branches, "data_vars") or hasattr(branches, "dataset"):
        yield None, _dataset(branches)
        return
    pairs: Iterable[tuple[str | None, Any]]
    pairs = branches.items() if isinstance(branches, Mapping) else ((None, b) for b in branches)
    for label, branch in pairs:
        yield label, _dataset(branch)


def _dataset(branch: Any) -> xarray.Dataset:
    dataset: xarray.Dataset = getattr(branch, "dataset", branch)
    return dataset


def quantity(dataset: xarray.Dataset, name: str) -> str:
    """Label of a variable: its long name, less what stands in brackets, and its unit, from the dataset itself."""
    attributes = dataset[name].attrs
    text = str(attributes.get("long_name", name.replace("_", " "))).split(" (")[0]
    units = str(attributes.get("units", ""))
    if name != "parameter":  # that is the user's own name
        text = text[:1].upper() + text[1:]
    return f"{text} [{units}]" if units not in ("", "1") else text


def abscissa(dataset: xarray.Dataset) -> str:
    """What the branch follows: ``omega``, or the parameter where the frequency stands still."""
    name = dataset.attrs.get("parameter", "")
    return "parameter" if name and "parameter" in dataset else "omega"


def abscissa_text(dataset: xarray.Dataset, point: int) -> str:
    """The followed quantity at a point, with its unit: "4.26 rad/s"."""
    values = dataset[abscissa(dataset)]
    units = str(values.attrs.get("units", ""))
    return f"{float(values[point]):.5g}" + (f" {units}" if units not in ("", "1") else "")


def save_figure(ax: Axes, stem: str | Path, *, formats: Iterable[str] = ("png", "svg")) -> list[Path]:
    """Write the figure of some axes as ``stem.png`` and ``stem.svg``; the files written."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    stem = Path(stem)
    paths = [stem.with_name(f"{stem.name}.{ending}") for ending in formats]
    for path in paths:
        metadata = {"Date": None} if path.suffix == ".svg" else {}
        figure.savefig(path, dpi=150, metadata=metadata)
    return paths
