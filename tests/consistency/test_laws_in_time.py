"""Laws other than friction in time: stability, limit cycles and integration against equations written here."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.stability import point_at
from other_codes import quiet, two_cubic_springs
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import slipstick as ss
from slipstick.analysis.stability.floquet import StabilityWatch
from slipstick.balance.balance import Balance
from slipstick.contact.law import Law, Motion, Response

K3, C3, LOAD, DAMPING = 1.0, 0.01, 0.1, 0.02


def duffing(harmonics=range(12)) -> ss.Problem:
    """``x'' + 0.03 x' + x + x^3 = 0.1 sin``, a third of the damping in the law."""
    law = ss.SampledLaw(force=lambda x, v, k, c: k * x**3 + c * v, parameters={"k": K3, "c": C3})
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[DAMPING]], K=[[1.0]], dofs=["x"]),
        contacts=[ss.ContactPair(name="spring", contact=law, ports={"x": "x"})],
        loads=[ss.Load(dof="x", sin=LOAD)], harmonics=harmonics,
    )  # fmt: skip


def shot(rates, slopes, start, period, newtons=5):
    """Start of a periodic motion and its monodromy matrix, by Newton's method on the period map."""
    n, y = len(start), np.asarray(start, dtype=float)

    def both(t, z):
        return np.concatenate([rates(t, z[:n]), (slopes(t, z[:n]) @ z[n:].reshape(n, n)).ravel()])

    for _ in range(newtons):
        z0 = np.concatenate([y, np.eye(n).ravel()])
        end = solve_ivp(both, (0.0, period), z0, rtol=1e-10, atol=1e-12, method="DOP853").y[:, -1]
        Phi = end[n:].reshape(n, n)
        y = y + np.linalg.solve(np.eye(n) - Phi, end[:n] - y)
    return y, Phi


def multipliers(branch: ss.Branch, point: int, n: int) -> np.ndarray:
    return np.sort_complex((branch.dataset.multiplier.values[point] @ [1.0, 1.0j])[:n])


def state(branch: ss.Branch, point: int) -> np.ndarray:
    """Motion and velocity of all dofs at the start of a period."""
    X, h = branch.dataset.displacement.values[point], branch.harmonics
    return np.concatenate([X @ h.H_minus(0.0), float(branch.dataset.omega[point]) * h.derivative(X) @ h.H_minus(0.0)])


@cache
def duffing_branch() -> ss.Branch:
    return ss.forced_response(duffing(), omega=(1.0, 2.0), at=[1.3, 1.5, 1.7], stability=True)


def test_multipliers_of_a_duffing_oscillator_are_those_of_its_shooting() -> None:
    branch = duffing_branch()
    requested = np.flatnonzero(branch.dataset.kind.values == "requested")
    assert requested.size >= 5  # on all three parts of the curve
    assert {0, 1} == set(branch.dataset.stable.values[requested].tolist())
    for point in requested:
        w = float(branch.dataset.omega[point])
        _, Phi = shot(
            lambda t, y, w=w: np.array([y[1], LOAD * np.sin(w * t) - (C3 + DAMPING) * y[1] - y[0] - K3 * y[0] ** 3]),
            lambda t, y: np.array([[0.0, 1.0], [-1.0 - 3.0 * K3 * y[0] ** 2, -C3 - DAMPING]]),
            state(branch, point), 2.0 * np.pi / w,
        )  # fmt: skip
        np.testing.assert_allclose(multipliers(branch, point, 2), np.sort_complex(np.linalg.eigvals(Phi)), atol=1e-7)


def test_the_unstable_part_lies_between_the_folds() -> None:
    branch = duffing_branch()
    kinds = branch.dataset.kind.values
    first, second = np.flatnonzero(kinds == "turning point")
    assert [point.kind for point in branch.bifurcations()] == ["fold", "fold"]
    assert np.all(branch.dataset.stable.values[first + 1 : second] == 0)
    assert np.all(branch.dataset.stable.values[:first] == 1)
    assert np.all(branch.dataset.stable.values[second + 1 :] == 1)


def test_a_second_frequency_appears_where_shooting_says() -> None:
    """NLvib's example 02: the pair that leaves the unit circle, found by shooting from points beside it."""
    problem = two_cubic_springs()
    M, C, K = (np.asarray(m) for m in (problem.structure.M, problem.structure.C, problem.structure.K))
    branch = quiet(lambda: ss.forced_response(problem, omega=(1.08, 1.14), stability=True))
    (point,) = [p for p in branch.bifurcations() if p.kind == "Neimark-Sacker"]
    start = state(branch, point.point)

    def outside(w: float) -> float:
        def rates(t, y):
            d, cube = y[0] - y[1], y[0] ** 3
            f = np.array([cube + 0.0042 * d**3 - 0.11 * np.cos(w * t), -0.0042 * d**3])
            return np.concatenate([y[2:], -np.linalg.solve(M, f + C @ y[2:] + K @ y[:2])])

        def slopes(t, y):
            d = 3.0 * 0.0042 * (y[0] - y[1]) ** 2
            own = np.array([[3.0 * y[0] ** 2 + d, -d], [-d, d]])
            return np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K + own), -np.linalg.solve(M, C)]])

        return float(np.abs(np.linalg.eigvals(shot(rates, slopes, start, 2.0 * np.pi / w, 4)[1])).max()) - 1.0

    # 7 harmonics are truncated at 1e-6 of the motion
    assert point.omega == pytest.approx(brentq(outside, point.omega - 1e-3, point.omega + 1e-3, xtol=1e-9), abs=2e-6)


