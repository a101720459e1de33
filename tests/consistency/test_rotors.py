"""Rotors in whole problems against brute force: closed forms, marching, differences of exact solutions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import slipstick as ss
from slipstick.errors import Outcome
from slipstick.models.rotor import TURN, jeffcott_rotor


def bearing_rotor(**change: Any) -> ss.MatrixStructure:
    """Two masses in x and y: gyroscopic, unsymmetric bearings, all of it."""
    rng = np.random.default_rng(3)
    T = rng.standard_normal((4, 4))
    given: dict[str, Any] = {
        "M": np.diag([1.0, 1.0, 0.5, 0.5]), "C": 0.25 * np.eye(4) + 0.05 * (T + T.T),
        "K": np.diag([40.0, 50.0, 90.0, 80.0]) + 0.8 * (T - T.T) + 2.0 * (T + T.T),
        "gyroscopic": np.kron(np.diag([0.2, 0.5]), TURN), "dofs": ["x", "y", "a", "b"], "speed": 3.0,
    }  # fmt: skip
    return ss.MatrixStructure(**given | change)


def rubbed(structure: Any, **change: Any) -> ss.Problem:
    damper = ss.FrictionContact(kt=20.0, mu=0.3, kn=15.0, gap=-3.0)
    pair = ss.ContactPair(
        name="damper",
        contact=damper,
        tangential={"x": 1.0, "a": 0.3},
        normal="y",
        rubbing=ss.RubbingMotion(velocity=2.0),
    )
    return ss.Problem(
        structure, **{"contacts": pair, "loads": [ss.Load(dof="x", sin=6.0)], "harmonics": range(8)} | change
    )


@pytest.mark.parametrize(
    "tie", [{"speed": 3.0}, {"speed": None, "engine_order": 1}, {"speed": None, "engine_order": 2}]
)
def test_a_rubbing_rotor_against_time_integration(tie: dict[str, Any]) -> None:
    branch = ss.forced_response(rubbed(bearing_rotor(**tie)), omega=(4.0, 7.5), at=[6.0], stability=True)
    assert branch.outcome is ss.Outcome.COMPLETED
    assert branch.dataset.newton_iterations.values.mean() < 4  # the derivative by omega is right
    at = branch.at(6.0)
    assert branch.check_in_time(at).relative_difference < 3e-3
    assert bool(branch.dataset.stable[at])


@pytest.mark.parametrize("tie", [{"speed": 3.0}, {"speed": None, "engine_order": 2}])
def test_multipliers_of_a_rotor_on_a_spring(tie: dict[str, Any]) -> None:
    """The exponential of its own equations, at the speed that belongs to the frequency."""
    structure, omega = bearing_rotor(**tie), 6.0
    spring = ss.SampledLaw(force=lambda q, velocity, k: k * q, parameters={"k": 7.0}, ports=("x",))
    problem = rubbed(structure, contacts=ss.ContactPair(name="spring", contact=spring, ports={"x": "x"}))
    data = ss.steady_response(problem, omega=omega, stability=True).dataset
    turning = structure.turning_with(omega)
    assert turning.speed == 3.0
    inverse, K = np.linalg.inv(structure.M), structure.K + np.diag([7.0, 0.0, 0.0, 0.0])
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ K, -inverse @ turning.C]])
    exact = np.linalg.eigvals(expm(A * 2.0 * np.pi / omega))
    found = data.multiplier.values[0] @ np.array([1.0, 1.0j])
    for each in found[np.isfinite(found)]:
        assert np.abs(exact - each).min() < 1e-8
    assert np.nanmax(np.abs(found)) == pytest.approx(np.abs(exact).max(), rel=1e-8)


@pytest.mark.parametrize("tie", [{"speed": 3.0}, {"speed": None, "engine_order": 2}])
def test_sensitivities_are_differences_of_solutions(tie: dict[str, Any]) -> None:
    problem = rubbed(bearing_rotor(**tie, loss_factor=0.02))
    names = ["loss_factor", "damping", "damper.mu", "load", *(["speed"] if tie["speed"] else [])]
    found = ss.steady_response(problem, omega=6.0).sensitivity(names, dof="x")
    for name in names:
        value, step = problem.parameter(name), 1e-3 * max(1.0, problem.parameter(name))
        ends = [
            float(
                ss.steady_response(problem.at_parameter(name, value + h), omega=6.0).dataset.amplitude.sel(dof="x")[0]
            )
            for h in (-step, step)
        ]
        got = float(np.ravel(found["amplitude"].sel(parameter=name).to_numpy())[0])
        assert got == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=1e-4)


def test_speed_is_followed_as_a_parameter() -> None:
    problem = rubbed(bearing_rotor())
    branch = ss.parameter_response(problem, "speed", (0.0, 8.0), omega=6.0, at=[5.0])
    assert branch.dataset.newton_iterations.values.mean() < 4
    exact = ss.steady_response(rubbed(bearing_rotor(speed=5.0)), omega=6.0).dataset.amplitude.values[0]
    assert branch.dataset.amplitude.values[branch.at(5.0)] == pytest.approx(exact, rel=1e-6)
    assert "rad/s" in str(branch.dataset.parameter.attrs)


def test_a_peak_that_is_tracked_over_the_speed() -> None:
    """The adjoint goes through transposes: the peak's derivative is that of the peaks beside it."""
    problem = rubbed(bearing_rotor())
    branch = ss.track_peak(problem, "speed", (2.0, 2.6), dof="x", omega=(4.0, 8.0))
    data = branch.dataset
    k = -1
    omega = float(data.omega[k])
    own = problem.at_parameter("speed", float(data.parameter[k]))
    near = ss.steady_response(own, omega=[omega * 0.999, omega, omega * 1.001]).dataset.amplitude.sel(dof="x").values
    assert near[1] == pytest.approx(float(data.amplitude.sel(dof="x")[k]), rel=1e-6)
    assert near[1] >= near.max() - 1e-9


