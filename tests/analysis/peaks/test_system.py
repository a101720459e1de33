from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import difference, random_problem

from slipstick.analysis.peaks.system import PeakSystem, StateSpace
from slipstick.balance.balance import Balance
from slipstick.balance.parameters import parameter_path
from slipstick.results.record import Outputs

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


@pytest.mark.parametrize("dof", ["d0", "d3"])
def test_jacobian_and_derivative_by_the_parameter_are_those_of_differences(dof):
    """At a random state: it need not be a peak."""
    problem, name = random_problem(1), "c0.kt"
    outputs = Outputs(Balance(problem), (dof,))
    system = PeakSystem(StateSpace(outputs, problem.inputs, parameter_path(problem, name)))
    rng, value = np.random.default_rng(2), problem.parameter(name)
    y = np.append(0.3 * rng.standard_normal(outputs.balance.size), 6.0)
    found = system.evaluate(y, value)
    dy = np.append(rng.standard_normal(y.size - 1), 0.5)
    expected = difference(lambda e: system.evaluate(y + e * dy, value, found.context).residual, 0.0, 1e-5)
    assert found.jacobian.multiply(dy) == pytest.approx(expected, rel=1e-5, abs=1e-5 * np.abs(expected).max())
    expected = difference(lambda p: system.evaluate(y, p, found.context).residual, value, 1e-2)
    assert found.parameter_derivative == pytest.approx(expected, rel=1e-5, abs=1e-5 * np.abs(expected).max())
    assert found.jacobian.solve(found.jacobian.multiply(dy)) == pytest.approx(dy, rel=1e-6, abs=1e-8)


def test_what_is_no_motion_has_no_peak():
    problem = random_problem(1)
    outputs = Outputs(Balance(problem), ("d0",))
    system = PeakSystem(StateSpace(outputs, problem.inputs, parameter_path(problem, "c0.kt")))
    y = np.append(np.zeros(outputs.balance.size), -1.0)
    assert np.all(np.isnan(system.evaluate(y, 100.0).residual))
    assert system.evaluate(y, 100.0).jacobian.singular
