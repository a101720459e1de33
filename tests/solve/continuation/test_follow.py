"""Continuation against branches known in closed form."""

import numpy as np
import pytest

from slipstick.errors import InputError, Outcome
from slipstick.solve.continuation import ArclengthScaling, BranchEvent, ContinuationOptions, continuation
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.continuation.step_control import Span, predict
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation, NewtonOptions


class Of:
    """A system of one function; counts its calls."""

    def __init__(self, function):
        self.function, self.calls = function, 0

    def evaluate(self, x, parameter):
        self.calls += 1
        return self.function(x, parameter)


def scalar(residual, by_x, by_parameter):
    return Of(
        lambda x, p: Evaluation(
            np.array([residual(x[0], p)]), DenseJacobian([[by_x(x[0], p)]]), np.array([by_parameter(x[0], p)])
        )
    )


def circle():
    return scalar(lambda x, p: x * x + p * p - 1, lambda x, p: 2 * x, lambda x, p: 2 * p)


def cubic():
    return scalar(lambda x, p: x**3 - 3 * x - p, lambda x, p: 3 * x * x - 3, lambda x, p: -1.0)


def resonances(frequencies, loss):
    """Modes with unit forces, receptance in cosine and (minus) sine parts."""

    def function(x, w):
        n = len(frequencies)
        residual, jacobian, slope = np.zeros(2 * n), np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
        for r, w0 in enumerate(frequencies):
            own = slice(2 * r, 2 * r + 2)
            a, b, db = w0**2 - w * w, loss * w0 * w, loss * w0
            Z = np.array([[a, b], [-b, a]])
            jacobian[own, own] = Z
            residual[own] = Z @ x[own] - [1.0, 0.0]
            slope[own] = np.array([[-2 * w, db], [-db, -2 * w]]) @ x[own]
        return Evaluation(residual, DenseJacobian(jacobian), slope)

    return Of(function)


def duffing(cubic=1.0, c=0.05, p=0.2):
    """x'' + c x' + x + cubic x^3 = p cos wt with one harmonic: backbone w^2 = 1 + 3/4 cubic a^2."""

    def function(z, w):
        x, y = z
        d, b = 1 - w * w + 0.75 * cubic * (x * x + y * y), 1.5 * cubic
        residual = np.array([d * x + c * w * y - p, d * y - c * w * x])
        jacobian = np.array([[d + b * x * x, c * w + b * x * y], [-c * w + b * x * y, d + b * y * y]])
        return Evaluation(residual, DenseJacobian(jacobian), np.array([-2 * w * x + c * y, -2 * w * y - c * x]))

    return Of(function)


def zigzag(scale):
    """p rises, falls and rises again in straight lines: corners at (1, 1) and (2, 0), in units of ``scale``."""
    xs, ps = np.array([-2.0, 1.0, 2.0, 5.0]), np.array([-2.0, 1.0, 0.0, 3.0])

    def function(x, p):
        i = min(max(int(np.searchsorted(xs, x[0] / scale)) - 1, 0), 2)
        slope = (ps[i + 1] - ps[i]) / (xs[i + 1] - xs[i])
        return Evaluation(
            np.array([ps[i] + slope * (x[0] / scale - xs[i]) - p]), DenseJacobian([[slope / scale]]), -np.ones(1)
        )

    return Of(function)


PEAK = BranchEvent(name="amplitude", kind="peak", function=lambda step: step.x @ step.tangent_x, direction=-1)


def kinds(steps):
    return [s.kind for s in steps if s.kind != "regular"]


def of_kind(steps, kind):
    return [s for s in steps if s.kind == kind]


def test_every_point_solves_the_equations_and_lies_in_order():
    run = continuation(circle(), [1.0], -0.9, 0.9)
    steps = list(run)
    for step in steps:
        assert step.x[0] ** 2 + step.parameter**2 == pytest.approx(1.0, abs=2.2e-10)  # 2 x tolerance
        radius = step.x[0] * step.tangent_x[0] + step.parameter * step.tangent_parameter
        assert radius == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff([s.parameter for s in steps]) > 0)
    assert np.all(np.diff([s.arclength for s in steps]) > 0)
    assert steps[0].parameter == -0.9
    assert steps[-1].parameter == 0.9
    assert run.outcome is Outcome.COMPLETED
    assert run.outcome.ok


def test_descending_range():
    steps = list(continuation(circle(), [1.0], 0.9, -0.9))
    assert steps[-1].parameter == -0.9
    assert np.all(np.diff([s.parameter for s in steps]) < 0)


