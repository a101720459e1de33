"""A Jacobian of a state that has none: every answer is nan, and it says that it is singular."""

import numpy as np

from slipstick.solve.linear.jacobian import Jacobian, UndefinedJacobian


def test_every_answer_is_nan():
    none = UndefinedJacobian(3)
    assert isinstance(none, Jacobian)
    assert none.singular
    for answer in (none.multiply(np.ones(3)), none.solve(np.ones(3), transposed=True), none.bound(np.ones(3))):
        assert np.isnan(answer).all()
        assert answer.shape == (3,)
    assert none.bordered(np.ones(3), np.ones(4)).size == 4
