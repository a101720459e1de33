"""Which of the maxima that were located along a branch are its peaks: a rule of the curve, not of its points."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.results.schema import LARGEST, branch_parts
from slipstick.typing import AnyArray, Array

PROMINENCE = 1e-3
"""Part of its height by which a maximum stands out at least that is a peak.

Between solved points motion is known to some 2e-4 of itself, and cubics are corrected from 1e-3 on: whether a shallower
maximum is seen depends on where these points come to lie.
"""
_UNSEEN = 3e-4
"""Part of a height by which a minimum is at most deeper than the points: where it is more a point is put."""
_EQUAL = 1e-6
"""Part of a height by which another maximum is not higher."""


def peak_points(data: Any, dof: int | None = None) -> AnyArray:
    """Numbers of the points of a table or dataset that are peaks, of one dof or of any, in order: tracked ones, too.

    A located maximum is none where the amplitude falls from it by less than ``PROMINENCE`` of its height and then rises
    above it, on either side along its part of the branch. The ends of a part are no sides: a peak next to the end of
    the range is one.
    """
    if "peak_dof" not in data:
        return np.zeros(0, dtype=int)
    of, kinds = data["peak_dof"].to_numpy(), data["kind"].to_numpy()
    points = np.flatnonzero(of >= 0 if dof is None else of == dof)
    parts, sizes, solved = branch_parts(data), data["amplitude"].to_numpy(), kinds != "interpolated"
    along = data["parameter" if data.attrs.get("parameter") else "omega"].to_numpy()
    if data.attrs.get("peaks_of") == LARGEST and LARGEST not in data["dof"].to_numpy():
        sizes = np.broadcast_to(sizes.max(axis=1)[:, None], sizes.shape)
    return np.array([
        k for k in points.tolist()
        if kinds[k] != "peak" or _stands_out(along, sizes[:, of[k]], solved, parts == parts[k], k)
    ], dtype=int)  # fmt: skip


def located_peaks(data: Any, dof: int | None = None) -> AnyArray:
    """Those of ``peak_points`` that were located on a curve."""
    points = peak_points(data, dof)
    return points[data["kind"].to_numpy()[points] == "peak"]


def _stands_out(along: Array, size: Array, solved: AnyArray, part: AnyArray, k: int) -> bool:
    """Whether the maximum at a point stands out of amplitudes (n,) on both sides, in its part of the branch."""
    height, begin, end = size[k], int(np.argmax(part)), part.size - int(np.argmax(part[::-1]))
    for way in (slice(k, begin - 1 if begin else None, -1), slice(k, end)):
        side = size[way]
        higher = np.flatnonzero((side > height * (1.0 + _EQUAL)) & solved[way])
        if higher.size and _lowest(along[way], side, int(higher[0])) > height * (1.0 - PROMINENCE):
            return False
    return True


def _lowest(x: Array, y: Array, count: int) -> float:
    """The minimum of a curve through points up to one of number ``count``: of the parabola through the lowest three."""
    k = int(np.argmin(y[: count + 1]))
    if not 0 < k < count:
        return float(y[k])
    a, b = x[k - 1] - x[k], x[k + 1] - x[k]
    if a * b >= 0.0:
        return float(y[k])
    p, q = (y[k - 1] - y[k]) / a, (y[k + 1] - y[k]) / b
    bend = (q - p) / (b - a)
    slope = p - bend * a
    return float(y[k] - min(0.25 * slope**2 / bend, _UNSEEN * y[k])) if bend > 0.0 else float(y[k])