def test_a_problem_with_a_rotor_is_stored(tmp_path: Any) -> None:
    for tie in ({"speed": 3.0}, {"speed": None, "engine_order": 2}):
        structure = bearing_rotor(**tie)
        branch = ss.steady_response(rubbed(structure), omega=6.0)
        branch.save(tmp_path / "rotor.nc")
        again = ss.load(tmp_path / "rotor.nc").problem.structure
        for name in ("K", "M", "gyroscopic", "speed", "engine_order"):
            assert np.array_equal(getattr(again, name), getattr(structure, name))
        assert ss.steady_response(rubbed(again), omega=6.0).dataset.amplitude.values == pytest.approx(
            branch.dataset.amplitude.values, rel=1e-12
        )


def test_analyses_that_need_real_modes_or_a_known_speed_say_so() -> None:
    still = ss.FrictionContact(kt=20.0, mu=0.3, normal_load=10.0)
    pair = ss.ContactPair(name="damper", contact=still, tangential="x")
    problem = rubbed(bearing_rotor(), contacts=pair)
    with pytest.raises(ss.InputError, match="unsymmetric matrices"):
        ss.nonlinear_modes(problem, amplitude=(0.1, 1.0))
    tied = rubbed(bearing_rotor(speed=None, engine_order=1), loads=[])
    with pytest.raises(ss.InputError, match="tied to a frequency"):
        ss.limit_cycles(tied, "damper.mu", (0.1, 0.3))


def test_an_unbalance_grows_with_the_square_of_the_frequency() -> None:
    """``x = e w^2 / (w0^2 - w^2 + i c w / m)``."""
    rotor = jeffcott_rotor(mass=2.0, stiffness=50.0, damping=0.3)
    load = ss.Load(dof="x", motion="unbalance", cos=2.0 * 0.1)
    problem = ss.Problem(rotor, loads=[load], harmonics=[0, 1])
    for w, found in zip(
        (3.0, 7.0), ss.linear_response(problem, omega=[3.0, 7.0]).dataset.amplitude.sel(dof="x").values, strict=True
    ):
        assert found == pytest.approx(abs(0.2 * w * w / (50.0 - 2.0 * w * w + 0.3j * w)), rel=1e-10)
    assert not problem.relative


# a Jeffcott rotor in a circular stator

MASS, K0, DAMPING, KN, GAP, MU, RADIUS = 2.0, 50.0, 1.0, 400.0, 0.1, 0.2, 0.5


def in_stator(loads: list[ss.Load], spin: ss.RubbingMotion, mu: float = MU, **change: Any) -> ss.Problem:
    law = ss.models.StatorContact(kn=KN, gap=GAP, mu=mu, slip_velocity=1e-4)
    pair = ss.ContactPair(name="stator", contact=law, ports={"x": "x", "y": "y"}, rubbing=spin)
    rotor = jeffcott_rotor(mass=MASS, stiffness=K0, damping=DAMPING)
    return ss.Problem(rotor, **{"contacts": pair, "loads": loads, "harmonics": [0, 1, 2, 3]} | change)


def turning_force(size: float, way: int, **kind: Any) -> list[ss.Load]:
    """Along x cos, along y sin: in the sense from x to y, or against it."""
    return [ss.Load(dof="x", cos=size, **kind), ss.Load(dof="y", sin=way * size, **kind)]


@pytest.mark.parametrize(("w", "unbalance"), [(6.0, 0.5), (7.0, 0.5)])
def test_full_annular_rub_of_an_unbalanced_rotor(w: float, unbalance: float) -> None:
    """Forward whirl: ``r |k - m w^2 + i c w + kn (1 - gap / r) (1 + i mu)| = U w^2``."""
    from scipy.optimize import brentq

    def rest(r: float) -> float:
        force = KN * (1.0 - GAP / r) * (1.0 + 1j * MU)
        return float(r * abs(K0 - MASS * w * w + 1j * DAMPING * w + force) - unbalance * w * w)

    spin = ss.RubbingMotion(velocity_per_omega=RADIUS)
    problem = in_stator(turning_force(unbalance, 1, motion="unbalance"), spin)
    data = ss.steady_response(problem, omega=w).dataset
    exact = brentq(rest, GAP, 10.0)
    assert exact > 1.5 * GAP
    assert data.amplitude.values[0] == pytest.approx([exact, exact], rel=1e-7)
    assert data.displacement.sel(coefficient="c2").values == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("speed", [40.0, 2.0])
