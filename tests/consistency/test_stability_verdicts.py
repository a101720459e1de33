"""Verdicts on stiff stops and friction with few harmonics, against shooting and against integration by other means."""

import warnings

import numpy as np
import pytest
from helpers.floquet import distance, exact_multipliers
from helpers.perturbed import random_contacts, random_stops
from helpers.stability import contact_motion
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.analysis.curve.response import follow
from slipstick.analysis.time_domain.event_integrator import ChatteringError

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")

CLEAR = 1e-4
"""Distance of the largest true multiplier from the unit circle from which on the verdict has to be right."""


def verdict(make, seed):
    """Growing disturbances as told and in truth; None where either has no motion or the circle is too near."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem, omega = make(seed)
        point = next(follow(problem, omega=(omega, omega + 0.01), stability=True), None)
    if point is None:
        return None
    try:
        exact = exact_multipliers(problem, point.detail.omega, *contact_motion(problem, point))
    except ChatteringError:
        return None
    if exact is None or abs(abs(exact[0][0]) - 1.0) < CLEAR:
        return None
    return point.stability.unstable, int(np.sum(np.abs(exact[0]) > 1.0)), point.stability, exact[0]


@pytest.mark.parametrize("seed", [39, 45, 51])
def test_a_motion_that_few_harmonics_picture_badly_is_judged_by_itself(seed) -> None:
    """By its truncated picture each is unstable, by 1.4 to 11; the motion that exists is stable."""
    told, true, found, exact = verdict(random_stops, seed)
    assert (told, true) == (0, 0)
    assert found.method == "shooting"
    assert distance(found.multipliers, exact) < 1e-6


@pytest.mark.parametrize("seed", [74, 92])
def test_a_contact_that_moves_along_one_line_remembers_the_slip_it_stuck_from(seed) -> None:
    """Its normal and its tangential motion turn at once, and critical times coincide."""
    _, _, found, exact = verdict(random_stops, seed)
    assert found.method == "PW"
    assert distance(found.multipliers, exact) < 2e-3


@pytest.mark.verify
def test_two_hundred_verdicts_are_those_of_shooting() -> None:
    """None is wrong, and at most 3 % are not known."""
    known = [verdict(random_stops, seed) for seed in range(130)] + [verdict(random_contacts, s) for s in range(90)]
    judged = [(told, true) for told, true, *_ in filter(None, known)]
    assert len(judged) >= 200
    assert [pair for pair in judged if pair[0] not in (-1, pair[1])] == []
    assert sum(told == -1 for told, _ in judged) <= 0.03 * len(judged)
    assert sum(true > 0 for _, true in judged) >= 20


def two_masses():
    """Example 3 of NLvib (Krack, Gross, doi 10.1007/978-3-030-14023-6): chain of two masses, a stop on the first."""
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    structure = ss.MatrixStructure(M=np.eye(2), C=0.03 * K, K=K, dofs=["a", "b"])
    contact = ss.FrictionContact(kt=1.0, mu=0.0, kn=100.0, gap=1.0)
    stop = ss.ContactPair(name="stop", tangential="a", normal="a", contact=contact)
    return ss.Problem(
        structure, contacts=stop, loads=ss.Load(dof="b", cos=0.1), harmonics=range(22), outputs=["a", "b"]
    )


def integrated(omega, z):
    """The two masses over a period from ``z`` (4,), and the derivative of what they end with, by Runge-Kutta."""
    K, load = np.array([[1.0, -1.0], [-1.0, 2.0]]), np.array([0.0, 0.1])

    def rate(t, y):
        q, v, Phi = y[:2], y[2:4], y[4:].reshape(4, 4)
        over = max(q[0] - 1.0, 0.0)
        stiffness = K + np.diag([100.0 * (over > 0.0), 0.0])
        force = load * np.cos(omega * t) - K @ q - 0.03 * K @ v - np.array([100.0 * over, 0.0])
        slope = -stiffness @ Phi[:2] - 0.03 * K @ Phi[2:]
        return np.concatenate([v, force, Phi[2:].ravel(), slope.ravel()])

    start = np.concatenate([z, np.eye(4).ravel()])
    end = solve_ivp(rate, (0.0, 2.0 * np.pi / omega), start, method="DOP853", rtol=1e-9, atol=1e-11, max_step=0.05)
    return end.y[:4, -1], end.y[4:, -1].reshape(4, 4)


def integrated_multipliers(branch, point):
    """Of the periodic motion beside a point, by Newton's method on the period."""
    data = branch.dataset.isel(point=point)
    omega, m = float(data.omega), branch.harmonics.m
    X = data.displacement.sel(dof=["a", "b"]).values
    z = np.concatenate([X[:, 0] + X[:, 1::2].sum(axis=1), omega * (X[:, 2::2] * m).sum(axis=1)])
    for _ in range(20):
        end, Phi = integrated(omega, z)
        if np.abs(end - z).max() < 1e-8:
            break
        z = z + np.linalg.solve(np.eye(4) - Phi, end - z)
    assert np.abs(end - z).max() < 1e-8
    found = np.linalg.eigvals(Phi)
    return found[np.argsort(-np.abs(found))]


@pytest.mark.verify
def test_two_masses_and_a_stop_as_in_nlvib() -> None:
    """Stable at 0.70 and unstable between the folds at 0.75; doublings where the motion in time has them."""
    branch = ss.forced_response(two_masses(), omega=(0.8, 0.5), at=[0.75, 0.70], stability=True)
    data = branch.dataset
    where, size = data.omega.values, data.amplitude.sel(dof="b").values
    middle = np.flatnonzero((where == 0.75) & (size > 0.5) & (size < 1.3))[0]
    top = np.flatnonzero((where == 0.70) & (size > 0.8))[0]
    assert (data.stable.values[middle], data.stable.values[top]) == (0, 1)
    for point in (middle, top):
        exact = integrated_multipliers(branch, point)
        assert float(data.multiplier_max.values[point]) == pytest.approx(abs(exact[0]), abs=1e-4)
    doublings = [found for found in branch.bifurcations() if found.kind == "period doubling"]
    assert [round(found.value, 4) for found in doublings] == [0.7556, 0.7388]
    exact = integrated_multipliers(branch, doublings[1].point)
    assert np.abs(exact + 1.0).min() < 1e-3
    assert np.mean(data.stable.values == -1) <= 0.03
