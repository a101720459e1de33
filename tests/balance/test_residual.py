"""The residual of the balance and its derivatives, against differences and against a balance written out anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.parameters import parameter_path
from slipstick.balance.ports import Balance
from slipstick.balance.problem import Problem
from slipstick.balance.residual import detail
from slipstick.balance.systems import FrequencySystem, ParameterSystem

Array = np.ndarray


def structure(rng: np.random.Generator, n: int, loss: float = 0.02) -> ss.MatrixStructure:
    root = rng.standard_normal((n, n))
    K = 50.0 * (root @ root.T + n * np.eye(n))
    C = 0.3 * np.eye(n) + 0.002 * K
    C[0, 0] += 0.5  # not diagonal in the modes
    return ss.MatrixStructure(
        M=np.diag(rng.uniform(0.5, 2, n)), C=C, K=K, dofs=[f"d{i}" for i in range(n)], loss_factor=loss
    )


def random_problem(seed: int, *, harmonics: list[int] | None = None, period_ratio: tuple[int, int] = (1, 1)) -> Problem:
    """Three contacts: node to ground with constant load, node to node, node to ground with a normal direction."""
    rng = np.random.default_rng(seed)
    directions: list[tuple[dict[str, float], dict[str, float] | None]] = [
        ({"d0": 1.0}, None),
        ({"d1": 0.8, "d2": 0.6, "d3": -0.8, "d4": -0.6}, {"d1": -0.6, "d2": 0.8, "d3": 0.6, "d4": -0.8}),
        ({"d5": 1.0}, {"d4": 1.0}),
    ]
    pairs = [
        ss.ContactPair(
            name=f"c{i}",
            contact=ss.FrictionContact(
                kt=rng.uniform(50, 200), mu=rng.uniform(0.1, 0.6), kn=rng.uniform(50, 200), gap=gap
            ),
            tangential=t,
            normal=n,
            rubbing=ss.RubbingMotion(velocity=rng.uniform(-4, 4), cos={1: rng.uniform(0, 0.5)}),
        )
        for i, ((t, n), gap) in enumerate(zip(directions, (-0.5, -0.4, 0.1), strict=True))
    ]
    loads = [ss.Load(dof="d0", sin=80.0), ss.Load(dof="d4", cos=60.0), ss.Load(dof="d2", harmonic=0, cos=20.0)]
    kept = ss.Harmonics(harmonics or [0, 1, 2, 3, 5])
    return Problem(structure(rng, 6), contacts=pairs, loads=loads, harmonics=kept, period_ratio=period_ratio)


def difference(f, x: float | Array, step: float) -> Array:  # type: ignore[no-untyped-def]
    """Fourth-order central difference."""
    return (8 * (f(x + step) - f(x - step)) - (f(x + 2 * step) - f(x - 2 * step))) / (12 * step)


def port_forces(balance: Balance, x: Array, omega: float, problem: Problem) -> Array:
    """Forces at every port (n_ports, L): first the tangential ones, then those of contacts with a normal direction."""
    (response,) = detail(balance, x, omega, problem.inputs).responses
    return np.vstack([response.force[0], response.force[1][1:]])


CASES = [(seed, harmonics, ratio) for seed in range(3) for harmonics, ratio in
         (([0, 1, 2, 3, 5], (1, 1)), ([0, 2, 3, 4, 6], (2, 3)))]  # fmt: skip


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


@pytest.mark.parametrize("name", ["c1.velocity", "c0.mu", "c1.kt", "c2.kn", "c1.gap", "c1.normal_load", "*.mu", "load",
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


def test_residual_is_the_balance_of_the_full_matrices() -> None:
    """``X + A (F - P) = 0`` is the port form of ``Z q = p - D f``: checked for the matrices themselves."""
    problem = random_problem(4)
    balance, omega, h = Balance(problem), 5.0, problem.harmonics
    x = 0.3 * np.random.default_rng(1).standard_normal(balance.size)
    F = port_forces(balance, x, omega, problem)
    D, s = balance.directions, problem.structure
    q = np.zeros((len(s.dofs), h.size))
    load = np.zeros_like(q)
    for each in problem.loads:
        row = s.dofs.index(str(each.dof))
        load[row, h.index(each.harmonic, "c")] += each.cos
        if each.harmonic:
            load[row, h.index(each.harmonic, "s")] += each.sin
    rhs = load - D @ F
    q[:, 0] = np.linalg.solve(s.K, rhs[:, 0])
    for j, m in enumerate(h.orders[1:]):
        Z = s.K * (1 + 1j * s.loss_factor) - (m * omega) ** 2 * s.M + 1j * m * omega * s.C
        hat = np.linalg.solve(Z, rhs[:, 2 * j + 1] - 1j * rhs[:, 2 * j + 2])
        q[:, 2 * j + 1], q[:, 2 * j + 2] = hat.real, -hat.imag
    wanted = x.reshape(balance.n_ports, -1) - D.T @ q
    found = FrequencySystem(balance, problem.inputs).evaluate(x, omega).residual.reshape(wanted.shape)
    assert found == pytest.approx(wanted, abs=1e-11 * np.abs(wanted).max())


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


def test_zero_harmonic_alone_is_a_static_problem() -> None:
    problem = random_problem(0)
    pairs = [replace(pair, rubbing=ss.RubbingMotion(velocity=pair.rubbing.velocity)) for pair in problem.contacts]
    static = replace(
        problem, contacts=pairs, loads=[ss.Load(dof="d2", harmonic=0, cos=20.0)], harmonics=ss.Harmonics([0])
    )
    balance = Balance(static)
    found = FrequencySystem(balance, static.inputs).evaluate(np.zeros(balance.size), 3.0)
    F = port_forces(balance, np.zeros(balance.size), 3.0, static)[:, 0]
    A = balance.receptance.static
    wanted = A[:, :5] @ F - 20.0 * A[:, 5]
    assert found.residual == pytest.approx(wanted, rel=1e-12)
