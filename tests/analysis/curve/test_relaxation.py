"""Where heated contacts come to rest: a balance of heat that a steady motion at those temperatures keeps."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.problems import first_point

import slipstick as ss
from slipstick.analysis.curve.state_continuation import relaxed
from slipstick.balance.balance import Balance
from slipstick.verify.cases import oscillator

CURVE = ss.FrictionCurve(temperature=[0.0, 200.0, 5000.0], mu=[0.3, 0.25, 0.2])


@pytest.mark.parametrize("start", [20.0, 60.0, 150.0])
def test_from_any_temperature_to_the_same_rest(start):
    """Friction falls gently with heat: one equilibrium, T = T_0 + R P, P the power of the steady motion there."""
    cold = oscillator(velocity=10.0)
    thermal = ss.ThermalModel(curve=CURVE, background=20.0, resistance=0.05)
    problem, omega = replace(cold, thermal=thermal), 5.0
    balance = Balance(problem)
    x = first_point(problem, omega)
    found = relaxed(balance, problem.inputs, omega, x, np.array([start]))
    assert found is not None
    motion, detail = found
    [heat] = detail.states
    T = float(heat.values[0])
    assert pytest.approx(20.0 + 0.05 * float(heat.power.value[0]), rel=1e-9) == T
    at_rest = cold.with_parameter("damper.mu", float(CURVE.mu(T)))
    branch = ss.forced_response(at_rest, omega=(omega, 5.1))
    assert float(branch.dataset["dissipated_power"][0, 0]) == pytest.approx(float(heat.power.value[0]), rel=1e-7)
    np.testing.assert_allclose(motion, branch.dataset["contact_tangential"].to_numpy()[0, 0], rtol=1e-6, atol=1e-8)
    assert relaxed(balance, problem.inputs, omega, 3.0 * x, np.array([start]), reach=1e-6) is None