def test_a_motion_in_time_is_that_of_solve_ivp() -> None:
    found = ss.transient(duffing(), 1.7)
    w = 1.7
    y, _ = shot(
        lambda t, y: np.array([y[1], LOAD * np.sin(w * t) - (C3 + DAMPING) * y[1] - y[0] - K3 * y[0] ** 3]),
        lambda t, y: np.array([[0.0, 1.0], [-1.0 - 3.0 * K3 * y[0] ** 2, -C3 - DAMPING]]),
        [found.displacement[0, 0], 0.0], 2.0 * np.pi / w,
    )  # fmt: skip
    assert found.converged
    assert found.displacement[0, 0] == pytest.approx(y[0], abs=1e-9 * found.amplitude[0])
    speed = w * found.coefficients[0] @ found.harmonics.derivative(np.eye(found.harmonics.size)).T
    assert found.power[0] == pytest.approx(C3 * 0.5 * np.sum(speed**2), rel=1e-8)
    assert np.isnan(found.friction_force).all()


def test_a_limit_cycle_is_van_der_pols() -> None:
    """``x'' + (0.3 - a) x' + b x^2 x' + x = 0``: at a = 1.3 the oscillator of van der Pol with mu = 1 and x sqrt(b).

    Its period and amplitude to 12 digits: M. Andersson, G. D. Geer, Math. Comp. 38 (1982) 483.
    """
    law = ss.SampledLaw(force=lambda x, v, a, b: (b * x**2 - a) * v, parameters={"a": 0.1, "b": 0.02})
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.3]], K=[[1.0]], dofs=["x"])
    pair = ss.ContactPair(name="own", contact=law, ports={"x": "x"})
    problem = ss.Problem(structure, contacts=pair, harmonics=range(20))
    branch = ss.limit_cycles(problem, "own.a", (0.1, 1.4), at=1.3)
    (hopf,) = [point for point in branch.bifurcations() if point.kind == "Hopf"]
    assert (hopf.value, hopf.omega) == (pytest.approx(0.3, abs=1e-9), pytest.approx(1.0, abs=1e-9))
    point = branch.at(1.3)
    assert branch.dataset.omega.values[point] == pytest.approx(2.0 * np.pi / 6.66328685932, rel=1e-9)
    assert branch.dataset.amplitude.values[point, 0] == pytest.approx(2.00861986087 / np.sqrt(0.02), rel=1e-6)
    # Floquet's exponent is the mean damping: 1 - <x^2> (A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations)
    X = branch.dataset.displacement.values[point, 0] * np.sqrt(0.02)
    damping = X[0] ** 2 + 0.5 * np.sum(X[1:] ** 2) - 1.0
    wanted = np.exp(-damping * 2.0 * np.pi / float(branch.dataset.omega[point]))
    assert multipliers(branch, point, 1)[0].real == pytest.approx(wanted, rel=1e-3)


def beside_friction(harmonics: int) -> float:
    """Distance of multipliers by pieces along the balance's motion from those of the motion in time."""
    spring = ss.SampledLaw(force=lambda x, v, k: k * x**3 + 0.1 * v, parameters={"k": 20.0})
    damper = ss.FrictionContact(kt=30.0, mu=0.3, normal_load=2.0)
    problem = ss.Problem(
        ss.MatrixStructure(M=np.eye(2), C=0.05 * np.eye(2), K=[[3.0, -1.0], [-1.0, 2.0]], dofs=["x", "y"]),
        contacts=[
            ss.ContactPair(name="spring", contact=spring, ports={"x": "y"}),
            ss.ContactPair(name="damper", contact=damper, tangential="x", rubbing=ss.RubbingMotion(velocity=0.05)),
        ],
        loads=[ss.Load(dof="x", sin=1.0)], harmonics=range(harmonics + 1), told=None,
    )  # fmt: skip
    watch, point = StabilityWatch(Balance(problem)), point_at(problem, 1.45)
    (slip,) = next(r.detail.slip_fraction for r in point.detail.responses if r.detail is not None)
    assert 0.1 < slip < 0.95
    motion, known = watch._iterate(point.x, point.detail), watch.systems.at(point.detail)
    line, pieces = watch._pieces(motion, known, point.detail.omega)
    orbit = watch._orbit(point.detail, motion, line, known)
    pair = (np.sort_complex(one.multipliers[:4]) for one in (pieces, orbit))
    return float(np.abs(np.subtract(*pair)).max())


