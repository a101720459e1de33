"""Points between corrected ones: of the cubics, as near to the branch as was asked for, and only where wanted."""

from itertools import pairwise

import numpy as np
import pytest

from slipstick.solve.continuation import ArclengthScaling, ContinuationOptions, continuation
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation

PLAIN = ArclengthScaling(x=1.0, weight=1.0, adaptive=False)


class Function:
    """x = f(p), with its derivative."""

    def __init__(self, f, slope):
        self._f, self._slope = f, slope

    def evaluate(self, x, parameter):
        return Evaluation(x - self._f(parameter), DenseJacobian(np.eye(x.size)), -self._slope(parameter))


def sine():
    return Function(lambda p: np.array([np.sin(p), np.cos(p)]), lambda p: np.array([np.cos(p), -np.sin(p)]))


def kinked(at=1.3, slope=0.4):
    """Its slope changes: the cubic over it is off by up to an eighth of the step times the change."""
    front = lambda p: np.array([max(p - at, 0.0) * slope, 1.0])  # noqa: E731
    return Function(front, lambda p: np.array([slope if p > at else 0.0, 0.0]))


def walked(system, x0, **options):
    chosen = ContinuationOptions(first_step=0.05, max_step=0.1, **options)
    return list(continuation(system, x0, 0.0, 3.0, options=chosen, scaling=PLAIN))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("system, x0", [(sine(), [0.0, 1.0]), (kinked(), [0.0, 1.0])])
def test_no_point_is_further_off_than_asked(system, x0, tolerance):
    steps = walked(system, x0, output_step=0.01, output_tolerance=tolerance)
    between = [s for s in steps if s.kind == "interpolated"]
    assert len(between) > 100
    off = [np.linalg.norm(s.x - system._f(s.parameter)) for s in between]
    assert max(off) < 2.0 * tolerance
    lengths = [np.linalg.norm(b.state - a.state) for a, b in pairwise(steps)]
    assert max(lengths) < 0.035  # 0.01 of the range of 3, on a slope up to 1
    assert np.all(np.diff([s.parameter for s in steps]) > 0)
    assert np.all(np.diff([s.arclength for s in steps]) > 0)


@pytest.mark.parametrize("slope, tolerance", [(0.15, 2e-4), (0.05, 1e-3), (0.02, 2e-4), (0.02, 1e-5)])
def test_no_point_beside_a_kink_is_further_off_than_asked_wherever_it_lies(slope, tolerance):
    """The corner is round enough to be stepped over; the cubic is off most beside it, not in the middle."""
    for at in np.linspace(1.25, 1.35, 21):
        system = kinked(at, slope)
        steps = walked(system, [0.0, 1.0], output_step=0.01, output_tolerance=tolerance)
        off = [np.linalg.norm(s.x - system._f(s.parameter)) for s in steps if s.kind == "interpolated"]
        assert len(off) > 60
        assert max(off) <= tolerance


def test_no_state_is_evaluated_twice():
    """What was looked at to judge a segment is not looked at again to record its points."""
    system = sine()
    known = system.evaluate

    def evaluate(x, parameter):
        asked.append((*x.tolist(), parameter))
        return known(x, parameter)

    asked: list[tuple[float, ...]] = []
    system.evaluate = evaluate
    steps = walked(system, [0.0, 1.0], output_step=0.01, output_tolerance=1e-8)
    assert sum(s.inserted and s.kind == "regular" for s in steps) > 2
    assert len(set(asked)) >= len(asked) - 2  # the start is asked for again


def test_a_finer_tolerance_takes_more_corrected_points():
    counts = [
        sum(s.kind != "interpolated" for s in walked(sine(), [0.0, 1.0], output_step=0.01, output_tolerance=tolerance))
        for tolerance in (1e-2, 1e-9)
    ]  # fmt: skip
    assert counts[1] > counts[0]


@pytest.mark.parametrize("step", [0.1, np.inf])
def test_there_are_none_where_the_steps_are_short_enough(step):
    assert "interpolated" not in {s.kind for s in walked(sine(), [0.0, 1.0], output_step=step)}


def test_interpolated_points_count_neither_as_points_nor_as_solutions():
    run = continuation(sine(), [0.0, 1.0], 0.0, 3.0, options=ContinuationOptions(output_step=0.002), scaling=PLAIN)
    steps = list(run)
    between = [s for s in steps if s.kind == "interpolated"]
    assert run.points == len(steps) - len(between) - sum(s.kind == "turning point" for s in steps)
    assert all(s.iterations == 0 and s.evaluation is None and s.jacobian is None for s in between)
    assert all(first.parameter < s.parameter < second.parameter for s in between for first, second, *_ in [s.place])
