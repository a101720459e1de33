from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import difference, random_problem

import slipstick as ss
from slipstick.analysis.sensitivity.linearization import FREQUENCY, Linearization, Move
from slipstick.balance.balance import Balance
from slipstick.balance.parameters import parameter_path
from slipstick.balance.states import at_states, power_along
from slipstick.results.record import Outputs

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

OMEGA = 6.0
rng = np.random.default_rng(1)


def setting(dof: str, heat: bool = False, anchored: bool = False):
    problem = random_problem(1)
    if heat:
        curve = ss.FrictionCurve(temperature=[0.0, 400.0], mu=[0.5, 0.3], kt=[150.0, 100.0])
        problem = ss.Problem(
            problem.structure, contacts=problem.contacts, loads=problem.loads, harmonics=problem.harmonics,
            thermal=ss.ThermalModel(curve=curve, background=20.0, resistance=1e-2),
        )  # fmt: skip
    outputs = Outputs(Balance(problem), (dof,))
    if anchored:
        outputs.balance.springs = np.linspace(1.0, 2.0, outputs.balance.n_ports)
    return problem, outputs, 0.3 * rng.standard_normal(outputs.balance.size)


CASES = [("d0", False, False), ("d3", False, False), ("d3", True, False), ("d3", False, True)]


@pytest.mark.parametrize(("dof", "heat", "anchored"), CASES)
def test_changes_are_those_of_differences(dof, heat, anchored):
    """Along the motion, the frequency and parameters of contacts, loads, structure; d0 is a port and d3 none."""
    problem, outputs, x = setting(dof, heat, anchored)
    here = Linearization(outputs, x, OMEGA, problem.inputs)
    still, dx = np.zeros_like(x), rng.standard_normal(x.size)

    def both(at: Linearization) -> np.ndarray:
        return np.concatenate([at.at.residual, at.motion()[0]])

    def close(change, function, at, step):
        expected = difference(function, at, step)
        assert np.abs(np.concatenate([change[0], change[1][0]]) - expected).max() <= 1e-6 * np.abs(expected).max()

    close(here.change(dx), lambda e: both(Linearization(outputs, x + e * dx, OMEGA, problem.inputs)), 0.0, 1e-5)
    close(here.change(still, FREQUENCY), lambda w: both(Linearization(outputs, x, w, problem.inputs)), OMEGA, 1e-4)
    for name in ("c1.kn", "c2.velocity", "load.d4.phase", "friction", "damping", "loss_factor"):
        path, value = parameter_path(problem, name), problem.parameter(name)
        direction = Move(inputs=path.at(value)[1])
        close(
            here.change(still, direction),
            lambda p, path=path: both(Linearization(outputs, x, OMEGA, path.at(p)[0])), value, 1e-5,
        )  # fmt: skip


@pytest.mark.parametrize(("dof", "heat", "anchored"), CASES)
def test_pulling_is_the_transpose_of_changing(dof, heat, anchored):
    problem, outputs, x = setting(dof, heat, anchored)
    here = Linearization(outputs, x, OMEGA, problem.inputs)
    dx, z, h = rng.standard_normal(x.size), rng.standard_normal(x.size), rng.standard_normal((1, outputs.balance.L))
    dR, dU = here.change(dx)
    assert here.pull(h, z) @ dx == pytest.approx(float(z @ dR + np.sum(h * dU)), rel=1e-12)
    for name in ("c1.kn", "load.d4.amplitude"):
        direction = Move(inputs=parameter_path(problem, name).at(problem.parameter(name))[1])
        dR, dU = here.change(np.zeros_like(x), direction)
        pulled = np.sum((here.columns_pulled(h, z).conj() * here.pushed(direction)).real)
        assert pulled == pytest.approx(float(z @ dR + np.sum(h * dU)), rel=1e-12)


@pytest.mark.parametrize("heat", [False, True])
def test_powers(heat):
    """Gradient over the motion at fixed temperature, by differences of a cold problem."""
    problem, outputs, x = setting("d0", heat)
    here = Linearization(outputs, x, OMEGA, problem.inputs)
    ((own,), dx) = here.powers(), rng.standard_normal(x.size)
    weights = rng.uniform(1.0, 2.0, 3)
    hot = problem.inputs.with_batch(0, **here.detail.responses[0].values)
    cold = Outputs(Balance(random_problem(1)), ("d0",))

    def power(e: float) -> float:
        return float(weights @ Linearization(cold, x + e * dx, OMEGA, hot).powers()[0].power.value)

    assert here.power_pulled(own, weights) @ dx == pytest.approx(difference(power, 0.0, 1e-5), rel=1e-6)
    by_omega = difference(
        lambda w: float(weights @ Linearization(cold, x, w, hot).powers()[0].power.value), OMEGA, 1e-4
    )
    assert weights @ own.power.omega == pytest.approx(by_omega, rel=1e-6)


@pytest.mark.parametrize(("dof", "heat", "anchored"), CASES)
def test_the_gradient_over_the_inputs_is_the_transpose_of_pushing(dof, heat, anchored):
    """Of numbers on all forces, and of weighted powers at fixed states besides, along every kind of parameter."""
    problem, outputs, x = setting(dof, heat, anchored)
    here = Linearization(outputs, x, OMEGA, problem.inputs)
    pairs = rng.standard_normal(
        (outputs.balance.n_ports + outputs.balance.n_loads, 2 * outputs.balance.orders.size + 2)
    )
    pairs[:, 1], weights, (powered,) = 0.0, rng.uniform(1.0, 2.0, 3), here.powers()
    psi = np.ascontiguousarray(pairs).view(complex)
    every = {(0, name) for name in ("velocity", "velocity_per_omega", "motion", *problem.inputs.batches[0].values)}
    gradient = here.inputs_pulled(psi, [(powered, weights)], every)
    for name in ("c1.kn", "c2.velocity", "c0.normal_load", "load.d4.phase", "friction", "load"):
        direction = parameter_path(problem, name).at(problem.parameter(name))[1]
        products = direction.map(lambda _, along, slope: along * slope, gradient)
        along = sum(float(array.sum()) for array in arrays_of(products))
        dpower = power_along(powered, at_states(here.detail.states, direction))
        expected = float(np.sum((psi.conj() * here.pushed(Move(inputs=direction))).real) + weights @ dpower)
        assert along == pytest.approx(expected, rel=1e-10), name


def arrays_of(inputs):
    for batch in inputs.batches:
        yield from (*batch.values.values(), batch.velocity, batch.velocity_per_omega, batch.motion)
    yield inputs.P
