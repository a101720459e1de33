"""Steady points alone: those of the curves, each by itself; and the solution next to an interpolated point."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.oscillator import one_mass
from helpers.results import corrected as solved

import slipstick as ss
from slipstick.analysis.time_domain.check import corrected
from slipstick.balance.start import FirstPoint
from slipstick.verify.cases import oscillator

MANY = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def same(points, curve, values, name="displacement"):
    for number, value in enumerate(values):
        wanted = curve.dataset[name].values[curve.at(value)]
        assert curve.dataset.kind.values[curve.at(value)] == "requested"
        np.testing.assert_allclose(
            points.dataset[name].values[number], wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max()
        )


@pytest.mark.parametrize("velocity", [0.0, 10.0])
def test_points_over_frequency_are_those_of_the_curve(velocity):
    problem, values = oscillator(velocity=velocity), [9.5, 4.0, 6.1]
    points = ss.steady_response(problem, omega=values)
    curve = ss.forced_response(problem, omega=(2.0, 15.0), at=values)
    assert points.outcome.ok
    assert points.dataset.omega.values.tolist() == values
    assert points.dataset.kind.values.tolist() == ["requested"] * 3
    same(points, curve, values)
    same(points, curve, values, "contact_tangential")
    assert points.dataset.residual.values.max() < 1e-9
    assert points.problem is problem


def test_one_number_is_one_point():
    points = ss.steady_response(oscillator(velocity=10.0), omega=6.0)
    assert points.dataset.omega.values.tolist() == [6.0]
    assert points.check_in_time(0).relative_difference < 1e-2


def test_frequencies_are_texts_too():
    points = ss.steady_response(oscillator(velocity=10.0), omega=["1 Hz", 6.0])
    assert points.dataset.omega.values.tolist() == pytest.approx([2.0 * np.pi, 6.0], rel=1e-15)


def test_points_over_a_parameter_are_those_of_the_curve():
    problem, values = oscillator(velocity=10.0), (20.0, 5.0)
    points = ss.steady_response(problem, "damper.velocity", values, omega=6.0)
    curve = ss.parameter_response(problem, "damper.velocity", (1.0, 30.0), omega=6.0, at=values)
    assert points.followed == "parameter"
    assert points.dataset.parameter.values.tolist() == list(values)
    same(points, curve, values)
    single = ss.steady_response(problem, "damper.velocity", 5.0, omega=6.0)
    assert single.dataset.amplitude.values[0, 0] == pytest.approx(points.dataset.amplitude.values[1, 0], rel=1e-12)


def test_stability_is_that_of_the_curve():
    problem = oscillator(velocity=10.0)
    points = ss.steady_response(problem, omega=[5.0, 8.0], stability=True)
    curve = ss.forced_response(problem, omega=(4.0, 9.0), at=[5.0, 8.0], stability=True)
    for number, omega in enumerate((5.0, 8.0)):
        for name in ("stable", "multiplier_max"):
            wanted = curve.dataset[name].values[curve.at(omega)]
            assert points.dataset[name].values[number] == pytest.approx(wanted, rel=1e-8)


def hardening():
    """A hardening spring: over part of the range three motions exist at one frequency."""
    cubic = ss.SampledLaw(force=lambda q, velocity, k: k * q**3, parameters={"k": 5.0})
    return one_mass(
        ss.ContactPair(name="spring", contact=cubic, ports={"x": "x"}), C=0.1, force=1.0, harmonics=range(6)
    )


@MANY
def test_the_guess_says_which_of_several_motions():
    problem = hardening()
    curve = ss.forced_response(problem, omega=(4.0, 14.0))
    data = curve.dataset
    omega = data.omega.values
    (folds,) = np.nonzero(data.kind.values == "turning point")
    value = float(omega[folds[:2]].mean())
    curve = ss.forced_response(problem, omega=(4.0, 14.0), at=value)
    at = np.flatnonzero((curve.dataset.omega.values == value) & (curve.dataset.kind.values == "requested"))
    assert at.size == 3
    amplitudes = curve.dataset.amplitude.values[at, 0]
    for point, amplitude in zip(at, amplitudes, strict=True):
        found = ss.steady_response(problem, omega=value, guess=curve.guess(int(point)))
        assert found.dataset.amplitude.values[0, 0] == pytest.approx(amplitude, rel=1e-9)
        again = ss.steady_response(problem, omega=value * (1.0 + 1e-4), guess=found)
        assert again.dataset.amplitude.values[0, 0] == pytest.approx(amplitude, rel=1e-2)


@MANY
def test_values_without_a_motion_are_named_and_the_others_kept(monkeypatch):
    find = FirstPoint.find
    monkeypatch.setattr(FirstPoint, "find", lambda self: None if self.omega == 6.0 else find(self))
    points = ss.steady_response(oscillator(velocity=10.0), omega=[5.0, 6.0, 7.0])
    assert points.outcome is ss.Outcome.NO_FIRST_POINT
    assert points.dataset.omega.values.tolist() == [5.0, 7.0]
    assert points.message.startswith("1 of 3 points were not found, at 6 rad/s: ")
    assert points.dataset.attrs["outcome"] == "NO_FIRST_POINT"


def hot():
    """Friction heats the contact; the table ends at 120."""
    curve = ss.FrictionCurve(temperature=[25, 120], mu=[0.3, 0.28])
    problem = oscillator(velocity=10.0)
    return replace(problem, thermal=ss.ThermalModel(curve=curve, background=25.0, resistance=0.01), told=None)


@MANY
def test_a_temperature_beyond_its_table_ends_that_point_alone():
    problem = hot()
    points = ss.steady_response(problem, "damper.velocity", [15.0, 100.0, 10.0], omega=6.0)
    assert points.outcome is ss.Outcome.OUTSIDE_TABLE
    assert points.dataset.parameter.values.tolist() == [15.0, 10.0]
    assert points.message.startswith("1 of 3 points were not found, at 100 (damper.velocity): ")
    assert "leaves its table" in points.message


@MANY
def test_a_branch_as_guess_brings_its_temperatures():
    problem = hot()
    curve = ss.forced_response(problem, omega=(2.0, 4.0), at=[3.0])
    points = ss.steady_response(problem, omega=3.0, guess=curve)
    same(points, curve, [3.0])
    same(points, curve, [3.0], "temperature")


@pytest.mark.parametrize(
    ("given", "where"),
    [
        ({"omega": [5.0, -1.0]}, "omega"),
        ({"omega": []}, "omega"),
        ({"omega": 5.0, "parameter": "damper.none", "values": 1.0}, "parameter"),
        ({"omega": 5.0, "parameter": "damper.mu"}, "values"),
        ({"omega": 5.0, "values": 1.0}, "parameter"),
        ({"omega": [5.0, 6.0], "parameter": "damper.mu", "values": 0.2}, "omega"),
        ({"omega": 5.0, "parameter": "damper.mu", "values": -0.2}, ""),
        ({"omega": 5.0, "guess": [1.0]}, "guess"),
        ({"omega": 5.0, "guess": ss.linear_response(oscillator(), omega=5.0)}, ""),
    ],
)
def test_what_cannot_be_computed_is_named(given, where):
    with pytest.raises(ss.InputError) as told:
        ss.steady_response(oscillator(velocity=10.0), **given)
    assert len(told.value.faults) == 1
    assert where in str(told.value)


def middle(branch):
    """The interpolated point furthest from those that were solved for."""
    residual, kind = branch.dataset.residual.values, branch.dataset.kind.values
    return int(np.argmax(np.where(kind == "interpolated", residual, 0.0)))


@pytest.mark.parametrize("velocity", [0.0, 10.0, 100.0])
def test_it_is_the_solution_there(velocity):
    problem = oscillator(velocity=velocity)
    branch = ss.forced_response(problem, omega=(2.0, 15.0))
    point = middle(branch)
    omega = float(branch.dataset.omega[point])
    found = corrected(branch, point)
    exact = ss.forced_response(problem, omega=(omega, omega + 0.1), guess=branch.guess(point))
    assert found["residual"] < 1e-8
    assert found["amplitude"] == pytest.approx(exact.dataset.amplitude.values[0], rel=1e-8)
    assert found["amplitude"] == pytest.approx(branch.dataset.amplitude.values[point], rel=1e-3)


def test_a_followed_parameter_stays_as_it_is():
    branch = ss.parameter_response(oscillator(velocity=10.0), "damper.velocity", (1.0, 30.0), omega=6.0)
    point = middle(branch)
    value = float(branch.dataset.parameter[point])
    wanted = ss.parameter_response(oscillator(), "damper.velocity", (1.0, 30.0), omega=6.0, at=value)
    exact = wanted.dataset.amplitude.values[wanted.at(value)]
    assert corrected(branch, point)["amplitude"] == pytest.approx(exact, rel=1e-8)


def test_a_check_in_time_of_an_interpolated_point_is_of_the_solution():
    branch = ss.forced_response(oscillator(velocity=10.0), omega=(2.0, 15.0))
    point = middle(branch)
    check = branch.check_in_time(point)
    assert check.converged
    assert check.amplitude == pytest.approx(corrected(branch, point)["amplitude"], rel=1e-12)
    assert check.relative_difference < 1e-3


def test_only_solved_points_meet_the_tolerance_of_the_solver():
    data = ss.forced_response(oscillator(velocity=10.0), omega=(2.0, 15.0)).dataset
    assert float(solved(data).residual.max()) < 1e-8
    between = data.kind.values == "interpolated"
    assert between.sum() > 50
    assert np.all(data.newton_iterations.values[between] == 0)
    assert 1e-8 < float(data.residual.values[between].max()) < 1e-3
