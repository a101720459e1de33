"""Newton: order of convergence, invariance, kinks, rounding, failures that say why."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.solve.homotopy import homotopy
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation, NewtonOptions, NewtonStop, iterate, newton, newton_at


def exponential_system(x):
    """Powell's badly scaled function: solution (1.0981593e-5, 9.106146740)."""
    residual = np.array([1e4 * x[0] * x[1] - 1.0, np.exp(-x[0]) + np.exp(-x[1]) - 1.0001])
    jacobian = np.array([[1e4 * x[1], 1e4 * x[0]], [-np.exp(-x[0]), -np.exp(-x[1])]])
    return Evaluation(residual, DenseJacobian(jacobian))


def cosine_system(x):
    return Evaluation(x - 0.5 * np.cos(x[::-1]), DenseJacobian(np.eye(2) + 0.5 * np.fliplr(np.diag(np.sin(x[::-1])))))


def saturations(rng):
    """Monotone piecewise linear equations with many stiff sticking and slipping springs: one solution."""
    n, m = int(rng.integers(2, 20)), int(rng.integers(1, 20))
    A = rng.standard_normal((n, n))
    skew = rng.standard_normal((n, n))
    A = A @ A.T + 0.01 * np.eye(n) + skew - skew.T
    K, stiffness = rng.standard_normal((m, n)), 10 ** rng.uniform(0, 4, m)
    limit, load = 10 ** rng.uniform(-2, 1, m), 10 * rng.standard_normal(n)

    def system(x):
        stick = stiffness * (K @ x)
        tangent = A + K.T @ ((stiffness * (abs(stick) < limit))[:, None] * K)
        return Evaluation(A @ x + K.T @ np.clip(stick, -limit, limit) - load, DenseJacobian(tangent))

    return system, np.zeros(n), float(np.linalg.norm(np.linalg.solve(A, load)))


def test_convergence_is_quadratic():
    result = newton(cosine_system, [3.0, -2.0])
    sizes = [c for c in result.corrections if 1e-12 < c < 0.5]
    orders = [np.log(b) / np.log(a) for a, b in pairwise(sizes)]
    assert result.converged
    assert not result.stagnated
    assert max(orders) > 1.8  # the last pair above rounding


def test_history_and_counts():
    calls = []
    result = newton(lambda x: calls.append(1) or cosine_system(x), [0.3, 0.2])
    assert result.evaluations == len(calls) == result.iterations + 1
    assert len(result.history) == len(result.corrections) == result.iterations + 1
    assert result.history[-1] == result.residual_norm
    assert result.solves >= result.iterations
    np.testing.assert_allclose(result.residual, cosine_system(result.x).residual, rtol=0, atol=0)


def test_far_guess_needs_damping():
    """arctan: the undamped iteration diverges from beyond 1.39."""
    result = newton(lambda x: Evaluation(np.arctan(x), DenseJacobian(np.diag(1 / (1 + x * x)))), [50.0])
    assert result.converged
    assert abs(result.x[0]) < 1e-10


def test_badly_scaled_system():
    result = newton(exponential_system, [0.0, 1.0])
    assert result.converged
    np.testing.assert_allclose(result.x, [1.098159e-5, 9.106146740], rtol=1e-6)


def test_iterates_do_not_depend_on_units_or_on_the_scaling_of_the_equations():
    units, rows = np.array([1e-6, 1e3]), np.diag([1e5, 1e-4])

    def other(x):
        value = exponential_system(x / units)
        return Evaluation(rows @ value.residual, DenseJacobian(rows @ value.jacobian.matrix / units))

    plain = newton(exponential_system, [0.0, 1.0], scale=[1.0, 10.0])
    scaled = newton(other, [0.0, 1e3], scale=units * [1.0, 10.0])
    assert scaled.iterations == plain.iterations
    np.testing.assert_allclose(scaled.corrections[:-2], plain.corrections[:-2], rtol=1e-6)


def test_absolute_value_equations_are_solved_exactly():
    rng = np.random.default_rng(5)
    for _ in range(100):
        n = int(rng.integers(2, 30))
        A, B = rng.standard_normal((2, n, n))
        B *= 0.9 * np.linalg.svd(A)[1][-1] / np.linalg.svd(B)[1][0]  # the condition of a unique solution
        exact = rng.standard_normal(n)
        right = A @ exact + B @ abs(exact)

        def system(x, A=A, B=B, b=right):
            return Evaluation(A @ x + B @ abs(x) - b, DenseJacobian(A + B * np.sign(x)))

        result = newton(system, 10 * exact)
        assert result.converged
        np.testing.assert_allclose(result.x, exact, atol=1e-12 * np.linalg.cond(A))


def test_stick_and_slip_kinks():
    """Stiffness jumps of up to 1e4 in up to 19 springs, started from the undeformed state."""
    rng = np.random.default_rng(11)
    problems = [saturations(rng) for _ in range(150)]
    failed = [p for p in problems if not newton(p[0], p[1], scale=p[2]).converged]
    assert len(failed) <= 3  # 0.75 % in 400 others
    for system, start, scale in failed:
        assert homotopy(system, start, scale=scale).converged


