"""The balance with contacts heated by their own friction: derivatives, closed form, convergence of Newton."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass
from helpers.problems import first_point

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.contacts import ContactPair
from slipstick.balance.evaluation import FrequencySystem, ParameterSystem
from slipstick.balance.loads import Load
from slipstick.balance.parameters import parameter_path
from slipstick.balance.problem import Problem
from slipstick.balance.states import pairs_at_start, state_faults
from slipstick.contact.friction import FrictionContact
from slipstick.contact.rubbing import RubbingMotion
from slipstick.errors import InputError
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.model import ThermalModel
from slipstick.structure.matrices import MatrixStructure
from slipstick.trig.harmonics import Harmonics

Array = np.ndarray
FALLING = FrictionCurve(
    temperature=[20, 100, 300, 2000, 20000],
    mu=[0.50, 0.45, 0.33, 0.2, 0.1],
    kt=[120.0, 115.0, 90.0, 60.0, 50.0],
)
WITH_KN = FrictionCurve(
    temperature=[20, 100, 300, 2000, 20000],
    mu=[0.50, 0.45, 0.33, 0.2, 0.1],
    kn=[50.0, 48.0, 40.0, 30.0, 30.0],
)
INFLUENCE = np.array([[0.05, 0.02], [0.02, 0.06]])


def two_contacts(thermal: ThermalModel | None, velocity: float = 6.0) -> Problem:
    """A chain of two masses with a tangential contact on each; the second one has a normal direction too."""
    structure = MatrixStructure(
        M=np.eye(3),
        C=0.4 * np.eye(3),
        K=np.array([[60.0, -20.0, 0.0], [-20.0, 50.0, 3.0], [0.0, 3.0, 400.0]]),
        dofs=["x1", "x2", "y2"],
    )
    rub = RubbingMotion(velocity=velocity, cos={1: 0.3})
    pairs = [
        ContactPair(
            name="a", contact=FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-80.0), tangential="x1", rubbing=rub
        ),
        ContactPair(
            name="b", contact=FrictionContact(kt=80.0, mu=0.3, kn=50.0, gap=-1.0), tangential="x2", normal="y2",
            rubbing=rub,
        ),
    ]  # fmt: skip
    loads = [Load(dof="x1", sin=60.0), Load(dof="y2", cos=150.0)]
    return Problem(structure, contacts=pairs, loads=loads, harmonics=Harmonics(range(5)), thermal=thermal)


def coupled(factor: float = 1.0) -> ThermalModel:
    return ThermalModel(curve={"a": FALLING, "b": WITH_KN}, background=25.0, resistance=factor * INFLUENCE)


def difference(function: Any, h: float) -> Array:
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


def assert_difference(exact: Array, function: Any, size: float) -> None:
    """The best of three steps: a state may change inside one."""
    errors = [np.abs(difference(function, size * h) - exact).max() for h in (1e-4, 1e-5, 1e-6)]
    assert min(errors) < 3e-6 * (np.abs(exact).max() + 1e-3), errors


def random_state(balance: Balance, seed: int) -> Array:
    return 0.8 * np.random.default_rng(seed).normal(size=balance.size)


@pytest.mark.parametrize("seed", range(6))
def test_jacobian_and_frequency_derivative(seed: int) -> None:
    problem = two_contacts(coupled())
    balance, inputs = Balance(problem), problem.inputs
    system, x, omega = FrequencySystem(balance, inputs), random_state(balance, seed), 5.3
    warm = system.evaluate(x, omega).context
    at = system.evaluate(x, omega, warm)
    assert at.detail.states[0].values.max() > 40.0
    for k in range(balance.size):
        unit = np.eye(balance.size)[k]
        assert_difference(
            at.jacobian.matrix[:, k], lambda h, u=unit: system.evaluate(x + h * u, omega, warm).residual, 1.0
        )
    assert_difference(at.parameter_derivative, lambda h: system.evaluate(x, omega + h, warm).residual, omega)


@pytest.mark.parametrize(
    "name", ["friction", "load", "a.velocity", "*.velocity", "b.gap", "a.normal_load", "b.kt", "a.kn"]
)
def test_parameter_derivatives(name: str) -> None:
    problem = two_contacts(coupled())
    balance = Balance(problem)
    system, x = ParameterSystem(balance, parameter_path(problem, name), 5.3), random_state(balance, 1)
    value = problem.parameter(name)
    warm = system.evaluate(x, value).context
    at = system.evaluate(x, value, warm)
    exact = at.parameter_derivative
    assert_difference(exact, lambda h: system.evaluate(x, value + h, warm).residual, abs(value))
    np.testing.assert_allclose(at.residual, FrequencySystem(balance, problem.inputs).evaluate(x, 5.3).residual)


def test_a_tabulated_parameter_cannot_be_followed() -> None:
    problem = two_contacts(coupled())
    with pytest.raises(InputError, match=r"a\.mu follows the temperature by its table; use the factor 'friction'"):
        problem.with_parameter("a.mu", 0.2)
    assert problem.with_parameter("b.kt", 70.0).parameter("b.kt") == 70.0


def test_cold_parameters_are_those_of_the_curves() -> None:
    problem = two_contacts(coupled())
    assert problem.contacts[0].values("mu") == pytest.approx(float(FALLING.mu(25.0)))
    assert problem.contacts[0].values("kt") == pytest.approx(float(FALLING.kt(25.0)))
    assert problem.contacts[1].values("kn") == pytest.approx(float(WITH_KN.kn(25.0)))
    assert problem.contacts[1].values("kt") == 80.0


@pytest.mark.parametrize("omega", [3.0, 5.5, 7.5])
def test_newton_is_quadratic(omega: float) -> None:
    """From a disturbed solution each correction is about the square of the one before, down to the temperature's."""
    problem = two_contacts(coupled(10.0))
    x = first_point(problem, omega)
    assert x is not None
    balance = Balance(problem)
    system = FrequencySystem(balance, problem.inputs)
    warm = system.evaluate(x, omega).context
    start = x * (1 + 1e-3 * np.random.default_rng(2).normal(size=x.size))
    sizes = []
    for _ in range(6):
        at = system.evaluate(start, omega, warm)
        step = at.jacobian.solve(-at.residual)
        sizes.append(np.linalg.norm(step) / np.linalg.norm(x))
        start = start + step
    assert sizes[0] > 1e-4
    quadratic = [b / a**2 for a, b in pairwise(sizes) if b > 1e-11]  # below: tolerance 1e-12 of the temperatures
    assert quadratic, sizes
    assert max(quadratic) < 50.0, sizes
    assert max(sizes[2:]) < 1e-11, sizes


