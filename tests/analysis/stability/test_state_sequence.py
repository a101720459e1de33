"""The time axis of all contacts: every state where its contact has it, cut in the longest interval."""

import numpy as np
from helpers.stability import point_at, two_dofs

import slipstick as ss
from slipstick.analysis.stability.refined_motion import Iteration
from slipstick.analysis.stability.state_sequence import state_order, timeline
from slipstick.balance.balance import Balance
from slipstick.contact.forces import element_states
from slipstick.contact.kernel.tuples import NAMES


def motion_of(problem, omega):
    point = point_at(problem, omega)
    return Iteration(Balance(problem))(point.x, point.detail)


def two_contacts():
    problem = two_dofs(ss.RubbingMotion(velocity=1.0))
    other = ss.ContactPair(
        name="d", tangential="y", contact=ss.FrictionContact(kt=50.0, mu=0.3, normal_load=10.0),
        rubbing=ss.RubbingMotion(velocity=0.5),
    )  # fmt: skip
    return ss.Problem(
        problem.structure, contacts=[*problem.contacts, other], loads=problem.loads, harmonics=problem.harmonics
    )


def test_states_follow_one_another_as_the_elements_say() -> None:
    motion = motion_of(two_contacts(), 6.0)
    line = timeline(motion)
    assert abs(sum(i.length for i in line.intervals) - 2.0 * np.pi) < 1e-12
    assert line.intervals[-1].change is None
    assert line.intervals[-1].states == line.cut
    ends = [i.change.time for i in line.intervals[:-1]]
    start = (ends[0] - line.intervals[0].length) % (2.0 * np.pi)
    known = element_states(motion.harmonics, motion.X, motion.Y, **motion.values)
    tau = start
    for interval in line.intervals:
        middle = (tau + 0.5 * interval.length) % (2.0 * np.pi)
        for contact, state in enumerate(interval.states):
            here = [n for a, b, n in known[contact] if a <= middle < b or a <= middle + 2.0 * np.pi < b]
            assert here == [NAMES[state]]
        tau += interval.length
    longest = max(i.length for i in line.intervals[1:-1])
    assert line.intervals[0].length + line.intervals[-1].length >= longest
    assert line.intervals[0].length == line.intervals[-1].length


def test_a_word_does_not_depend_on_where_the_period_begins() -> None:
    problem = two_dofs(ss.RubbingMotion())
    loads = [ss.Load(dof="x", cos=40.0), ss.Load(dof="y", sin=-25.0)]
    late = ss.Problem(problem.structure, contacts=problem.contacts, loads=loads, harmonics=problem.harmonics)
    words = [state_order(m.harmonics, m.X, m.Y, m.values) for m in (motion_of(problem, 6.0), motion_of(late, 6.0))]
    assert words[0] == words[1]
    assert len(words[0][0]) > 2


def test_without_changes_there_is_one_interval() -> None:
    line = timeline(motion_of(two_dofs(ss.RubbingMotion(velocity=100.0), gap=-5.0), 6.0))
    assert [i.states for i in line.intervals] == [(2,)]
    assert line.neutral == ()
