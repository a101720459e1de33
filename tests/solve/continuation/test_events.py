"""Events: which sign changes count, and how well their places are known."""

import numpy as np
import pytest

from slipstick.errors import Outcome
from slipstick.solve.continuation import BranchEvent, continuation
from slipstick.solve.continuation.events import BracketedRoot, turning_points
from slipstick.solve.continuation.step_control import StepOptions, next_step
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation


class Sine:
    """x = sin(p)."""

    def evaluate(self, x, parameter):
        return Evaluation(x - np.sin(parameter), DenseJacobian(np.eye(1)), np.array([-np.cos(parameter)]))


def slope(step):
    return step.tangent_x[0]


@pytest.mark.parametrize("direction, expected", [(-1, [0.5, 2.5]), (1, [1.5]), (0, [0.5, 1.5, 2.5])])
def test_direction_chooses_maxima_or_minima(direction, expected):
    event = BranchEvent(name="extreme", kind="peak", function=slope, direction=direction)
    steps = list(continuation(Sine(), [0.0], 0.0, 9.0, events=[event]))
    found = [s for s in steps if s.kind == "peak"]
    assert [s.parameter for s in found] == pytest.approx(np.pi * np.array(expected), rel=1e-9)
    assert {s.name for s in found} == {"extreme"}


def test_several_events_in_one_step_come_in_order():
    places = [3.0, 3.001, 3.002, 3.0015]
    events = [BranchEvent(name=str(p), kind="mark", function=lambda s, p=p: s.parameter - p) for p in places]
    steps = list(continuation(Sine(), [0.0], 0.0, 9.0, events=events, requested=[3.0005]))
    found = [s.parameter for s in steps if s.kind in ("mark", "requested")]
    assert found == pytest.approx([3.0, 3.0005, 3.001, 3.0015, 3.002], abs=1e-9)
    assert np.all(np.diff([s.parameter for s in steps]) > 0)


def test_terminal_event_ends_the_branch():
    event = BranchEvent(name="quarter", kind="peak", function=slope, terminal=True)
    run = continuation(Sine(), [0.0], 0.0, 9.0, events=[event])
    steps = list(run)
    assert steps[-1].kind == "peak"
    assert steps[-1].parameter == pytest.approx(np.pi / 2, rel=1e-9)
    assert run.outcome is Outcome.COMPLETED
    assert "quarter" in run.message


def test_a_jump_of_the_function_is_bracketed():
    event = BranchEvent(name="jump", kind="switch", function=lambda s: 1.0 if s.parameter > 4.0 else -1.0)
    steps = list(continuation(Sine(), [0.0], 0.0, 9.0, events=[event]))
    (found,) = [s for s in steps if s.kind == "switch"]
    assert found.parameter == pytest.approx(4.0, abs=1e-8)


@pytest.mark.parametrize(
    "before, after, rising, falling",
    [
        (-1, 1, True, False),
        (1, -1, False, True),
        (-1, 0, True, False),
        (1, 0, False, True),
        (0, 1, False, False),
        (0, 0, False, False),
        (1, 2, False, False),
    ],
)
def test_crossings(before, after, rising, falling):
    def event(direction):
        return BranchEvent(name="", kind="", function=slope, direction=direction)

    assert event(1).crossed(before, after) == rising
    assert event(-1).crossed(before, after) == falling
    assert event(0).crossed(before, after) == (rising or falling)
    assert turning_points().kind == "turning point"


@pytest.mark.parametrize(
    "function, low, high, root",
    [
        (np.cos, 0.0, 3.0, np.pi / 2),
        (lambda x: (x - 1.0) ** 3, 0.0, 3.0, 1.0),
        (lambda x: np.exp(20 * (x - 0.9)) - 1.0, 0.0, 1.0, 0.9),
        (lambda x: -1.0 if x < 0.3 else 1.0, 0.0, 1.0, 0.3),
        (lambda x: x - 1.0, 0.0, 1.0, 1.0),
    ],
)
def test_bracketed_root(function, low, high, root):
    search = BracketedRoot(low, function(low), high, function(high))
    trials = 0
    while search.width > 1e-12 and trials < 60:
        search.update(search.trial, function(search.trial), 1e-12)
        trials += 1
    assert search.best == pytest.approx(root, abs=1e-4 if root == 1.0 and high == 3.0 else 1e-11)
    assert trials < 60


def test_step_length_follows_contraction_angle_and_iterations():
    options = StepOptions(max_step=1.0)
    good = {"contraction": 1e-6, "iterations": 2, "angle": 1e-3, "order": 4, "options": options}
    assert next_step(0.1, **good) == pytest.approx(0.2)
    assert next_step(0.9, **good) == 1.0
    assert next_step(0.1, **good | {"contraction": 0.1}) == pytest.approx(0.1)
    assert next_step(0.1, **good | {"contraction": 0.1 * 1.2**4}) == pytest.approx(0.1 / 1.2)
    assert next_step(0.1, **good | {"angle": 1.5 * options.aimed_angle}) == pytest.approx(0.1 / 1.5)
    assert next_step(0.1, **good | {"iterations": 100}) == pytest.approx(0.05)
