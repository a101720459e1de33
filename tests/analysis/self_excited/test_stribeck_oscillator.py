"""A mass on a belt with Stribeck friction: onset in closed form, stick-slip against an integration with events."""

import numpy as np
import pytest
from helpers.belt import Belt
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.analysis.peaks.system import StateSpace
from slipstick.analysis.self_excited.system import CycleSystem, CycleWatch
from slipstick.balance.balance import Balance
from slipstick.balance.parameters import parameter_path
from slipstick.results.record import Outputs
from slipstick.solve.newton import NewtonOptions, newton_at

KT = 30.0


def oscillator(harmonics):
    """x'' + 0.1 x' + x + f = 0, mu = 0.5 + 0.5 exp(-v / 0.5), N = 1; the belt moves at -velocity."""
    law = ss.models.StribeckContact(kt=KT, mu_s=1.0, mu_d=0.5, v_s=0.5, normal_load=1.0)
    rubbing = ss.RubbingMotion(velocity=-1.3)
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[1.0]], dofs=["x"]),
        contacts=ss.ContactPair(name="belt", contact=law, tangential="x", rubbing=rubbing),
        harmonics=range(harmonics + 1),
    )


def test_vibration_begins_where_damping_and_falling_friction_cancel(tmp_path):
    branch = ss.limit_cycles(oscillator(3), "belt.velocity", (-1.17, -1.14))
    hopf = next(point for point in branch.bifurcations() if point.kind == "Hopf")
    onset = 0.5 * np.log(0.5 / (0.1 * 0.5))  # 0.1 + mu'(V) = 0
    assert hopf.value == pytest.approx(-onset, rel=1e-12)
    assert hopf.omega == pytest.approx(1.0, rel=1e-12)
    cycles = branch.dataset.isel(point=np.flatnonzero(branch.dataset.branch_part == 1))
    # faster belts, where steady sliding is stable: the bifurcation is subcritical, its cycles are unstable
    assert np.all(cycles.parameter[1:] < -onset)
    assert np.all(cycles.unstable_multipliers[1:] == 1)
    branch.save(tmp_path / "belt.nc")
    assert ss.load(tmp_path / "belt.nc").problem.contacts[0].contact == branch.problem.contacts[0].contact


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_a_doubling_is_named_though_its_own_stability_is_undecided():
    branch = ss.limit_cycles(oscillator(9), "belt.velocity", (-1.9, -1.1), options={"max_points": 60})
    doubled = next(point for point in branch.bifurcations() if point.kind == "period doubling")
    assert doubled.multiplier == pytest.approx(-1.0, abs=1e-8)
    assert (doubled.before, doubled.after) == (0, 1)
    assert int(branch.dataset.stable[doubled.point]) == -1
    unknown = [text for text in branch.warnings if text.startswith("stability is not known")]
    others = int((branch.dataset.stable == -1).sum()) - 1
    assert unknown == [] if others == 0 else f" at {others} of " in unknown[0]


def cycle(law, V, damping, harmonics, size):
    """Of the limit cycle near a cosine of some size: frequency, largest x over the mean, first harmonic, stability."""
    start, omega = np.array([float(law.normal_load) * float(law.mu(V)[0]), size]), 1.0
    for n in sorted({7, 11, 23, harmonics}):
        if n > harmonics:
            break
        problem = ss.Problem(
            ss.MatrixStructure(M=[[1.0]], C=[[damping]], K=[[1.0]], dofs=["x"]),
            contacts=ss.ContactPair(name="belt", contact=law, tangential="x", rubbing=ss.RubbingMotion(velocity=-V)),
            harmonics=range(n + 1),
        )
        h, balance = problem.harmonics, Balance(problem)
        start = np.pad(start, (0, h.size - start.size))
        space = StateSpace(Outputs(balance, ()), problem.inputs, parameter_path(problem, "belt.velocity"))
        system = CycleSystem(space, h.derivative(start))
        found = newton_at(system, np.append(start, omega), -V, options=NewtonOptions(), scale=1.0)
        assert found.converged
        start, omega = found.x[:-1], found.x[-1]
    stability = CycleWatch(balance).at(found.x, found.evaluation.detail)
    x = h.H_minus(np.linspace(0.0, 2.0 * np.pi, 20_001)) @ start
    return omega, x.max() - start[0], np.hypot(*start[1:3]), stability


