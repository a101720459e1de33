"""Steps of Runge-Kutta methods show their orders, and the implicit one damps what is stiff."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slipstick.solve.runge_kutta import DORMAND_PRINCE, EULER, MIDPOINT, RK4, Method, explicit_step, rosenbrock_step
from slipstick.typing import Array

START, LENGTH = np.array([1.0, 2.0]), 2.0


def rate(z: Array, part: float) -> tuple[Array, None]:
    return np.array([z[1] - z[0] ** 2, -np.sin(z[0]) * z[1] - 0.3 * z[1] ** 2]), None


def slopes(z: Array) -> Array:
    return np.array([[-2.0 * z[0], 1.0], [-np.cos(z[0]) * z[1], -np.sin(z[0]) - 0.6 * z[1]]])


def error(method: Method | None, count: int) -> float:
    """Of the end of so many steps; None: the implicit method."""
    z, h = START, LENGTH / count
    for _ in range(count):
        k = rate(z, 0.0)[0]
        end = rosenbrock_step(rate, z, k, h, slopes(z)) if method is None else explicit_step(rate, z, k, h, method)
        assert end is not None
        z = end.state
    exact = solve_ivp(lambda t, z: rate(z, 0.0)[0], (0.0, LENGTH), START, method="DOP853", rtol=1e-13, atol=1e-14)
    return float(np.abs(z - exact.y[:, -1]).max())


@pytest.mark.parametrize(
    ("method", "order"), [(EULER, 1), (MIDPOINT, 2), (RK4, 4), (DORMAND_PRINCE, 5), (None, 4)],
    ids=["euler", "midpoint", "rk4", "dormand-prince", "rodas"],
)  # fmt: skip
def test_the_order_is_observed(method: Method | None, order: int) -> None:
    observed = np.log2(error(method, 20) / error(method, 40))
    assert order - 0.1 < observed < order + 1.0


def test_estimates_of_the_error_are_one_order_lower() -> None:
    k, estimates = rate(START, 0.0)[0], []
    for h in (0.05, 0.025):
        ends = explicit_step(rate, START, k, h, DORMAND_PRINCE), rosenbrock_step(rate, START, k, h, slopes(START))
        estimates.append([float(np.abs(end.error).max()) for end in ends if end is not None])
    observed = np.log2(np.array(estimates[0]) / estimates[1])
    assert observed == pytest.approx([5.0, 4.0], abs=0.35)


def test_a_stage_without_a_value_ends_the_step() -> None:
    def half(z: Array, part: float) -> tuple[Array, None] | None:
        return None if part > 0.6 else rate(z, part)

    k = rate(START, 0.0)[0]
    assert explicit_step(half, START, k, 0.1, RK4) is None
    assert rosenbrock_step(half, START, k, 0.1, slopes(START)) is None
