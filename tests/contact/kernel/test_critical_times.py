"""Critical times against the roots of each trial function by itself."""

import numpy as np
import pytest
from helpers.elements import GRID, SEEDS, H, batch, critical, given, tuples

from slipstick.trig.roots import roots


def element_of(inputs, k):
    v, kt, mu, kn, gap = inputs.parameters
    X = critical.padded(inputs.X, 0.0, k.parts[:2])
    return tuples.ElementMotion(
        X, critical.padded(inputs.Y, inputs.Y[0] - gap, k.parts[2:]), v, kt, mu, kn, mu * kn, False
    )


def trial_functions(inputs):
    """Coefficients of ``y - g`` and of the rates ``phi_+'`` and ``phi_-'``."""
    v, kt, mu, kn, gap = inputs.parameters
    y = inputs.Y - gap * (np.arange(H.size) == 0)
    rate, limit = kt * H.derivative(inputs.X), mu * kn * H.derivative(inputs.Y)
    rate[0] = kt * v
    return {tuples.NORMAL: y, tuples.UPPER: rate - limit, tuples.LOWER: rate + limit}


@pytest.mark.parametrize("seed", SEEDS)
def test_every_root_is_there_once_with_the_states_of_the_segments(seed):
    inputs, k = given(seed), batch.workspace(GRID)
    count, rate, limit = critical.critical_times(element_of(inputs, k), GRID, k)
    time, kind = k.segments.time[:count], k.segments.kind[:count]
    assert np.all(np.diff(time) >= 0)
    functions = trial_functions(inputs)
    t = np.linspace(0, 2 * np.pi, 2000)
    y = H.H_minus(t) @ functions[tuples.NORMAL]
    for code, p in functions.items():
        expected = np.asarray(roots(H, p)[0])
        found = time[kind == code]
        if code == tuples.NORMAL:
            np.testing.assert_allclose(np.sort(found), np.sort(expected), atol=1e-12)
        else:  # where the contact is open for certain there is no need to look
            np.testing.assert_allclose(H.H_minus(found) @ p, 0.0, atol=1e-11)
            closed = expected[H.H_minus(expected) @ functions[tuples.NORMAL] > 0]
            assert all(np.abs(found - root).min() < 1e-11 for root in closed)
    middles = 0.5 * (time + np.append(time[1:], time[0] + 2 * np.pi))
    at = {code: H.H_minus(middles) @ p for code, p in functions.items()}
    np.testing.assert_array_equal(k.segments.contact[:count], at[tuples.NORMAL] > 0)
    contact = k.segments.contact[:count]
    np.testing.assert_array_equal(k.segments.plus[:count][contact], np.sign(at[tuples.UPPER][contact]))
    np.testing.assert_array_equal(k.segments.minus[:count][contact], np.sign(at[tuples.LOWER][contact]))
    w1 = inputs.parameters[0] + H.H_minus(t) @ H.derivative(inputs.X)
    assert rate >= inputs.parameters[1] * np.abs(w1).max()
    assert limit == pytest.approx(inputs.parameters[2] * inputs.parameters[3] * max(y.max(), 0.0), rel=0.1, abs=1e-3)


def test_nothing_happens_without_vibration():
    k = batch.workspace(GRID)
    inputs = given(0)
    still = inputs._replace(X=0 * inputs.X, Y=0 * inputs.Y)
    count, *_ = critical.critical_times(element_of(still, k), GRID, k)
    assert count == 1
    assert k.segments.kind[0] == tuples.NONE


def test_under_constant_load_both_trial_functions_turn_together():
    inputs = given(1, v=0.0, gap=-2.0)
    k = batch.workspace(GRID)
    count, *_ = critical.critical_times(element_of(inputs._replace(Y=0 * inputs.Y), k), GRID, k)
    assert set(k.segments.kind[:count].tolist()) == {tuples.BOTH}
