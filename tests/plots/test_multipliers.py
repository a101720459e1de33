"""Unstable stretches are dashed, bifurcations marked, multipliers drawn."""

import numpy as np
import pytest
from helpers.figures import dataset, drawn, named

import slipstick as ss
from slipstick import plots


def with_stability():
    data = dataset()
    stable = np.ones(40, dtype=int)
    stable[10:15] = 0
    data["stable"] = ("point", stable)
    meaning = {"units": "1", "long_name": "largest magnitude"}
    data["multiplier_max"] = ("point", np.where(stable == 1, 0.9, 1.1), meaning)
    kinds = data["kind"].values.astype("<U20")
    kinds[[9, 15]] = "turning point", "period doubling"
    data["kind"] = ("point", kinds)
    return data


def test_unstable_motion_is_dashed_in_the_colour_of_its_curve() -> None:
    data = with_stability()
    ax = plots.response(data, "x", peaks=False)
    solid, dashed, *marks = ax.lines
    assert solid.get_color() == dashed.get_color()
    assert dashed.get_linestyle() == "--"
    assert np.flatnonzero(np.isnan(drawn(solid)[1])).tolist() == list(range(10, 15))
    assert np.flatnonzero(np.isfinite(drawn(dashed)[1])).tolist() == list(range(9, 16))
    assert [line.get_xdata().tolist() for line in marks] == [[data.omega.values[9]], [data.omega.values[15]]]
    assert named(ax) == ["x", "fold", "period doubling"]


def test_motion_of_unknown_stability_is_dotted() -> None:
    data = with_stability()
    data["stable"] = data["stable"].where(data["stable"] == 1, -1)
    _, dotted, *_ = plots.response(data, "x", peaks=False).lines
    on, off = dotted._dash_pattern[1]
    assert off > on, "dots"
    assert np.flatnonzero(np.isfinite(drawn(dotted)[1])).tolist() == list(range(9, 16))


def test_the_largest_multiplier_is_drawn_with_the_limit() -> None:
    ax = plots.stability(with_stability())
    assert any((np.asarray(line.get_ydata()) == 1.0).all() for line in ax.lines)
    assert ax.get_ylabel() == "Largest magnitude"
    (x, solid), (_, dashed) = (drawn(line) for line in ax.lines[:2])
    np.testing.assert_array_equal(x, with_stability().omega.values)
    np.testing.assert_array_equal(np.fmax(solid, dashed), with_stability().multiplier_max.values)
    assert named(ax) == ["fold", "period doubling"]
    assert named(plots.stability({"a": with_stability(), "b": with_stability()}))[:2] == ["a", "b"]


def test_without_stability_curves_are_solid_and_multipliers_are_refused() -> None:
    assert len(plots.response(dataset(), "x", peaks=False).lines) == 1
    with pytest.raises(ss.InputError, match="follow the branch with stability=True"):
        plots.stability(dataset())


def test_marks_on_multipliers_have_names_also_where_there_is_one_kind() -> None:
    data = with_stability()
    kinds = data["kind"].values
    kinds[15] = ""
    ax = plots.stability(data.assign(kind=("point", kinds)))
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["fold"]