def test_friction_beside_a_smooth_law_by_pieces_and_by_shooting() -> None:
    """Both are the same but for what the harmonics left out add, which fades with their number."""
    few, many = beside_friction(10), beside_friction(40)
    assert many < 0.1 * few
    assert many < 1e-4


class Dahl(Law):
    """``f = k z``, ``dz/dt = v - |v| z / limit``: for motion in time alone."""

    ports, memory = ("along",), ("z",)

    def __init__(self, k, limit):
        self.values = {"k": k, "limit": limit}

    def changed(self, **values):
        return Dahl(**{**self.values, **values})

    def rate(self, q, velocity, memory, values):
        return values["k"] * memory, velocity - np.abs(velocity) * memory / values["limit"]

    def respond(self, motion: Motion, values) -> Response:
        raise AssertionError("not asked for")


def test_a_law_that_remembers_is_integrated_in_time() -> None:
    """Its state is one of the unknowns: against solve_ivp over many periods."""
    problem = ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.02]], K=[[1.0]], dofs=["mass"]),
        contacts=[ss.ContactPair(name="joint", contact=Dahl(1.0, 1.0), ports={"along": "mass"})],
        loads=[ss.Load(dof="mass", sin=0.3)], harmonics=range(6), told=None,
    )  # fmt: skip
    w = 1.2
    found = ss.transient(problem, w)
    assert found.converged

    def rates(t, y):
        return [y[1], 0.3 * np.sin(w * t) - 0.02 * y[1] - y[0] - y[2], y[1] - abs(y[1]) * y[2]]

    T = 2.0 * np.pi / w
    y = solve_ivp(rates, (0.0, 60 * T), [0.0, 0.0, 0.0], rtol=1e-9, atol=1e-11, max_step=T / 50).y[:, -1]
    assert found.displacement[0, 0] == pytest.approx(y[0], abs=1e-6 * found.amplitude[0])


def behind_a_residual(force) -> ss.Problem:
    """A mode, and compliance 0.2 beside it that answers at once."""
    structure = ss.ModalStructure(
        omega=[2.0], mode_shapes=[[1.0]], static_compliance=[[0.45]], dofs=["x"], damping_ratio=0.05
    )  # warned of: the residual is large
    pair = ss.ContactPair(name="own", contact=ss.SampledLaw(force=force, parameters={"k": 3.0}), ports={"x": "x"})
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=1.0)], harmonics=range(4), told=None)


def test_stability_behind_a_static_residual() -> None:
    """Closed form: the mode with the spring in series with the residual."""
    problem = behind_a_residual(lambda x, v, k: k * x)
    branch = quiet(lambda: ss.forced_response(problem, omega=(1.2, 1.21), stability=True))
    stiffness, damping = 4.0 + 3.0 / (1.0 + 0.2 * 3.0), 0.2
    exponent = -0.5 * damping + 1j * np.sqrt(stiffness - 0.25 * damping**2)
    wanted = np.exp(np.array([exponent, exponent.conjugate()]) * 2.0 * np.pi / 1.2)
    np.testing.assert_allclose(multipliers(branch, 0, 2), np.sort_complex(wanted), atol=1e-10)


def test_velocities_that_jump_are_said_to_be_unknown() -> None:
    problem = behind_a_residual(lambda x, v, k: k * x**3 + 0.1 * v)
    branch = quiet(lambda: ss.forced_response(problem, omega=(1.2, 1.21), stability=True))
    assert "stability is not known" in branch.table.attrs["warnings"]
    assert set(branch.dataset.stable.values.tolist()) == {-1}
    with pytest.raises(ss.InputError, match="act on a static residual"):
        ss.transient(problem, 1.2)


@pytest.mark.verify
def test_beyond_a_neimark_sacker_point_motion_is_quasi_periodic() -> None:
    """Two masses on cubic springs: on the branch beside it motion is unstable, a second frequency has appeared."""
    problem = two_cubic_springs()
    branch = quiet(lambda: ss.forced_response(problem, omega=(1.105, 1.13), stability=True))
    (point,) = [p for p in branch.bifurcations() if p.kind == "Neimark-Sacker"]
    run = ss.runs.run_up(problem, 1.126, periods=400, samples=8)
    motion = run.motion(last=128)
    assert point.omega < 1.126
    assert motion.kind == "quasi-periodic"
    assert motion.remainder < 1e-6
    assert motion.second_omega == pytest.approx(point.second_omega, rel=0.05)
    assert run.dataset["energy_error"].to_numpy().max() < 1e-9
