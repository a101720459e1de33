"""Ports: motion handed out and forces gathered are adjoint."""

import numpy as np
import pytest
from helpers.problems import random_problem

from slipstick.balance.balance import Balance

BALANCE = Balance(random_problem(0))
RNG = np.random.default_rng(0)


def test_motion_is_the_unknowns_and_that_of_the_counter_surface():
    x, given = RNG.normal(size=BALANCE.size), BALANCE.problem.inputs.batches[0]
    motion = BALANCE.layout.motion(0, x, 6.0, given)
    still = BALANCE.layout.motion(0, 0 * x, 6.0, given)
    spread = BALANCE.layout.spread(x)[0]
    for i in range(2):
        np.testing.assert_allclose(motion.Q[i] - still.Q[i], spread.get(i, 0.0), atol=1e-14)
        np.testing.assert_array_equal(still.Q[i], given.motion[i])
    np.testing.assert_allclose(motion.drift * 6.0, given.velocity)


def test_handing_out_and_gathering_are_adjoint():
    x = RNG.normal(size=BALANCE.size)
    count, L = BALANCE.n_contacts, BALANCE.L
    forces = [{i: RNG.normal(size=(count, L)) for i in range(2)}]
    moved = BALANCE.layout.spread(x)[0]
    power = sum(float(np.sum(forces[0][i] * moved[i])) for i in moved)
    assert power == pytest.approx(float(BALANCE.layout.real(BALANCE.layout.excitation(forces)) @ x))


def test_springs_are_put_where_there_is_no_damping():
    assert BALANCE.springs is None
    damped = Balance(random_problem(1))
    damped.anchor_if_undamped(6.0)
    assert damped.springs is None


def test_many_motions_are_handed_out_and_gathered_as_each_alone():
    layout, given, count = BALANCE.layout, BALANCE.problem.inputs.batches[0], BALANCE.n_contacts
    x, omega = RNG.normal(size=(3, BALANCE.size)), np.array([1.0, 6.0, 7.0])
    P = RNG.normal(size=(3, BALANCE.n_loads, BALANCE.L))
    forces = {i: RNG.normal(size=(3 * count, BALANCE.L)) for i in range(2)}
    motion, spread = layout.motion(0, x, omega, given.repeated(3)), layout.spread(x)[0]
    G = layout.excitation([forces], P, (3,))
    for i in range(3):
        own = slice(i * count, (i + 1) * count)
        alone = layout.motion(0, x[i], float(omega[i]), given)
        for both in zip(motion.Q, alone.Q, strict=True):
            np.testing.assert_array_equal(both[0][own], both[1])
        np.testing.assert_array_equal(motion.drift[:, own], alone.drift)
        for j, moved in layout.spread(x[i])[0].items():
            np.testing.assert_array_equal(spread[j][own], moved)
        np.testing.assert_array_equal(G[i], layout.excitation([{j: F[own] for j, F in forces.items()}], P[i]))
