from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import difference

import slipstick as ss
from slipstick.analysis.modes.following import first_guess
from slipstick.analysis.modes.nonlinear_modes import free_problem


@pytest.mark.parametrize("damping", [0.0, 0.5])
@pytest.mark.parametrize("at_dof", [False, True])
@pytest.mark.parametrize("dof", ["b", "d", "a"])  # no port, a normal and a tangential one
def test_jacobian_and_derivative_by_the_amplitude_are_those_of_differences(dof, at_dof, damping):
    """At a random state of three contacts, one with a normal direction, rubbing and a static load."""
    n = 4
    K = 50.0 * np.eye(n) - 10.0 * np.eye(n, k=1) - 10.0 * np.eye(n, k=-1)
    C = 0.01 * K + damping * np.diag([1.0, 0.2, 0.0, 0.0])  # what is added couples the modes
    structure = ss.MatrixStructure(M=np.eye(n), C=C, K=K, dofs=["a", "b", "c", "d"], loss_factor=0.01)
    law = ss.FrictionContact(kt=40.0, mu=0.3, kn=30.0, normal_load=5.0)
    pairs = [
        ss.ContactPair(name="one", tangential="a", contact=law, rubbing=ss.RubbingMotion(velocity=2.0)),
        ss.ContactPair(name="two", tangential={"b": 1.0, "c": -1.0}, contact=law),
        ss.ContactPair(name="three", tangential="a", normal="d", contact=law),
    ]
    loads = [ss.Load(dof="d", harmonic=0, cos=3.0), ss.Load(dof="a", sin=10.0)]
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(4))
    free, linear = free_problem(problem, 1, dof)
    guess = first_guess(free.balance, free.target, linear, 0.5)
    system = free.system(guess[:-2], at_dof=at_dof)
    rng = np.random.default_rng(3)
    y = np.append(guess[:-2] / system.sizes(0.5), guess[-2:])
    y += 0.3 * rng.standard_normal(guess.size)
    dy, p = rng.standard_normal(y.size), float(np.log(0.5))
    found = system.evaluate(y, p)
    expected = difference(lambda e: system.evaluate(y + e * dy, p).residual, 0.0, 1e-5)
    assert found.jacobian.multiply(dy) == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())
    expected = difference(lambda q: system.evaluate(y, q).residual, p, 1e-4)
    assert found.parameter_derivative == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())
