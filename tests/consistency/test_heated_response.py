"""Response curves of contacts heated by their own friction."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.analysis.curve.response import forced_response, parameter_response
from slipstick.errors import InputError, Outcome
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.model import ThermalModel
from slipstick.state.thermal.search import SurfaceEquilibria

CURVE = FrictionCurve(temperature=[25, 200, 400, 800, 1200], mu=[0.3, 0.27, 0.23, 0.18, 0.15])
DATA = Path(__file__).parents[2] / "examples" / "blade_reduced" / "blade_reduced.npz"


def oscillator(velocity: float, thermal: ThermalModel | None, normal_load: float = 800.0) -> ss.Problem:
    return one_mass(damper(velocity, normal_load=normal_load), harmonics=range(11), thermal=thermal)


def test_curve_balances_heat_at_every_point() -> None:
    """T = T0 + R power, mu = mu(T) at every point; hot contacts slip in both directions and damp less."""
    thermal = ThermalModel(curve=CURVE, background=25.0, resistance=0.05)
    branch = forced_response(oscillator(10.0, thermal, 200.0), omega=(2.0, 15.0))
    assert branch.outcome is Outcome.COMPLETED
    d = branch.dataset
    T, power = d["temperature"].to_numpy(), d["dissipated_power"].to_numpy()
    assert T.max() > 150.0
    np.testing.assert_allclose(T, 25.0 + 0.05 * power, rtol=1e-10)
    np.testing.assert_allclose(d["friction_coefficient"].to_numpy(), CURVE.mu(T), rtol=1e-12)
    cold = forced_response(oscillator(10.0, None, 200.0), omega=(2.0, 15.0))
    assert max(a for _, a in branch.peaks("x")) > 1.1 * max(a for _, a in cold.peaks("x"))


def test_one_sided_slip_does_not_feel_the_heat() -> None:
    """Constant load and slip in one direction only: friction moves with the motion by kt, mu sets its mean alone."""
    hot = oscillator(50.0, ThermalModel(curve=CURVE, background=25.0, resistance=0.05))
    peaks = [forced_response(p, omega=(5.0, 7.0)).peaks("x") for p in (hot, oscillator(50.0, None))]
    assert peaks[0][0] == pytest.approx(peaks[1][0], rel=1e-8)


def test_heated_point_is_the_cold_problem_with_that_friction_coefficient() -> None:
    thermal = ThermalModel(curve=CURVE, background=25.0, resistance=0.05)
    branch = forced_response(oscillator(50.0, thermal), omega=(5.0, 6.0), at=[5.5])
    point = branch.at(5.5)
    mu = float(branch.dataset["friction_coefficient"][point, 0])
    plain = oscillator(50.0, None).with_parameter("damper.mu", mu)
    same = forced_response(plain, omega=(5.0, 6.0), at=[5.5])
    expected = same.dataset["displacement"].to_numpy()[same.at(5.5)]
    np.testing.assert_allclose(branch.dataset["displacement"].to_numpy()[point], expected, atol=1e-8)


def test_velocity_is_followed_to_permanent_slip() -> None:
    """Beyond the threshold p/c the amplitude is the free one whatever the temperature, the mean is -mu(T) N/k."""
    thermal = ThermalModel(curve=CURVE, background=25.0, resistance=0.005)
    branch = parameter_response(oscillator(20.0, thermal), "damper.velocity", (20.0, 260.0), omega=6.0)
    assert branch.outcome is Outcome.COMPLETED
    end = branch.dataset.isel(point=-1)
    mu = float(end["friction_coefficient"][0])
    rise = float(end["temperature"][0]) - 25.0
    assert rise == pytest.approx(0.005 * mu * 800.0 * 260.0, rel=1e-9)
    assert float(end["mean"][0]) == pytest.approx(-mu * 800.0 / 40.0, rel=1e-9)
    assert float(end["amplitude"][0]) == pytest.approx(100.0 / abs(40.0 - 36.0 + 2.4j), rel=1e-8)


def test_a_temperature_outside_its_table_stops_the_curve_with_a_sentence() -> None:
    short = FrictionCurve(temperature=[25, 120], mu=[0.3, 0.28])
    thermal = ThermalModel(curve=short, background=25.0, resistance=0.02)
    branch = forced_response(oscillator(50.0, thermal), omega=(2.0, 15.0))
    assert branch.outcome is Outcome.OUTSIDE_TABLE
    assert "the temperature of contact damper leaves its table, 25 to 120" in branch.dataset.attrs["outcome_text"]
    assert len(branch) == 0  # it is too hot from the first point on
    units = {"length": "mm", "force": "N", "time": "s", "temperature": "K"}
    named = replace(oscillator(50.0, thermal), units=units, told=None)
    said = forced_response(named, omega=(2.0, 15.0)).message
    assert "(at 2 rad/s: the temperature of contact damper leaves its table, 25 to 120 K: " in said
    assert re.search(r"lies near \d+\.?\d* K \(power \S+ mW\)", said)
    later = forced_response(
        oscillator(10.0, ThermalModel(curve=short, background=25.0, resistance=0.05), 200.0), omega=(2.0, 15.0)
    )
    assert later.outcome is Outcome.OUTSIDE_TABLE
    assert len(later) > 10
    assert np.all(later.dataset["temperature"] <= 120.0)


def test_a_jump_between_thermal_equilibria_is_said() -> None:
    """Friction that rises steeply at 300: with growing velocity the cool equilibrium ends and the hot one is taken.

    The cool one ends where T - T0 = R mu N v touches the curve, the hot branch is the same formula at mu = 0.4; all in
    full slip, so the temperatures are known.
    """
    steep = FrictionCurve(temperature=[25, 200, 280, 300, 330, 360, 2000], mu=[0.1, 0.1, 0.1, 0.12, 0.35, 0.4, 0.4])
    problem = oscillator(260.0, ThermalModel(curve=steep, background=25.0, resistance=0.012), 100.0)
    up = parameter_response(problem, "damper.velocity", (1900.0, 2400.0), omega=6.0)
    assert up.outcome is Outcome.COMPLETED
    T, v = up.dataset["temperature"].to_numpy()[:, 0], up.dataset["parameter"].to_numpy()
    cool, hot = np.less(T, 280.0), np.greater(T, 360.0)
    np.testing.assert_allclose(T[cool], 25.0 + 0.012 * 0.1 * 100.0 * v[cool], rtol=1e-10)
    np.testing.assert_allclose(T[hot], 25.0 + 0.012 * 0.4 * 100.0 * v[hot], rtol=1e-10)
    assert cool.any()
    assert hot.any()
    assert "the contacts took another one" in up.dataset.attrs["outcome_text"]
    [several] = up.thermal_equilibria(0)
    assert list(several.stable) == [True, False, True]
    back = parameter_response(problem, "damper.velocity", (2400.0, 1900.0), omega=6.0)
    assert back.dataset["temperature"].to_numpy()[-1, 0] == pytest.approx(25.0 + 0.012 * 0.4 * 100.0 * 1900.0)
    assert "took another one" not in back.dataset.attrs["outcome_text"]


def test_a_branch_without_points_says_why() -> None:
    short = FrictionCurve(temperature=[25, 30], mu=[0.3, 0.28])
    thermal = ThermalModel(curve=short, background=25.0, resistance=0.02)
    branch = forced_response(oscillator(50.0, thermal), omega=(2.0, 15.0))
    assert len(branch) == 0
    with pytest.raises(InputError, match="a contact temperature left"):
        branch.at(5.0)


def test_all_equilibria_of_a_point() -> None:
    thermal = ThermalModel(curve=CURVE, background=25.0, resistance=0.05)
    branch = forced_response(oscillator(50.0, thermal), omega=(5.0, 6.0))
    [found] = branch.thermal_equilibria(-1)
    taken = float(branch.dataset["temperature"][-1, 0])
    assert np.abs(found.temperature - taken).min() < 1e-8 * taken
    cold = forced_response(oscillator(50.0, None), omega=(5.0, 6.0))
    with pytest.raises(InputError, match="no contact of this branch is heated"):
        cold.thermal_equilibria(0)
    assert branch.plot.temperature().lines[0].get_ydata()[-1] == taken
    with pytest.raises(InputError, match="the contacts are not heated"):
        cold.plot.temperature()


def test_case_file_of_the_hot_blade() -> None:
    """The example with mu over temperature: heat balances, and the hottest contact is far above the background."""
    from slipstick.case.case import Case

    case = Case.from_file(DATA.with_name("blade_reduced_hot_rub.toml"))
    branch = case.run()
    assert branch.outcome is Outcome.COMPLETED
    T, power = branch.dataset["temperature"].to_numpy(), branch.dataset["dissipated_power"].to_numpy()
    np.testing.assert_allclose(T, 25.0 + power @ np.load(DATA, allow_pickle=False)["thermal_influence"].T, rtol=1e-9)
    assert 200.0 < T.max() < 800.0
    mu = branch.dataset["friction_coefficient"].to_numpy()
    assert mu.max() < 0.5
    assert mu.min() < 0.42


def test_reduced_blade_with_coupled_heat() -> None:
    """Eight contacts on one surface: heat balances through the influence matrix, and Newton needs few corrections."""
    if not DATA.exists():
        pytest.skip("examples/blade_reduced is not installed")
    data = np.load(DATA, allow_pickle=False)
    dofs = [f"n{i}{a}" for i in range(8) for a in "xyz"]
    from slipstick.structure.modal import LoadShape

    shape = LoadShape(participation=data["load_participation"], static_response=data["static_load_response"])
    structure = ss.ModalStructure(
        omega=data["omega"], mode_shapes=data["mode_shapes"], static_compliance=data["static_compliance"], dofs=dofs,
        loss_factor=0.001, load_shapes={"pressure": shape},
    )  # fmt: skip
    k = 27450.33
    pairs = [
        ss.ContactPair(
            name=f"n{i}", contact=ss.FrictionContact(kt=k, mu=0.3, kn=k, gap=-0.2 * 3.96918 / k),
            tangential=f"n{i}y", normal=f"n{i}z", rubbing=ss.RubbingMotion(velocity=2.0),
        )
        for i in range(8)
    ]  # fmt: skip
    curve = FrictionCurve(temperature=[25, 200, 400, 600, 800], mu=[0.50, 0.45, 0.38, 0.31, 0.27])
    influence = data["thermal_influence"]
    problem = ss.Problem(
        structure, contacts=pairs, loads=[ss.Load(shape="pressure", cos=2.0)], harmonics=range(6), outputs=["n0y"],
        thermal=ThermalModel(curve=curve, background=25.0, resistance=influence),
    )  # fmt: skip
    branch = forced_response(problem, omega=(1240.0, 1400.0))
    assert branch.outcome is Outcome.COMPLETED, branch.dataset.attrs["outcome_text"]
    d = branch.dataset
    T, power = d["temperature"].to_numpy(), d["dissipated_power"].to_numpy()
    np.testing.assert_allclose(T, 25.0 + power @ influence.T, rtol=1e-9)
    assert T.max() > 30.0
    assert np.median(d["newton_iterations"].to_numpy()) <= 4
    found = branch.thermal_equilibria(0)
    assert isinstance(found, SurfaceEquilibria)
    assert np.abs(found.temperature - T[0]).max(axis=1).min() < 1e-7 * T[0].max()
