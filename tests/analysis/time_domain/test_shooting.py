"""The derivative of the period map against differences, state changes included."""

import numpy as np
import pytest

from slipstick.analysis.time_domain.event_integrator import Stepper
from slipstick.analysis.time_domain.initial_state import start_at_rest
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import one_period, periods, relative_change
from slipstick.verify.cases import oscillator


def stepper(velocity, omega=4.2):
    return Stepper(PiecewiseLinear(friction_system(oscillator(velocity=velocity), omega)))


@pytest.mark.parametrize("velocity", [0.0, 10.0, 1000.0])
def test_derivative_of_the_period_map(velocity):
    s = stepper(velocity)
    z, states = start_at_rest(s)
    one_period(s, z, states, False)
    z, states = s.z.copy(), s.states
    Phi = one_period(s, z, states, True)
    end, h = s.z.copy(), 1e-6
    n = s.model.system.n
    columns = [*range(2 * n), *([2 * n] if states[0] is State.STICK else [])]
    for k in columns:
        ends = []
        for step in (h, -h):
            moved = z.copy()
            moved[k] += step
            one_period(s, moved, states, False)
            ends.append(s.z.copy())
        difference = (ends[0] - ends[1]) / (2 * h)
        np.testing.assert_allclose(Phi[:, k], difference, atol=1e-5 * max(1.0, np.abs(Phi).max()))
    assert end.shape == z.shape


def test_newton_ends_quadratically_where_marching_creeps():
    s = stepper(10.0, 6.0)
    z, states = start_at_rest(s)
    changes = []
    for end in periods(s, z, states, shooting=True):
        changes.append(end.change)
        if end.change < 1e-12 or end.period > 40:
            break
    assert changes[-1] < 1e-12
    marched = []
    for end in periods(s, z, states, shooting=False):
        marched.append(end.change)
        if end.period == len(changes):
            break
    assert marched[-1] > 1e3 * changes[-1]


def test_no_change_is_none():
    s = stepper(10.0)
    z, states = start_at_rest(s)
    assert relative_change(s, z, z, states) == 0.0


@pytest.mark.parametrize("shooting", [True, False])
def test_the_error_told_is_the_distance_from_the_periodic_state(shooting):
    """Of marching it is a bound of the right size: two multipliers that turn are taken for one that does not."""
    s = stepper(10.0, 6.0)
    closed = next(end for end in periods(s, *start_at_rest(s), shooting=True) if end.change < 1e-13)
    known = []
    for end in periods(s, *start_at_rest(s), shooting=shooting):
        if 1e-9 < end.error < 1e-2 and end.states == closed.states:
            known.append(end.error / relative_change(s, closed.z, end.z, end.states))
        if end.change < 1e-10 or end.period > 90:
            break
    assert known
    assert 0.3 < min(known) < max(known) < (3.0 if shooting else 30.0)
