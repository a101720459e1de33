"""Where a body let go at a temperature comes to rest: the first root downhill, against brute force."""

import numpy as np
import pytest

from slipstick.state.thermal.equilibrium import TemperatureCells, downhill, near_start

T_LOW, T_HIGH = 0.0, 10.0


def small(T):
    return 1e-12 * (1.0 + np.abs(T))


def cubic(roots):
    """``G`` with these roots (n, 3), steep: closer ones than slopes of about 1 can tell are not looked for."""
    roots = np.asarray(roots, dtype=float)

    def balance(T):
        d = T[:, None] - roots
        return 50 * d.prod(axis=1), 50 * (d[:, 1] * d[:, 2] + d[:, 0] * d[:, 2] + d[:, 0] * d[:, 1])

    return balance


def run(balance, start):
    start = np.asarray(start, dtype=float)
    limits = np.full(start.size, T_LOW), np.full(start.size, T_HIGH)
    return downhill(balance, start, limits, np.empty((0, start.size)), small)


def test_each_body_comes_to_rest_at_the_next_equilibrium_downhill():
    roots = np.tile([2.0, 5.0, 8.0], (6, 1))
    T, found, _ = run(cubic(roots), [0.1, 4.9, 5.1, 9.9, 2.0, 8.0])
    assert found.all()
    np.testing.assert_allclose(T, [2.0, 2.0, 8.0, 8.0, 2.0, 8.0], atol=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_random_ones_against_the_sorted_roots(seed):
    rng = np.random.default_rng(seed)
    roots = np.sort(rng.uniform(1.0, 9.0, (40, 3)), axis=1)
    start = rng.uniform(T_LOW, T_HIGH, 40)
    T, found, _ = run(cubic(roots), start)
    assert found.all()
    expected = np.where(start < roots[:, 1], roots[:, 0], roots[:, 2])
    np.testing.assert_allclose(T, expected, atol=1e-7)


def test_an_unstable_place_on_the_way_is_said():
    """Let go on a slope that rises the wrong way, the body has passed an unstable place."""
    _, found, passed = run(cubic([[2.0, 5.0, 8.0]] * 2), [4.5, 2.5])
    assert found.all()
    assert passed.tolist() == [True, False]


def test_beyond_the_limits_the_parameters_stay_as_they_are():
    """``G`` = T - 15 has its root outside: there the slope is 1 and the root is where the step leads."""
    T, found, _ = run(lambda T: (np.minimum(T, 10.0) - 15.0, np.ones_like(T)), [3.0])
    assert found.all()
    assert T[0] == pytest.approx(15.0)


def test_newton_takes_near_roots_and_refuses_those_beyond_a_bend():
    balance = cubic([[2.0, 5.0, 8.0]] * 3)
    longest = np.full(3, 1.0)
    T, good = near_start(balance, np.array([2.01, 5.01, 3.4]), longest, small)
    assert good.tolist() == [True, False, False]
    assert T[0] == pytest.approx(2.0, abs=1e-10)
    held, good = near_start(balance, np.array([2.01, 5.01, 2.01]), longest, small, hold=True)
    assert good.tolist() == [True, True, True]
    np.testing.assert_allclose(held, [2.0, 5.0, 2.0], atol=1e-10)


def test_a_cell_says_whether_its_ends_leave_room_for_more():
    """Parabolas above zero at both ends: one dips beyond the axis, one does not; a plain crossing has one root."""
    one = np.ones(1)
    dips = TemperatureCells(0 * one, one, -4 * one, one, one, 4 * one)
    stays = TemperatureCells(0 * one, one, -0.4 * one, one, one, 0.4 * one)
    crosses = TemperatureCells(0 * one, -one, 2 * one, one, one, 2 * one)
    folds = TemperatureCells(0 * one, -one, -2 * one, one, one, 2 * one)
    assert [bool(cell.may_hold_more_roots()[0]) for cell in (dips, stays, crosses, folds)] == [True, False, False, True]
    assert [bool(cell.is_curved()[0]) for cell in (dips, stays, crosses)] == [True, True, False]
