"""Laws of the user's own in whole problems: a Duffing oscillator, two laws at once, many contacts in one object."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.results import corrected

import slipstick as ss
from slipstick.verify.cases import oscillator


def duffing(*, k3: float = 1.0, c: float = 0.02, load: float = 0.02, harmonics=(0, 1)) -> ss.Problem:
    """``x'' + c x' + x + k3 x^3 = load sin``."""
    spring = ss.SampledLaw(force=lambda x, velocity, k3: k3 * x**3, parameters={"k3": k3})
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[c]], K=[[1.0]], dofs=["mass"]),
        contacts=[ss.ContactPair(name="spring", contact=spring, ports={"x": "mass"})],
        loads=[ss.Load(dof="mass", sin=load)],
        harmonics=ss.Harmonics(harmonics),
    )


def one_term(a: np.ndarray, c: float, load: float) -> np.ndarray:
    """The two frequencies at which one harmonic of amplitude ``a`` balances, squared: of the upper and lower branch."""
    backbone = 1.0 + 0.75 * a**2
    # (backbone - w2)^2 + c^2 w2 = (load/a)^2
    b = backbone - 0.5 * c**2
    root = np.sqrt(np.maximum(b**2 - backbone**2 + (load / a) ** 2, 0.0))
    return np.array([b - root, b + root])


def test_duffing_with_one_harmonic_is_the_closed_one_term_solution() -> None:
    """Backbone ``w^2 = 1 + 3/4 a^2``, the curve, its peak and its fold points."""
    c, load = 0.02, 0.02
    branch = ss.forced_response(duffing(c=c, load=load), omega=(0.7, 1.6))
    assert branch.outcome.ok
    solved = corrected(branch.dataset)
    a, w = solved.amplitude.values[:, 0], solved.omega.values
    assert np.abs(one_term(a, c, load) - w**2).min(axis=0).max() < 2e-8
    (peak,) = branch.peaks("mass")
    # at the peak the root vanishes: load^2 = a^2 c^2 (1 + 3/4 a^2 - c^2/4)
    assert peak[1] ** 2 * c**2 * (1 + 0.75 * peak[1] ** 2 - 0.25 * c**2) == pytest.approx(load**2, rel=1e-8)
    folds = branch.dataset.omega.values[branch.dataset.kind.values == "turning point"]
    # both folds lie beyond the peak, where the larger frequency of an amplitude has its extremes
    grid = np.linspace(0.02, peak[1], 400_000)
    beyond = np.sqrt(one_term(grid, c, load)[1])
    assert folds.max() == pytest.approx(beyond[grid > 0.25].max(), rel=1e-8)
    assert folds.min() == pytest.approx(beyond.min(), rel=1e-8)


def test_duffing_backbone_with_many_harmonics() -> None:
    """Free vibration of ``x'' + x + x^3 = 0``: period by an elliptic integral; the light peak lies on it."""
    from scipy.special import ellipk

    branch = ss.forced_response(duffing(c=2e-4, load=2e-4, harmonics=range(12)), omega=(0.9, 1.4))
    ((omega, a),) = branch.peaks("mass")
    m = a**2 / (2 * (1 + a**2))
    exact = np.pi * np.sqrt(1 + a**2) / (2 * ellipk(m))
    assert a > 0.5
    assert omega == pytest.approx(exact, rel=1e-7)


def test_a_parameter_of_the_own_law_is_followed() -> None:
    branch = ss.parameter_response(duffing(c=0.2), "spring.k3", (0.0, 5.0), omega=1.2)
    assert branch.outcome.ok
    assert branch.dataset.k3.values[:, 0] == pytest.approx(branch.dataset.parameter.values)
    a, k3 = branch.dataset.amplitude.values[:, 0], branch.dataset.parameter.values
    assert np.hypot(1 + 0.75 * k3 * a**2 - 1.44, 0.2 * 1.2) * a == pytest.approx(0.02, rel=1e-8)


def test_two_laws_at_once() -> None:
    """A damper and a cubic spring on one mass; without its stiffness the spring changes nothing."""
    plain = oscillator(velocity=10.0)
    spring = ss.SampledLaw(force=lambda x, velocity, k3: k3 * x**3, parameters={"k3": 0.0})
    pair = ss.ContactPair(name="spring", contact=spring, ports={"x": "x"})
    both = ss.Problem(plain.structure, contacts=[pair, *plain.contacts], loads=plain.loads, harmonics=plain.harmonics)
    wanted = ss.forced_response(plain, omega=(2.0, 15.0)).peaks("x")
    found = ss.forced_response(both, omega=(2.0, 15.0))
    assert found.peaks("x") == [pytest.approx(peak, rel=1e-8) for peak in wanted]
    assert found.dataset.contact.values.tolist() == ["spring", "damper"]
    assert np.isnan(found.dataset.stick_fraction.sel(contact="spring").values).all()
    assert (found.dataset.dissipated_power.sel(contact="damper").values > 0).all()
    stiff = both.with_parameter("spring.k3", 5.0)
    assert ss.forced_response(stiff, omega=(2.0, 15.0)).peaks("x") != found.peaks("x")


