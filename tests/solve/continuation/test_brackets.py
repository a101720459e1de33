"""Maxima at corners of a branch: the point of largest value, whatever the slopes on both sides are."""

import numpy as np
import pytest

from slipstick.solve.continuation import BranchEvent, ContinuationOptions, continuation
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation


class Given:
    """``x = f(p)`` with a derivative that may jump."""

    def __init__(self, f, rate):
        self._f, self._rate = f, rate

    def evaluate(self, x, parameter):
        rate = np.array([-self._rate(parameter)])
        return Evaluation(x - self._f(parameter), DenseJacobian(np.eye(1)), rate)


def maxima(f, rate, **options):
    event = BranchEvent(
        name="x", kind="peak", direction=-1, function=lambda step: step.tangent_x[0], height=lambda step: step.x[0]
    )
    run = continuation(Given(f, rate), [f(0.0)], 0.0, 1.0, events=[event], options=ContinuationOptions(**options))
    return [(step.parameter, step.x[0]) for step in run if step.kind == "peak"]


@pytest.mark.parametrize("at", [0.3, 0.31234, 0.5, 0.777])
@pytest.mark.parametrize("up, down", [(1.0, 1.0), (5.0, 0.01), (0.01, 5.0), (0.3, 40.0)])
def test_a_corner_is_located_where_it_is(at, up, down):
    """Steep on one side, nearly level on the other: the side of the smaller slope is not the higher one."""
    found = maxima(
        lambda p: 2.0 + (up * (p - at) if p < at else down * (at - p)), lambda p: up if p < at else -down
    )  # fmt: skip
    assert len(found) == 1
    assert found[0][0] == pytest.approx(at, abs=1e-8)
    assert found[0][1] == pytest.approx(2.0, abs=1e-8 * max(up, down))
    assert found[0][1] <= 2.0


def test_two_maxima_between_two_points_where_the_cubic_is_not_near():
    """A corner and, 0.0057 on, a smooth one: the slope rises at the point before and falls at the one after."""
    corner = 0.505

    def f(p):
        q = p - corner
        return 1.0 + 2.0 * q if q < 0.0 else 1.0 - 2.0 * q + 1200.0 * q**2 - 1.2e5 * q**3

    def rate(p):
        q = p - corner
        return 2.0 if q < 0.0 else -2.0 + 2400.0 * q - 3.6e5 * q**2

    found = maxima(f, rate, max_step=1 / 60)
    q = (2400.0 + np.sqrt(2400.0**2 - 8.0 * 3.6e5)) / 7.2e5
    np.testing.assert_allclose(found, [(corner, 1.0), (corner + q, f(corner + q))], atol=1e-8)


def test_a_plateau_that_is_left_as_it_was_entered_has_no_maximum():
    """Falling, level, falling; and rising, level, falling, which has one."""

    def level(p, sign):
        return 0.0 if 0.4 <= p <= 0.6 else (sign if p < 0.4 else -1.0)

    def falls(p, sign=-1.0):
        return 1.0 + (sign * (min(p, 0.4) - 0.4)) - max(p - 0.6, 0.0)

    assert maxima(falls, lambda p: level(p, -1.0)) == []
    found = maxima(lambda p: falls(p, 1.0), lambda p: level(p, 1.0))
    assert [height for _, height in found] == pytest.approx([1.0], abs=1e-9)


@pytest.mark.parametrize("at", [0.3, 0.31234, 0.5, 0.5103, 0.777])
@pytest.mark.parametrize("down, up", [(0.05, 0.83), (0.83, 0.05), (0.01, 5.0), (5.0, 0.03), (0.06, 0.06)])
@pytest.mark.parametrize("bend", [0.0, 1.0, -0.2])
def test_a_minimum_at_a_corner_is_as_deep_as_it_is(at, down, up, bend):
    """The cubic between two points says nothing of it; with a ``bend`` below 0 the sides grow steeper towards it.

    Beside an unknown that changes far more the segment is as good as straight, and trusted.
    """

    class Beside(Given):
        def evaluate(self, x, parameter):
            value = super().evaluate(x[:1], parameter)
            residual = np.append(value.residual, x[1] - 20.0 * parameter)
            return Evaluation(residual, DenseJacobian(np.eye(2)), np.append(value.parameter_derivative, -20.0))

    def f(p):
        q = p - at
        return 2.0 + (-down if q < 0.0 else up) * q + bend * q * q

    def along(first, second, segment, places):
        return segment.derivatives(places)[:, 0] / segment.length

    event = BranchEvent(
        name="x", kind="peak", direction=-1, function=lambda step: step.tangent_x[0], height=lambda step: step.x[0],
        along=along,
    )  # fmt: skip
    system = Beside(f, lambda p: (-down if p < at else up) + 2.0 * bend * (p - at))
    run = continuation(system, [f(0.0), 0.0], 0.0, 1.0, events=[event])
    assert min(step.x[0] for step in run if abs(step.parameter - at) < 0.02) == pytest.approx(2.0, rel=2e-5)


@pytest.mark.parametrize("up, down", [(1.0, 1.0), (5.0, 0.01), (0.3, 40.0)])
@pytest.mark.parametrize("bend", [0.0, -3.0])
def test_a_corner_is_located_in_few_trials(up, down, bend):
    """By the place where the tangents of both sides meet: the distance to it is squared, not halved, by each trial."""
    at, trials = 0.31234, []

    def slope(step):
        trials.append(step)
        return step.tangent_x[0]

    event = BranchEvent(name="x", kind="peak", direction=-1, function=slope, height=lambda step: step.x[0])
    system = Given(
        lambda p: 2.0 + (up if p < at else -down) * (p - at) + bend * (p - at) ** 2,
        lambda p: (up if p < at else -down) + 2.0 * bend * (p - at),
    )
    run = list(continuation(system, [system._f(0.0)], 0.0, 1.0, events=[event]))
    (peak,) = (step for step in run if step.kind == "peak")
    assert peak.parameter == pytest.approx(at, abs=1e-9)
    steps = [step for step in run if step.kind != "peak"]
    assert len(trials) - len(steps) <= (16 if bend == 0.0 else 24)


def test_peaks_close_to_each_other_share_their_solutions():
    """Twenty quantities with peaks in one step: one alone takes 4 evaluations."""

    def work(count, apart):
        at = 0.5 + apart * np.arange(count)

        class Bumps:
            def evaluate(self, x, parameter):
                q = parameter - at
                return Evaluation(x - (1.0 - q * q + q**3), DenseJacobian(np.eye(count)), 2.0 * q - 3.0 * q * q)

        events = [
            BranchEvent(
                name=str(i), kind="peak", direction=-1, function=lambda step, i=i: step.tangent_x[i],
                height=lambda step, i=i: step.x[i],
                along=lambda first, second, segment, places, i=i: segment.derivatives(places)[:, i] / segment.length,
            )
            for i in range(count)
        ]  # fmt: skip
        runs = [continuation(Bumps(), 1.0 - at**2 - at**3, 0.0, 1.0, events=these) for these in ([], events)]
        peaks = [step.parameter for step in list(runs[1]) if step.kind == "peak"]
        np.testing.assert_allclose(peaks, at, atol=1e-9)
        assert list(runs[0])
        return runs[1].evaluations - runs[0].evaluations

    assert work(20, 0.0) == work(1, 0.0)
    assert work(20, 2e-4) <= 16 * work(1, 0.0)
