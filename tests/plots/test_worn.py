"""Worn depth on the surface: colours of its triangles are depths of the contacts they lie round; bars without one."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.blocks import block, branch, worn
from helpers.faults import raises_fault

import slipstick as ss

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def test_triangles_have_the_depth_of_their_contact() -> None:
    made = worn()
    (ax,) = made.plot.worn_surface(-1)
    depth = made.dataset.worn_depth.values[-1]
    assert depth[0] != depth[1]
    drawn = ax.collections[0]
    places = block().points.positions[:, :2]  # the surface looks along z
    corners = np.array([path.vertices[:3] for path in drawn.get_paths()]).reshape(-1, 3, 2)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [length]", "y [length]")
    for triangle, colour in zip(corners, drawn.get_array(), strict=True):
        apart = np.linalg.norm(triangle[:, None] - places, axis=2).min(axis=0)
        if abs(apart[0] - apart[1]) > 0.2:
            assert colour == depth[np.argmin(apart)]
    assert set(drawn.get_array()) == set(depth)
    assert drawn.get_clim() == (0.0, depth.max())
    dots = ax.lines[0].get_xydata()
    np.testing.assert_allclose(dots[:, 0], places[:, 0], atol=0.11)


def test_panels_are_spread_over_the_cycles_in_one_scale() -> None:
    made = worn()
    axes = made.plot.worn_surface()
    titles = [ax.get_title() for ax in axes]
    assert titles[-1] == "20 cycles"
    assert "0 cycles" not in titles
    assert titles == sorted(titles, key=lambda title: float(title.split()[0]))
    assert len({ax.collections[0].get_clim() for ax in axes}) == 1
    assert len({ax.figure for ax in axes}) == 1
    wanted = made.plot.worn_surface([0, -1])
    assert [ax.get_title() for ax in wanted] == ["0 cycles", "20 cycles"]


def test_bars_where_the_surface_is_not_known() -> None:
    """Of a dataset alone: a bar for each contact and point, as high as its depth."""
    made = worn()
    (ax,) = ss.plots.worn_surface(made.dataset, [1, -1])
    heights = np.array([bar.get_height() for bar in ax.patches]).reshape(2, 2)
    np.testing.assert_array_equal(heights, made.dataset.worn_depth.values[[1, -1]])
    assert [label.get_text() for label in ax.get_xticklabels()] == ["c1", "c2"]
    assert len(ax.get_legend().get_texts()) == 2


def test_what_is_no_wear_is_refused() -> None:
    with pytest.raises(ss.InputError, match="not of wear over cycles"):
        branch().plot.worn_surface()
    with raises_fault("points", found="99"):
        worn().plot.worn_surface(99)
