"""A rotor in a circular stator: coefficients against adaptive integration of the force, whatever the slip velocity."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from slipstick.contact.law import Motion
from slipstick.models import StatorContact
from slipstick.trig.harmonics import Harmonics

H = Harmonics(range(4))
TURN = 2.0 * np.pi


def whirling(n=1):
    """A circle beside the centre, seen turning about as fast as the surface: it touches for part, and slip reverses."""
    x, y = np.zeros((n, H.size)), np.zeros((n, H.size))
    x[:, 0], x[:, 1], y[:, 2], y[:, 3] = 0.5, 1.0, 1.0, 0.1
    return Motion(H, 1.3, (x, y, np.zeros_like(x)), np.array([[0.0], [0.0], [-1.0]]) * np.ones((1, n)))


def values(law, n=1):
    return {name: np.full(n, float(value)) for name, value in law.values.items()}


@pytest.mark.parametrize("slow", [1.0, 1e-6])
def test_coefficients_are_resolved_whatever_the_slip_velocity(slow):
    law, motion = StatorContact(kn=5.0, gap=1.0, mu=0.3, cn=0.1, slip_velocity=slow), whirling()
    response, at = law.respond(motion, values(law)), values(law)
    grid = np.linspace(0.0, TURN, 20001)
    forces = np.stack([f[0] for f in law.forces_in_time(motion, at, grid)])
    fast = np.abs(np.diff(forces[2]))
    places = grid[:-1][fast > 0.02 * np.abs(forces[2]).max()]
    edges = np.unique(np.concatenate([np.linspace(0.0, TURN, 9), places, places + TURN / 20000]))
    for c in (1,):
        for i in (0, 2):

            def integrand(t, c=c, i=i):
                tau = np.array([t])
                return law.forces_in_time(motion, at, tau)[i][0, 0] * H.H_plus(tau)[0, c] / np.pi

            exact = sum(quad(integrand, a, b, epsabs=1e-11, limit=400)[0] for a, b in pairwise(edges))
            assert response.force[i][0, c] == pytest.approx(exact, abs=3e-8)


@pytest.mark.parametrize("slow", [0.3, 1e-4])
def test_derivatives_are_differences_and_many_are_single_ones(slow):
    law, motion = StatorContact(kn=5.0, gap=1.0, mu=0.3, slip_velocity=slow), whirling(2)
    at = values(law, 2)
    response, step = law.respond(motion, at), 1e-5
    for j, c in ((0, 1), (1, 2), (1, 3)):

        def moved(h, j=j, c=c):
            Q = [q.copy() for q in motion.Q]
            Q[j][:, c] += h
            return law.respond(motion._replace(Q=tuple(Q)), at).force

        for i in range(3):
            near, far = (moved(h)[i] - moved(-h)[i] for h in (step, 2.0 * step))
            exact = response.by_motion[i, j][:, :, c]
            np.testing.assert_allclose(
                exact, (8.0 * near - far) / (12.0 * step), rtol=0, atol=2e-3 * np.abs(exact).max()
            )
    one = law.respond(whirling(), values(law))
    for i in range(3):
        np.testing.assert_array_equal(response.force[i][1], one.force[i][0])
    np.testing.assert_array_equal(response.by_parameter("mu")[2][0], one.by_parameter("mu")[2][0])


def test_states_are_where_the_rotor_is_beyond_the_clearance():
    """Against samples of the distance; inside and outside all period there is one state."""
    law, motion = StatorContact(kn=5.0, gap=1.0), whirling()
    (states,) = law.states(motion, values(law))
    tau = np.linspace(0.0, TURN, 4001)
    x, y = (H.H_minus(tau) @ Q[0] for Q in motion.Q[:2])
    touching = np.zeros(tau.size, dtype=bool)
    for start, end, state in states:
        touching |= ((tau - start) % TURN < end - start) & (state == "slip")
    clear = np.abs(np.hypot(x, y) - 1.0) > 1e-9
    assert (touching == (np.hypot(x, y) > 1.0))[clear].all()
    assert sum(end - start for start, end, _ in states) == pytest.approx(TURN)
    assert 0.1 < touching.mean() < 0.9
    for gap, state in ((0.1, "slip"), (9.0, "separation")):
        assert law.states(motion, values(StatorContact(kn=5.0, gap=gap)))[0] == [(0.0, TURN, state)]
