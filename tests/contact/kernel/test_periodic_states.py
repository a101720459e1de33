"""The periodic sequence of states against small steps of the law itself."""

import numpy as np
import pytest
from helpers.elements import SEEDS, evaluated, given, marched, motion, tuples


@pytest.mark.parametrize("seed", SEEDS)
def test_states_follow_one_another_and_their_forces_are_those_of_the_march(seed):
    inputs = given(seed)
    _, k, total = evaluated(inputs)
    at, code = k.intervals.at[:total], k.intervals.code[:total]
    assert at[-1, 1] - at[0, 0] == pytest.approx(2 * np.pi, abs=1e-13)
    np.testing.assert_array_equal(at[1:, 0], at[:-1, 1])
    assert np.all(code[1:, 0] != code[:-1, 0])
    t, f = marched(inputs)
    whole = total == 1 and code[0, 0] == tuples.STICK
    if not whole:  # stuck all period the march stops anywhere within the residual traction
        expected = np.interp(np.mod(at[:, 0], 2 * np.pi), t, f)
        sticks = code[:, 0] == tuples.STICK
        np.testing.assert_allclose(at[sticks, 2], expected[sticks], atol=5e-3 * (1 + np.abs(f).max()))


@pytest.mark.parametrize("seed", SEEDS)
def test_each_state_obeys_its_law(seed):
    """Open contacts are open; a sticking force stays within its limit; slip goes the way of the force."""
    inputs = given(seed)
    _, k, total = evaluated(inputs)
    _, kt, mu, kn, _ = inputs.parameters
    for (start, end, force), (state, _) in zip(k.intervals.at[:total], k.intervals.code[:total], strict=True):
        t = np.linspace(start, end, 200)[1:-1]
        w, y = motion(inputs, t)
        limit = mu * kn * np.maximum(y, 0.0)
        if state == tuples.SEPARATION:
            assert y.max() < 1e-9
            continue
        assert y.min() > -1e-9
        if state == tuples.STICK:
            f = force + kt * (w - motion(inputs, np.array(start))[0])
            assert np.all(np.abs(f) <= limit + 1e-9)
        else:
            sign = 1.0 if state == tuples.SLIP_PLUS else -1.0
            h = 1e-6
            gained = kt * (motion(inputs, t + h)[0] - motion(inputs, t - h)[0])
            grown = mu * kn * (motion(inputs, t + h)[1] - motion(inputs, t - h)[1])
            assert np.all(sign * gained - grown >= -1e-9)


def test_a_stuck_contact_keeps_what_the_last_slip_left():
    """v = 0 and little motion: any constant within the bounds will do, the middle is taken."""
    inputs = given(0, v=0.0, kt=0.01, gap=-5.0)
    out, k, total = evaluated(inputs)
    assert (total, k.intervals.code[0, 0]) == (1, tuples.STICK)
    t = np.linspace(0, 2 * np.pi, 100_001)
    w, y = motion(inputs, t)
    limit = inputs.parameters[2] * inputs.parameters[3] * y
    pull = inputs.parameters[1] * w
    low, high = (-limit - pull).max(), (limit - pull).min()
    assert out.scalars[tuples.S_LOW] == pytest.approx(low, rel=1e-8)
    assert out.scalars[tuples.S_HIGH] == pytest.approx(high, rel=1e-8)
    assert out.vectors[tuples.V_FX, 0] == pytest.approx(0.5 * (low + high), rel=1e-7, abs=1e-8)