def test_frozen_parameters_lose_quadratic_convergence() -> None:
    """Without the heat's part of the tangent the same iteration is linear, so that part is not decoration."""
    problem, omega = two_contacts(coupled(10.0)), 5.5
    x = first_point(problem, omega)
    assert x is not None
    balance, inputs = Balance(problem), problem.inputs
    system, compliance = FrequencySystem(balance, inputs), balance.compliance(omega)
    warm = system.evaluate(x, omega).context
    start, sizes = x * 1.001, []
    for _ in range(6):
        at = system.evaluate(start, omega, warm)
        tangents = [response.by_motion for response in at.detail.responses]
        step = balance.jacobian(tangents, compliance).solve(-at.residual)
        sizes.append(np.linalg.norm(step) / np.linalg.norm(x))
        start = start + step
    assert sizes[3] > 1e-8, sizes


def oscillator(velocity: float, resistance: float) -> Problem:
    """The oscillator of the published study with a falling mu(T)."""
    curve = FrictionCurve(temperature=[25, 200, 400, 800, 1200, 3000], mu=[0.3, 0.27, 0.23, 0.18, 0.15, 0.1])
    thermal = ThermalModel(curve=curve, background=25.0, resistance=resistance)
    return one_mass(damper(velocity), harmonics=range(11), thermal=thermal)


