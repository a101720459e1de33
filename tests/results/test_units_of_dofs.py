"""Rotations are in rad, and no number in rad is compared with one in a length."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.rotors import shaft

from slipstick.cli.verbs.run import peak_lines
from slipstick.errors import InputError
from slipstick.report.content import content_of


def test_results_tell_both_units() -> None:
    data = shaft().dataset
    assert {data[name].attrs["units"] for name in ("amplitude", "mean", "displacement")} == {"m or rad"}
    straight = content_of(shaft(), "a", contacts=1, dofs=6)["dofs"]
    assert straight["units"] == "m"
    assert straight["units_of"] == ["m"] * 6
    assert straight["names"] == [f"n{k}{way}" for k in range(3) for way in "xy"]


def test_figures_do_not_mix_units() -> None:
    made = shaft()
    assert made.plot.response("n0x").get_ylabel() in ("Amplitude [m]", "Amplitude [mm]", "Amplitude [µm]")
    assert made.plot.response("n0ry").get_ylabel() == "Amplitude [rad]"
    assert made.plot.history(0, "n0ry").get_ylabel() == "Motion [rad]"
    for draw in (made.plot.response, lambda dofs: made.plot.spectrum(0, dofs)):
        with pytest.raises(InputError, match="n0x in m, n0ry in rad; draw them apart"):
            draw(["n0x", "n0ry"])


def test_peaks_of_rotations_come_last_and_in_rad() -> None:
    lines = peak_lines(shaft().table, most=1000)
    turned = [" rad at " in line for line in lines]
    assert turned == sorted(turned)
    assert set(turned) == {False, True}
    for line in lines:
        assert (" rad at " in line) == ("r" in line.split(":")[0].removeprefix("peak of "))


def test_the_largest_numbers_are_rotations() -> None:
    """What made a page open on one."""
    data = shaft().dataset
    names = data["dof"].values
    assert "r" in names[np.unravel_index(data["amplitude"].values.argmax(), data["amplitude"].shape)[1]]
