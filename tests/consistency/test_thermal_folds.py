"""Curves over the folds where a thermal equilibrium ends: where they jump, between which temperatures, both ways."""

from __future__ import annotations

import re

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.analysis.curve.response import parameter_response
from slipstick.branch import Branch
from slipstick.errors import Outcome
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.model import ThermalModel

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")  # on purpose

Array = np.ndarray
BACKGROUND = 25.0
STEEP = FrictionCurve(temperature=[25, 200, 280, 300, 330, 360, 2000], mu=[0.1, 0.1, 0.1, 0.12, 0.35, 0.4, 0.4])
FALLING = FrictionCurve(temperature=[25, 94, 131, 279, 483, 1200], mu=[0.56, 0.31, 0.54, 0.3, 0.47, 0.32])


def oscillator(curve: FrictionCurve, load: float, velocity: float, resistance: float) -> ss.Problem:
    thermal = ThermalModel(curve=curve, background=BACKGROUND, resistance=resistance)
    return one_mass(damper(velocity, normal_load=load), thermal=thermal)


def jumps(branch: Branch) -> list[tuple[float, float, float]]:
    """(parameter, temperature before, after) of the first contact named at each jump, as the outcome says it."""
    text = branch.dataset.attrs["outcome_text"]
    found = re.findall(r"(?:at |, )([\d.]+)(?: rad/s)? \(temperature of \w+ from ([\d.]+) to ([\d.]+)", text)
    return [(float(p), float(a), float(b)) for p, a, b in found]


def folds(curve: FrictionCurve, load: float, resistance: float) -> tuple[Array, Array]:
    """In full slip ``T - T0 = R mu(T) N v``, so the velocity of an equilibrium is known over T: folds turn it."""
    T = np.linspace(curve.limits[0] + 1e-3, curve.limits[1], 400_001)
    return T, (T - BACKGROUND) / (resistance * load * curve.mu(T))


@pytest.mark.parametrize("up", [True, False])
def test_the_jump_is_at_the_fold_and_leads_to_the_next_equilibrium(up: bool) -> None:
    resistance, load = 0.012, 100.0
    problem = oscillator(STEEP, load, 1900.0, resistance)
    span = (1900.0, 2400.0) if up else (2400.0, 500.0)
    branch = parameter_response(problem, "damper.velocity", span, omega=6.0)
    assert branch.outcome is Outcome.COMPLETED
    T, v = folds(STEEP, load, resistance)
    inner = slice(*np.searchsorted(T, [260.0, 370.0]))
    at = inner.start + (np.argmax(v[inner]) if up else np.argmin(v[inner]))
    others = np.flatnonzero(np.diff(np.sign(v - v[at])))
    target = T[others[-1] if up else others[0]]
    [(where, before, after)] = jumps(branch)
    assert where == pytest.approx(v[at], rel=1e-5)
    assert before == pytest.approx(T[at], abs=0.1)
    assert after == pytest.approx(target, rel=1e-3)
    rise, power = branch.dataset["temperature"] - BACKGROUND, branch.dataset["dissipated_power"]
    np.testing.assert_allclose(rise, resistance * power, rtol=1e-9)


@pytest.mark.parametrize(
    ("curve", "load", "omega", "resistance", "span", "expected"),
    [
        (
            FrictionCurve(temperature=[25, 216, 229, 714, 1200], mu=[0.17, 0.12, 0.21, 0.37, 0.35]),
            800.0, 8.0, 0.026814665, (61.2, 114.3), (74.238, 216.2, 608.6),
        ),
        (FALLING, 800.0, 6.0, 0.014399158, (178.5, 66.8), (79.484, 417.2, 308.5)),
        (
            FrictionCurve(temperature=[25, 171, 273, 655, 708, 796, 1200], mu=[0.4, 0.6, 0.56, 0.46, 0.52, 0.2, 0.1]),
            300.0, 4.0, 0.0555409472, (37.6, 144.3), (82.597, 661.46, 719.63),
        ),
    ],
    ids=["warming", "cooling", "narrow"],
)  # fmt: skip
def test_partial_slip_goes_on_beyond_the_fold(
    curve: FrictionCurve, load: float, omega: float, resistance: float, span: tuple[float, float],
    expected: tuple[float, float, float],
) -> None:  # fmt: skip
    """The equilibria on both sides are those of the cold problem with the friction coefficient of each temperature."""
    branch = parameter_response(oscillator(curve, load, span[0], resistance), "damper.velocity", span, omega=omega)
    assert branch.outcome is Outcome.COMPLETED, branch.dataset.attrs["outcome_text"]
    [found] = jumps(branch)
    assert found == pytest.approx(expected, rel=1e-3)
    beyond = int(np.argmax(np.abs(np.diff(branch.dataset["temperature"][:, 0])))) + 1
    v, mu = float(branch.dataset["parameter"][beyond]), float(branch.dataset["friction_coefficient"][beyond, 0])
    cold = ss.Problem(
        branch.problem.structure, contacts=branch.problem.contacts, loads=branch.problem.loads, harmonics=range(4)
    )
    cold = cold.with_parameter("damper.velocity", v).with_parameter("damper.mu", mu)
    same = ss.forced_response(cold, omega=(omega, omega + 0.01))
    np.testing.assert_allclose(same.dataset["displacement"][0], branch.dataset["displacement"][beyond], atol=1e-7)


