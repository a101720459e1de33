"""One formula for one state and for k: what k states say is what each says alone."""

from dataclasses import dataclass

import numpy as np
import pytest

from slipstick.solve.continuation.brackets import (
    Chord,
    fall,
    is_bottom,
    is_known,
    is_plain,
    is_within,
    leads_on,
    share_of,
)  # fmt: skip
from slipstick.solve.continuation.corrector import is_near
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.solve.continuation.lockstep import Table
from slipstick.solve.continuation.metric import ArclengthScaling, Measure, Metric
from slipstick.solve.continuation.step_control import (
    Span,
    StepOptions,
    along_tangent,
    cubic_distance,
    is_cubic_valid,
    is_far,
    is_kink,
    is_short,
    max_distance,
    next_step,
    place_ahead,
    shortened,
)
from slipstick.solve.newton import NewtonOptions, gains, is_clear_gain, may_be_taken_whole, stalls

K, N = 40, 6
ROUNDING = 1e-13
SCALING = ArclengthScaling(rows=2, judged=np.array([False, True, True]))


class Points:
    """Neighbouring states, some of them beside a corner, and the tangents there; ``of(i)`` are those of one branch."""

    def __init__(self, i=None):
        rng = np.random.default_rng(3)
        self.typical = rng.uniform(0.5, 2.0, K)
        self.a, self.first = rng.standard_normal((2, K, N + 1))
        self.second = self.first + 0.3 * rng.standard_normal((K, N + 1))
        shares = rng.uniform(0.0, 0.2, (2, K, 1))
        self.b = self.a + shares[0] * self.first + shares[1] * self.second
        self.b[::2] += 0.1 * rng.standard_normal((K // 2, N + 1))
        self.guess = self.b + 0.02 * rng.standard_normal((K, N + 1))
        self.length = 10.0 ** rng.uniform(-4.0, -1.0, K)
        self.u = rng.uniform(0.0, 1.2, K)
        for name in list(vars(self)) if i is not None else ():
            value = getattr(self, name)[i]
            setattr(self, name, value if isinstance(value, np.ndarray) else float(value))
        self.metric = Metric(SCALING, self.a[..., :-1], 10.0, self.typical).renewed(0.1 * self.b[..., :-1])
        self.ends = (self.a, self.first), (self.b, self.second)
        self.segment = HermiteSegment.of(self.metric, *self.ends)


def lengths(p):
    return p.metric.length(p.a), p.metric.cosine(p.first, p.second), p.metric.weights, p.metric.inverse


def sizes(p):
    own = p.metric.sizes(p.a, p.b)
    return own, p.metric.judged(p.b - p.a, own)


def segments(p):
    return p.segment.length, *p.segment.rates, p.segment.point(p.u), p.segment.derivative(p.u), p.segment.parameter(p.u)


def places(p):
    basis = HermiteBasis(np.linspace(0.0, 1.0, 5))
    middle = 0.5 * (p.segment.parameter(0.0 * p.u) + p.segment.parameter(0.0 * p.u + 1.0))
    where = p.segment.where(middle, 0.0 * p.u, 0.0 * p.u + 1.0)
    return p.segment.points(basis), p.segment.derivatives(basis), p.segment.parameter(where) - middle


def predictions(p):
    guess, direction = along_tangent(p.metric, p.a, p.first, p.length)
    return (
        guess, direction, place_ahead(p.metric, p.segment, p.second, p.length),
        is_cubic_valid(p.metric, p.segment.derivative(3.0 * p.u), p.first), shortened(p.a, guess, 0.2),
    )  # fmt: skip


def ranges(p):
    span = Span(1.0, -1.0)
    return span.beyond(p.a[..., -1]), span.behind(p.a[..., -1]), span.outside(p.a[..., -1])


def acceptance(p):
    options = StepOptions()
    kink = is_kink(p.metric, *p.ends)
    return (
        is_short(options, p.length), max_distance(options, p.length), kink,
        is_far(p.metric, options, p.b, p.guess, 0.01 + 0.0 * p.length, kink),
        is_near(p.metric, p.b - p.guess, p.length),
        cubic_distance(p.metric, (p.b, p.second), (p.guess, p.first), p.length),
    )  # fmt: skip


def chords(p):
    chord = Chord(p.metric, (p.a, p.first), (p.b, p.a))
    return (
        chord.turns, chord.before, chord.after, chord.gap, chord.room, *chord.beside(0.5, nearer=False),
        *chord.beside(0.1, nearer=True), is_within(p.metric, p.guess, p.a, p.b, chord.room),
    )  # fmt: skip


def slopes(p):
    """Of heights at two points, some of which say nothing of a minimum between."""
    before, after, low, high = p.a[..., 0], p.a[..., 1], 1.0 + 0.1 * p.a[..., 2], 1.0 + 0.1 * p.a[..., 3]
    length = 0.1 + p.length
    bisect = p.u > 0.6
    return (
        is_plain(1e-2 * before, 1e-2 * after, low, low + 1e-4 * high, length),
        is_known(low, 1e-4 * abs(before), -1e-4 * abs(after), p.length, 1e-3), fall(low, before, high, after, length),
        is_bottom(low, 3e-5 * high, 1.001 * high), share_of(abs(before), -abs(after), bisect, length, 1e-2),
        leads_on(np.sign(before), np.sign(after), np.sign(p.a[..., 2])),
    )  # fmt: skip


def corrections(p):
    options, natural = NewtonOptions(), 10.0 ** (4.0 * p.u - 2.0)
    return (
        stalls(p.length, 3.0 * p.u * p.length, 12.0 * p.length), is_clear_gain(natural, p.length, options),
        may_be_taken_whole(natural), gains(natural, 0.5),
    )  # fmt: skip


def steps(p):
    contraction, iterations = 100.0 * p.length, np.floor(8.0 * p.u)
    return (
        next_step(
            p.length, contraction=contraction, iterations=iterations, angle=p.u, order=2.0 + 0.0 * p.u,
            options=StepOptions(),
        ),
    )  # fmt: skip


@pytest.mark.parametrize(
    "formulas",
    [lengths, sizes, segments, places, predictions, ranges, acceptance, chords, slopes, corrections, steps],
    ids=lambda f: f.__name__,
)
def test_k_states_are_k_times_one(formulas):
    together = formulas(Points())
    for i in range(K):
        for one, each in zip(formulas(Points(i)), together, strict=True):
            np.testing.assert_allclose(each[i], one, rtol=ROUNDING, atol=ROUNDING)


def test_both_answers_occur():
    """Else the comparison above says nothing of decisions."""
    p = Points()
    for marks in (is_cubic_valid(p.metric, p.segment.derivative(3.0 * p.u), p.first), *ranges(p), acceptance(p)[0]):
        assert 0 < np.sum(marks) < K
    plain, known, down, bottom, _, on = slopes(p)
    turns, *_, within = chords(p)
    for marks in (plain, known, np.isfinite(down), bottom, on, turns, within, *corrections(p)):
        assert 0 < np.sum(marks) < K
    _, _, kink, too_far, close, _ = acceptance(p)
    for marks in (kink, too_far, close):
        assert 0 < np.sum(marks) < K


def test_lots_are_parted_joined_and_replaced():
    p, which = Points(), np.array([3, 1])
    rest = np.array([0, 2, *range(4, K)])
    parts = Metric.joined([p.metric.at(which), p.metric.at(rest)])
    np.testing.assert_array_equal(parts.weights, p.metric.weights[[*which, *rest]])
    other = p.metric.renewed(3.0 * p.a[:, :-1])
    expected = p.metric.weights.copy()
    expected[which] = other.weights[which]
    p.metric.put(which, other.at(which))
    np.testing.assert_array_equal(p.metric.weights, expected)
    back = other.measuring(Measure(*(part.copy() for part in p.metric.measure)))
    np.testing.assert_array_equal(back.weights, expected)
    segment, shifted = Points().segment, HermiteSegment.of(other, *Points().ends)
    segment.put(which, shifted.at(which))
    for u in (0.3, 0.8):
        at = np.full(K, u)
        np.testing.assert_array_equal(segment.point(at)[which], shifted.point(at)[which])
        np.testing.assert_array_equal(segment.point(at)[rest], Points().segment.point(at)[rest])


@dataclass
class Rows(Table):
    numbers: np.ndarray
    metric: Metric


def test_rows_of_tables_are_picked_joined_and_replaced():
    p, which = Points(), np.array([3, 1])
    table = Rows(numbers=np.arange(K), metric=p.metric)
    some = table.at(which)
    assert some.numbers.tolist() == [3, 1]
    np.testing.assert_array_equal(some.metric.weights, p.metric.weights[which])
    both = Rows.joined([some, table.at(which[:1])])
    assert both.numbers.tolist() == [3, 1, 3]
    both.put(np.array([2]), table.at(np.array([7])))
    assert both.numbers.tolist() == [3, 1, 7]
    np.testing.assert_array_equal(both.metric.weights, p.metric.weights[[3, 1, 7]])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_where_tangents_meet(sign):
    """Two sides of a corner that turns back by 120 degrees: its ways are the distances to it, known in closed form."""
    metric = Metric(ArclengthScaling(x=1.0, weight=1.0, adaptive=False), np.zeros(1), 1.0)
    corner, a, b = np.array([0.2, 0.1]), np.array([1.0, 0.0]), np.array([-0.5, sign * np.sqrt(0.75)])
    chord = Chord(metric, (corner - 0.3 * a, a), (corner + 0.5 * b, b))
    assert chord.turns
    assert (chord.before, chord.after, chord.room) == pytest.approx((0.3, 0.5, 0.8))
    assert chord.part(corner - 0.1 * a, a) < chord.part(corner + 0.1 * b, b)
    guess, direction = chord.beside(0.5, nearer=False)  # from the end that is further off
    np.testing.assert_allclose(guess, corner + 0.25 * b)
    np.testing.assert_allclose(direction, b)
