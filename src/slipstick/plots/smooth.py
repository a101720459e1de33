"""Smooth lines through few points: cubics over arclength that pass every point and do not overshoot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PchipInterpolator

from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

_CORNERS = ("tie", "corner")
BETWEEN = 16
"""Pieces that a stretch between two points is drawn in."""


def is_sparse(dataset: xarray.Dataset) -> bool:
    """Whether points are far from each other: tracked peaks and nonlinear modes."""
    return "modal_damping" in dataset or bool(dataset.attrs.get("peak_of", ""))


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
