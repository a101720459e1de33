"""A rotor in a circular stator: coefficients against adaptive integration of the force, whatever the slip velocity."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from slipstick.contact import sampled, stator
from slipstick.contact.law import Motion
from slipstick.errors import SlipstickWarning
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


@pytest.mark.parametrize("cn", [0.0, 0.4])
@pytest.mark.parametrize("slow", [0.3, 1e-4])
def test_derivatives_are_differences_and_many_are_single_ones(slow, cn):
    law, motion = StatorContact(kn=5.0, gap=1.0, mu=0.3, cn=cn, slip_velocity=slow), whirling(2)
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


@pytest.mark.parametrize("slow", [1.0, 1e-2, 1e-4, 1e-6, 1e-8])
def test_damping_that_jumps_where_it_touches_is_integrated(slow):
    """Gauss's rule between all corners and reversals, known to rounding, in panels far shorter than needed."""
    law, motion = StatorContact(kn=5.0, gap=1.0, mu=0.3, cn=0.1, slip_velocity=slow), whirling()
    at, grid = values(law), np.linspace(0.0, TURN, 4001)

    def depth(t):
        x, y = (motion.Q[i][0] @ H.H_minus(t) for i in (0, 1))
        return np.hypot(x, y) - 1.0

    def slip(t):
        (x, y), (dx, dy) = ([f(motion.Q[i][0]) @ H.H_minus(t) for i in (0, 1)] for f in (np.asarray, H.derivative))
        return -1.0 + (x * dy - y * dx) / np.hypot(x, y)

    edges = [grid]
    for f in (depth, slip):
        told = np.array([f(t) for t in grid])
        roots = [
            brentq(f, a, b, xtol=1e-15)
            for a, b, p in zip(grid, grid[1:], told[1:] * told[:-1], strict=False)
            if p < 0.0
        ]
        edges += [np.add.outer(roots, sign * np.geomspace(1e-10, 1e-2, 200)).ravel() for sign in (-1.0, 0.0, 1.0)]
    ends = np.unique(np.clip(np.concatenate(edges), 0.0, TURN))
    nodes, weights = np.polynomial.legendre.leggauss(8)
    tau = (ends[:-1, None] + 0.5 * np.diff(ends)[:, None] * (1.0 + nodes)).ravel()
    share = (0.5 * np.diff(ends)[:, None] * weights).ravel() / np.pi
    found = law.respond(motion, at).force
    for i, force in enumerate(law.forces_in_time(motion, at, tau)):
        np.testing.assert_allclose(found[i][0], (share * force[0]) @ H.H_plus(tau), rtol=0, atol=3e-9)


@pytest.mark.parametrize("kn", [0.0, 5.0])
def test_the_phase_at_which_damping_begins_moves_with_the_clearance_and_the_motion(kn):
    """The damping force jumps there; complex steps inside the panels do not see it."""
    law, motion, step = StatorContact(kn=kn, gap=1.0, mu=0.3, cn=0.4, slip_velocity=0.3), whirling(), 1e-6
    response = law.respond(motion, values(law))
    by_gap = response.by_parameter("gap")
    wider, narrower = (law.changed(gap=1.0 + h).respond(motion, {**values(law), "gap": np.array([1.0 + h])}).force
                       for h in (step, -step))  # fmt: skip
    for i in range(3):
        np.testing.assert_allclose(by_gap[i][0], (wider[i] - narrower[i])[0] / (2.0 * step), rtol=0, atol=1e-8)
    for j, c in ((0, 0), (0, 2), (1, 1)):
        Q = [[q + h * (np.arange(H.size) == c) * (k == j) for k, q in enumerate(motion.Q)] for h in (step, -step)]
        ahead, behind = (law.respond(motion._replace(Q=tuple(moved)), values(law)).force for moved in Q)
        for i in range(3):
            difference = (ahead[i] - behind[i])[0] / (2.0 * step)
            np.testing.assert_allclose(response.by_motion[i, j][0, :, c], difference, rtol=0, atol=1e-8)


def test_a_contact_shorter_than_any_grid_is_found():
    """Beyond a circle inside the clearance for 2e-4 of a radian; force times kn is the integral over that arc."""
    ahead = 5e-9  # x = 1 + ahead at the phase 0.1, falling off as 1 - tau^2/2 there
    x, y = np.zeros((1, H.size)), np.zeros((1, H.size))
    x[0, 1], x[0, 2] = (1.0 + ahead) * np.cos(0.1), (1.0 + ahead) * np.sin(0.1)
    motion = Motion(H, 1.0, (x, y, np.zeros_like(x)), np.array([[0.0], [0.0], [1.0]]))
    law = StatorContact(kn=1.0, gap=1.0)
    half = np.sqrt(2.0 * ahead)  # two such arcs a period, on both sides
    assert [state for _, _, state in law.states(motion, values(law))[0]].count("slip") == 2
    first = np.hypot(*law.respond(motion, values(law)).force[0][0, 1:3])
    assert first == pytest.approx(2.0 * (4.0 / 3.0 * ahead * half) / np.pi, rel=1e-4, abs=0.0)


def test_too_many_panels_are_told(monkeypatch):
    monkeypatch.setattr(sampled, "MOST_PANELS", 20)
    law = StatorContact(kn=5.0, gap=1.0, mu=0.3, slip_velocity=0.1)
    with pytest.warns(SlipstickWarning, match="changes too fast in time"):
        law.respond(whirling(), values(law))


def test_slopes_are_those_of_complex_steps():
    rng, at = np.random.default_rng(0), {"kn": 5.0, "mu": 0.3, "gap": 1.0, "cn": 0.2, "slip_velocity": 0.4}
    arguments = [[2.0 * rng.normal(size=(3, 50)) for _ in range(3)] for _ in range(2)]
    table = {name: np.full((3, 1), value) for name, value in at.items()}
    for k, found in enumerate(stator._slopes(*arguments, table)):
        for j in range(3):
            moved = [[part.astype(complex) for part in parts] for parts in arguments]
            moved[k][j] = moved[k][j] + 1e-30j
            for i, force in enumerate(stator._force(*moved, **table)):
                np.testing.assert_allclose(found[i, j], np.imag(force) / 1e-30, rtol=0, atol=1e-12)


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
