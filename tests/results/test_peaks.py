from __future__ import annotations

import numpy as np
import pytest

from slipstick.results.peaks import PROMINENCE, located_peaks, peak_points
from slipstick.results.schema import LARGEST


def table(sizes, kinds, parts=None, **attrs):
    from xarray import Dataset

    n, kinds = len(sizes), np.array(kinds)
    return Dataset(
        {
            "amplitude": (("point", "dof"), np.array(sizes, dtype=float).reshape(n, -1)),
            "kind": ("point", kinds), "peak_dof": ("point", np.where(kinds == "peak", 0, -1)),
            "omega": ("point", np.arange(float(n))),
            "branch_part": ("point", np.ones(n, dtype=int) if parts is None else np.array(parts)),
        },
        coords={"dof": ["x"] if np.ndim(sizes) == 1 else ["x", "y"]}, attrs=attrs,
    )  # fmt: skip


KINDS = ["start", "peak", "regular", "peak", "end"]


@pytest.mark.parametrize("depth, count", [(0.9 * PROMINENCE, 1), (1.1 * PROMINENCE, 2)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_maximum_stands_out_by_a_thousandth_to_be_a_peak(depth, count, way):
    sizes = [0.5, 1.0, 1.0 - depth, 1.0 + depth, 0.5][::way]
    assert len(peak_points(table(sizes, KINDS[::way]), 0)) == count


def test_solved_points_alone_tell_how_deep_a_dip_is():
    """What is interpolated is known to 2e-4 of itself."""
    sizes = [0.5, 1.0, 1.0 - 0.95e-3, 1.0 - 1.05e-3, 1.2, 0.5]
    kinds = ["start", "peak", "regular", "interpolated", "peak", "end"]
    assert len(peak_points(table(sizes, kinds), 0)) == 1
    kinds[3] = "regular"
    assert len(peak_points(table(sizes, kinds), 0)) == 2


def test_ends_and_equal_maxima_hide_no_peak():
    """A peak beside the end of the range is one; so are two that are equal, whichever of them is larger by rounding."""
    assert peak_points(table([0.9999, 1.0, 0.5], ["start", "peak", "end"])).tolist() == [1]
    assert peak_points(table([0.5, 1.0, 0.9999, 1.0 + 1e-9, 0.5], KINDS)).tolist() == [1, 3]


def test_interpolated_points_are_known_to_their_tolerance_only():
    kinds = ["start", "peak", "interpolated", "regular", "end"]
    assert peak_points(table([0.5, 1.0, 1.0001, 0.9, 0.5], kinds)).tolist() == [1]


def test_another_part_of_the_branch_is_another_curve():
    assert peak_points(table([0.5, 1.0, 1.2, 0.5], ["start", "peak", "start", "end"], [1, 1, 2, 2])).tolist() == [1]


def test_the_largest_amplitude_is_judged_as_a_whole():
    """Where another output becomes the largest the amplitude falls no further."""
    sizes = [[0.5, 0.1], [1.0, 0.9], [0.9, 0.9995], [0.8, 1.0005], [0.1, 0.1]]
    kinds = ["start", "peak", "regular", "regular", "end"]
    assert len(located_peaks(table(sizes, kinds, peaks_of="x"))) == 1
    assert len(located_peaks(table(sizes, kinds, peaks_of=LARGEST))) == 0


def test_a_dof_at_rest_has_no_peak():
    data = table([0.0, 1e-16, 0.0, 1e-17, 0.0], KINDS).assign(mean=(("point", "dof"), np.full((5, 1), 0.04)))
    assert peak_points(data).size == 0
    assert located_peaks(data.assign(amplitude=data["amplitude"] * 1e14)).size
    assert peak_points(table([0.0] * 5, KINDS)).size == 0