def test_undamped_newton_would_not_do():
    """The counterpart of the test above: without search and whole steps only, many of them cycle."""
    rng = np.random.default_rng(11)
    options = NewtonOptions(min_damping=1.0, non_monotone=30)
    failed = 0
    for _ in range(50):
        system, start, scale = saturations(rng)
        failed += not newton(system, start, scale=scale, options=options).converged
    assert failed > 3


def test_rounding_level_is_accepted_and_said():
    n = 10
    hilbert = 1.0 / (np.arange(n)[:, None] + np.arange(n) + 1.0)  # condition 1.6e13: corrections stay near 1e-4
    jacobian = DenseJacobian(hilbert)
    result = newton(lambda x: Evaluation(hilbert @ (x - 1.0), jacobian), 2 * np.ones(n), scale=3.0)
    assert result.converged
    result = newton(lambda x: Evaluation(hilbert @ x - hilbert @ np.ones(n), jacobian), np.zeros(n))
    assert result.converged
    assert result.stagnated
    assert "rounding" in result.reason.text
    assert result.iterations < 8  # seen at once, not after the last iteration


@pytest.mark.parametrize(
    "system, reasons",
    [
        (lambda x: Evaluation(x * 0.0 + 1.0, DenseJacobian(np.zeros((1, 1)))), {NewtonStop.SINGULAR}),
        (lambda x: Evaluation(x * np.nan, DenseJacobian(np.eye(1))), {NewtonStop.NOT_FINITE}),
        (lambda x: Evaluation(x**2 + 1.0, DenseJacobian(np.diag(2 * x))), {NewtonStop.NO_GAIN, NewtonStop.TOO_MANY}),
    ],
)
def test_failures_say_why(system, reasons):
    result = newton(system, [0.7])
    assert not result.converged
    assert result.reason in reasons


def test_fixed_parameter():
    class Square:
        def evaluate(self, x, parameter):
            return Evaluation(x * x - parameter, DenseJacobian(np.diag(2 * x)), -np.ones(1))

    assert newton_at(Square(), [1.0], 9.0).x[0] == pytest.approx(3.0, rel=1e-12)


def test_all_faulty_options_are_named_at_once():
    with pytest.raises(InputError) as error:
        NewtonOptions(tolerance=-1.0, max_iterations=0, min_damping=2.0, non_monotone=-1, stagnation=1.0)
    assert len(error.value.sentences) == 5


def test_a_first_correction_that_leads_too_far_is_not_followed():
    def system(x):
        found = cosine_system(x)
        return found.residual, found.jacobian, found

    start, ones = np.array([40.0, 0.0]), np.ones(2)
    given_up = iterate(system, start, ones, NewtonOptions(), lambda step: float(abs(step).max()) > 1.0)
    assert given_up.reason is NewtonStop.TOO_FAR
    assert given_up.evaluations == 1
    assert not given_up.converged
    assert iterate(system, start, ones, NewtonOptions(), lambda step: float(abs(step).max()) > 1e3).converged
    # the corrections after the first are not asked: all of them are smaller here
    assert iterate(system, start, ones, NewtonOptions(), lambda step: float(abs(step).max()) < 1.0).converged


def test_the_contraction_is_that_of_the_first_correction():
    start = np.array([0.9, -0.4])
    first = cosine_system(start)
    step = np.linalg.solve(first.jacobian.matrix, first.residual)
    simplified = np.linalg.solve(first.jacobian.matrix, cosine_system(start - step).residual)
    result = newton(cosine_system, start)
    assert result.iterations > 1
    assert result.contraction == pytest.approx(np.linalg.norm(simplified) / np.linalg.norm(step), rel=1e-9)


def scalar(f, slope):
    return lambda x: Evaluation(np.array([f(x[0])]), DenseJacobian(np.array([[slope(x[0])]])))


@pytest.mark.parametrize("start", [1.0, 2.0, 20.0])
def test_an_overshooting_correction_is_shortened(start):
    """Newton's method alone diverges from the root of arctan beyond 1.39."""
    found = newton(scalar(np.arctan, lambda x: 1 / (1 + x * x)), np.array([start]))
    assert found.converged
    assert abs(found.x[0]) < 1e-9


def test_a_whole_correction_is_taken_where_it_helps():
    """Quadratic convergence: few evaluations, none wasted on fractions."""
    found = newton(scalar(lambda x: x * x - 2.0, lambda x: 2 * x), np.array([1.5]))
    assert found.converged
    assert found.x[0] == pytest.approx(np.sqrt(2.0))
    assert found.evaluations <= found.iterations + 1


def test_without_a_root_it_ends_with_a_reason():
    options = NewtonOptions(non_monotone=0)
    found = newton(scalar(lambda x: x * x + 1.0, lambda x: 2 * x), np.array([0.5]), options=options)
    assert not found.converged
    assert found.reason.text


def test_all_at_once():
    with pytest.raises(InputError) as caught:
        NewtonOptions(tolerance=0.0, max_iterations=0, min_damping=2.0, non_monotone=-1, stagnation=1.0)
    assert len(caught.value.sentences) == 5
    with pytest.raises(InputError, match="tolerance"):
        NewtonOptions(tolerance=np.nan)