def test_permanent_slip_of_the_oscillator() -> None:
    """v = 260 > p/c: no stick, T - T0 = R mu(T) N v, mean -mu(T) N/k, dynamic part as without contact."""
    problem, omega = oscillator(260.0, 0.01), 6.0
    x = first_point(problem, omega)
    assert x is not None
    balance = Balance(problem)
    heat = FrequencySystem(balance, problem.inputs).evaluate(x, omega).detail.states[0]
    T, mu = heat.values[0], heat.response.values["mu"][0]
    curve = problem.thermal.curve
    assert T > 200.0
    assert mu == pytest.approx(float(curve.mu(T)), rel=1e-14)
    rise = T - 25.0
    assert rise == pytest.approx(0.01 * mu * 800.0 * 260.0, rel=1e-11)
    assert x[0] == pytest.approx(-mu * 800.0 / 40.0, rel=1e-11)
    free = 100.0 / (40.0 - omega**2 + 0.4j * omega)  # of sin: s part is Re, c part is Im
    np.testing.assert_allclose(x[1:3], [free.imag, free.real], rtol=1e-10)


def test_heat_off_is_the_plain_problem() -> None:
    hot, plain = oscillator(10.0, 0.0), oscillator(10.0, 0.0)
    object.__setattr__(plain, "thermal", None)
    object.__setattr__(plain, "contact_states", ())
    a, b = first_point(hot, 4.25), first_point(plain, 4.25)
    assert a is not None
    assert b is not None
    np.testing.assert_allclose(a, b, atol=1e-9)


def test_constant_normal_load_refuses_a_table_of_kn() -> None:
    with raises_fault("contact", "a", says="kn depends on temperature"):
        two_contacts(ThermalModel(curve=WITH_KN, background=25.0, resistance=1.0))


def test_faults_of_the_thermal_model_come_with_the_others() -> None:
    with raises_fault("thermal", "background", says="10 of contact a lies outside its table"):
        two_contacts(ThermalModel(curve=FALLING, background=10.0, resistance=1.0))


def test_newton_solver_converges_from_the_cold_solution() -> None:
    """The whole damped iteration, from the solution without heat."""
    cold, hot = two_contacts(None), two_contacts(coupled())
    x = first_point(cold, 5.5)
    system = FrequencySystem(Balance(hot), hot.inputs)
    result = newton(lambda z: system.evaluate(z, 5.5), x, options=NewtonOptions(), scale=float(np.linalg.norm(x)))
    assert result.converged
    assert result.iterations <= 12


CURVE = {"temperature": [20.0, 100.0], "mu": [0.5, 0.3], "kn": [2.0, 1.0]}


def heated_pair(normal="y", **curve):
    K = [[40.0, 0.0], [0.0, 60.0]]
    structure = ss.MatrixStructure(M=[[1.0, 0.0], [0.0, 1.0]], C=[[0.1, 0.0], [0.0, 0.1]], K=K, dofs=["x", "y"])
    contact = ss.FrictionContact(kt=1.0, mu=0.1, kn=1.0, gap=-1.0)
    pairs = [
        ss.ContactPair(name="hot", contact=contact, tangential="x", normal=normal),
        ss.ContactPair(name="other", contact=contact, tangential="y"),
    ]
    thermal = ss.ThermalModel(
        curve={"hot": ss.FrictionCurve(**(CURVE | curve))}, background=60.0, resistance={"hot": 1.0}
    )
    return ss.Problem(structure, contacts=pairs, loads=[ss.Load(dof="x", sin=1.0)], harmonics=range(6), thermal=thermal)


def test_cold_values_are_those_of_the_curves_at_the_background():
    p = heated_pair()
    [heated] = p.contact_states
    hot, other = pairs_at_start(p.contacts, p.batches[heated.batch], heated)
    assert float(hot.contact.mu) == pytest.approx(0.4)
    assert float(hot.contact.kn) == pytest.approx(1.5)
    assert float(hot.contact.kt) == 1.0
    assert other == p.contacts[1]


def test_a_constant_load_does_not_follow_a_stiffness():
    p = heated_pair()
    assert not list(state_faults(p.contacts, p.batches, p.contact_states))
    with raises_fault("contact", "hot", says="kn depends on temperature"):
        ss.forced_response(heated_pair(normal=None), omega=(2.0, 3.0))
