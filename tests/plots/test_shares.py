"""Shares of the period: stacked where they can be, lines where a curve turns back."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import OMEGA, dataset, drawn, named, title

from slipstick import plots


def test_fractions_are_stacked_to_one() -> None:
    ax = plots.fractions(dataset(), "root")
    tops = [float(np.max(c.get_paths()[0].vertices[:, 1])) for c in ax.collections]
    assert tops == pytest.approx([0.25, 0.95, 1.0])
    assert named(ax) == ["stick", "slip", "separation"]
    assert title(ax) == "root"


def test_states_that_never_occur_are_left_out() -> None:
    data = dataset()
    data["separation_fraction"].values[:] = 1e-16
    assert named(plots.fractions(data)) == ["stick", "slip"]


def test_a_curve_that_turns_back_is_drawn_by_lines() -> None:
    data = dataset()
    data["omega"].values[20:30] = OMEGA[20:30][::-1]
    ax = plots.fractions(data)
    assert (len(ax.lines), len(ax.collections)) == (3, 0)
    np.testing.assert_array_equal(drawn(ax.lines[1])[0], data["omega"].values)
    assert (drawn(ax.lines[1])[1] == 0.7).all()
