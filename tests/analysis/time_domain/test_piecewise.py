"""The linear system of each combination of states: forces by their laws, equations by the structure's."""

from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.errors import InputError

OMEGA = 3.0


def problem():
    K = np.array([[40.0, -5.0], [-5.0, 60.0]])
    structure = ss.MatrixStructure(M=np.diag([1.0, 2.0]), C=0.02 * K, K=K, dofs=["x", "y"])
    law = ss.FrictionContact(kt=30.0, mu=0.3, kn=50.0, gap=-0.1)
    rub = ss.RubbingMotion(velocity=3.0, cos={1: 0.4}, normal_sin={2: 0.05})
    pair = ss.ContactPair(name="tip", contact=law, tangential="x", normal="y", rubbing=rub)
    loads = [ss.Load(dof="x", sin=4.0), ss.Load(dof="y", cos=1.0)]
    return ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(6))


def state_at(system, tau):
    z = np.random.default_rng(0).normal(size=system.size)
    z[system.n_dynamic :] = system.forcing(tau)
    return z


@pytest.mark.parametrize("state", list(State))
@pytest.mark.parametrize("tau", [0.0, 1.1])
def test_forces_and_accelerations_are_those_of_the_laws(state, tau):
    p = problem()
    system = friction_system(p, OMEGA)
    linear = PiecewiseLinear(system)((state,))
    z = state_at(system, tau)
    x, y, e = z[0], z[1], z[4]
    u, above = 0.4 * np.cos(tau), 0.05 * np.sin(2 * tau) + 0.1
    normal = 0.0 if state is State.SEPARATION else 50.0 * (y + above)
    friction = {
        State.SEPARATION: 0.0, State.STICK: 30.0 * (x + u) + e,
        State.SLIP_PLUS: 0.3 * normal, State.SLIP_MINUS: -0.3 * normal,
    }[state]  # fmt: skip
    assert linear.fy[0] @ z == pytest.approx(normal, abs=1e-12)
    assert linear.fx[0] @ z == pytest.approx(friction, abs=1e-12)
    rate = linear.A @ z
    push = np.array([4.0 * np.sin(tau) - friction, np.cos(tau) - normal])
    s = p.structure
    expected = np.linalg.solve(s.M, push - s.K @ z[:2] - OMEGA * s.C @ z[2:4]) / OMEGA**2
    np.testing.assert_allclose(rate[2:4], expected, atol=1e-12)
    np.testing.assert_allclose(rate[:2], z[2:4])
    assert rate[4] == pytest.approx(30.0 * 3.0 / OMEGA if state is State.STICK else 0.0)
    h = 1e-6
    later = (system.forcing(tau + h) - system.forcing(tau - h)) / (2 * h)
    np.testing.assert_allclose(rate[system.n_dynamic :], later, atol=1e-8)
    assert linear.rate[0] @ z == pytest.approx(z[2] - 0.4 * np.sin(tau) + 3.0 / OMEGA, abs=1e-12)


def test_margins_are_positive_while_a_state_lasts():
    system = friction_system(problem(), OMEGA)
    model, z = PiecewiseLinear(system), state_at(system, 0.4)
    y_g = z[1] + 0.05 * np.sin(0.8) + 0.1
    for state in State:
        linear = model((state,))
        for switch, row in zip(linear.switches, linear.margins, strict=True):
            if switch.target is State.SEPARATION:
                assert row @ z == pytest.approx(y_g)
            elif switch.target is None:
                assert row @ z == pytest.approx(-y_g)
            elif switch.target in (State.SLIP_PLUS, State.SLIP_MINUS):
                sign = 1.0 if switch.target is State.SLIP_PLUS else -1.0
                assert row @ z == pytest.approx(0.3 * 50.0 * y_g - sign * linear.fx[0] @ z)


def test_the_fastest_motion_bounds_all_combinations_of_one_contact():
    model = PiecewiseLinear(friction_system(problem(), OMEGA))
    stuck = np.abs(np.linalg.eigvals(model((State.STICK,)).A[:4, :4])).max()
    assert model.fastest() >= stuck - 1e-12


def test_a_mass_that_is_missing_is_said():
    system = friction_system(problem(), OMEGA)
    singular = replace(system.equations, M=np.diag([1.0, 0.0]))
    with pytest.raises(InputError, match="the mass matrix is singular"):
        PiecewiseLinear(replace(system, equations=singular))


def test_names_of_states_are_those_of_results():
    assert [state.text for state in State] == ["separation", "stick", "slip+", "slip-"]
