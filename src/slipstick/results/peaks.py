"""Which of the maxima that were located along a branch are its peaks: a rule of the curve, not of its points."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.results.schema import LARGEST, branch_parts
from slipstick.typing import AnyArray, Array
from slipstick.units import compared

PROMINENCE = 1e-3
"""Least prominence of a peak, relative to its height.

Minima are located to 2e-5 of their height: only a prominence this close to the limit can be judged either way.
"""
_EQUAL = 1e-6
"""Relative difference up to which two heights are equal."""
ROUNDING = 1e-11
"""Size of a value, relative to the terms it is computed from, below which it is rounding."""


def peak_points(data: Any, dof: int | None = None) -> AnyArray:
    """Numbers of the points of a table or dataset that are peaks, of one dof or of any, in order: tracked ones, too.

    A located maximum is none where the amplitude falls from it by less than ``PROMINENCE`` of its height and then rises
    above it, on either side along its part of the branch. The ends of a part are no sides: a peak next to the end of
    the range is one. Where a dof rests but for rounding beside its largest motion and mean, it has no peak.
    """
    if "peak_dof" not in data:
        return np.zeros(0, dtype=int)
    of, kinds = data["peak_dof"].to_numpy(), data["kind"].to_numpy()
    points = np.flatnonzero(of >= 0 if dof is None else of == dof)
    parts, sizes, solved = branch_parts(data), data["amplitude"].to_numpy(), kinds != "interpolated"
    least = ROUNDING * _motion(data)
    if data.attrs.get("peaks_of") == LARGEST and LARGEST not in data["dof"].to_numpy():
        among = compared([str(name) for name in data["dof"].to_numpy()])
        sizes = np.broadcast_to(sizes[:, among].max(axis=1)[:, None], sizes.shape)
    return np.array([
        k for k in points.tolist()
        if kinds[k] != "peak"
        or (sizes[k, of[k]] > least[of[k]] and _stands_out(sizes[:, of[k]], solved, parts == parts[k], k))
    ], dtype=int)  # fmt: skip


def _motion(data: Any) -> Array:
    """The largest amplitude or mean (n_dofs,) of each dof."""
    sizes = [np.abs(data[name].to_numpy()) for name in ("amplitude", "mean") if name in data]
    return np.nanmax(np.concatenate(sizes), axis=0, initial=0.0)


def located_peaks(data: Any, dof: int | None = None) -> AnyArray:
    """Those of ``peak_points`` that were located on a curve."""
    points = peak_points(data, dof)
    return points[data["kind"].to_numpy()[points] == "peak"]


def _stands_out(size: Array, solved: AnyArray, part: AnyArray, k: int) -> bool:
    """Whether the maximum at a point is prominent on both sides among amplitudes (n,) of its part of the branch.

    Only ``solved`` points count: interpolated ones are not accurate enough.
    """
    own = np.flatnonzero(part & solved)
    sizes, at, height = size[own], int(np.searchsorted(own, k)), size[k]
    for side in (sizes[at::-1], sizes[at:]):
        higher = np.flatnonzero(side > height * (1.0 + _EQUAL))
        if higher.size and side[: higher[0]].min(initial=height) > height * (1.0 - PROMINENCE):
            return False
    return True
