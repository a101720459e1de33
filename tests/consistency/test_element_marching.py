"""The exact element against brute-force marching on random states.

The march errs by the square of its step. Every state is marched with ever more samples until it agrees with the element
to 1e-6 of the forces in play; a state that does not agree at the finest grid fails. The order of the fall is asserted
too, so the limit of the march is the element, not something near it.
"""

import numpy as np
import pytest
from marching import force_scale, march, random_states

from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics

TOLERANCE = 1e-6
GAPPY = {4: [0, 1, 2, 5, 9], 3: [0, 1, 3, 7], 2: [0, 5, 40]}


def orders_of(n, gaps=False):
    return GAPPY[n] if gaps else list(range(n + 1))


def errors(orders, state, Fx, Fy, samples):
    """Relative distance of forces from the march, for each element."""
    marched = march(orders, **state, samples=samples)
    distance = [np.abs(a - b).max(axis=1) for a, b in zip((Fx, Fy), marched, strict=False)]
    return np.maximum(*distance) / force_scale(orders, **state)


def assert_marched(orders, state, first=2**11, last=2**20, batch=256):
    """Marches each state with four times the samples until it agrees."""
    forces = element_forces(Harmonics(orders), **state)
    left, samples = np.arange(len(state["v"])), first
    while len(left) and samples <= last:
        differing = []
        for part in np.array_split(left, np.ceil(len(left) * samples / (batch * first))):
            chosen = {name: value[part] for name, value in state.items()}
            error = errors(orders, chosen, forces.Fx[part], forces.Fy[part], samples)
            differing.append(part[error >= TOLERANCE])
        left = np.concatenate(differing)
        samples *= 4
    assert len(left) == 0, f"{orders}: states {left} differ at {samples // 4} samples"


@pytest.mark.parametrize("n", range(1, 11))
def test_random_states(n):
    rng = np.random.default_rng(n)
    orders = orders_of(n)
    assert_marched(orders, random_states(rng, 50, orders))


@pytest.mark.parametrize("n", sorted(GAPPY))
def test_random_states_with_gaps_in_the_harmonics(n):
    rng = np.random.default_rng(100 + n)
    orders = orders_of(n, gaps=True)
    assert_marched(orders, random_states(rng, 50, orders), first=2**13)


@pytest.mark.verify(sample=3)
@pytest.mark.parametrize("n", range(1, 11))
def test_ten_thousand_random_states(n):
    """Ten times 1e4 states: 1e5 in all."""
    rng = np.random.default_rng(1000 + n)
    orders = orders_of(n)
    assert_marched(orders, random_states(rng, 10_000, orders))


def test_march_converges_to_the_element_with_second_order():
    orders = list(range(6))
    state = random_states(np.random.default_rng(7), 80, orders)
    forces = element_forces(Harmonics(orders), **state)
    samples = 2 ** np.arange(10, 17)
    mean = [np.mean(errors(orders, state, forces.Fx, forces.Fy, s)) for s in samples]
    order = -np.polyfit(np.log(samples), np.log(mean), 1)[0]
    assert 1.8 < order < 2.2
    assert mean[-1] < 1e-8


def test_residual_traction_is_the_interval_of_the_march():
    """For v = 0 both limits of the friction force after a period; equal wherever the element ever slipped or opened."""
    orders = [0, 1, 2]
    state = random_states(np.random.default_rng(3), 300, orders, still=1.0)
    state["kt"] = state["kt"] * 0.03
    forces = element_forces(Harmonics(orders), **state)
    _, _, ends, _ = march(orders, **state, samples=2**15)
    width = ends[:, 1] - ends[:, 0]
    stuck = width > 1e-6
    assert 20 < stuck.sum() < 280
    np.testing.assert_allclose(
        np.diff(forces.residual_traction, axis=1)[:, 0][stuck], width[stuck], rtol=1e-6, atol=1e-7
    )
    np.testing.assert_allclose(np.diff(forces.residual_traction, axis=1)[:, 0][~stuck], 0.0, atol=1e-12)
    np.testing.assert_allclose(forces.stick_fraction[stuck], 1.0)
    np.testing.assert_allclose(forces.Fx[stuck, 0], forces.residual_traction[stuck].mean(axis=1), rtol=1e-9, atol=1e-12)
