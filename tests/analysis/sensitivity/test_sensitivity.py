from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from consistency.random_systems import random_system
from helpers.faults import raises_fault
from helpers.oscillator import with_law
from helpers.problems import random_problem
from helpers.resolved import assert_sensitive

import slipstick as ss
from slipstick.results.sensitivities import parameter_names
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

POINT = {"max_points": 1}
SHORT = {"max_points": 3, "max_step": 1 / 120, "first_step": 1 / 300}


@cache
def curve(velocity, omega):
    return ss.forced_response(oscillator(velocity=velocity), omega=omega)


@pytest.mark.parametrize(
    ("velocity", "omega", "name", "of_amplitude", "of_omega"),
    [
        (0.0, (9.0, 12.0), "damper.mu", 6.2553947, 5.5399634),
        (0.0, (9.0, 12.0), "damper.kt", -3.195277e-2, 3.388663e-2),
        (0.0, (9.0, 12.0), "damper.normal_load", 2.345773e-3, 2.077486e-3),
        (0.0, (9.0, 12.0), "damping", 0.4 * -5.312028e-1, 0.4 * 5.312706e-1),
        (100.0, (5.5, 7.0), "damper.velocity", 1.6063053e-1, 2.785703e-3),
        (100.0, (5.5, 7.0), "damper.kt", -1.1532029e-2, -2.069974e-3),
        (10.0, (4.0, 4.6), "load.x.amplitude", 1.4141997e-2, 2.602761e-3),
        (10.0, (4.0, 4.6), "damper.mu", 0.0, 0.0),
        (10.0, (4.0, 4.6), "damper.normal_load", 0.0, 0.0),
    ],
)
def test_peaks_of_the_oscillator(velocity, omega, name, of_amplitude, of_omega):
    """Against peaks located again with another parameter, to seven digits; c is 0.4 times the factor "damping"."""
    found = curve(velocity, omega).sensitivity(name).isel(peak=0)
    assert float(found.peak_amplitude[0]) == pytest.approx(of_amplitude, rel=1e-6, abs=1e-9)
    assert float(found.peak_omega[0]) == pytest.approx(of_omega, rel=2e-6, abs=1e-8)


def test_without_parameters_there_is_nothing_to_tell():
    assert curve(0.0, (9.0, 12.0)).sensitivity([]).sizes["parameter"] == 0


def test_a_corner_has_no_derivatives():
    """The first peak is a tie of two extremes, at which neither has a slope of zero; the second is smooth."""
    problem, band = oscillator(velocity=5.0), (2.3, 3.6)
    branch = ss.forced_response(problem, omega=band)
    found = branch.sensitivity("damper.kt").isel(parameter=0)
    corner, smooth = found.peak_amplitude.values
    low, high = (
        ss.forced_response(problem.with_parameter("damper.kt", kt), omega=band).peaks("x") for kt in (99.99, 100.01)
    )
    first, second = ((b[1] - a[1]) / 0.02 for a, b in zip(low, high, strict=True))
    assert smooth == pytest.approx(second, rel=1e-4)
    assert float(found.amplitude[found.peak[0]]) != pytest.approx(first, rel=0.1)
    assert np.isnan(corner)
    assert np.isnan(found.peak_omega.values).tolist() == [True, False]


def test_setting_a_stuck_contact_in_motion_has_no_derivative():
    """Its mean friction force jumps from the middle of an interval to its end."""
    still = ss.forced_response(oscillator(), omega=(4.0, 4.1), options=POINT)
    moving = ss.forced_response(oscillator(velocity=1e-9), omega=(4.0, 4.1), options=POINT)
    assert float(still.dataset.stick_fraction[0, 0]) == 1.0
    assert abs(float(moving.dataset["mean"][0, 0] - still.dataset["mean"][0, 0])) > 1.0
    found = still.sensitivity(["damper.velocity", "damper.mu"])
    for name in ("amplitude", "mean", "dissipated_power"):
        assert np.isnan(found[name].values[:, 0]).tolist() == [True, False]


def test_defaults_are_all_contacts_loads_and_damping():
    problem = oscillator(velocity=10.0)
    found = ss.forced_response(problem, omega=(4.0, 4.1), options=POINT).sensitivity()
    names = ["kt", "mu", "kn", "gap", "normal_load", "velocity"]
    wanted = [*(f"damper.{n}" for n in names), "load.x.amplitude", "load.x.phase", "loss_factor", "damping"]
    assert found.parameter.values.tolist() == wanted
    assert found.value.values[:3].tolist() == [100.0, 0.3, 1.0]
    assert found.units.values[:2].tolist() == ["force/length", "1"]
    sides = {"amplitude_above", "amplitude_below"}
    assert set(found.data_vars) == {"amplitude", "mean", "dissipated_power", "peak_amplitude", "peak_omega"} | sides
    assert all(np.array_equal(found[side], found.amplitude) for side in sides)