def test_backward_whirl_that_is_forced(speed: float) -> None:
    """Against its turning the rotor's surface slides at ``R W - r w``, of either sign."""
    from scipy.optimize import brentq

    w, force = 8.0, 60.0

    def rest(r: float) -> float:
        sense = np.sign(RADIUS * speed - r * w)
        # z = r e^{-i w t}: friction at -i mu N in its sense of turning is +i mu N in that of the whirl
        held = KN * (1.0 - GAP / r) * (1.0 + 1j * MU * sense)
        return float(r * abs(K0 - MASS * w * w - 1j * DAMPING * w + held) - force)

    problem = in_stator(turning_force(force, -1), ss.RubbingMotion(velocity=RADIUS * speed))
    data = ss.steady_response(problem, omega=w).dataset
    r = float(data.amplitude.values[0, 0])
    assert rest(r) == pytest.approx(0.0, abs=1e-5 * force)
    lo, hi = (0.5 * r, 1.5 * r)
    assert r == pytest.approx(brentq(rest, max(lo, GAP), hi), rel=1e-6)
    assert r > 1.05 * GAP


def test_dry_friction_backward_whirl_keeps_itself_up() -> None:
    """Without load: ``m w^2 - c w / mu - k = 0``, ``kn (1 - gap / r) = c w / mu`` while the surface slides."""
    w = (DAMPING / MU + np.sqrt((DAMPING / MU) ** 2 + 4.0 * MASS * K0)) / (2.0 * MASS)
    r = GAP / (1.0 - DAMPING * w / MU / KN)
    law = ss.models.StatorContact(kn=KN, gap=GAP, mu=MU, slip_velocity=1e-6)
    values = {name: np.full((1, 1), value) for name, value in law.values.items()}

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        q = np.array([z[0], z[1], 0.0]).reshape(3, 1, 1)
        v = np.array([z[2], z[3], RADIUS * 60.0]).reshape(3, 1, 1)
        force = law.rate(q, v, np.zeros((0, 1, 1)), values)[0][:2, 0, 0]
        return np.concatenate([z[2:], -(K0 * z[:2] + DAMPING * z[2:] + force) / MASS])

    periods = 2.0 * np.pi / w
    found = solve_ivp(rate, (0.0, periods), [r, 0.0, 0.0, -r * w], rtol=1e-10, atol=1e-12).y[:, -1]
    assert found == pytest.approx([r, 0.0, 0.0, -r * w], abs=1e-7 * r * w)
    assert r * w < RADIUS * 60.0


def test_a_rotor_that_bounces_in_its_stator_against_time_integration() -> None:
    """An unbalance and weight: partial rub, with separation."""
    spin = ss.RubbingMotion(velocity_per_omega=RADIUS)
    weight = ss.Load(dof="y", harmonic=0, cos=-6.0)
    problem = in_stator([*turning_force(0.05, 1, motion="unbalance"), weight], spin, harmonics=range(21))
    branch = ss.steady_response(problem, omega=4.0, stability=True)
    assert branch.check_in_time(0).relative_difference < 2e-3
    assert float(branch.dataset.dissipated_power.values[0, 0]) > 0.0


def test_a_damped_stator_lost_for_part_of_the_period_does_not_slow_the_curve_down() -> None:
    """Steps stay those of a smooth curve where short separations begin, whose damping forces begin and end there."""
    structure = ss.MatrixStructure(
        M=np.diag([1.0, 1.3]), C=np.diag([0.6, 0.8]), K=[[60.0, -12.0], [-12.0, 50.0]], dofs=["x", "y"]
    )
    law = ss.models.StatorContact(kn=80.0, gap=0.5, mu=0.2, cn=2.0, slip_velocity=0.1)
    pair = ss.ContactPair(
        name="stator", contact=law, ports={"x": "x", "y": "y"}, rubbing=ss.RubbingMotion(velocity=-30.0)
    )
    loads = [ss.Load(dof="x", sin=100.0), ss.Load(dof="y", cos=60.0)]
    problem = ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(16))
    branch = ss.forced_response(problem, (8.8, 9.2))
    assert branch.outcome is Outcome.COMPLETED
    steps = branch.dataset["newton_iterations"].to_numpy()
    assert len(branch) < 130  # steps are at most 1/60 of the range; thousands before
    assert steps.mean() < 6.0
    motions = branch.dataset["displacement"].to_numpy()
    h = problem.harmonics
    tau = np.linspace(0.0, 2.0 * np.pi, 4000)
    closed = [np.mean(np.hypot(h.H_minus(tau) @ x, h.H_minus(tau) @ y) > 0.5) for x, y in motions]
    assert min(closed) < 0.97  # the rotor loses the stator
    assert max(closed) == 1.0  # and does not