def test_circle_comes_back_to_the_start():
    run = continuation(circle(), [1.0], 0.0, 2.0, options=ContinuationOptions(max_step=0.05))
    steps = list(run)
    assert kinds(steps) == ["start", "turning point", "end"]
    assert steps[-1].parameter == 0.0
    assert steps[-1].x[0] == pytest.approx(-1.0, abs=1e-10)
    assert run.outcome is Outcome.TURNED_BACK
    assert not run.outcome.ok


def test_folds_of_the_cubic():
    steps = list(continuation(cubic(), [-3.0], -18.0, 18.0))
    turning = of_kind(steps, "turning point")
    assert [s.parameter for s in turning] == pytest.approx([2.0, -2.0], abs=1e-10)
    assert [s.x[0] for s in turning] == pytest.approx([-1.0, 1.0], abs=1e-7)
    assert steps[-1].x[0] == pytest.approx(3.0, abs=1e-12)


def test_every_passage_of_a_requested_value_is_found_exactly():
    steps = list(continuation(cubic(), [-3.0], -18.0, 18.0, requested=[0.0, -10.0, 1.999999]))
    found = of_kind(steps, "requested")
    assert [s.parameter for s in found] == [-10.0, 0.0, 1.999999, 1.999999, 0.0, 0.0, 1.999999]
    for step in found:
        assert step.x[0] ** 3 - 3 * step.x[0] == pytest.approx(step.parameter, abs=1e-8)  # slope 25, x 3, tolerance
    assert np.all(np.diff([s.x[0] for s in steps]) > 0)


@pytest.mark.parametrize("below", [1e-4, 1e-8, 1e-12])
def test_requested_value_close_to_a_fold(below):
    """The two passages are sqrt(below / 3) on either side of x = -1: each is found on its own side."""
    steps = list(continuation(cubic(), [-3.0], -18.0, 18.0, requested=[2.0 - below]))
    first, second, _ = of_kind(steps, "requested")
    assert first.parameter == second.parameter == 2.0 - below
    expected = np.sqrt(below / 3)
    assert first.x[0] + 1 == pytest.approx(-expected, rel=1e-3)
    assert second.x[0] + 1 == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("ends", [(0.1, 4.0), (4.0, 0.1)])
def test_duffing_peak_on_the_backbone_and_folds(ends):
    c, p = 0.05, 0.2
    steps = list(continuation(duffing(c=c, p=p), [0.2, 0.0], *ends, events=[PEAK]))
    (peak,) = of_kind(steps, "peak")
    squared = peak.x @ peak.x
    # the largest amplitude: stationary a^2 in ((1 + 3/4 a^2 - w^2)^2 + c^2 w^2) a^2 = p^2
    assert peak.parameter**2 == pytest.approx(1 + 0.75 * squared - c * c / 2, rel=1e-9)
    folds = of_kind(steps, "turning point")
    assert len(folds) == 2
    for step in folds:
        assert abs(np.linalg.det(duffing(c=c, p=p).evaluate(step.x, step.parameter).jacobian.matrix)) < 1e-7
    assert steps[-1].parameter == ends[1]


@pytest.mark.parametrize("loss", [0.1, 1e-2, 1e-3, 1e-5])
def test_resonance_peak_whatever_the_damping(loss):
    run = continuation(resonances([1.0], loss), [0.0, 0.0], 0.1, 10.0, events=[PEAK])
    steps = list(run)
    (peak,) = of_kind(steps, "peak")
    assert peak.parameter == pytest.approx(np.sqrt(1 - loss**2 / 2), rel=1e-9)
    assert np.linalg.norm(peak.x) == pytest.approx(1 / (loss * np.sqrt(1 - loss**2 / 4)), rel=1e-9)
    assert run.outcome.ok
    assert len(steps) < 220  # amplitudes over 5 decades within a few times the points of the smooth curve


def test_amplitude_unit_does_not_change_the_points():
    metres = list(continuation(zigzag(1.0), [-1.9], -1.9, 0.9))
    micrometres = list(continuation(zigzag(1e-6), [-1.9e-6], -1.9, 0.9))
    assert len(metres) == len(micrometres)
    assert [s.parameter for s in metres] == pytest.approx([s.parameter for s in micrometres], abs=1e-8)


def test_neighbouring_resonances():
    steps = list(continuation(resonances([1.0, 1.5, 3.0, 7.0], 1e-3), np.zeros(8), 0.1, 10.0, events=[PEAK]))
    assert [s.parameter for s in of_kind(steps, "peak")] == pytest.approx([1.0, 1.5, 3.0, 7.0], rel=1e-5)