@pytest.mark.parametrize("dof", [pytest.param("d0", marks=pytest.mark.verify), "d3"])
def test_every_parameter_against_solving_again(dof):
    """Contacts to ground and between nodes, with a normal direction, d0 a port and d3 none."""
    problem = random_problem(1)
    branch = ss.forced_response(problem, omega=(6.0, 6.1), options=POINT)
    assert_sensitive(branch, [*parameter_names(problem), "friction", "load"], dof)


def test_a_name_of_all_contacts_moves_each_from_its_own_value():
    branch = ss.forced_response(random_problem(1), omega=(6.0, 6.1), options=POINT)
    found = branch.sensitivity(["*.mu", "c0.mu", "c1.mu", "c2.mu"]).amplitude.values[:, 0]
    assert found[0] == pytest.approx(found[1:].sum(), rel=1e-12)


def test_a_normal_load_of_an_open_contact_is_refused():
    """A load of 0 stands for a gap of 0: the contact, open at rest, would jump there."""
    branch = ss.forced_response(random_problem(1), omega=(6.0, 6.1), options=POINT)
    with raises_fault("c2.normal_load", says="the gap of 'c2'"):
        branch.sensitivity("c2.normal_load")
    assert "c2.normal_load" not in branch.sensitivity().parameter


@pytest.mark.parametrize("jacobian", ["dense", "iterative"])
def test_both_kinds_of_jacobians(jacobian):
    problem = random_system(2).problem if jacobian == "dense" else modal()
    branch = ss.forced_response(problem, omega=(6.0, 6.1), options=POINT | {"jacobian": jacobian})
    assert_sensitive(branch, parameter_names(problem)[:4], problem.outputs[-1])


def modal() -> ss.Problem:
    """Many contacts on few modes: the Jacobian is never written out."""
    n, rng = 60, np.random.default_rng(3)
    dofs = [f"x{i}" for i in range(n + 1)]
    shapes = rng.standard_normal((n + 1, 4))
    structure = ss.ModalStructure(
        omega=[5.0, 9.0, 14.0, 20.0], mode_shapes=shapes, static_compliance=shapes @ np.diag([0.05, 0.02, 0.01, 0.005])
        @ shapes.T + 1e-3 * np.eye(n + 1), dofs=dofs, damping_ratio=0.02,
    )  # fmt: skip
    law = ss.FrictionContact(kt=1.0, mu=0.3, kn=1.0, normal_load=2.0)
    pair = ss.ContactPair(name="many", tangential=dofs[:-1], contact=law, rubbing=ss.RubbingMotion(velocity=2.0))
    load = ss.Load(dof="x0", sin=20.0)
    return ss.Problem(structure, contacts=pair, loads=load, harmonics=range(5), outputs=["x0", dofs[-1]])


def heated() -> ss.Problem:
    curve = ss.FrictionCurve(temperature=[20.0, 200.0, 600.0], mu=[0.5, 0.4, 0.25], kt=[120.0, 100.0, 70.0])
    thermal = ss.ThermalModel(curve=curve, background=25.0, resistance=[[0.05, 0.03], [0.01, 0.04]])
    structure = ss.MatrixStructure(
        M=np.eye(3), C=0.3 * np.eye(3), K=np.diag([60.0, 70, 80]) - 5.0, dofs=["a", "b", "c"]
    )
    law = ss.FrictionContact(kt=1.0, mu=1.0, kn=2.0, normal_load=60.0)
    pairs = [
        ss.ContactPair(name=n, tangential=d, contact=law, rubbing=ss.RubbingMotion(velocity=v))
        for n, d, v in (("one", "a", 12.0), ("two", "b", -8.0))
    ]
    return ss.Problem(structure, contacts=pairs, loads=ss.Load(dof="a", sin=90.0), harmonics=range(6), thermal=thermal)


@pytest.mark.parametrize("dof", ["a", "c"])
def test_heat_is_in_the_derivatives(dof):
    """Temperatures follow: curves of mu and kt, contacts that heat each other, not equally."""
    problem = heated()
    branch = ss.forced_response(problem, omega=(6.5, 6.6), options=POINT)
    assert float(branch.dataset.temperature[0].max()) > 40.0
    names = ["friction", "one.velocity", "two.gap", "two.kn", "load.a.amplitude", "damping", "loss_factor"]
    assert_sensitive(branch, names, dof)
    assert "temperature" in branch.sensitivity("friction")


