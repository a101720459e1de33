"""From a problem to what is integrated in time: sizes, held parameters, and what cannot be."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.laws import Spring
from helpers.oscillator import with_law

from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.errors import InputError
from slipstick.verify.cases import oscillator


def test_sizes_and_orders_are_those_that_move():
    system = friction_system(oscillator(velocity=10.0), 5.0)
    assert (system.n, system.n_contacts, system.orders, system.size) == (1, 1, (1,), 6)
    assert system.velocity.tolist() == [10.0]
    assert system.approach.tolist() == [[800.0, 0.0, 0.0]]
    assert system.varies.tolist() == [False]
    np.testing.assert_allclose(system.forcing(0.3), [1.0, np.cos(0.3), np.sin(0.3)])
    assert system.loads.tolist() == [[0.0, 0.0, 100.0]]


def test_parameters_are_held():
    system = friction_system(oscillator(velocity=10.0), 5.0, {"mu": np.array([0.7]), "gap": np.array([-2.0])})
    assert (system.mu[0], system.kt[0], system.approach[0, 0]) == (0.7, 100.0, 2.0)


@pytest.mark.parametrize(
    ("held", "said"),
    [
        ({"nu": [1.0]}, "expected one of mu, kt, kn, gap"),
        ({"mu": [1.0, 2.0]}, r"found shape \(2,\); expected \(1,\)"),
        ({"mu": ["a"]}, "held 'mu'"),
        ([1.0], "a dict of contact parameters"),
    ],
)
def test_what_cannot_be_held(held, said):
    with pytest.raises(InputError, match=said):
        friction_system(oscillator(velocity=10.0), 5.0, held)


def test_other_laws_are_not_known():
    p = with_law(Spring(1.0), name="s", port="along")
    with raises_fault("time integration", says="'s' .* does not tell its rate"):
        friction_system(p, 5.0)