@pytest.mark.verify
def test_an_equilibrium_that_only_the_motion_keeps_stable_is_no_end() -> None:
    """Friction that rises with heat also lessens the motion: followed beyond where it is unstable at held motion."""
    curve = FrictionCurve(
        temperature=[25, 131, 356, 459, 581, 689, 736, 1200], mu=[0.17, 0.14, 0.55, 0.14, 0.47, 0.22, 0.25, 0.35]
    )
    problem = oscillator(curve, 300.0, 36.6, 0.29808960542)
    branch = parameter_response(problem, "damper.velocity", (36.646, 20.0), omega=6.0)
    assert branch.outcome is Outcome.COMPLETED, branch.dataset.attrs["outcome_text"]
    assert not jumps(branch)


def coupled(curves: dict[str, FrictionCurve], loads: Array, influence: Array) -> ss.Problem:
    n = len(curves)
    structure = ss.MatrixStructure(
        M=np.eye(n), C=0.4 * np.eye(n), K=60.0 * np.eye(n) - 10.0 * (np.eye(n, k=1) + np.eye(n, k=-1)),
        dofs=[f"x{i}" for i in range(n)],
    )  # fmt: skip
    pairs = [
        ss.ContactPair(
            name=name, contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-float(loads[i])), tangential=f"x{i}",
            rubbing=ss.RubbingMotion(velocity=300.0),
        )
        for i, name in enumerate(curves)
    ]  # fmt: skip
    return ss.Problem(
        structure, contacts=pairs, loads=[ss.Load(dof="x0", sin=50.0)], harmonics=range(3),
        thermal=ThermalModel(curve=curves, background=BACKGROUND, resistance=influence),
    )  # fmt: skip


@pytest.mark.parametrize(
    "span", [pytest.param((1300.0, 2600.0), marks=pytest.mark.verify), (2600.0, 700.0)], ids=["up", "down"]
)
def test_coupled_contacts_settle_where_the_body_settles(span: tuple[float, float]) -> None:
    """Three contacts that heat each other, in full slip: beyond each jump the end of ``dT/dt = T0 + R P - T``."""
    shift = [0.0, 60.0, 150.0]
    curves = {
        f"c{i}": FrictionCurve(temperature=[25, 200 + s, 230 + s, 3000], mu=[0.1, 0.1, 0.3, 0.3])
        for i, s in enumerate(shift)
    }
    loads = np.array([100.0, 110.0, 120.0])
    influence = 0.01 * np.array([[1.0, 0.15, 0.05], [0.15, 1.0, 0.15], [0.05, 0.15, 1.0]])
    branch = parameter_response(coupled(curves, loads, influence), "*.velocity", span, omega=6.0)
    assert branch.outcome is Outcome.COMPLETED
    assert jumps(branch)
    T, v = branch.dataset["temperature"].to_numpy(), branch.dataset["parameter"].to_numpy()

    def rate(velocity: float, at: Array) -> Array:
        mu = np.array([float(c.mu(np.clip(t, *c.limits))) for c, t in zip(curves.values(), at, strict=True)])
        return BACKGROUND + influence @ (mu * loads * velocity) - at

    assert max(np.abs(rate(w, at)).max() for w, at in zip(v, T, strict=True)) < 1e-8
    moved = np.abs(np.diff(T, axis=0)).max(axis=1)
    for k in np.flatnonzero(moved > 50.0):
        w = v[k + 1]
        body = solve_ivp(lambda t, at, w=w: rate(w, at), (0.0, 2e4), T[k], method="LSODA", rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(T[k + 1], body.y[:, -1], atol=1e-3)


@pytest.mark.parametrize(
    ("span", "where"),
    [((2.0, 15.0), 8.349), pytest.param((15.0, 2.0), 7.662, marks=pytest.mark.verify)],
    ids=["up", "down"],
)
def test_frequency_is_followed_over_folds(span: tuple[float, float], where: float) -> None:
    """Hot within the resonance: with rising friction it gets hot at another frequency than it cools down at."""
    curve = FrictionCurve(temperature=[25, 100, 150, 1200], mu=[0.2, 0.2, 0.5, 0.5])
    branch = ss.forced_response(oscillator(curve, 200.0, 10.0, 0.08), omega=span)
    assert branch.outcome is Outcome.COMPLETED, branch.dataset.attrs["outcome_text"]
    assert any(abs(place - where) < 2e-3 for place, _, _ in jumps(branch))
    T, omega = branch.dataset["temperature"].to_numpy()[:, 0], branch.dataset["omega"].to_numpy()
    assert T.max() > 140.0
    for place, before, after in jumps(branch):
        k = int(np.argmin(np.abs(omega[:-1] - place) + np.abs(T[:-1] - before)))
        assert T[k] == pytest.approx(before, rel=1e-3)
        assert abs(after - before) > 1.0


def test_a_fold_that_leads_out_of_the_table_says_both() -> None:
    short = FrictionCurve(temperature=[25, 200, 280, 300, 330, 360, 500], mu=[0.1, 0.1, 0.1, 0.12, 0.35, 0.4, 0.4])
    branch = parameter_response(oscillator(short, 100.0, 1900.0, 0.012), "damper.velocity", (1900.0, 2400.0), omega=6.0)
    assert branch.outcome is Outcome.OUTSIDE_TABLE
    said = branch.dataset.attrs["outcome_text"]
    assert re.search(r"the thermal equilibrium ends at 2\d+\.\d+ \(temperature of damper from 28\d.* to 10\d\d", said)
    assert "leaves its table, 25 to 500" in said
    assert float(branch.dataset["temperature"].max()) < 300.0