@pytest.mark.parametrize("scale", [1.0, 1e-5])
def test_sharp_corners_that_turn_back(scale):
    steps = list(continuation(zigzag(scale), [-1.9 * scale], -1.9, 2.9, requested=[0.5]))
    found = [s.x[0] / scale for s in of_kind(steps, "requested")]
    assert found == pytest.approx([0.5, 1.5, 2.5], abs=1e-9)
    assert max(s.parameter for s in steps if s.x[0] < 1.5 * scale) == pytest.approx(1.0, abs=1e-3)
    assert steps[-1].x[0] / scale == pytest.approx(4.9, abs=1e-9)


def test_kink_without_reversal_needs_no_rejection():
    system = scalar(lambda x, p: x + 3 * max(x - 1, 0) - p, lambda x, p: 1 + 3 * (x > 1), lambda x, p: -1.0)
    run = continuation(system, [0.1], 0.1, 4.0)
    assert list(run)[-1].x[0] == pytest.approx(1.75, abs=1e-12)
    assert run.rejected <= 2


def test_bifurcation_is_crossed_and_noted():
    system = scalar(lambda x, p: p * x - x**3, lambda x, p: p - 3 * x * x, lambda x, p: x)
    steps = list(continuation(system, [0.0], -1.0, 1.3))
    assert [s.name for s in steps if s.name] == ["orientation change"]
    assert all(s.x[0] == 0.0 for s in steps)


def fronts(width, gap):
    """Two steep fronts x = tanh((p - 1/2) / width), one ``gap`` above the other; distance of steps from the first."""

    def front(p):
        return np.tanh((p - 0.5) / width)

    def by_parameter(x, p):
        return -(1 - front(p) ** 2) / width * (2 * (x - front(p)) - gap)

    system = scalar(
        lambda x, p: (x - front(p)) * (x - front(p) - gap), lambda x, p: 2 * (x - front(p)) - gap, by_parameter
    )
    return system, lambda steps: max(abs(s.x[0] - front(s.parameter)) for s in steps)


@pytest.mark.parametrize("width", [0.02, 0.005, 0.002, 0.0005])
@pytest.mark.parametrize("gap", [0.02, 0.1, 0.5])
def test_does_not_jump_to_a_neighbouring_branch(width, gap):
    system, distance = fronts(width, gap)
    steps = list(continuation(system, [-1.0], 0.0, 1.0, scaling=ArclengthScaling(adaptive=False)))
    assert distance(steps) < 1e-6  # 1e-10 in p times the slope 1 / width
    assert steps[-1].parameter == 1.0
    assert max(np.diff([s.x[0] for s in steps])) < 0.25  # and the front is resolved


def test_unguarded_it_would_jump():
    """The counterpart of the test above: each of these ends on the wrong front with the acceptance tests off."""
    off = ContinuationOptions(max_angle=1.57, max_correction=1e9, kink_step=1.0)
    for width, gap in ((0.005, 0.02), (0.002, 0.1), (0.0005, 0.02)):
        system, distance = fronts(width, gap)
        steps = list(continuation(system, [-1.0], 0.0, 1.0, options=off, scaling=ArclengthScaling(adaptive=False)))
        assert distance(steps) > 0.5 * gap


def corrections(length, order):
    """Distance from prediction to solution on the circle for steps of one length."""
    options = ContinuationOptions(first_step=length, max_step=length, max_correction=10.0, aimed_angle=0.5)
    run = continuation(
        circle(), [1.0], -0.5, 0.8, options=options, scaling=ArclengthScaling(adaptive=False, weight=1.0, parameter=1.0)
    )
    steps = [next(run) for _ in range(4)]
    segment = run._corrector.segment(steps[-2], steps[-1]) if order == 4 else None
    return abs(np.hypot(*predict(run._metric, Span(-0.5, 0.8), steps[-1], segment, length).guess) - 1.0)


@pytest.mark.parametrize("order", [2, 4])
def test_order_of_the_predictor(order):
    errors = [corrections(length, order) for length in (0.08, 0.04, 0.02)]
    observed = np.log2(np.array(errors[:-1]) / errors[1:])
    assert observed == pytest.approx(order, abs=0.15)


def test_few_evaluations_a_point():
    run = continuation(duffing(), [0.2, 0.0], 0.1, 4.0, options=ContinuationOptions(locate_turning_points=False))
    steps = list(run)
    assert run.evaluations / len(steps) < 3.0
    assert run.rejected == 0