def test_small_friction_vibrates_as_averaging_has_it():
    """J. J. Thomsen and A. Fidlin, Int. J. Non-Linear Mechanics 38 (2003) 389: cubic law, sliding at all times.

    The energy of x = A cos t over a period: A = 2 sqrt(V0^2 - V^2),
    V0^2 = v_s^2 (1 - 2 c v_s / (3 N (mu_s - mu_d))).
    What averaging leaves out is of second order in the friction.
    """
    V0 = 0.5 * np.sqrt(1.0 - 2.0 * 0.1 * 0.5 / (3.0 * 0.15))
    exact, errors = 2.0 * np.sqrt(V0**2 - 0.42**2), []
    for N in (0.2, 0.1):
        law = ss.models.StribeckContact(kt=100.0, mu_s=0.4, mu_d=0.25, v_s=0.5, form="cubic", normal_load=N)
        _, _, first, stability = cycle(law, 0.42, 0.1 * N, 7, exact)
        errors.append(first / exact - 1.0)
        assert stability.unstable == 0
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert abs(errors[1]) < 0.1**2


def test_what_was_counted_near_the_onset_had_not_decayed_yet():
    """The published count at V = 1.175 calls vibration what moves faster than 0.2 after a time of 400."""

    def back(t, y):  # of f = -mu(V - x')
        return [-y[1], y[0] + 0.1 * y[1] - (0.5 + 0.5 * np.exp(-(1.175 - y[1]) / 0.5))]

    mean = 0.5 + 0.5 * np.exp(-1.175 / 0.5)
    laps = 400.0 - np.linspace(2.0 * np.pi, 0.0, 101)
    path = solve_ivp(back, (0.0, 400.0), [mean, 0.2], "DOP853", t_eval=laps, rtol=1e-10, atol=1e-12).y
    radius = np.hypot(path[0] - mean, path[1]).mean()
    assert np.pi * radius**2 / 2.0 / 8.0 == pytest.approx(0.0132, abs=2.0 * 0.0016)  # of the starts, two errors


TABLE = [(0.0, 1.0), (0.3, 0.75), (1.0, 0.6), (3.0, 0.5)]
FALLING = {"mu_s": 1.0, "mu_d": 0.5, "v_s": 0.5}
CYCLES = {  # of ``Belt.cycle``: frequency, largest x over the mean, multiplier
    "curve": (FALLING, 1.0, 0.1, (1.0041647003, 0.9923669814, -0.807351)),
    "table": ({"mu": TABLE}, 1.3, 0.02, (1.0041901512, 1.2698383886, -0.903906)),
}
SIZES = {"curve": 1.2, "table": 1.05}
TRUNCATED = 3e-4
"""What 11 harmonics leave out of a force with corners: they fall as 1/m^2, what the mass answers as 1/m^4."""


@pytest.mark.parametrize("kind", CYCLES)
def test_stick_slip_cycles_and_their_multipliers_are_those_of_an_integration_with_events(kind):
    numbers, V, damping, (omega, largest, multiplier) = CYCLES[kind]
    law = ss.models.StribeckContact(kt=KT, **numbers, normal_load=1.0)
    found = cycle(law, V, damping, 11, SIZES[kind] * V)
    assert found[0] == pytest.approx(omega, rel=TRUNCATED)
    assert found[1] == pytest.approx(largest, rel=TRUNCATED)
    assert abs(found[3].multipliers[0] - multiplier) < found[3].error < 0.05


@pytest.mark.verify
@pytest.mark.parametrize("kind", CYCLES)
def test_more_harmonics_come_nearer(kind):
    numbers, V, damping, known = CYCLES[kind]
    speeds, coefficients = np.array(TABLE).T
    slopes = np.append(np.diff(coefficients) / np.diff(speeds), 0.0)
    if kind == "table":
        belt = Belt(
            V, lambda v: np.interp(v, speeds, coefficients), lambda v: slopes[np.searchsorted(speeds, v, "right") - 1],
            kt=KT, c=damping,
        )  # fmt: skip
    else:
        belt = Belt(V, lambda v: 0.5 + 0.5 * np.exp(-v / 0.5), lambda v: -np.exp(-v / 0.5), kt=KT, c=damping)
    exact = belt.cycle(1.5 * V)
    assert exact[:2] == pytest.approx(known[:2], rel=1e-8)
    assert exact[2] == pytest.approx(known[2], abs=1e-3)  # by differences
    law = ss.models.StribeckContact(kt=KT, **numbers, normal_load=1.0)
    few, many = (cycle(law, V, damping, n, SIZES[kind] * V) for n in (11, 45))
    assert abs(many[1] - exact[1]) < 0.25 * abs(few[1] - exact[1])
    assert abs(many[3].multipliers[0] - exact[2]) < many[3].error < 0.25 * few[3].error
