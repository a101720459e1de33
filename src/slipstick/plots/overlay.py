"""Branches and the axes that their curves go into: labels, legend, limits, scale, title.

Lines through few points are made smooth by cubics over arclength that pass every point and do not overshoot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PchipInterpolator

from slipstick.errors import InputError
from slipstick.faults import text
from slipstick.plots.quantities import (
    Branches,
    abscissa,
    chosen,
    datasets,
    held_text,
    parted,
    quantity,
    title_of,
)
from slipstick.plots.style import GREY, legend, log_scale, over_decades, show_lengths, styled, titled
from slipstick.results.stability import UNKNOWN
from slipstick.results.view import largest_length, values_of, view_of
from slipstick.typing import Array, DrawnAxes, Names
from slipstick.units import length_shown

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes


@dataclass
class Curves:
    """Branches and the axes their curves go into."""

    branches: Branches
    ax: Axes | None = None
    label: str | None = None
    frequency: str | None = None
    overlaid: list[tuple[str | None, xarray.Dataset]] = field(init=False)

    def __post_init__(self) -> None:
        self.overlaid = datasets(self.branches)
        if self.label is not None:
            text("label", self.label)
        self.new = self.ax is None
        self.abscissa = abscissa(self.first, self.frequency)
        for _, dataset in self.overlaid[1:]:  # frequencies all in the unit of the first
            first, other = (quantity(d, abscissa(d).name) for d in (self.first, dataset))
            if first != other:
                raise InputError(f"branches over {first} and over {other} do not fit in one figure")

    @property
    def first(self) -> xarray.Dataset:
        """The dataset that sets the axes."""
        return self.overlaid[0][1]

    def draw(self, name: str, dim: str, names: Names) -> DrawnAxes:
        """A variable of named dofs or contacts."""
        of = {id(d): chosen(d, dim, names) for _, d in self.overlaid}
        labels = {quantity(d, name, of[id(d)] if dim == "dof" else ()) for _, d in self.overlaid if name in d}
        if len(labels) > 1:
            raise InputError(f"branches in different units do not fit in one figure: {', '.join(sorted(labels))}")
        values = {id(d): {n: values_of(d, name, dim, n) for n in of[id(d)]} for _, d in self.overlaid}
        return self.draw_values(labels.pop(), values, max(largest_length(d, name) for _, d in self.overlaid))

    def draw_values(
        self, y_label: str, values: Mapping[int, Mapping[str, np.ndarray]], largest: float = 0.0
    ) -> DrawnAxes:
        """Values (point,) by the id of their dataset and by name; the ``largest`` length decides their unit."""
        ax = styled(self.ax, self.abscissa.label, y_label)
        show_lengths(ax.yaxis, largest=largest)
        show_lengths(ax.xaxis, largest=max(largest_length(d, self.abscissa.name) for _, d in self.overlaid))
        for branch_label, dataset in self.overlaid:
            for name, series in values[id(dataset)].items():
                label = self._label(branch_label, name, len(values[id(dataset)]))
                stable = dataset["stable"].to_numpy() if "stable" in dataset else np.ones(dataset.sizes["point"])
                x, y, stable, corners = parted(
                    dataset, self.abscissa.values(dataset), series, stable, corners_of(dataset)
                )
                if is_sparse(dataset) and "stable" not in dataset:
                    x, y = smooth(x, y, corners)
                    stable = np.ones(len(x))
                _line(ax, x, y, stable, label)
        every = np.concatenate([series for curves in values.values() for series in curves.values()])
        if self.new:
            _limits(ax, every, length_shown("m", largest)[0])
            self._scale(ax)
            alone = {name for curves in values.values() for name in curves}
            about = (alone.pop() if len(alone) == 1 else "", held_text(self.first))
            titled(ax.figure, title_of(self.overlaid), *about)
        self.ax = ax
        return ax

    def legend(self) -> None:
        """Names of the curves; a single one that only the title could name needs none."""
        assert self.ax is not None
        legend(self.ax, least=2 if self.new and self.label is None and self.overlaid[0][0] is None else 1)

    def _label(self, branch_label: str | None, name: str, names: int) -> str:
        """A branch by its label, else a curve by its dof or contact."""
        branch = branch_label or self.label or ""
        return ", ".join(part for part in (branch, name) if part) if names > 1 or not branch else branch

    def _scale(self, ax: Axes) -> None:
        """A range over decades has a logarithmic axis."""
        x = [self.abscissa.values(dataset) for _, dataset in self.overlaid]
        if over_decades(x) and all(values.min(initial=1.0) > 0.0 for values in x):
            log_scale(ax, "x")


_PENS = {0: (0, (4, 3)), UNKNOWN: (0, (1, 2))}
"""Dashes of unstable motion, and of motion whose stability is unknown."""


def _line(ax: Axes, x: np.ndarray, y: np.ndarray, stable: np.ndarray, label: str) -> None:
    """Draw a curve: dashed where an end of a piece is unstable, dotted where stability is unknown at one."""
    alone = "o" if len(x) == 1 else None
    off = (stable == 0) | (stable == UNKNOWN)
    (line,) = ax.plot(x, np.where(off & (len(x) > 1), np.nan, y), linewidth=1.6, marker=alone, label=label)
    for verdict, pen in _PENS.items():
        if (stable == verdict).any():
            beside = np.convolve(stable == verdict, np.ones(3), "same") > 0
            ax.plot(x, np.where(beside, y, np.nan), linewidth=1.2, linestyle=pen, color=line.get_color(), label="_")


def _limits(ax: Axes, values: np.ndarray, factor: float) -> None:
    """Set limits that do not magnify rounding; ``factor`` is that of the unit shown."""
    known = values[np.isfinite(values)]
    if not known.size:
        ax.text(0.5, 0.5, "no values", transform=ax.transAxes, ha="center", color=GREY)
    elif not known.any():
        ax.set_ylim(-0.05 / factor, 1.0 / factor)
    elif known.size and np.ptp(known) < 1e-6 * np.abs(known).max():
        ax.set_ylim(*np.sort(known[0] * np.array([0.8, 1.2])))


_CORNERS = ("tie", "corner")


BETWEEN = 16
"""Pieces that a stretch between two points is drawn in."""


def is_sparse(dataset: xarray.Dataset) -> bool:
    """Whether points are far from each other: tracked peaks and nonlinear modes."""
    return view_of(dataset).sparse


def corners_of(dataset: xarray.Dataset) -> Array:
    """Which points (n_points,) are corners of the line, as 1.0 and 0.0."""
    kinds = dataset["kind"].to_numpy() if "kind" in dataset else np.array([""] * dataset.sizes["point"])
    return np.asarray(np.isin(kinds, _CORNERS), dtype=float)


def smooth(x: Array, y: Array, corners: Array) -> tuple[Array, Array]:
    """A line (``BETWEEN * (n - 1) + 1``,) through points (n,), every ``BETWEEN``-th number of it one of them.

    Arclength is measured in parts of the ranges of x and y. Corners, and points where a number is missing, end a
    cubic and begin the next.
    """
    known = np.isfinite(x) & np.isfinite(y)
    if np.count_nonzero(known) < 3:
        return x, y
    length = np.hypot(*(np.diff(v) / (np.ptp(v[known]) or 1.0) for v in (x, y)))
    at = np.arange(BETWEEN) / BETWEEN
    lines = [np.append((v[:-1, None] + np.diff(v)[:, None] * at).ravel(), v[-1]) for v in (x, y)]
    first = 0
    for i in range(1, len(x) + 1):
        joined = i < len(x) and length[i - 1] > 0.0
        if joined and not corners[i]:
            continue
        last = i if joined else i - 1
        if last - first > 1:
            s = np.concatenate([[0.0], np.cumsum(length[first:last])])
            dense = np.append((s[:-1, None] + np.diff(s)[:, None] * at).ravel(), s[-1])
            for line, v in zip(lines, (x, y), strict=True):
                line[first * BETWEEN : last * BETWEEN + 1] = PchipInterpolator(s, v[first : last + 1])(dense)
        first = i
    for line, v in zip(lines, (x, y), strict=True):
        line[::BETWEEN] = v
    return lines[0], lines[1]
