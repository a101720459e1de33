"""Receptances of one frequency: derivatives, and the anchored form has the same solutions."""

import numpy as np
import pytest
from helpers.problems import random_problem

from slipstick.balance.balance import Balance
from slipstick.balance.compliance import Compliance, driving, lossless

BALANCE = Balance(random_problem(0))
ORDERS = BALANCE.orders


def at(omega, along=None):
    return Compliance(BALANCE.receptance, ORDERS, omega, along)


@pytest.mark.parametrize("springs", [None, np.linspace(1.0, 3.0, BALANCE.n_ports)], ids=["plain", "anchored"])
def test_slope_is_the_derivative_by_omega(springs):
    def made(omega):
        found = at(omega)
        if springs is not None:
            found.anchor(springs)
        return found

    h = 1e-4
    difference = (made(6.0 + h).value - made(6.0 - h).value) / (2 * h)
    np.testing.assert_allclose(made(6.0).slope, difference, atol=1e-6 * np.abs(difference).max())


def test_the_zero_harmonic_is_static_and_real():
    found = at(6.0)
    np.testing.assert_array_equal(found.value[:, :, 0], BALANCE.receptance.static.T)
    np.testing.assert_array_equal(found.slope[:, :, 0], 0.0)


def test_answer_and_reach_are_sums_over_columns():
    found, rng = at(6.0), np.random.default_rng(0)
    columns, _, n = found.value.shape
    G = rng.normal(size=(columns, n)) + 1j * rng.normal(size=(columns, n))
    G[:, 0] = G[:, 0].real
    for own, of, given in (
        (found.answer, found.value, G),
        (found.answer, found.value, G[:2]),
        (found.rate, found.slope, G),
    ):
        expected = BALANCE.layout.real(np.einsum("crn,cn->rn", of[: len(given)], given))
        np.testing.assert_allclose(own(given), expected, atol=1e-14)
    sizes = rng.uniform(size=columns)
    np.testing.assert_allclose(found.bound(sizes), np.einsum("crn,c->rn", np.abs(found.value), sizes), atol=1e-14)


def test_the_residual_with_its_slope_is_that_of_the_sums() -> None:
    """``X + conj(A) (F - P - springs)``; the slope is that of the compliance plus that of the forces."""
    found, rng, none = at(6.0), np.random.default_rng(4), np.empty(0)
    columns, ports, n = found.value.shape
    L = 2 * n - 1
    x, on_ports, P = rng.normal(size=(ports, L)), rng.normal(size=(2, ports, L)), rng.normal(size=(columns - ports, L))
    for springs, support in ((none, none), (rng.uniform(size=ports), none), (none, rng.uniform(size=ports))):
        G = BALANCE.layout.excitation([], P)  # the loads alone
        for p, row in enumerate(on_ports[0]):
            G[p, 0], G[p, 1:] = row[0], row[1::2] + 1j * row[2::2]
        if springs.size:
            G[:ports, 1:] += 1j * springs[:, None] * (x[:, 1::2] + 1j * x[:, 2::2])
        if support.size:
            G[:ports, 0] -= support * x[:, 0]
        np.testing.assert_allclose(driving(x, on_ports[0], P, springs, support), G, atol=1e-14)
        residual, slope = found.residual_with_slope(x, on_ports, P, springs, support)
        np.testing.assert_allclose(residual, x.ravel() + found.answer(G), atol=1e-13)
        pushed = driving(x, on_ports[1], P[:0], none, none)
        np.testing.assert_allclose(slope, found.rate(G) + found.answer(pushed), atol=1e-13)


def test_the_anchored_form_has_the_same_solutions():
    """``x = -A f`` holds where ``x + B (f - i k x) = 0`` does, written with conjugates as the balance sums."""
    plain, anchored, rng = at(6.0), at(6.0), np.random.default_rng(1)
    p = BALANCE.n_ports
    springs = rng.uniform(1.0, 30.0, p)
    anchored.anchor(springs)
    f = rng.normal(size=(p, ORDERS.size + 1)) + 1j * rng.normal(size=(p, ORDERS.size + 1))
    f[:, 0] = f[:, 0].real
    x = np.zeros((p, 2 * ORDERS.size + 2))
    x[:, 2:] = -plain.answer(f).reshape(p, -1)[:, 1:]
    residual = x[:, 2:] + anchored.answer(f + 1j * springs[:, None] * x.view(complex)).reshape(p, -1)[:, 1:]
    np.testing.assert_allclose(residual, 0.0, atol=1e-13)


def test_what_counts_as_lossless():
    value = np.array([1.0 + 0j, 1.0 - 1e-6j, 1.0 - 1e-3j, -2.0 + 0j, 0j])
    assert lossless(value, 1e-5).tolist() == [True, True, False, True, True]
