"""Cases that once went wrong: plateaus without peaks, ladders that must end, structures without damping."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.start import FirstPoint


def oscillator(C=0.4, harmonics=range(11), **load):
    return one_mass(damper(10.0), C=C, loads=ss.Load(dof="x", sin=100.0, **load), harmonics=harmonics)


def test_a_plateau_has_no_peaks():
    """Above the mu at which the contact no longer slips backwards the amplitude does not depend on mu."""
    branch = ss.parameter_response(oscillator(), "damper.mu", (0.05, 2.0), omega=6.0)
    assert branch.outcome.ok
    amplitude = branch.dataset.amplitude.sel(dof="x").values
    assert np.ptp(amplitude[-20:]) < 1e-8  # Newton stops at 1e-10 of the scaled motion
    assert len(branch.peaks("x")) <= 2


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_the_ladder_ends_when_no_harmonic_can_be_left_out():
    """Orders 0, 1 and 3, driven on 3: fewer harmonics would be the same ones again."""
    problem = oscillator(harmonics=[0, 1, 3], harmonic=3)
    balance = Balance(problem)
    names = [name for name, _ in FirstPoint(balance, problem.inputs, 2.0).strategies()]
    assert "fewer harmonics first" not in names
    assert "Newton homotopy" in names
    full = Balance(oscillator())
    assert "fewer harmonics first" in [name for name, _ in FirstPoint(full, full.problem.inputs, 2.0).strategies()]


def test_no_damping_is_warned_of():
    assert any("no damping" in text for text in problem_warnings(oscillator(C=0.0), (2.0, 15.0)))
    assert not any("no damping" in text for text in problem_warnings(oscillator(), (2.0, 15.0)))


@pytest.mark.parametrize("value", [1e308, 1e101])
def test_numbers_beyond_any_machine_are_refused(value):
    with raises_fault("kt", says="check the units"):
        ss.FrictionContact(kt=value, mu=0.3, gap=-1.0)


@pytest.mark.parametrize("span", [(2.0,), 3.0, ("2", "15"), None, (1.0, 2.0, 3.0)])
def test_a_range_is_two_numbers(span):
    with raises_fault("frequency range", says="expected (two frequencies|a number in rad/s)"):
        ss.forced_response(oscillator(), omega=span)
    with raises_fault("range of damper.mu", says="expected two numbers"):
        ss.parameter_response(oscillator(), "damper.mu", span, omega=6.0)


def pushed(static: float, **parts) -> ss.Problem:
    """The oscillator under a static load, which friction under a constant load answers with a shift of the mean."""
    loads = [ss.Load(dof="x", sin=100.0), ss.Load(dof="x", harmonic=0, cos=static)]
    return one_mass(damper(**parts), loads=loads, harmonics=range(8))


@pytest.mark.parametrize("static", [1e6, 1e8, 1e10])
def test_a_vibration_beside_a_far_larger_mean(static):
    """It is that without the mean, to the digits that the mean leaves to it: eps times the ratio of both."""
    alone, beside = (ss.forced_response(pushed(load), omega=(2.0, 15.0)) for load in (0.0, static))
    assert beside.outcome.ok
    np.testing.assert_allclose(beside.peaks("x"), alone.peaks("x"), rtol=1e-8)
    np.testing.assert_allclose(beside.dataset["mean"], static / 40.0, rtol=1e-9)


def test_rubbing_whose_friction_moves_the_mean_far_away():
    """Once the contact slips one way nearly all period, more friction only moves the mean."""
    with pytest.warns(ss.SlipstickWarning, match="more than dry surfaces reach"):
        some, more = (ss.forced_response(pushed(0.0, velocity=10.0, mu=mu), omega=(2.0, 15.0)) for mu in (1e3, 1e7))
    np.testing.assert_allclose(more.peaks("x"), some.peaks("x"), rtol=1e-6)


@pytest.mark.parametrize("mu", [1e12, 1e30])
@pytest.mark.filterwarnings("ignore:.*more than dry surfaces reach")
def test_a_vibration_lost_beside_the_mean_is_told(mu):
    """The digits of a number do not hold both; the curve ends without an error all the same."""
    with pytest.warns(ss.SlipstickWarning, match="times the vibration at .* do not resolve the vibration"):
        branch = ss.forced_response(pushed(0.0, velocity=10.0, mu=mu), omega=(2.0, 15.0), options={"max_points": 60})
    assert branch.outcome is not ss.Outcome.FAILED
    assert "do not resolve the vibration" in branch.dataset.attrs["warnings"]


@pytest.mark.parametrize("mu", [1e3, 1e20, 1e100])
@pytest.mark.filterwarnings("ignore:.*more than dry surfaces reach")
def test_a_contact_that_no_force_moves_is_a_spring(mu):
    """Also where the motion is less than the rounding of the friction limit."""
    (found,) = ss.forced_response(pushed(0.0, mu=mu), omega=(2.0, 15.0)).peaks("x")
    stiffness, damping = 140.0, 0.4
    omega = np.sqrt(stiffness - 0.5 * damping**2)
    amplitude = 100.0 / np.hypot(stiffness - omega**2, damping * omega)
    np.testing.assert_allclose(found, (omega, amplitude), rtol=1e-7)
