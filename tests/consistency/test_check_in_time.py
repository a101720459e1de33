"""Points of branches against time integration: one degree of freedom at 25 points, the reduced blade at a few."""

import numpy as np
import pytest
from helpers.benchmarks import benchmark

import slipstick as ss
from slipstick.verify.cases import oscillator


@pytest.mark.parametrize(("velocity", "omega"), [(0.0, 10.0), (10.0, 4.3), (1.0, 2.7)])
def test_oscillator_point(velocity, omega):
    """With 0..40 harmonics the balance is right to 1e-5, and the check starts where it is: a few periods suffice."""
    branch = ss.forced_response(oscillator(velocity=velocity, harmonics=range(41)), omega=(omega, omega * 1.001))
    check = branch.check_in_time(0, periods=30)
    assert check.converged
    assert check.relative_difference < 2e-5


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_check_sees_a_wrong_point():
    """A balance with too few harmonics differs by what is cut off; a wrong amplitude is not let through."""
    few = ss.forced_response(oscillator(velocity=10.0, harmonics=[0, 1, 3]), omega=(4.3, 4.301))
    assert few.check_in_time(0, periods=60).relative_difference > 0.05


def test_followed_parameter_is_that_of_the_point():
    branch = ss.parameter_response(
        oscillator(velocity=10.0, harmonics=range(21)), "damper.normal_load", (800.0, 400.0), omega=5.0
    )
    check = branch.check_in_time(-1, periods=60)
    assert check.converged
    assert check.relative_difference < 1e-3


@pytest.mark.verify
@pytest.mark.parametrize("velocity", [0.0, 1.0, 10.0, 50.0, 100.0])
def test_oscillator_curves_at_25_points(velocity):
    """Five points of five curves with harmonics 0..10: 4 digits, as the balance with 10 harmonics can have."""
    omegas = (2.5, 4.2, 6.0, 9.0, 13.0)
    branch = ss.forced_response(oscillator(velocity=velocity), omega=(2.0, 15.0), at=omegas)
    for omega in omegas:
        check = branch.check_in_time(branch.at(omega), periods=100)
        assert check.omega == pytest.approx(omega)
        assert check.converged
        assert check.relative_difference < (1e-3 if omega > 3 else 5e-3), check


@pytest.mark.verify
@pytest.mark.parametrize(
    ("level", "velocity", "hertz"), [(1.0, 0.0, 307.7), (1.0, 1.0, 212.0), (1.0, 5.0, 211.2), (4.0, 0.0, 309.2)]
)
def test_reduced_blade(level, velocity, hertz):
    """128 modes, 8 contacts that open and rub, harmonics 0..15.

    Damping is viscous here: hysteretic damping has no exact counterpart in time (it differs by 6e-4 at these points).
    """
    blade = benchmark("curves").blade(level=level, velocity=velocity, harmonics=range(16), viscous=True)
    omega = 2 * np.pi * hertz
    branch = ss.forced_response(blade, omega=(omega, omega * 1.0001))
    check = branch.check_in_time(0, periods=40)
    assert check.converged
    assert check.relative_difference < 2e-5, check
