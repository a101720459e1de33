from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import branch, drawn, named, title

import slipstick as ss
from slipstick.plots.tolerances import highest

SHARES = {"c0.mu": 0.2, "load.x0.amplitude": 0.05}


def test_a_band_is_the_sum_of_what_the_tolerances_do():
    own = branch()
    ax = ss.plots.tolerance_band(own, SHARES, "x0")
    slopes = own.sensitivity(list(SHARES), "x0")
    spread = np.abs(slopes.amplitude) * np.abs(slopes.value) * np.array([[0.2], [0.05]])
    x, y = drawn(ax.lines[0])
    vertices = ax.collections[0].get_paths()[0].vertices
    assert vertices[:, 1].max() == pytest.approx(float((y + spread.sum("parameter")).max()))
    assert vertices[:, 0].min() == x.min()
    assert named(ax) == ["x0", "c0.mu ±20 %\nload.x0.amplitude ±5 %"]


def test_a_tornado_has_the_largest_on_top():
    own = branch()
    ax = own.plot.tornado(SHARES, "x0")
    at = int(np.argmax(own.dataset.amplitude.sel(dof="x0").values))
    slopes = own.sensitivity(list(SHARES), "x0").isel(point=at)
    changes = (slopes.amplitude * slopes.value * [0.2, 0.05]).values
    bars = sorted((bar.get_y(), bar.get_width()) for bar in ax.patches[:2])
    assert [width for _, width in bars] == pytest.approx(sorted(changes, key=abs))
    assert (
        ax.get_yticklabels()[-1].get_text() == ["c0.mu ±20 %", "load.x0.amplitude ±5 %"][int(np.argmax(abs(changes)))]
    )
    assert title(ax).startswith("Chain (")
    more, less = ({bar.get_facecolor() for bar in bars} for bars in (ax.patches[:2], ax.patches[2:]))
    assert len(more) == len(less) == 1
    assert more != less


def test_a_tornado_is_as_high_as_its_bars_need():
    heights = [branch().plot.tornado(most=most).figure.get_figheight() for most in (1, 3, 6)]
    assert heights[0] == heights[1] < heights[2]


def test_the_highest_point_is_a_located_peak_where_there_is_one():
    own = branch()
    size = own.dataset["amplitude"].sel(dof="x0").to_numpy()
    data = own.dataset.copy(deep=True)
    data["peak_dof"][:] = -1
    data["peak_dof"][[3, 5]] = own.dof_index("x0")
    data["amplitude"].loc[{"dof": "x0"}] = np.where(np.arange(len(size)) == 5, 0.5 * size.max(), 0.1 * size)
    data["amplitude"].loc[{"dof": "x0"}][0] = 2.0 * size.max()  # larger, at the end of the range
    assert highest(ss.Branch(data, own.outcome), "x0") == 5
    data["peak_dof"][:] = -1
    assert highest(ss.Branch(data, own.outcome), "x0") == 0
    assert highest(ss.Branch(data.drop_vars("peak_dof"), own.outcome), "x0") == 0


def test_by_default_a_tenth_of_everything():
    ax = branch().plot.tornado(most=4)
    assert len(ax.get_yticklabels()) == 4
    assert all(text.get_text().endswith("±10 %") for text in ax.get_yticklabels())


@pytest.mark.parametrize(
    ("tolerances", "match"),
    [
        ({}, "tolerances: found {}"),
        ({"c0.nu": 0.1}, "there is no parameter 'c0.nu'"),
        ({"c0.mu": -0.1}, "tolerances, c0.mu: found -0.1; expected a share"),
        ({"c0.velocity": 0.1}, "the parameter is 0, of which 0.1 is nothing"),
    ],
)
def test_wrong_tolerances(tolerances, match):
    with pytest.raises(ss.InputError, match=match):
        ss.plots.tolerance_band(branch(), tolerances)
