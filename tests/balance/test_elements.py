"""Tangents as blocks: what they answer is what the batch's derivatives answer, port by port."""

import numpy as np
import pytest
from helpers.problems import random_problem

from slipstick.balance.balance import Balance
from slipstick.balance.contact_jacobian import Elements

BALANCE = Balance(random_problem(0))
RNG = np.random.default_rng(0)
L, COUNT = BALANCE.L, BALANCE.n_contacts
TANGENTS = {key: RNG.normal(size=(COUNT, L, L)) for key in ((0, 0), (0, 1), (1, 1))}


@pytest.fixture(scope="module")
def elements():
    return Elements(BALANCE, 0, TANGENTS)


def padded(dx):
    return np.vstack([dx.reshape(BALANCE.n_ports, L), np.zeros(L)])


def test_forces_of_motion_are_those_of_the_derivatives(elements):
    dx = RNG.normal(size=BALANCE.size)
    out = np.zeros((BALANCE.n_ports + 1, L))
    elements.forces(padded(dx), out)
    moved, forces = BALANCE.layout.spread(dx)[0], {}
    for (i, j), tangent in TANGENTS.items():
        forces[i] = forces.get(i, 0.0) + np.einsum("cij,cj->ci", tangent, moved[j])
    layout = BALANCE.layout
    np.testing.assert_allclose(out[:-1].reshape(-1), layout.real(layout.excitation([forces])), atol=1e-12)


def test_the_transpose_is_adjoint(elements):
    a, b = (padded(dx) for dx in RNG.normal(size=(2, BALANCE.size)))
    forward, back = np.zeros_like(a), np.zeros_like(a)
    elements.forces(a, forward)
    elements.forces(b, back, transposed=True)
    assert np.sum(forward[:-1] * b[:-1]) == pytest.approx(np.sum(a[:-1] * back[:-1]))


def test_every_port_has_a_stiffness(elements):
    missing = elements.rows < 0
    assert missing.any()
    found = elements.stiffness(elements.local)
    assert found.shape == missing.shape
    assert np.all((found > 0.0) != missing)
