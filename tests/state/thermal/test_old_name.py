"""Pickles written when the room was called ``slipstick.thermal``."""

import pickle

import numpy as np

import slipstick as ss
from slipstick.verify.cases import oscillator


def test_a_pickle_that_names_the_old_room_loads():
    curve = ss.FrictionCurve(temperature=[0.0, 200.0, 5000.0], mu=[0.3, 0.25, 0.2])
    problem = ss.Problem(
        oscillator(velocity=10.0).structure,
        contacts=oscillator(velocity=10.0).contacts,
        thermal=ss.ThermalModel(curve=curve, background=20.0, resistance=0.05),
    )
    text = pickle.dumps(problem, protocol=0)
    assert b"slipstick.state.thermal.model" in text
    old = pickle.loads(text.replace(b"slipstick.state.thermal.", b"slipstick.thermal."))
    assert type(old.thermal) is ss.ThermalModel
    np.testing.assert_array_equal(old.thermal.curve.mu([20.0, 400.0]), curve.mu([20.0, 400.0]))
    assert [state.names for state in old.contact_states] == [("damper",)]
