"""The solution next to an interpolated point: at the same frequency, parameter and temperature."""

import numpy as np
import pytest
from helpers.results import corrected as solved

import slipstick as ss
from slipstick.analysis.curve.correcting import corrected
from slipstick.verify.cases import oscillator


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
    wanted = ss.parameter_response(oscillator(), "damper.velocity", (1.0, 30.0), omega=6.0, requested=value)
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
