"""Passing through with contacts of laws told in time: against scipy's integrators, linear limits, steady curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.analysis.time_domain.long_run import LongRun, PeriodDone
from slipstick.results.run_up import RunUp, half_range

DAMPING, STIFFNESS = 0.4, 40.0
Rate = Callable[[float, float, float], tuple[float, float]]
"""Force and rate of the memory from motion, velocity and memory."""


def dahl(kt: float = 60.0, limit: float = 25.0) -> tuple[Any, Rate]:
    return ss.models.DahlContact(kt=kt, limit=limit), lambda w, v, f: (f, kt * (v - abs(v) * f / limit))


def bouc_wen(kt: float = 60.0) -> tuple[Any, Rate]:
    law = ss.models.BoucWenContact(kt=kt, alpha=0.1, beta=1.2, gamma=0.4, n=1.5)

    def rate(w: float, v: float, z: float) -> tuple[float, float]:
        return kt * (0.1 * w + 0.9 * z), v * (1.0 - abs(z) ** 1.5 * (1.2 * np.sign(v * z) + 0.4))

    return law, rate


def stribeck(kt: float = 100.0) -> tuple[Any, Rate]:
    law = ss.models.StribeckContact(kt=kt, mu_s=0.4, mu_d=0.25, v_s=3.0, normal_load=100.0, relaxation=200.0)

    def rate(w: float, v: float, z: float) -> tuple[float, float]:
        limit = 100.0 * (0.25 + 0.15 * np.exp(-abs(v) / 3.0))
        friction = min(max(z, -limit), limit)
        return friction, kt * v - 200.0 * (z - friction)

    return law, rate


LAWS = {"Dahl": dahl, "Bouc-Wen": bouc_wen, "Stribeck": stribeck}
RUBBING = {
    "at rest": ss.RubbingMotion(),
    "rubbing": ss.RubbingMotion(velocity=1.0, velocity_per_omega=0.3, sin={1: 0.2}, cos={2: 0.1}),
}


def problem(law: Any, rubbing: Any = None) -> ss.Problem:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[DAMPING]], K=[[STIFFNESS]], dofs=["x"])
    pair = ss.ContactPair(name="joint", contact=law, tangential="x", rubbing=rubbing)
    loads = [ss.Load(dof="x", sin=100.0), ss.Load(dof="x", cos=20.0, harmonic=3)]
    return ss.Problem(structure, contacts=pair, loads=loads, harmonics=range(8))


def integrated(rate: Rate, rubbing: str, start: float, growth: float, times: Any) -> Any:
    """The motion at times from rest, by scipy."""
    moved = rubbing == "rubbing"

    def rates(t: float, y: Any) -> Any:
        phi, speed = start * t + 0.5 * growth * t**2, start + growth * t
        way, velocity = 0.0, 0.0
        if moved:
            way = 0.2 * np.sin(phi) + 0.1 * np.cos(2 * phi)
            velocity = 1.0 + 0.3 * speed + speed * (0.2 * np.cos(phi) - 0.2 * np.sin(2 * phi))
        force, remembered = rate(y[0] + way, y[1] + velocity, y[2])
        load = 100.0 * np.sin(phi) + 20.0 * np.cos(3 * phi)
        return [y[1], load - DAMPING * y[1] - STIFFNESS * y[0] - force, remembered]

    found = solve_ivp(rates, (0.0, times[-1]), [0.0, 0.0, 0.0], "DOP853", times, rtol=1e-11, atol=1e-12, max_step=0.004)
    assert found.success
    return found.y[0]


@pytest.mark.parametrize("rate", [2.0, pytest.param(0.5, marks=pytest.mark.verify)], ids=["fast", "slow"])
@pytest.mark.parametrize("rubbing", RUBBING)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("span", [(6.0, 10.0), pytest.param((11.0, 6.0), marks=pytest.mark.verify)], ids=["up", "down"])
def test_a_sweep_is_that_of_an_independent_integrator(
    law: str, rubbing: str, span: tuple[float, float], rate: float
) -> None:
    contact, rates = LAWS[law]()
    data = ss.runs.run_up(problem(contact, RUBBING[rubbing]), span, rate=rate, samples=16).dataset
    growth = rate if span[1] > span[0] else -rate
    exact = integrated(rates, rubbing, span[0], growth, data["sample_time"].to_numpy())
    np.testing.assert_allclose(data["displacement"].to_numpy()[:, 0], exact, atol=1e-8 * np.abs(exact).max())
    assert float(data["energy_error"].max()) < 1e-10
    assert float(data["dissipated_power"].min()) > 0.0


def test_a_law_without_memory_of_its_own_is_the_spring_it_is() -> None:
    """Bouc-Wen with alpha = 1 is linear: the sweep of the structure with that spring, which is exact."""
    law = ss.models.BoucWenContact(kt=100.0, alpha=1.0, beta=0.5, gamma=0.5, n=1.0)
    stiff = ss.MatrixStructure(M=[[1.0]], C=[[DAMPING]], K=[[STIFFNESS + 100.0]], dofs=["x"])
    sprung = problem(law)
    runs = [
        ss.runs.run_up(each, (10.0, 13.0), rate=1.0).dataset
        for each in (sprung, ss.Problem(stiff, loads=sprung.loads, harmonics=range(8)))
    ]
    found, linear = (data["displacement"].interp(sample=range(60)).to_numpy() for data in runs)
    times = [data["sample_time"].to_numpy()[:60] for data in runs]
    np.testing.assert_allclose(*times)
    np.testing.assert_allclose(found, linear, atol=1e-9 * np.abs(linear).max())


@pytest.mark.verify
@pytest.mark.parametrize("law", LAWS)
def test_a_slow_sweep_is_the_steady_motion(law: str) -> None:
    slow = problem(LAWS[law]()[0])
    run = ss.runs.run_up(slow, (8.0, 8.05), rate=0.001)
    omega, size = run.envelope("x")
    steady = ss.forced_response(replace(slow, harmonics=range(30)), omega=(7.9, 8.2))
    expected = np.interp(omega[-20:], steady.dataset.omega, half_range(steady, "x"))
    np.testing.assert_allclose(size[-20:], expected, rtol=2e-3)


def plane(*, planar: bool, rubbing: Any = None, loads: Any = None, beside: bool = False) -> ss.Problem:
    """A foot on the ground that moves along x, pressed by a load that opens it."""
    structure = ss.MatrixStructure(
        M=np.eye(3), C=0.4 * np.eye(3), K=np.diag([40.0, 50.0, 60.0]), dofs=["x", "y", "z"]
    )  # fmt: skip
    law: Any = ss.PlanarFrictionContact if planar else ss.FrictionContact
    foot = ss.ContactPair(
        name="foot", contact=law(kt=100.0, mu=0.3, kn=80.0, gap=-1.0), tangential=("x", "y") if planar else "x",
        normal="z", rubbing=rubbing,
    )  # fmt: skip
    joint = ss.ContactPair(name="joint", contact=ss.FrictionContact(kt=20.0, mu=0.3, normal_load=30.0), tangential="y")
    given = loads or [ss.Load(dof="x", sin=60.0), ss.Load(dof="z", cos=180.0)]
    return ss.Problem(structure, contacts=[joint, foot] if beside else foot, loads=given, harmonics=range(5))


@pytest.mark.parametrize("velocity", [0.0, 1.5])
def test_a_planar_contact_that_moves_along_a_line_sweeps_as_one_with_a_line(velocity: float) -> None:
    found, line = (
        ss.runs.run_up(plane(planar=planar, rubbing=ss.RubbingMotion(velocity=given)), (6.0, 9.0), rate=1.0).dataset
        for planar, given in ((True, (velocity, 0.0)), (False, velocity))
    )
    for name in ("amplitude", "section_displacement", "section_velocity"):
        a, b = (data[name].to_numpy() for data in (found, line))
        np.testing.assert_allclose(a, b, atol=1e-7 * np.abs(b).max())
    for name in ("slip_fraction", "stick_fraction", "separation_fraction"):
        a, b = (data[name].to_numpy() for data in (found, line))
        assert b.max() > 0.05
        np.testing.assert_allclose(a, b, atol=1e-6)
    np.testing.assert_allclose(found["change_time"][:20], line["change_time"][:20], atol=1e-6)
    assert set(found["change_after"].to_numpy()) == {"separation", "stick", "slip"}
    assert float(found["energy_error"].max()) < 1e-8


@pytest.mark.parametrize("omega", [8.0, (7.0, 9.0)], ids=["speed that stays", "sweep"])
def test_contacts_of_both_kinds_have_their_states_and_names(omega: Any) -> None:
    loads = [ss.Load(dof="x", sin=60.0), ss.Load(dof="y", cos=50.0), ss.Load(dof="z", cos=180.0)]
    more = {"rate": 1.0} if isinstance(omega, tuple) else {"periods": 3}
    data = ss.runs.run_up(plane(planar=True, loads=loads, beside=True), omega, **more).dataset
    states = data["separation_fraction"] + data["stick_fraction"] + data["slip_fraction"]
    np.testing.assert_allclose(states, 1.0, atol=1e-12)
    assert set(data["change_contact"].to_numpy()) == {"joint", "foot"}
    of_joint = data["change_after"].to_numpy()[data["change_contact"].to_numpy() == "joint"]
    assert set(of_joint) == {"stick", "slip+", "slip-"}
    assert float(data["energy_error"].max()) < 1e-8


@pytest.mark.parametrize("make", [lambda: problem(stribeck()[0]), lambda: plane(planar=True, beside=True)])
def test_what_is_killed_goes_on_to_the_last_bit(make: Callable[[], ss.Problem], tmp_path: Path) -> None:
    class Killed(Exception):
        pass

    def stop(done: PeriodDone) -> None:
        if done.checkpoint.period == 1:
            raise Killed

    whole = ss.runs.run_up(make(), (6.0, 9.0), rate=1.5, folder=tmp_path / "whole")
    with pytest.raises(Killed):
        ss.runs.run_up(make(), (6.0, 9.0), rate=1.5, folder=tmp_path / "killed", listener=stop)
    gone_on = ss.runs.run_up(make(), (6.0, 9.0), rate=1.5, folder=tmp_path / "killed")
    assert whole.dataset.sizes["period"] == 2
    for name in ("displacement", "section_velocity", "energy_error", "change_time"):
        np.testing.assert_array_equal(gone_on.dataset[name], whole.dataset[name])


def test_a_period_depends_on_the_state_at_its_start_alone() -> None:
    """Not on how far the polynomials of the period before reached."""
    run = LongRun(problem=problem(dahl()[0]), start=6.0, stop=9.0, rate=4.0, periods=1, samples=4)
    first = next(run.after()).checkpoint
    run.stepper._length = 2.0**-6
    np.testing.assert_array_equal(next(run.after()).checkpoint.z, first.z)


def test_a_stiff_law_has_the_steps_it_needs() -> None:
    """At a speed that stays, and in a sweep: the fastest motion goes on by less than is good for polynomials."""
    stiff = problem(ss.models.BoucWenContact(kt=2e6, alpha=0.5, beta=0.5, gamma=0.5, n=1.0))
    for start, stop, rate in ((8.0, 8.0, 0.0), (8.0, 9.0, 1.0)):
        run = LongRun(problem=stiff, start=start, stop=stop, rate=rate, periods=1, samples=0)
        assert run.stepper.steps >= 2 * np.pi * 1e3 / run.reference / 1.5


def test_a_velocity_that_grows_with_the_speed_is_refused_where_a_law_holds_it() -> None:
    tied = plane(planar=True, rubbing=ss.RubbingMotion(velocity_per_omega=(0.1, 0.0)))
    with raises_fault("run_up", says="holds it constant"):
        ss.runs.run_up(tied, (6.0, 9.0), rate=1.0)
    assert isinstance(ss.runs.run_up(tied, 6.0, periods=1), RunUp)
