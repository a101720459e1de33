"""The Haigh diagram shows the stresses of the branch, the worst place and how far it is from the line."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.blocks import branch, stressed
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.plots import stresses


def test_places_are_alternating_over_mean() -> None:
    made = stressed(12)
    found, ax = made.stress(3), made.plot.haigh(3)
    shown = ax.collections[0].get_offsets()
    np.testing.assert_allclose(shown[:, 0], found["stress_mean"][0])
    np.testing.assert_allclose(shown[:, 1], found["stress_alternating"][0])
    worst = int(np.argmax(found["stress_alternating"].values[0]))
    assert ax.texts[0].get_text() == f"element {worst + 1}"
    assert ax.get_xlabel() == "Mean stress [force/length^2]"
    some = made.plot.haigh(3, [1, 2], ax=ax)
    assert some is ax
    assert stressed(24, at="nodes").plot.haigh(0).texts[0].get_text().startswith("node ")


def test_pascals_are_shown_as_megapascals(monkeypatch: pytest.MonkeyPatch) -> None:
    def in_pascals(*arguments: object) -> object:
        found = stress_of(*arguments)
        for name in ("stress_mean", "stress_alternating"):
            found[name].attrs["units"] = "N/m^2"
        return found

    stress_of = stresses.stress_of
    monkeypatch.setattr(stresses, "stress_of", in_pascals)
    ax = stressed(12).plot.haigh(3)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Mean stress [MPa]", "Alternating stress [MPa]")
    assert ax.yaxis.get_major_formatter()(2.5e6) == "2.5"


def test_the_reserve_reaches_the_goodman_line() -> None:
    """Both stresses times the reserve lie on the line; under compression it is level."""
    made = stressed(12)
    found = made.stress(3)
    mean, alternating = found["stress_mean"].values[0], found["stress_alternating"].values[0]
    ax = made.plot.haigh(3, endurance=2.0, strength=5.0)
    name, _, reserve = ax.texts[0].get_text().partition(", reserve ")
    k, times = int(name.removeprefix("element ")) - 1, float(reserve)
    assert times * alternating[k] == pytest.approx(2.0 * (1.0 - times * max(mean[k], 0.0) / 5.0), rel=1e-3)
    each = 1.0 / (alternating / 2.0 + np.maximum(mean, 0.0) / 5.0)
    assert times == pytest.approx(each.min(), rel=1e-3)
    x, y = ax.lines[0].get_data()
    np.testing.assert_allclose(y, 2.0 * (1.0 - np.maximum(x, 0.0) / 5.0))
    assert x[0] <= min(0.0, mean.min())


def test_what_cannot_be_drawn_is_said() -> None:
    with raises_fault("strength", expected="a stress > 0: the line needs both"):
        stressed(12).plot.haigh(3, endurance=2.0)
    with raises_fault("endurance", found="0.0"):
        stressed(12).plot.haigh(3, endurance=0.0, strength=1.0)
    with pytest.raises(ss.InputError, match="has no geometry and material of elements"):
        branch().plot.haigh(3)
