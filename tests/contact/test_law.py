"""What makes a law: any class with its members; sums that leave their parts alone."""

import numpy as np

from slipstick.contact.law import Law, Motion, Response, add_to
from slipstick.trig.harmonics import Harmonics


class Spring:
    """The smallest law: one port, one parameter."""

    ports = ("along",)

    def __init__(self, k):
        self.values = {"k": k}

    def changed(self, **values):
        return Spring(**values)

    def respond(self, motion, values):
        (q,), k = motion.Q, values["k"]
        return Response(
            force=(k[:, None] * q,),
            by_motion={(0, 0): k[:, None, None] * np.eye(q.shape[1])},
            by_parameter=lambda name: {0: q},
            values=values,
            work=np.zeros(len(q)),
        )


def test_a_class_with_the_members_is_a_law():
    assert isinstance(Spring(1.0), Law)
    assert not isinstance(object(), Law)
    del_respond = type("Half", (), {"ports": (), "values": {}, "changed": None})
    assert not isinstance(del_respond(), Law)


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
