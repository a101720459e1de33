"""What makes a law: its ports, parameters and answer; the defaults of all else; sums that leave parts alone."""

import numpy as np
import pytest
from helpers.laws import Spring

from slipstick.contact.law import Law, Motion, add_to
from slipstick.trig.harmonics import Harmonics


def test_a_law_without_its_methods_is_none():
    with pytest.raises(TypeError, match="respond"):
        type("Half", (Law,), {"ports": (), "values": {}, "changed": None})()


def test_what_a_law_does_not_tell_is_unknown():
    spring, values, h = Spring(1.0), {"k": np.ones(2)}, Harmonics(2)
    motion = Motion(h, 1.0, (np.ones((2, h.size)),), np.zeros((1, 2)))
    assert spring.states(motion, values) is None
    assert spring.forces_in_time(motion, values, np.zeros(3)) is None
    assert not spring.in_time
    assert spring.kind != Spring(1.0).kind


def test_what_a_response_leaves_out_is_empty():
    h = Harmonics(2)
    response = Spring(2.0).respond(Motion(h, 1.0, (np.ones((3, h.size)),), np.zeros((1, 3))), {"k": np.full(3, 2.0)})
    assert (response.by_drift, response.by_omega, response.detail) == ({}, {}, None)


def test_sums_do_not_write_on_their_parts():
    part = np.ones(2)
    total = {}
    for _ in range(3):
        add_to(total, 0, part)
    add_to(total, (1, 0), part)
    np.testing.assert_array_equal(part, 1.0)
    np.testing.assert_array_equal(total[0], 3.0)
    np.testing.assert_array_equal(total[1, 0], 1.0)
