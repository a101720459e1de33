"""Derivatives of all coefficients of a motion, held against solutions found again with a parameter moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.counting import calls_of
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.analysis.sensitivity.linearization import Linearization
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.results.record import Outputs
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.structure.modal import LoadShape
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

TIGHT = NewtonOptions(tolerance=1e-13, max_iterations=40)
NAMES = [
    "d.mu", "d.kt", "d.kn", "d.velocity", "load.c.amplitude", "load.c.phase", "loss_factor", "damping",
    "mode1.omega", "mode2.omega", "mode1.damping_ratio", "mode2.damping_ratio",
]  # fmt: skip


def modal() -> ss.Problem:
    """Two modes and a residual, a contact that sticks, slips and separates; "c" is no port."""
    shapes = np.array([[0.9, -0.4], [0.5, 0.7], [-0.3, 1.1]])
    static = shapes @ np.diag([1.0 / 36.0, 1.0 / 196.0]) @ shapes.T + 1e-2 * np.eye(3)
    structure = ss.ModalStructure(
        omega=[6.0, 14.0], mode_shapes=shapes, static_compliance=static, dofs=["a", "b", "c"],
        damping_ratio=[0.02, 0.01], loss_factor=0.01,
        load_shapes={"base x": LoadShape(participation=[0.3, 0.2], static_response=[0.02, 0.01, 0.03])},
    )  # fmt: skip
    contact = ss.FrictionContact(kt=20.0, mu=0.3, kn=5.0, normal_load=20.0)
    pair = ss.ContactPair(
        name="d", tangential="a", normal="b", contact=contact, rubbing=ss.RubbingMotion(velocity=0.3)
    )  # fmt: skip
    loads = [ss.Load(dof="c", cos=40.0, sin=10.0), ss.Load(base="x", motion="acceleration", cos=3.0)]
    return ss.Problem(structure, contacts=pair, loads=loads, harmonics=range(8), outputs=["a", "c"])


def again(problem, near, omega, name, value, dof, jacobian):
    balance = Balance(problem.at_parameter(name, value), backend=jacobian)
    system, x = FrequencySystem(balance, balance.problem.inputs), near.guess(1).reshape(-1)
    found = newton(lambda z: system.evaluate(z, omega, None), x, options=TIGHT, scale=float(np.linalg.norm(x)))
    return Linearization(Outputs(balance, (dof,)), found.x, omega, balance.problem.inputs).motion()[0]


@pytest.mark.parametrize(("jacobian", "dof"), [("dense", "c"), ("iterative", "a")])
def test_every_coefficient_against_solving_again(jacobian, dof):
    """By contacts, loads, damping and single modes; central differences of order four, at the better of two steps."""
    problem = modal()
    branch = ss.steady_response(problem, omega=[4.5, 6.2], options={"jacobian": jacobian})
    assert 0.0 < float(branch.dataset.stick_fraction[0, 0]) < 1.0
    found = branch.sensitivity(NAMES, dof, points=[-1], of="displacement").displacement
    assert found.dims == ("parameter", "point", "coefficient")
    assert found.point.values.tolist() == [1]
    for name in NAMES:
        exact, value, errors = found.sel(parameter=name).values[0], problem.parameter(name), []
        for h in abs(value) * np.array([1e-3, 1e-4]):
            U = [again(problem, branch, 6.2, name, value + k * h, dof, jacobian) for k in (1, -1, 2, -2)]
            errors.append(np.abs((8 * U[0] - 8 * U[1] - U[2] + U[3]) / (12 * h) - exact).max())
        assert np.abs(exact).max() > 0.0
        assert min(errors) < 1e-7 * np.abs(exact).max(), name


def test_a_mode_of_the_structure_is_the_mode_of_its_receptance():
    """Its frequency moves the static compliance of ports and load shapes, what the modes leave out stays."""
    structure = modal().structure
    moved = structure.changed(**{"mode2.omega": 13.0, "mode1.damping_ratio": 0.05})
    rebuilt = ss.ModalStructure(
        **(structure.arguments | {
            "omega": [6.0, 13.0], "damping_ratio": [0.05, 0.01],
            "static_compliance": structure.static_compliance
            + np.outer(*2 * [structure.mode_shapes[:, 1]]) * (1 / 13.0**2 - 1 / 14.0**2),
            "load_shapes": {"base x": replace(structure.shapes["base x"], static_response=structure.shapes["base x"]
            .static_response + 0.2 * structure.mode_shapes[:, 1] * (1 / 13.0**2 - 1 / 14.0**2))},
        })
    )  # fmt: skip
    one, all_of = np.eye(3)[:, :1], np.eye(3)
    by_receptance = structure.project(one, all_of, ["base x"]).changed(
        **{"mode2.omega": 13.0, "mode1.damping_ratio": 0.05}
    )
    for other in (moved.project(one, all_of, ["base x"]), by_receptance):
        np.testing.assert_allclose(other.static, rebuilt.project(one, all_of, ["base x"]).static, rtol=1e-13)
        for a, b in zip(other.at([1, 3], 4.3), rebuilt.project(one, all_of, ["base x"]).at([1, 3], 4.3), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12)
    with raises_fault("mode2.omega", says="> 0"):
        structure.changed(**{"mode2.omega": 0.0})


def test_the_phase_is_that_of_the_coefficients():
    branch = ss.steady_response(modal(), omega=5.0)
    found = branch.sensitivity(["d.mu", "load.c.phase"], "c", of="displacement")
    c, s = branch.dataset.displacement.sel(dof="c").values[0][1:3]
    dc, ds = found.displacement.values[:, 0, 1:3].T
    z, dz = complex(c, -s), dc - 1j * ds
    np.testing.assert_allclose(found.phase.values[:, 0, 0], (dz / z).imag, rtol=1e-12)
    assert found.phase.harmonic.values.tolist() == list(range(1, 8))


def test_points_are_those_asked_for():
    branch = ss.forced_response(oscillator(), omega=(9.0, 12.0))
    peak = int(np.flatnonzero(branch.dataset.peak_dof == 0)[0])
    every, some = branch.sensitivity("damper.mu"), branch.sensitivity("damper.mu", points=[2, peak])
    assert some.point.values.tolist() == [2, peak]
    assert some.peak.values.tolist() == [peak]
    np.testing.assert_array_equal(some.amplitude.values, every.amplitude.values[:, [2, peak]])
    np.testing.assert_array_equal(some.peak_omega.values, every.peak_omega.values)
    assert branch.sensitivity("damper.mu", points=2).sizes["peak"] == 0
    with raises_fault("points"):
        branch.sensitivity("damper.mu", points=[len(branch)])
    with raises_fault("of", says="displacement"):
        branch.sensitivity("damper.mu", of="velocity")


def test_a_few_points_cost_less_than_differences(monkeypatch):
    """36 points of a curve by four parameters, against solving each again twice a parameter from its own motion."""
    problem = oscillator()
    branch = ss.forced_response(problem, omega=(2.0, 15.0))
    names, at = ["damper.mu", "damper.kt", "damper.normal_load", "damping"], list(range(0, 144, 4))
    omega = branch.dataset.omega.values[at]
    made = calls_of(monkeypatch, Balance, "jacobian")
    branch.sensitivity(names, points=at, of="displacement")
    exact = len(made)
    ss.steady_response(problem, omega=omega, guess=branch)
    once = len(made) - exact
    assert len(at) == 36 <= exact
    assert exact < 2 * len(names) * once / 3.0
