"""Starts of a time integration: at rest nothing is stressed; from a periodic motion it is nearly periodic at once."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.time_domain.event_integrator import Stepper
from slipstick.analysis.time_domain.initial_state import HarmonicStart, sampled_forces, start_at_rest, start_from_motion
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import periods
from slipstick.verify.cases import oscillator


@pytest.mark.parametrize(("gap", "state"), [(-800.0, State.STICK), (10.0, State.SEPARATION)])
@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_at_rest_springs_have_no_force(gap, state):
    problem = oscillator(velocity=10.0).with_parameter("damper.gap", gap)
    s = Stepper(PiecewiseLinear(friction_system(problem, 5.0)))
    z, states = start_at_rest(s)
    assert states == (state,)
    assert not z[:2].any()
    assert s.model(states).fx[0] @ z == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("velocity", [0.0, 10.0, 50.0])
def test_from_a_branch_point_the_motion_is_nearly_periodic(velocity):
    problem, omega = oscillator(velocity=velocity, harmonics=range(21)), 4.0
    branch = ss.forced_response(problem, omega=(omega, 4.1))
    d = branch.point(0)
    start = HarmonicStart(
        harmonics=problem.harmonics,
        tangential=d["contact_tangential"].to_numpy(),
        normal=d["contact_normal"].to_numpy(),
    )
    s = Stepper(PiecewiseLinear(friction_system(problem, omega)))
    from_motion = next(periods(s, *start_from_motion(s, start), shooting=False)).change
    from_rest = next(periods(s, *start_at_rest(s), shooting=False)).change
    assert from_motion < 0.02
    assert from_rest > 10 * from_motion


def test_sampled_forces_are_those_of_the_element():
    """Against the exact element, by coefficients of the samples."""
    problem = oscillator(velocity=10.0)
    h, omega = problem.harmonics, 4.0
    X = np.random.default_rng(0).normal(size=(1, h.size)) * 3.0
    system = friction_system(problem, omega)
    _, fx, fy = sampled_forces(system, HarmonicStart(harmonics=h, tangential=X, normal=0 * X))
    pair = problem.contacts[0]
    exact = ss.contact_forces(pair.contact, h, X[0], 0 * X[0], omega=omega, rubbing=pair.rubbing)
    tau = 2 * np.pi * np.arange(fx.shape[1]) / fx.shape[1]
    np.testing.assert_allclose(2 * fx[0] @ h.H_plus(tau) / tau.size, exact.Fx, atol=0.5)
    np.testing.assert_allclose(2 * fy[0] @ h.H_plus(tau) / tau.size, exact.Fy, atol=1e-9)
