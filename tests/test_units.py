"""Names of units: put together from those of the base units, in results and messages, on every road."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.cases import oscillator
from helpers.command import slipstick
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.case.case import Case
from slipstick.cli.verbs.run import peak_lines
from slipstick.units import Units, after_number

NAMES = {"length": "mm", "force": "N", "time": "s", "temperature": "degC"}
CASE = oscillator(
    head='harmonics = "0..3"\nunits = { length = "mm", force = "N", time = "s" }\n',
    rubbing="velocity = 10.0",
    response='from = "0.9 Hz"\nto = "60 rpm"\n',
)


def problem(**units: str) -> ss.Problem:
    return one_mass(damper(10.0), units=units)


@pytest.mark.parametrize(
    "units, dimension, label",
    [
        ({}, "force length/time", "force length/time"),
        ({}, "rad/time", "rad/s"),
        (NAMES, "force length/time", "N mm/s"),
        (NAMES, "length", "mm"),
        (NAMES, "force/length", "N/mm"),
        (NAMES, "temperature", "degC"),
        (NAMES, "rad/time", "rad/s"),
        ({"length": "mm"}, "force/length", "force/mm"),
        ({"time": "ms"}, "rad/time", "rad/ms"),
        ({"force": "kg m/s^2", "length": "m"}, "force length", "(kg m/s^2) m"),
        ({"force": "kg m/s^2"}, "force", "kg m/s^2"),
        (NAMES, "1", "1"),
        (NAMES, "rad", "rad"),
    ],
)
def test_labels_are_put_together(units: dict[str, str], dimension: str, label: str) -> None:
    assert Units(**units).label(dimension) == label


def test_after_a_number_stand_names_alone() -> None:
    assert Units(**NAMES).after("force/length") == " N/mm"
    assert Units(length="mm").after("force/length") == ""
    assert (after_number("1"), after_number("length"), after_number("rad/s")) == ("", "", " rad/s")


def test_frequencies_in_words() -> None:
    assert Units().frequency_text(6.283185307) == "6.28319 rad/s (1 Hz)"
    assert Units().frequency_text(314.159265, "rpm") == "314.159 rad/s (3000 rpm)"
    assert Units(time="ms").frequency_text(2.0) == "2 rad/ms"
    assert Units().frequency_factor("rpm") * 3000 == pytest.approx(314.1592653589793, rel=1e-15)
    assert Units(time="ms").frequency_factor("rad/ms") == 1.0
    with pytest.raises(ss.InputError, match="found 'Hz'; expected one of rad/ms"):
        Units(time="ms").frequency_factor("Hz")


def test_wrong_names_are_told() -> None:
    with pytest.raises(ss.InputError) as caught:
        problem(lenght="mm", force="", time="s\n")
    assert caught.value.sentences == (
        "units, lenght: unknown key; did you mean 'length'?",
        """units, force: found ''; expected a short text such as "mm", at most 30 characters""",
        """units, time: found 's\\n'; expected a short text such as "mm", at most 30 characters""",
    )


def test_results_carry_them(tmp_path: Path) -> None:
    branch = ss.forced_response(problem(**NAMES), omega=(5.0, 7.0))
    again = ss.load(branch.save(tmp_path / "r.nc"))
    for data in (branch.dataset, again.dataset):
        units = {name: data[name].attrs["units"] for name in data.data_vars}
        assert units["omega"] == units["excitation_frequency"] == "rad/s"
        assert units["displacement"] == units["amplitude"] == units["mean"] == units["gap"] == "mm"
        assert units["dissipated_power"] == "N mm/s"
        assert units["tangential_stiffness"] == units["normal_stiffness"] == "N/mm"
        assert units["friction_force"] == "N"
        assert units["rubbing_velocity"] == "mm/s"
        assert units["temperature"] == "degC"
        assert units["friction_coefficient"] == units["kind"] == "1"
        assert Units.of_results(data.attrs) == Units(**NAMES)
        assert data.attrs["frequency_unit"] == "rad/s"
    assert again.problem is not None
    assert again.problem.units == Units(**NAMES)
    assert again.problem.with_parameter("damper.mu", 0.4).units == Units(**NAMES)
    linear = ss.linear_response(problem(**NAMES), omega=[2.0]).dataset
    assert (linear["amplitude"].attrs["units"], linear["omega"].attrs["units"]) == ("mm", "rad/s")


def test_without_names_results_are_as_ever() -> None:
    data = ss.parameter_response(problem(), "damper.velocity", (10.0, 12.0), omega=5.0).dataset
    assert data["amplitude"].attrs["units"] == "length"
    assert data["parameter"].attrs["units"] == "length/time"
    assert peak_lines(ss.forced_response(problem(), omega=(9.0, 11.0)).dataset) == [
        "peak of x: amplitude 3.67152 at 9.80712 rad/s (1.5609 Hz)"
    ]


def test_a_followed_parameter_has_its_unit() -> None:
    data = ss.parameter_response(problem(**NAMES), "damper.velocity", (10.0, 12.0), omega=5.0).dataset
    assert data["parameter"].attrs["units"] == "mm/s"


def test_a_case_is_shown_in_its_units(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    said = slipstick("check", path).output
    assert "range: 5.65487 rad/s (0.9 Hz) to 6.28319 rad/s (1 Hz)" in said
    assert "kt 100 N/mm, mu 0.3, normal_load 800 N, rubbing at 10 mm/s" in said
    assert "largest amplitude of x 38.96 mm at 6.28319 rad/s (1 Hz), an end of the range" in said
    done = slipstick("run", path, "-o", tmp_path / "out", "--no-figures")
    assert done.exit_code == 0, done.output
    branch = ss.load(tmp_path / "out" / "results.nc")
    assert branch.dataset["displacement"].attrs["units"] == "mm"
    assert branch.dataset.attrs["frequency_unit"] == "Hz"
    assert branch.problem is not None
    assert branch.problem.units == Units(length="mm", force="N", time="s")


def test_peaks_are_told_as_the_range_is_written() -> None:
    branch = Case.from_text(CASE.replace('"0.9 Hz"', '"90 rpm"').replace('"60 rpm"', '"100 rpm"')).run()
    assert peak_lines(branch.dataset) == ["peak of x: amplitude 3.67152 mm at 9.80712 rad/s (93.651 rpm)"]


def test_a_parameter_curve_takes_the_unit_of_its_frequency() -> None:
    text = CASE.replace(
        'from = "0.9 Hz"\nto = "60 rpm"', 'parameter = "damper.velocity"\nfrom = 1\nto = 2\nomega = "50 rpm"'
    )
    case = Case.from_text(text)
    assert case.frequency_unit == "rpm"
    assert case.request == "damper.velocity from 1 to 2 mm/s at 5.23599 rad/s (50 rpm)"


def test_faults_of_units_in_a_case() -> None:
    with pytest.raises(ss.InputError) as caught:
        Case.from_text(CASE.replace('{ length = "mm", force = "N"', '{ lenth = "mm", force = ""'))
    assert caught.value.sentences == (
        'units.force: found ""; expected a short text such as "mm", at most 30 characters',
        "unknown key 'lenth' in units; did you mean 'length'?",
    )


def test_hertz_need_a_time_in_seconds() -> None:
    with pytest.raises(ss.InputError) as caught:
        Case.from_text(CASE.replace('time = "s"', 'time = "ms"'))
    but = 'which counts in seconds, but the unit of time is "ms"; give a plain number in rad/ms'
    assert caught.value.sentences == (
        f'[response] from: found "0.9 Hz", {but}',
        f'[response] to: found "60 rpm", {but}',
    )
    plain = CASE.replace('time = "s"', 'time = "ms"').replace('"0.9 Hz"', "5.6").replace('"60 rpm"', "6.0")
    case = Case.from_text(plain)
    assert case.request == "5.6 rad/ms to 6 rad/ms"
    assert case.run().dataset["omega"].attrs["units"] == "rad/ms"


def test_the_parametric_blade_is_in_si() -> None:
    blade = CASE.replace('kind = "matrices"', 'kind = "blade"').replace(
        'time = "s"', 'time = "s", temperature = "degF"'
    )
    with pytest.raises(ss.InputError) as caught:
        Case.from_text(blade)
    told = zip(caught.value.faults, caught.value.sentences, strict=True)
    assert [sentence for fault, sentence in told if fault.where[0] == "units"] == [
        'units.length: found "mm", but a structure of kind "blade" is in SI units; expected "m"'
    ]