def test_parameters_that_follow_the_temperature_are_refused_by_name():
    problem = heated()
    branch = ss.forced_response(problem, omega=(6.5, 6.6), options=POINT)
    with pytest.raises(ss.InputError, match="use the factor 'friction'"):
        branch.sensitivity(["one.mu", "load"])
    assert "one.mu" not in branch.sensitivity().parameter


@pytest.mark.parametrize("followed", ["damper.velocity", "load.x.amplitude", "damping"])
def test_along_a_parameter(followed):
    """The values at each point are those of the followed parameter; peaks are along it."""
    span = {"damper.velocity": (1.0, 30.0), "load.x.amplitude": (80.0, 130.0), "damping": (0.5, 2.0)}[followed]
    branch = ss.parameter_response(oscillator(velocity=10.0), followed, span, omega=4.6, options=SHORT)
    found = branch.sensitivity(followed)
    d, x = branch.dataset, branch.dataset.parameter.values
    secant = (d.amplitude[-1, 0] - d.amplitude[-2, 0]) / (x[-1] - x[-2])
    assert float(found.amplitude[0, -2:].mean()) == pytest.approx(float(secant), rel=1e-3)
    assert_sensitive(branch, ["damper.mu", "damper.kt", "load.x.phase"], "x")


def test_place_of_a_peak_along_a_parameter():
    """How the velocity of the largest amplitude moves, against curves followed again."""

    def peak(load: float) -> tuple[float, ss.Branch]:
        problem = oscillator(velocity=10.0).with_parameter("load.x.amplitude", load)
        branch = ss.parameter_response(problem, "damper.velocity", (0.5, 60.0), omega=5.0)
        return branch.peaks("x")[0][0], branch

    _, branch = peak(100.0)
    found = branch.sensitivity(["load.x.amplitude", "damping"]).isel(peak=0)
    moved = (peak(100.01)[0] - peak(99.99)[0]) / 0.02
    assert float(found.peak_parameter[0]) == pytest.approx(moved, rel=1e-4)


def test_points_that_are_near_solutions_are_brought_to_them():
    """As those with few of the harmonics, and those between computed ones."""
    branch = ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 4.1), options=POINT)
    rough = branch.dataset.copy(deep=True)
    rough.contact_tangential[..., 1:] *= 1.001
    near = ss.Branch(rough, branch.outcome, branch.problem).sensitivity()
    assert np.allclose(near.amplitude, branch.sensitivity().amplitude, rtol=1e-6, atol=1e-7)


def test_laws_of_ones_own():
    law = ss.SampledLaw(force=lambda x, v, k=1.0, c=0.1: k * x**3 + c * v, parameters={"k": 2.0, "c": 0.3})
    law = ss.SampledLaw(force=lambda x, v, k=1.0, c=0.1: k * x**3 + c * v, parameters={"k": 2.0, "c": 0.3})
    problem = with_law(law, name="cubic", force=10.0, harmonics=range(6))
    branch = ss.forced_response(problem, omega=(6.0, 6.1), options=POINT)
    assert_sensitive(branch, ["cubic.k", "cubic.c", "damping"], "x")


def test_without_a_problem_or_contacts():
    problem = oscillator(velocity=10.0)
    branch = ss.forced_response(problem, omega=(4.0, 4.1), options=POINT)
    with pytest.raises(ss.InputError, match=r"there is no parameter 'damper.nu'; did you mean 'damper.mu'"):
        branch.sensitivity("damper.nu")
    with pytest.raises(ss.InputError, match="there is no dof"):
        branch.sensitivity("damper.mu", "y")
    with pytest.raises(ss.InputError, match="the problem of the branch"):
        ss.Branch(branch.dataset, branch.outcome).sensitivity()
    with pytest.raises(ss.InputError, match="linear response"):
        ss.linear_response(problem, omega=[4.0]).sensitivity()


def random_point(seed: int) -> None:
    system, rng = random_system(seed), np.random.default_rng(seed)
    omega = float(rng.uniform(*sorted(system.span)))
    branch = ss.forced_response(system.problem, omega=(omega, 1.001 * omega), options=POINT)
    if not len(branch):
        return
    names = [n for n in parameter_names(system.problem) if not n.endswith("velocity") or system.problem.parameter(n)]
    chosen = [str(n) for n in rng.choice(names, min(3, len(names)), replace=False)]
    assert_sensitive(branch, chosen, str(rng.choice(system.problem.outputs)))


@pytest.mark.parametrize("seed", range(6))
def test_random_systems(seed):
    random_point(seed)


@pytest.mark.verify
@pytest.mark.parametrize("first", range(0, 1000, 100))
def test_a_thousand_random_systems(first):
    for seed in range(first, first + 100):
        random_point(seed)
