"""The balance with a free frequency: derivatives against differences, phase, the multiplier that is left out."""

import numpy as np
from helpers.stability import at_the_hopf_point, brake

from slipstick.analysis.self_excited.system import CycleWatch
from slipstick.analysis.stability.floquet import StabilityWatch


def test_derivatives_are_those_of_differences():
    _, _, rest, start = at_the_hopf_point(brake())
    system = start.system
    y = np.append(rest + 1.1 * start.largest * start.motion, 10.1)
    rng, mu, h = np.random.default_rng(3), 0.57, 1e-6
    y[:-1] += 1e-3 * rng.standard_normal(y.size - 1)
    here = system.evaluate(y, mu)
    for _ in range(5):
        way = rng.standard_normal(y.size)
        difference = (system.evaluate(y + h * way, mu).residual - system.evaluate(y - h * way, mu).residual) / (2 * h)
        np.testing.assert_allclose(here.jacobian.multiply(way), difference, atol=1e-6 * np.abs(difference).max())
    difference = (system.evaluate(y, mu + h).residual - system.evaluate(y, mu - h).residual) / (2 * h)
    np.testing.assert_allclose(here.parameter_derivative, difference, atol=1e-6 * np.abs(difference).max())


def test_a_cycle_is_one_at_every_phase_and_only_one_is_in_phase():
    request, _, _, start = at_the_hopf_point(brake())
    system = start.system
    step = start.first()
    balance, turn = request.balance, 0.7
    z = step.x[:-1].reshape(balance.n_ports, -1)
    shifted = z.copy()
    for k, m in enumerate(balance.harmonics.m):
        c, s = z[:, 2 * k + 1], z[:, 2 * k + 2]
        shifted[:, 2 * k + 1] = c * np.cos(m * turn) + s * np.sin(m * turn)
        shifted[:, 2 * k + 2] = s * np.cos(m * turn) - c * np.sin(m * turn)
    found = system.evaluate(np.append(shifted, step.x[-1]), step.parameter)
    assert np.abs(found.residual[:-1]).max() < 1e-9 * np.abs(z).max()
    assert abs(found.residual[-1]) > 0.1 * start.size(step.x[:-1])
    assert abs(system.evaluate(step.x, step.parameter).residual[-1]) < 1e-12


def test_the_multiplier_of_a_shift_in_time_is_left_out():
    request, _, _, start = at_the_hopf_point(brake())
    step = start.first()
    detail = step.evaluation.detail
    every = StabilityWatch(request.balance).at(step.x[:-1], detail).multipliers
    kept = CycleWatch(request.balance).at(step.x, detail).multipliers
    assert len(kept) == len(every) - 1
    assert min(abs(every - 1.0)) < 1e-4
    assert min(abs(kept - 1.0)) > 1e-3


def test_what_is_no_motion_is_not_defined():
    _, _, rest, start = at_the_hopf_point(brake())
    system = start.system
    for omega in (0.0, -1.0, np.nan):
        assert np.all(np.isnan(system.evaluate(np.append(rest, omega), 0.5).residual))
