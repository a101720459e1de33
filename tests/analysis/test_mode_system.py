from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import difference

import slipstick as ss
from slipstick.analysis.mode_system import ModeSystem
from slipstick.analysis.nonlinear_modes import free_problem
from slipstick.balance.ports import Balance
from slipstick.results.record import Outputs


def test_jacobian_and_derivative_by_the_amplitude_are_those_of_differences():
    """At a random state of three contacts, one with a normal direction, rubbing and a static load."""
    n = 4
    K = 50.0 * np.eye(n) - 10.0 * np.eye(n, k=1) - 10.0 * np.eye(n, k=-1)
    structure = ss.MatrixStructure(M=np.eye(n), C=0.01 * K, K=K, dofs=["a", "b", "c", "d"], loss_factor=0.01)
    law = ss.FrictionContact(kt=40.0, mu=0.3, kn=30.0, normal_load=5.0)
    pairs = [
        ss.ContactPair(name="one", tangential="a", contact=law, rubbing=ss.RubbingMotion(velocity=2.0)),
        ss.ContactPair(name="two", tangential={"b": 1.0, "c": -1.0}, contact=law),
        ss.ContactPair(name="three", tangential="b", normal="d", contact=law),
    ]
    loads = [ss.Load(dof="d", harmonic=0, cos=3.0), ss.Load(dof="a", sin=10.0)]
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(4))
    free = free_problem(problem, 1, "b")
    balance = Balance(free.problem)
    shape = balance.directions.T @ free.modal.mode_shapes[:, 1]
    system = ModeSystem(Outputs(balance, ("b",)), free.target, shape)
    rng = np.random.default_rng(3)
    y = system.start() + 0.3 * rng.standard_normal(balance.size + 2)
    dy, p = rng.standard_normal(y.size), float(np.log(0.5))
    found = system.evaluate(y, p)
    expected = difference(lambda e: system.evaluate(y + e * dy, p).residual, 0.0, 1e-5)
    assert found.jacobian.multiply(dy) == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())
    expected = difference(lambda q: system.evaluate(y, q).residual, p, 1e-4)
    assert found.parameter_derivative == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())
