"""Exact steps against the matrix exponential, and state changes at the instants of closed forms."""

import numpy as np
import pytest
from helpers.counting import calls_of
from scipy.linalg import expm

import slipstick as ss
from slipstick.analysis.time_domain.event_integrator import StateChange, Stepper, replaced, spring_memory
from slipstick.analysis.time_domain.initial_state import start_at_rest
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.errors import InputError
from slipstick.verify.cases import oscillator


def stepper(velocity=10.0, omega=5.0, steps=None):
    return Stepper(PiecewiseLinear(friction_system(oscillator(velocity=velocity), omega)), steps)


@pytest.mark.parametrize("fraction", [1.0, 0.37, 1e-6])
def test_a_step_is_the_matrix_exponential(fraction):
    s = stepper()
    linear = s.model((State.STICK,))
    z = np.random.default_rng(0).normal(size=s.model.system.size)
    exact = expm(linear.A * s.step * fraction) @ z
    np.testing.assert_allclose(fraction ** np.arange(s.degree + 1) @ s.powers(linear, z), exact, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(s.propagate(linear, np.stack([z, 2 * z], 1), fraction)[:, 1], 2 * exact, rtol=1e-12)


def test_pieces_follow_one_another_and_forces_are_continuous():
    s = stepper()
    z, states = start_at_rest(s)
    tau, previous = 0.0, None
    for item in s.period(z, states):
        if isinstance(item, StateChange):
            force = item.linear.fx[item.contact] @ item.z
            after = s.model(item.states).fx[item.contact] @ s.z
            assert after == pytest.approx(force, abs=1e-9 * 240)
            assert item.tau == pytest.approx(tau, abs=1e-12)
            assert (item.before, item.after) == (previous, item.states[item.contact])
        else:
            assert item.tau == pytest.approx(tau, abs=1e-12)
            tau, previous = item.tau + item.fraction * s.step, item.states[0]
    assert tau == pytest.approx(2 * np.pi)


def test_slip_begins_where_the_spring_reaches_the_limit():
    """Pushed off from rest: kt times the motion is mu N at that instant."""
    s = stepper(velocity=0.0)
    z, states = start_at_rest(s)
    z[1] = 20.0
    change = next(item for item in s.period(z, states) if isinstance(item, StateChange))
    assert change.before == State.STICK
    assert change.after in (State.SLIP_PLUS, State.SLIP_MINUS)
    assert abs(change.linear.fx[0] @ change.z) == pytest.approx(240.0, rel=1e-11)
    assert abs(100.0 * change.z[0]) == pytest.approx(240.0, rel=1e-9)


def test_the_memory_of_a_spring_gives_the_force_asked_for():
    s = stepper()
    z = np.random.default_rng(1).normal(size=s.model.system.size)
    z[2 * s.model.system.n] = spring_memory(s.model, (State.STICK,), 0, z, 17.0)
    assert s.model((State.STICK,)).fx[0] @ z == pytest.approx(17.0)
    assert replaced((State.STICK, State.STICK), 1, State.SEPARATION) == (State.STICK, State.SEPARATION)


def test_too_few_steps_are_refused():
    with pytest.raises(InputError, match="time integration, steps: found 2"):
        stepper(omega=0.5, steps=2)


def test_slip_in_the_plane_takes_few_rounds_a_step(monkeypatch):
    """Newton's steps over all nodes together: the plain iteration took 30 to 50 rounds."""
    structure = ss.MatrixStructure(M=np.eye(3), C=0.4 * np.eye(3), K=np.diag([40.0, 50.0, 90.0]), dofs=list("xyz"))
    foot = ss.ContactPair(
        name="foot", contact=ss.PlanarFrictionContact(kt=90.0, mu=0.4, kn=30.0, gap=-2.0), tangential=("x", "y"),
        normal="z", rubbing=ss.RubbingMotion(velocity=(3.0, 1.0)),
    )  # fmt: skip
    loads = [ss.Load(dof="x", sin=60.0), ss.Load(dof="y", cos=40.0), ss.Load(dof="z", cos=30.0)]
    problem = ss.Problem(structure, contacts=foot, loads=loads, harmonics=[0, 1])
    s = Stepper(PiecewiseLinear(friction_system(problem, 6.0)))
    z, states = start_at_rest(s)
    rates, steps = calls_of(monkeypatch, PiecewiseLinear, "rate"), calls_of(monkeypatch, Stepper, "_collocated")
    changes = [item for item in s.period(z, states) if isinstance(item, StateChange)]
    assert changes
    assert len(steps) > 50
    assert len(rates) < 12 * len(steps)
