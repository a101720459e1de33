"""Structures without damping: resonances where the receptance is infinite, bounded by friction or by nothing."""

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass
from helpers.results import corrected

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

NATURAL = np.sqrt(40.0)


def oscillator(*, load, velocity=0.0, C=0.0):
    return one_mass(damper(velocity), C=C, force=load, harmonics=range(11))


def assert_solved_within(branch, low, high):
    d = branch.dataset
    assert d.omega.values.min() == low
    assert d.omega.values.max() == high
    assert float(corrected(d).residual.max()) < 1e-8
    assert all(low <= omega <= high for omega, _ in branch.peaks("x"))


@pytest.mark.parametrize("span", [(2.0, 15.0), (15.0, 2.0)])
@pytest.mark.parametrize("velocity", [0.0, 10.0, 100.0])
def test_friction_bounds_the_motion(velocity, span):
    """The load 100 is below 4 mu N / pi = 306: friction takes out what it puts in, at every resonance."""
    branch = ss.forced_response(oscillator(load=100.0, velocity=velocity), omega=span)
    assert branch.outcome.ok
    assert_solved_within(branch, 2.0, 15.0)
    assert float(branch.dataset.amplitude.max()) < 20.0


def test_the_limit_of_light_damping():
    """Undamped and nearly undamped curves are the same where friction bounds the motion."""
    at = (5.0, 6.3, NATURAL, 6.4, 8.0)
    amplitudes = []
    for C in (0.0, 1e-5):
        branch = ss.forced_response(oscillator(load=100.0, velocity=100.0, C=C), omega=(4.0, 9.0), at=at)
        assert branch.outcome.ok
        amplitudes.append([float(branch.dataset.amplitude[branch.at(w), 0]) for w in at])
    np.testing.assert_allclose(amplitudes[0], amplitudes[1], rtol=1e-5)


def test_motion_without_bound_is_blamed_on_the_damping():
    """The load 400 is above 4 mu N / pi: friction cannot hold the resonance."""
    branch = ss.forced_response(oscillator(load=400.0), omega=(2.0, 15.0))
    assert_solved_within(branch, 2.0, 15.0)
    text = branch.dataset.attrs["outcome_text"]
    assert "next to no damping" in text
    assert "6.32" in text


@pytest.mark.parametrize("C", [1e-9, pytest.param(1e-6, marks=pytest.mark.verify)])
def test_a_peak_of_any_height_leaves_the_rest_as_exact(C):
    """Down from a resonance of 1e7 to 1e10 times the motion beside it, points are as well solved as before it."""
    branch = ss.forced_response(oscillator(load=400.0, C=C), omega=(2.0, 15.0))
    assert branch.outcome.ok
    assert_solved_within(branch, 2.0, 15.0)
    (top,) = [size for omega, size in branch.peaks("x") if abs(omega - NATURAL) < 0.01]
    assert top == pytest.approx((400.0 - 4 / np.pi * 240.0) / (C * NATURAL), rel=1e-4)


def test_the_anchored_balance_is_the_same_balance():
    """With springs i k on both sides: same solutions, exact derivatives."""
    problem = oscillator(load=100.0, velocity=10.0, C=0.4)
    solved = corrected(ss.forced_response(problem, omega=(4.0, 5.0)).dataset)
    balance, inputs = Balance(problem), problem.inputs
    balance.anchor_if_undamped(4.0)
    assert balance.springs is None
    balance.springs = np.array([40.0])
    system, w = FrequencySystem(balance, inputs), float(solved.omega[3])
    x = solved.contact_tangential.values[3].reshape(-1)
    assert np.linalg.norm(system.evaluate(x, w).residual) < 1e-9 * np.linalg.norm(x)
    x = 1.01 * x
    value, steps = system.evaluate(x, w), 1e-6 * np.eye(x.size)
    J = [(system.evaluate(x + h, w).residual - system.evaluate(x - h, w).residual) / 2e-6 for h in steps]
    np.testing.assert_allclose(value.jacobian.matrix, np.transpose(J), atol=1e-6 * np.abs(J).max())
    slope = (system.evaluate(x, w + 1e-6).residual - system.evaluate(x, w - 1e-6).residual) / 2e-6
    np.testing.assert_allclose(value.parameter_derivative, slope, atol=1e-6 * np.abs(slope).max())
