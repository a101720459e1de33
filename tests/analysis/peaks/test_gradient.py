from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import difference, random_problem

from slipstick.analysis.peaks.system import Extreme, PeakGradient, StateSpace
from slipstick.analysis.sensitivity.linearization import FREQUENCY
from slipstick.balance.balance import Balance
from slipstick.balance.parameters import parameter_path
from slipstick.results.record import Outputs
from slipstick.trig.harmonics import Harmonics

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def test_extremes_next_to_a_time():
    h = Harmonics([0, 1, 3])
    U = np.array([5.0, 1.0, 0.0, 0.4, 0.0])
    t = np.linspace(0.0, 2.0 * np.pi, 20001)
    x = h.H_minus(t)[:, 1:] @ U[1:]
    largest = Extreme.largest(h, U)
    assert largest.value == pytest.approx(np.abs(x).max())
    near = Extreme.near(h, U, np.pi + 0.1)
    assert (near.value, near.time, near.sign) == (pytest.approx(1.4), pytest.approx(np.pi), -1.0)
    assert (near.h @ U)[0] == pytest.approx(1.4)


def test_an_extreme_is_followed_from_one_motion_to_another():
    """However far it moves in time, and to no other one; where it vanishes on the way it does not go on."""
    h = Harmonics(range(3))
    first = np.array([0.0, 1.0, 0.0, 0.2, 0.0])
    turned = np.array([0.0, np.cos(1.2), np.sin(1.2), 0.2 * np.cos(2.4), 0.2 * np.sin(2.4)])
    top = Extreme.near(h, first, 0.0)
    assert top.continues_as(Extreme.near(h, turned, 1.2), first, turned)
    assert not top.continues_as(Extreme.near(h, turned, 1.2 + np.pi), first, turned)
    assert not top.continues_as(Extreme.near(h, -first, 0.0), first, -first)


def test_the_rival_of_an_extreme_is_the_largest_other_one():
    """Two waves of different heights and what lies between: every extreme of a fine sampling of one period."""
    h = Harmonics([0, 1, 2, 3])
    U = np.array([9.0, 1.0, 0.2, 0.9, -0.3, 0.6, 0.1])
    t = np.linspace(0.0, 2.0 * np.pi, 40000, endpoint=False)
    size = np.abs(h.H_minus(t)[:, 1:] @ U[1:])
    tops = np.sort(size[(size > np.roll(size, 1)) & (size > np.roll(size, -1))])[::-1]
    assert len(tops) > 3
    largest = Extreme.largest(h, U)
    rival = largest.rival(U)
    assert rival is not None
    assert rival.value == pytest.approx(tops[1], rel=1e-6)
    assert largest.ahead(U) == pytest.approx(tops[1] / tops[0] - 1.0, rel=1e-5)
    assert rival.ahead(U) == pytest.approx(tops[0] / tops[1] - 1.0, rel=1e-5)


@pytest.mark.parametrize("over", ["omega", "parameter"])
@pytest.mark.parametrize("dof", ["d0", "d3"])
def test_the_gradient_of_a_slope_is_that_of_differences(dof, over):
    """At any state, whether it solves the balance or not: by motion, frequency and parameter."""
    problem = random_problem(1)
    outputs, name = Outputs(Balance(problem), (dof,)), "c0.kt"
    rng = np.random.default_rng(2)
    x, omega, value = 0.3 * rng.standard_normal(outputs.balance.size), 6.0, problem.parameter(name)
    surface = StateSpace(outputs, problem.inputs, parameter_path(problem, name))
    time = Extreme.largest(problem.harmonics, surface.at(x, omega, value).motion()[0]).time

    def slope(x: np.ndarray, omega: float, value: float) -> PeakGradient:
        here = surface.at(x, omega, value)
        extreme = Extreme.near(problem.harmonics, here.motion()[0], time)
        return PeakGradient(surface, here, value, extreme, FREQUENCY if over == "omega" else surface.along(value))

    own = slope(x, omega, value)
    beside = own.displaced(1.0)
    dx = rng.standard_normal(x.size)
    scale = abs(own.value)
    for found, function, at, step in (
        (beside.by_motion() @ dx, lambda e: slope(x + e * dx, omega, value).value, 0.0, 1e-5),
        (beside.along(FREQUENCY), lambda w: slope(x, w, value).value, omega, 1e-4),
        (beside.along(surface.along(value)), lambda p: slope(x, omega, p).value, value, 1e-2),
    ):
        assert found == pytest.approx(difference(function, at, step), rel=1e-5, abs=1e-5 * scale)
