"""Laws of one's own that several tests use."""

from __future__ import annotations

import numpy as np

from slipstick.contact.law import Law, Response


class Spring(Law):
    """The smallest law: one port, one parameter, nothing told beside."""

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
