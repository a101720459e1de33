"""Smooth lines through few points: all are on them, nothing overshoots, the truth is nearer than to straight ones."""

from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.plots.overlay import BETWEEN, smooth
from slipstick.verify.cases import oscillator


def test_every_point_is_on_the_line_and_nothing_lies_beyond_two_neighbours() -> None:
    rng = np.random.default_rng(1)
    x, y = np.cumsum(rng.uniform(-0.2, 1.0, 30)), rng.normal(size=30)
    X, Y = smooth(x, y, np.zeros(30))
    for line, points in ((X, x), (Y, y)):
        assert line[::BETWEEN].tolist() == points.tolist()
        pieces = np.lib.stride_tricks.sliding_window_view(line, BETWEEN + 1)[::BETWEEN]
        low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
        assert np.all(pieces.min(axis=1) >= low - 1e-12)
        assert np.all(pieces.max(axis=1) <= high + 1e-12)


def test_a_corner_stays_one_and_a_gap_is_left() -> None:
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0, np.nan, 5.0, 6.0, 7.0])
    y = np.array([0.0, 1.0, 2.0, 1.0, 0.0, np.nan, 0.0, 1.0, 4.0])
    X, Y = smooth(x, y, (np.arange(9) == 2).astype(float))
    straight = X <= 4.0
    np.testing.assert_allclose(Y[straight], 2.0 - np.abs(X[straight] - 2.0), atol=1e-12)  # two straight stretches
    assert np.isnan(X[4 * BETWEEN + 1 : 6 * BETWEEN]).all()
    assert np.isfinite(X[6 * BETWEEN :]).all()
    assert Y[int(6.5 * BETWEEN)] < 0.5  # it bends there


def test_a_tracked_peak_between_its_points_is_nearer_to_that_of_the_load_there() -> None:
    problem, omega = oscillator(), (8.0, 12.0)
    branch = ss.track_peak(problem, "damper.normal_load", (350.0, 500.0), omega=omega)
    line = ss.plots.response(branch, "x").lines[0]
    x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    points, sizes = branch.dataset.parameter.values, branch.dataset.amplitude.values[:, 0]
    assert x[::BETWEEN].tolist() == points.tolist()
    assert y[::BETWEEN].tolist() == sizes.tolist()
    errors = []
    for i in range(len(points) - 1):
        at = i * BETWEEN + BETWEEN // 2
        exact = ss.forced_response(problem.with_parameter("damper.normal_load", x[at]), omega=omega).peaks("x")
        truth = max(size for _, size in exact)
        errors.append((abs(y[at] - truth), abs(np.interp(x[at], points, sizes) - truth)))
    smoothed, straight = np.array(errors).max(axis=0)
    assert smoothed < 0.25 * straight, (smoothed, straight)


@pytest.mark.parametrize("count", [1, 2])
def test_two_points_are_joined_by_a_straight_line(count: int) -> None:
    x, y = np.arange(count, dtype=float), np.ones(count)
    assert smooth(x, y, np.zeros(count)) == (x, y)
