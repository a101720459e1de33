"""Certified roots miss nothing; sampling does (64 points miss some in 1 % of random states)."""

import numpy as np
from marching import random_states

from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics
from slipstick.trig.roots import roots


def sign_changes(orders, coefficients, samples):
    """Number of sign changes a period seen on a uniform grid, for each row of coefficients."""
    basis = Harmonics(orders).H_minus(2 * np.pi * (np.arange(samples) + 0.123) / samples).T
    some = [rows @ basis > 0.0 for rows in np.array_split(coefficients, max(1, len(coefficients) // 50))]
    return np.concatenate([(up != np.roll(up, -1, axis=1)).sum(axis=1) for up in some])


def polynomials(rng, orders, count):
    m = np.concatenate([[1.0], np.repeat(np.asarray(orders[1:], float), 2)])
    p = rng.normal(size=(count, len(m))) * m ** -rng.uniform(0, 1, (count, 1))
    p[:, 0] *= rng.uniform(0, 3, count)
    return p


def test_sampling_misses_roots_that_the_certified_search_finds():
    orders = list(range(11))
    p = polynomials(np.random.default_rng(8), orders, 2000)
    h = Harmonics(orders)
    certified = np.array([len(roots(h, row)[0]) for row in p])
    coarse, fine = sign_changes(orders, p, 64), sign_changes(orders, p, 2**15)
    assert np.all(certified >= fine)
    assert np.all(certified >= coarse)
    assert 0.002 < (coarse < certified).mean() < 0.2
    assert (certified > fine).mean() < 1e-3


def test_roots_are_roots_of_the_companion_matrix():
    """Against the eigenvalues of the companion matrix of the polynomial in exp(i tau): same count, same places."""
    orders = list(range(9))
    for row in polynomials(np.random.default_rng(3), orders, 300):
        found, _ = roots(Harmonics(orders), row)
        complex_ = (row[1::2] - 1j * row[2::2]) / 2
        z = np.roots(np.concatenate([complex_[::-1], [row[0]], complex_.conj()]))
        angle = np.sort(np.mod(np.angle(z[np.abs(np.abs(z) - 1) < 1e-7]), 2 * np.pi))
        assert len(found) == len(angle)
        distance = np.abs(np.exp(1j * np.sort(np.mod(found, 2 * np.pi))) - np.exp(1j * angle))
        assert distance.max(initial=0.0) < 1e-6


def test_events_of_the_element_that_sampling_misses():
    """Separations too short for 64 samples are in the state sequence."""
    orders = list(range(11))
    state = random_states(np.random.default_rng(21), 3000, orders)
    f = element_forces(Harmonics(orders), **state)
    p = state["Y"].copy()
    p[:, 0] -= state["gap"]
    seen = sign_changes(orders, p, 64) // 2
    found = np.array([sum(name == "separation" for _, _, name in s) for s in f.states])
    mixed = (f.separation_fraction > 0) & (f.separation_fraction < 1)
    assert np.all(found[mixed] >= seen[mixed])
    assert (found > seen).sum() > 0
