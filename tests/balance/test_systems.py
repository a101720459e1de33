"""Systems in omega and in parameters: every derivative against differences."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import CASES, Array, difference, random_problem

from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem, ParameterSystem
from slipstick.balance.parameters import parameter_path


@pytest.mark.parametrize("seed, harmonics, ratio", CASES)
def test_jacobian_and_frequency_derivative(seed: int, harmonics: list[int], ratio: tuple[int, int]) -> None:
    problem = random_problem(seed, harmonics=harmonics, period_ratio=ratio)
    balance = Balance(problem)
    system = FrequencySystem(balance, problem.inputs)
    x, omega = 0.5 * np.random.default_rng(seed).standard_normal(balance.size), 6.0
    found = system.evaluate(x, omega)
    for k in range(balance.size):
        unit = np.eye(balance.size)[k]
        wanted = difference(lambda s, unit=unit: system.evaluate(x + s * unit, omega).residual, 0.0, 1e-4)
        # states change within the step now and then: F is only once differentiable
        assert np.abs(found.jacobian.matrix[:, k] - wanted).max() < 2e-6 * np.abs(found.jacobian.matrix).max()
    wanted = difference(lambda w: system.evaluate(x, w).residual, omega, 1e-4)
    assert np.abs(found.parameter_derivative - wanted).max() < 1e-6 * np.abs(wanted).max()


@pytest.mark.parametrize("seed", range(3))
def test_frequency_derivative_with_velocities_that_grow_with_the_frequency(seed: int) -> None:
    """At its frequency a swept velocity is the same as a constant one; the derivative by omega is another."""
    omega, constant = 6.0, random_problem(seed)
    x = 0.5 * np.random.default_rng(seed).standard_normal(Balance(constant).size)
    share = {"c0": 1.0, "c1": 0.5, "c2": 2.0}
    swept = constant
    for name, s in share.items():
        v = constant.parameter(f"{name}.velocity")
        swept = swept.with_parameter(f"{name}.velocity_per_omega", s * v / omega)
        swept = swept.with_parameter(f"{name}.velocity", (1.0 - s) * v)
    first, second = (FrequencySystem(Balance(p), p.inputs) for p in (constant, swept))
    found = second.evaluate(x, omega)
    np.testing.assert_allclose(found.residual, first.evaluate(x, omega).residual, rtol=1e-12, atol=1e-12)
    wanted = difference(lambda w: second.evaluate(x, w).residual, omega, 1e-4)
    assert np.abs(found.parameter_derivative - wanted).max() < 1e-6 * np.abs(wanted).max()
    assert np.abs(found.parameter_derivative - first.evaluate(x, omega).parameter_derivative).max() > 1e-3


@pytest.mark.parametrize("name", ["c1.velocity", "c1.velocity_per_omega", "*.velocity_per_omega",
                                  "c0.mu", "c1.kt", "c2.kn", "c1.gap", "c1.normal_load", "*.mu", "load",
                                  "friction", "*.velocity", "c0.cos1", "c1.sin2", "*.normal_cos1", "c2.normal_sin2",
                                  "c1.normal_cos0", "rubbing.cos1", "rubbing.normal_cos2", "load.d0.amplitude",
                                  "load.d0.phase", "load.d4.1.phase", "load.d2.amplitude"])  # fmt: skip
@pytest.mark.parametrize("seed", [0, 1])
def test_parameter_derivatives(name: str, seed: int) -> None:
    problem = random_problem(seed)
    balance = Balance(problem)
    x, omega = 0.5 * np.random.default_rng(seed).standard_normal(balance.size), 6.0
    value = problem.parameter(name) if not name.startswith(("*", "rubbing")) else 0.4
    system = ParameterSystem(balance, parameter_path(problem, name), omega)
    found = system.evaluate(x, value)

    def residual(p: float) -> Array:
        changed = problem.with_parameter(name, p)
        return FrequencySystem(Balance(changed), changed.inputs).evaluate(x, omega).residual

    assert found.residual == pytest.approx(residual(value), abs=1e-12 * np.abs(found.residual).max())
    wanted = difference(residual, value, 1e-4 * max(abs(value), 0.1))
    assert np.abs(found.parameter_derivative - wanted).max() < 1e-5 * np.abs(wanted).max()
    unchanged = FrequencySystem(balance, problem.with_parameter(name, value).inputs).evaluate(x, omega)
    assert np.allclose(found.jacobian.matrix, unchanged.jacobian.matrix, rtol=1e-12, atol=1e-12)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("change", [{"c0.mu": 0.0, "c1.mu": 0.0}, {"c0.kt": 0.0, "c2.kt": 0.0}, {"c1.kn": 0.0},
                                    {"c1.gap": 50.0, "c2.gap": 50.0}, {"*.velocity": 0.0}])  # fmt: skip
def test_degenerate_contacts_have_a_regular_jacobian(change: dict[str, float]) -> None:
    problem = random_problem(2)
    for name, value in change.items():
        problem = problem.with_parameter(name, value)
    balance = Balance(problem)
    system = FrequencySystem(balance, problem.inputs)
    for x in (np.zeros(balance.size), np.random.default_rng(0).standard_normal(balance.size)):
        found = system.evaluate(x, 6.0)
        assert np.all(np.isfinite(found.jacobian.matrix))
        assert np.all(np.isfinite(found.parameter_derivative))
        assert np.linalg.cond(found.jacobian.matrix) < 1e8
