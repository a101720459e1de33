"""Laws given as a function of time: forces against closed forms, every derivative against central differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.oscillator import with_law

import slipstick as ss
from slipstick.balance.physics_checks import problem_warnings
from slipstick.contact.law import Law, Motion

Array = np.ndarray
H = ss.Harmonics([0, 1, 2, 5])
N = 4


def two_ports(q, velocity, k, c):
    """Coupled in motion and velocity, smooth: a toy bearing."""
    x, y = q
    u, w = velocity
    return k * x * (1 + y**2) + c * u * x**2, k * np.sin(y) + c * w + 0.3 * x * w


LAWS = {
    "one port": ss.SampledLaw(force=lambda x, v, k, c: k * x**3 + c * v * x**2 + np.sinh(0.1 * v),
                              parameters={"k": 0.5, "c": 0.2}),
    "two ports": ss.SampledLaw(force=two_ports, parameters={"k": 0.5, "c": 0.2}, ports=("x", "y")),
}  # fmt: skip


def state(law: ss.SampledLaw, seed: int) -> tuple[list[Array], Array, float, dict[str, Array]]:
    rng = np.random.default_rng(seed)
    Q = [rng.normal(size=(N, H.size)) for _ in law.ports]
    values = {name: rng.uniform(0.2, 1.0, N) for name in law.values}
    return Q, rng.normal(size=(len(law.ports), N)), 1.7, values


def respond(law: ss.SampledLaw, Q: list[Array], drift: Array, omega: float, values: dict[str, Array]):
    return law.respond(Motion(H, omega, tuple(Q), drift), values)


def central(force, h: float = 1e-4) -> list[Array]:
    at = {k: force(k * h) for k in (-2, -1, 1, 2)}
    return [(8 * (b - a) - (d - c)) / (12 * h) for c, a, b, d in zip(at[-2], at[-1], at[1], at[2], strict=True)]


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("seed", range(3))
def test_every_derivative(name: str, seed: int) -> None:
    law = LAWS[name]
    Q, drift, omega, values = state(law, seed)
    at = respond(law, Q, drift, omega, values)
    size = max(np.abs(tangent).max() for tangent in at.by_motion.values())
    for j in range(len(law.ports)):
        for k in range(H.size):
            unit = np.eye(H.size)[k]

            def moved(h: float, j: int = j, unit: Array = unit):
                return respond(law, [q + h * unit * (i == j) for i, q in enumerate(Q)], drift, omega, values).force

            for i, wanted in enumerate(central(moved)):
                assert np.abs(at.by_motion[i, j][:, :, k] - wanted).max() < 1e-8 * size
        step = np.zeros_like(drift)
        step[j] = 1.0
        for i, wanted in enumerate(central(lambda h, s=step: respond(law, Q, drift + h * s, omega, values).force)):
            assert np.abs(at.by_drift[i, j] - wanted).max() < 1e-8 * size
    for i, wanted in enumerate(central(lambda h: respond(law, Q, drift, omega + h, values).force)):
        assert np.abs(at.by_omega[i] - wanted).max() < 1e-8 * size
    for p in values:
        own = at.by_parameter(p)

        def changed(h: float, p: str = p):
            return respond(law, Q, drift, omega, {**values, p: values[p] + h}).force

        for i, wanted in enumerate(central(changed)):
            assert np.abs(own[i] - wanted).max() < 1e-8 * size


def test_cubic_spring_in_closed_form() -> None:
    """``k3 x^3`` of ``a cos``: ``3/4 k3 a^3`` on harmonic 1, ``1/4 k3 a^3`` on harmonic 3; no work."""
    law = ss.SampledLaw(force=lambda x, v, k3: k3 * x**3, parameters={"k3": 0.8})
    h = ss.Harmonics([0, 1, 3])
    X = np.array([[0.0, 1.5, 0.0, 0.0, 0.0]])
    found = law.respond(Motion(h, 3.0, (X,), np.zeros((1, 1))), {"k3": np.array([0.8])})
    cube = 0.8 * 1.5**3
    assert found.force[0][0] == pytest.approx([0.0, 0.75 * cube, 0.0, 0.25 * cube, 0.0], abs=1e-14)
    assert found.work == pytest.approx([0.0], abs=1e-14)


def test_dashpot_dissipates_what_it_should() -> None:
    """``c x'`` of ``a sin``: power ``c a^2 omega^2 / 2``, and with a drift ``v`` that of ``c v^2`` besides."""
    law = ss.SampledLaw(force=lambda x, v, c: c * v, parameters={"c": 0.4})
    X = np.array([[0.0, 0.0, 2.0]])
    found = law.respond(Motion(ss.Harmonics([0, 1]), 3.0, (X,), np.full((1, 1), 0.5)), {"c": np.array([0.4])})
    assert 3.0 * found.work == pytest.approx([0.4 * 9.0 * (4.0 / 2 + 0.25)], rel=1e-14)


def test_is_a_law_and_refuses_nonsense() -> None:
    assert isinstance(LAWS["one port"], Law)
    assert isinstance(ss.FrictionContact(kt=1.0, mu=0.3, kn=1.0, gap=-1.0), Law)
    with raises_fault("law parameter k", found="nan"):
        ss.SampledLaw(force=lambda x, v, k: k * x, parameters={"k": np.nan})
    with raises_fault("law samples", found="1"):
        ss.SampledLaw(force=lambda x, v: x, samples=1)


@pytest.mark.parametrize(
    "force", [lambda x, v: np.abs(x) * x, lambda x, v: np.real(x) ** 3, lambda x, v: np.abs(v) * v]
)
def test_a_function_that_is_not_analytic_is_told(force) -> None:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[1.0]], dofs=["x"])
    pair = ss.ContactPair(name="s", contact=ss.SampledLaw(force=force), ports={"x": "x"})
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=1.0)])
    assert "'s': the derivative of its law by complex steps is not the slope" in "".join(problem_warnings(problem))


def test_too_few_samples_are_refused() -> None:
    law = ss.SampledLaw(force=lambda x, v: x**3, samples=8)
    motion = Motion(ss.Harmonics(range(8)), 1.0, (np.zeros((1, 15)),), np.zeros((1, 1)))
    with pytest.raises(ss.InputError, match="found 8 with harmonics up to 7; expected at least 29"):
        law.respond(motion, {})


@pytest.mark.parametrize(
    "force, said",
    [
        (lambda q, velocity, k: "a", "returned 'a'; expected arrays of numbers"),
        (lambda q, velocity, k: None, "returned None; expected arrays of numbers"),
        (lambda q, velocity, k: np.array(["a"] * q.size), "expected arrays of numbers"),
        (lambda q, velocity, k: np.ones(3), r"returned shapes \[\(3,\)\] for motions of shape \(4,\)"),
        (lambda q, velocity, k: k * q * np.nan, "not a finite number at any motion that was tried"),
        (lambda q, velocity, k: np.full(q.shape, np.inf), "not a finite number at any motion that was tried"),
    ],
)
def test_a_force_that_is_no_number_is_told_in_one_sentence(force: Any, said: str) -> None:
    problem = with_law(ss.SampledLaw(force=force, parameters={"k": 1.0}), name="a")
    with pytest.raises(ss.InputError, match=said) as caught:
        ss.forced_response(problem, omega=(1.0, 2.0))
    assert len(caught.value.sentences) == 1