def chain(n: int, *, grouped: bool) -> ss.Problem:
    """n masses, each with a rubbing contact of its own numbers; as one object or as many."""
    rng = np.random.default_rng(1)
    K = 40.0 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)) + 10.0 * np.eye(n)
    dofs = [f"x{i}" for i in range(n)]
    structure = ss.MatrixStructure(M=np.eye(n), C=0.01 * K, K=K, dofs=dofs)
    mu, load, velocity = rng.uniform(0.2, 0.4, n), rng.uniform(5, 20, n), rng.uniform(0, 2, n)
    if grouped:
        contact = ss.FrictionContact(kt=100.0, mu=mu, kn=1.0, gap=-load)
        pairs = [
            ss.ContactPair(name="rub", contact=contact, tangential=dofs, rubbing=ss.RubbingMotion(velocity=velocity))
        ]
    else:
        pairs = [
            ss.ContactPair(
                name=f"rub.{i + 1}", contact=ss.FrictionContact(kt=100.0, mu=mu[i], kn=1.0, gap=-load[i]),
                tangential=dofs[i], rubbing=ss.RubbingMotion(velocity=velocity[i]),
            )
            for i in range(n)
        ]  # fmt: skip
    return ss.Problem(structure, contacts=pairs, loads=[ss.Load(dof="x0", sin=30.0)], harmonics=range(6))


def test_many_contacts_in_one_object_are_many_contacts() -> None:
    many, one = chain(6, grouped=False), chain(6, grouped=True)
    assert one.elements == many.elements
    a, b = (ss.forced_response(p, omega=(2.0, 8.0)).dataset for p in (many, one))
    assert np.array_equal(a.displacement.values, b.displacement.values)
    assert a.contact.values.tolist() == b.contact.values.tolist()
    assert one.with_parameter("rub.3.mu", 0.7).contact_values("mu")[2] == 0.7
    assert one.with_parameter("rub.mu", 0.7).contact_values("mu").tolist() == [0.7] * 6
    assert one.parameter("*.velocity") == pytest.approx(many.parameter("*.velocity"))


def test_many_contacts_in_one_object_are_checked_in_time() -> None:
    branch = ss.forced_response(chain(3, grouped=True), omega=(3.0, 6.0))
    check = branch.check_in_time(len(branch) // 2)
    assert check.converged
    assert check.relative_difference < 5e-3
    found = ss.transient(branch.problem, 4.0)
    assert found.contacts == ("rub.1", "rub.2", "rub.3")


def test_faults_of_ports_are_named() -> None:
    structure = ss.MatrixStructure(M=[[1.0]], K=[[1.0]], dofs=["x"])
    law = ss.SampledLaw(force=lambda x, v: x**3)
    with raises_fault("contact", "s", "ports", "x", statement="has no direction"):
        ss.Problem(structure, contacts=[ss.ContactPair(name="s", contact=law)])
    with raises_fault("contact", "s", "tangential", says="its law has no port 'tangential'"):
        ss.Problem(structure, contacts=[ss.ContactPair(name="s", contact=law, tangential="x", ports={"x": "x"})])


@pytest.mark.parametrize("name", ["k", "self", "name", "omega", "amplitude", "point", "dof"])
def test_parameters_of_any_name_can_be_followed(name):
    def force(q, velocity, **given):
        return given[name] * q**3

    law = ss.SampledLaw(force=force, parameters={name: 1.0})
    problem = ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.2]], K=[[1.0]], dofs=["x"]),
        contacts=[ss.ContactPair(name="own", contact=law, ports={"x": "x"})],
        loads=[ss.Load(dof="x", sin=0.1)], harmonics=[0, 1, 3],
    )  # fmt: skip
    branch = ss.parameter_response(problem, f"own.{name}", (1.0, 2.0), omega=0.8)
    there = ss.forced_response(problem.with_parameter(f"own.{name}", 2.0), omega=(0.8, 0.81))
    np.testing.assert_allclose(branch.dataset.amplitude[-1], there.dataset.amplitude[0], rtol=1e-9)
    stored = f"law_{name}" if name in ("omega", "amplitude", "point", "dof") else name
    assert branch.dataset[stored].values[-1] == 2.0


@pytest.mark.parametrize("name", ["velocity", "motion", "cos1", "normal_sin2", "load"])
def test_parameters_that_mean_something_else_are_refused(name):
    law = ss.SampledLaw(force=lambda *motion, **given: motion[0], parameters={name: 1.0})
    pair = ss.ContactPair(name="own", contact=law, ports={"x": "x"})
    with raises_fault("contact", "own", "contact", says=f"its law has a parameter called '{name}'"):
        ss.Problem(
            ss.MatrixStructure(M=[[1.0]], C=[[0.2]], K=[[1.0]], dofs=["x"]), contacts=[pair],
            loads=[ss.Load(dof="x", sin=0.1)],
        )  # fmt: skip
