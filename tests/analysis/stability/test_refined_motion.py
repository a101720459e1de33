"""The iterated motion: kept harmonics stay, the others come nearer to the truth."""

import numpy as np
from helpers.stability import contact_motion, point_at, two_dofs

import slipstick as ss
from slipstick.analysis.curve.response import follow
from slipstick.analysis.stability.refined_motion import Iteration
from slipstick.balance.balance import Balance


def test_further_harmonics_are_those_of_a_balance_that_keeps_them() -> None:
    few = two_dofs(ss.RubbingMotion(velocity=1.0), harmonics=6)
    many = two_dofs(ss.RubbingMotion(velocity=1.0), harmonics=41)
    point = point_at(few, 6.0)
    motion = Iteration(Balance(few))(point.x, point.detail)
    assert motion.harmonics.highest == 20
    kept = contact_motion(few, point)
    assert np.array_equal(motion.X[:, :11], kept[0])
    assert np.array_equal(motion.Y[:, :11], kept[1])
    true = contact_motion(many, point_at(many, 6.0))
    for found, wanted in zip((motion.X, motion.Y), true, strict=True):
        left_out = wanted[:, 11:41]
        assert np.abs(found[:, 11:] - left_out).max() < 0.5 * np.abs(left_out).max()


def test_orders_that_were_left_out_between_are_added_too() -> None:
    problem = two_dofs(ss.RubbingMotion(velocity=1.0))
    odd = ss.Problem(problem.structure, contacts=problem.contacts, loads=problem.loads, harmonics=[0, 1, 2, 5])
    point = point_at(odd, 6.0)
    motion = Iteration(Balance(odd))(point.x, point.detail)
    assert np.all(motion.X[:, 5:9] != 0.0)


def test_harmonics_that_are_not_in_use_at_a_point_are_added_there() -> None:
    """Multipliers of a curve with harmonics by need are those of all harmonics, to the accuracy asked for."""
    problem = two_dofs(ss.RubbingMotion(velocity=1.0))
    adapt = {"adapt_harmonics": 0.02, "max_step": 0.5}
    point = list(follow(problem, omega=(5.5, 6.0), stability=True, options=adapt))[-1]
    assert point.detail.adapted.in_use < problem.harmonics.n
    whole = point_at(problem, point.omega, stability=True).stability
    assert np.abs(point.stability.multipliers - whole.multipliers).max() < 2e-3
