"""Rotations are in rad, and no number in rad is compared with one in a length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray
from helpers.reports import decoded
from helpers.rotors import shaft

import slipstick as ss
from slipstick.analysis.time_domain.long_run import PeriodRecorder
from slipstick.cli.verbs.run import peak_lines
from slipstick.cli.verbs.verify import _highest, _row
from slipstick.errors import InputError
from slipstick.report.content import content_of
from slipstick.units import is_rotation, length_shown


def test_results_tell_both_units() -> None:
    data = shaft().dataset
    assert {data[name].attrs["units"] for name in ("amplitude", "mean", "displacement")} == {"m or rad"}
    straight = content_of(shaft(), "a", contacts=1, dofs=6)["dofs"]
    assert straight["units"] == "mm"  # as lengths are shown
    assert straight["units_of"] == ["mm"] * 6
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


def test_the_largest_amplitude_is_that_of_a_displacement() -> None:
    """Where tilts are the larger numbers, and with their peaks elsewhere."""
    made = ss.forced_response(shaft().problem, omega=(60.0, 500.0), peaks_of="largest")
    data = made.dataset
    names = [str(name) for name in data["dof"].values]
    straight = [name for name in names if not is_rotation(name)]
    of = {names[int(d)] for d in data["peak_dof"].values if d >= 0}
    assert of
    assert of <= set(straight)
    heights = data["amplitude"].sel(dof=straight).max("dof").values
    at = [int(np.argmin(np.abs(data["omega"].values - omega))) for omega, _ in made.peaks("largest")]
    np.testing.assert_array_equal([size for _, size in made.peaks("largest")], heights[at])
    for k in at:
        assert heights[k] >= max(heights[k - 1], heights[k + 1])


def test_a_check_in_time_takes_displacements_and_measures_each_unit_by_itself() -> None:
    made = shaft()
    data = made.dataset
    chosen = _highest(made)
    assert all(not is_rotation(str(data["dof"].values[int(data["peak_dof"].values[k])])) for k in chosen)
    check = made.check_in_time(chosen[0])
    assert not is_rotation(_row(made, chosen[0], check, 1e-3)["dof"])
    turned = np.array([is_rotation(dof) for dof in check.dofs])
    for own in (turned, ~turned):
        pairs = ((check.amplitude, check.amplitude_in_time), (check.mean, check.mean_in_time))
        off = max(np.abs(balance - in_time)[own].max() for balance, in_time in pairs)
        size = max(check.amplitude[own].max(), check.amplitude_in_time[own].max())
        assert off <= check.relative_difference * size * (1.0 + 1e-12)


def test_tables_and_files_tell_the_unit_of_each_dof(tmp_path: Path) -> None:
    made = shaft()
    with pytest.warns(ss.SlipstickWarning, match="saved without the problem"):  # the law is a function
        made.save(tmp_path / "results.nc")
    dof = xarray.open_dataset(tmp_path / "results.nc", engine="h5netcdf")["dof"]
    units = dict(zip(dof.values.tolist(), dof.attrs["motion_units"].split("\n"), strict=True))
    assert units == {name: "rad" if is_rotation(name) else "m" for name in units}
    assert ss.load(tmp_path / "results.nc").dataset["dof"].attrs == dof.attrs
    made.save_table(tmp_path / "a.csv")
    head = (tmp_path / "a.csv").read_text().partition("\n")[0].split(",")
    assert {"amplitude.n0x [m]", "amplitude.n0ry [rad]", "displacement.n0ry.c1 [rad]"} <= set(head)
    assert not [name for name in head if " or " in name]
    made.save_table(tmp_path / "p.csv", table="peaks")
    rows = [line.split(",") for line in (tmp_path / "p.csv").read_text().splitlines()]
    of, unit = rows[0].index("dof"), rows[0].index("unit")
    assert {(row[of], row[unit]) for row in rows[1:]} == {("n0x", "m"), ("n0ry", "rad")}


def test_motion_in_time_tells_both_units() -> None:
    problem = shaft().problem
    variables = PeriodRecorder(problem).layout.variables
    assert variables["section_displacement"].units == "m or rad"
    assert variables["section_velocity"].units == "m/s or rad/s"
    assert variables["highest_time"].units == "s"


def test_every_face_names_the_peak_in_one_unit() -> None:
    """Terminal, page, notebook and figures; radians and units the user chose keep theirs."""
    made = shaft()
    data = made.dataset
    straight = [str(name) for name in data["dof"].values if not is_rotation(str(name))]
    factor, unit = length_shown("m", float(data["amplitude"].sel(dof=straight).max()))
    assert unit in ("mm", "µm")
    _, height = max(made.peaks("n0x"), key=lambda peak: peak[1])
    line = next(line for line in peak_lines(made.table) if line.startswith("peak of n0x: "))
    assert f"amplitude {height * factor:.6g} {unit} at" in line
    page = content_of(made, "a", contacts=1, dofs=12)
    at = page["dofs"]["names"].index("n0x")
    amplitude = decoded(next(curve for curve in page["curves"] if curve["key"] == "amplitude")["values"])
    np.testing.assert_allclose(amplitude[:, at].max(), data["amplitude"].sel(dof="n0x").max() * factor, rtol=1e-6)
    assert (page["dofs"]["units"], page["dofs"]["factor"]) == (unit, factor)
    turned = page["dofs"]["names"].index("n0ry")
    np.testing.assert_allclose(amplitude[:, turned].max(), data["amplitude"].sel(dof="n0ry").max(), rtol=1e-6)
    assert page["dofs"]["units_of"][turned] == "rad"
    for draw in (made.plot.response, made.plot.mean, lambda dof: made.plot.history(0, dof)):
        ax = draw("n0x")
        ax.figure.draw_without_rendering()
        assert f"[{unit}]" in ax.get_ylabel()


def test_pages_of_several_results_share_a_unit() -> None:
    small, large = (tiny(size) for size in (1e-6, 1e-2))
    alone, together = (content_of(small, "a", contacts=1, dofs=1, beside=beside) for beside in ((), (large.table,)))
    assert (alone["dofs"]["units"], together["dofs"]["units"]) == ("µm", "mm")
    key = (together["curves"][0]["units"], content_of(large, "b", contacts=1, dofs=1)["curves"][0]["units"])
    assert key == ("mm", "mm")


def tiny(force: float) -> ss.Branch:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[1.0]], dofs=["x"])
    units = {"length": "m", "force": "N", "time": "s"}
    problem = ss.Problem(structure, loads=[ss.Load(dof="x", cos=force)], harmonics=[0, 1], units=units)
    return ss.linear_response(problem, omega=[0.5, 0.9])