def test_smallest_step_is_reported_and_points_are_kept():
    """x^2 = 1/2 - p has no solution beyond 1/2 and, with x >= 0 only, no way back."""
    system = scalar(lambda x, p: x * x + p - 0.5 if x > 0 else np.nan, lambda x, p: 2 * x, lambda x, p: 1.0)
    run = continuation(system, [0.7], 0.0, 1.0)
    steps = list(run)
    assert run.outcome is Outcome.STEP_TOO_SMALL
    assert steps[-1].parameter == pytest.approx(0.5, abs=1e-3)
    assert "min_step" in run.message


def test_no_first_point():
    run = continuation(scalar(lambda x, p: x * x + 1, lambda x, p: 2 * x, lambda x, p: 0.0), [0.3], 0.0, 1.0)
    assert list(run) == []
    assert run.outcome is Outcome.NO_FIRST_POINT


def test_point_limit_and_abandoning():
    run = continuation(circle(), [1.0], -0.9, 0.9, options=ContinuationOptions(max_points=5))
    assert len(list(run)) == 5
    assert run.outcome is Outcome.POINT_LIMIT
    system = circle()
    run = continuation(system, [1.0], -0.9, 0.9)
    next(run)
    calls = system.calls
    assert calls < 10  # the first point only
    assert run.outcome is None


def test_outcome_is_the_value_of_yield_from():
    def outer():
        outcome = yield from continuation(circle(), [1.0], -0.9, 0.9)
        assert outcome is Outcome.COMPLETED

    assert len(list(outer())) > 10


def test_take_up_inside_the_range_on_an_overhanging_branch():
    steps = list(continuation(cubic(), [-3.0], -18.0, 18.0))
    back = next(s for s in steps if s.kind == "regular" and -0.8 < s.x[0] < 0.8)
    again = list(
        continuation(cubic(), back.x, -18.0, 18.0, at=back.parameter, direction=back.tangent, requested=[0.0, 10.0])
    )
    assert kinds(again)[-1] == "end"
    assert [s.parameter for s in of_kind(again, "turning point")] == pytest.approx([-2.0], abs=1e-10)
    assert again[-1].parameter == 18.0
    assert again[1].x[0] > back.x[0]


def test_converged_evaluation_is_handed_out():
    system = Of(lambda x, p: Evaluation(x - p, DenseJacobian(np.eye(1)), -np.ones(1), {"at": (x.copy(), p)}))
    for step in continuation(system, [0.0], 0.0, 1.0, requested=[0.25]):
        x, p = step.evaluation.detail["at"]
        assert x == step.x
        assert p == step.parameter


def test_work_is_counted():
    system = duffing()
    run = continuation(system, [0.2, 0.0], 0.1, 4.0, events=[PEAK])
    steps = list(run)
    assert run.evaluations == system.calls
    assert run.solves > len(steps)
    assert run.points == sum(s.kind in ("start", "regular", "end") for s in steps)


def test_metric_follows_the_solution_but_not_to_zero():
    metric = Metric(ArclengthScaling(weight=1.0, floor=1e-3), np.array([3.0, 4.0]), 2.0)
    np.testing.assert_allclose(metric.weights, [0.2, 0.2, 0.5])
    metric = metric.renewed(np.array([0.0, 0.0]))
    np.testing.assert_allclose(metric.weights, [200.0, 200.0, 0.5])
    fixed = Metric(ArclengthScaling(adaptive=False, weight=1.0, x=[1.0, 10.0]), np.array([3.0, 4.0]), 2.0)
    np.testing.assert_allclose(fixed.weights, [1.0, 0.1, 0.5])


def test_tangent_of_the_bordered_system():
    metric = Metric(ArclengthScaling(adaptive=False, weight=1.0), np.array([1.0]), 1.0)
    corrector = Corrector(circle(), 1, metric, NewtonOptions())
    step, _ = corrector.correct(np.array([0.61, 0.81]), np.array([-0.8, 0.6]), "regular")
    np.testing.assert_allclose(step.tangent, [-step.parameter, step.x[0]], atol=1e-10)


def test_bad_input_is_refused_with_every_fault():
    with pytest.raises(InputError) as error:
        continuation(circle(), [np.nan], 1.0, 1.0, requested=[3.0], at=5.0, direction=[1.0])
    assert len(error.value.sentences) == 5
    with pytest.raises(InputError):
        ArclengthScaling(weight=0.0)
    with pytest.raises(InputError) as error:
        ContinuationOptions(first_step=0.0, min_step=1.0, aimed_angle=2.0)
    assert len(error.value.sentences) == 3
