"""What is located next to corners at which a branch turns back, against a branch of straight lines."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.solve.continuation import BranchEvent, continuation
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation

PARAMETERS = np.array([-2.0, 1.0, 0.0, 3.0])
CORNERS = [
    pytest.param((-2.0, 1.0, 2.0, 5.0), id="blunt"),
    pytest.param((-2.0, 1.0, 1.1, 5.0), id="sharp"),
    pytest.param((-2.0, 1.0, 1.001, 5.0), id="steep"),
    pytest.param((-2.0, -1.9, 4.0, 5.0), id="steep at first"),
]


class Lines:
    """The parameter rises, falls and rises again in straight lines between corners at given ``x``."""

    def __init__(self, xs):
        self._xs, self._rates = np.array(xs), np.diff(PARAMETERS) / np.diff(xs)

    def evaluate(self, x, parameter):
        i = min(max(int(np.searchsorted(self._xs, x[0])) - 1, 0), 2)
        residual = PARAMETERS[i] + self._rates[i] * (x - self._xs[i]) - parameter
        return Evaluation(residual, DenseJacobian([[self._rates[i]]]), -np.ones(1))


def followed(xs, **sought):
    start = xs[0] + 0.01 * (xs[1] - xs[0])
    return list(continuation(Lines(xs), [start], -1.97, 2.9, **sought))


@pytest.mark.parametrize("xs", CORNERS)
def test_a_fold_at_a_corner_is_the_extreme_of_the_parameter(xs):
    steps = followed(xs)
    folds = [step for step in steps if step.kind == "turning point"]
    assert [step.parameter for step in folds] == pytest.approx([1.0, 0.0], abs=5e-10)  # of a range of 4.87
    assert [step.x[0] for step in folds] == pytest.approx(xs[1:3], abs=2e-9)
    assert max(step.parameter for step in steps if step.x[0] < xs[2]) <= folds[0].parameter
    assert not [step for step in steps if step.kind.startswith("near")]


@pytest.mark.parametrize("xs", CORNERS)
def test_every_passage_next_to_a_corner_is_found(xs):
    """Also where the whole step lies beside the corner and no cubic leads there."""
    low = [1e-8, 1e-6, 4e-6, 1e-5, 3e-5, 1e-3, 0.3]
    asked = [*low, *(1.0 - below for below in reversed(low))]
    found = [step for step in followed(xs, requested=asked) if step.kind == "requested"]
    assert [step.parameter for step in found] == [*asked, *asked[::-1], *asked]
    n = len(asked)
    for i in range(3):
        at, x = np.array([(step.parameter, step.x[0]) for step in found[i * n : (i + 1) * n]]).T
        share = (at - PARAMETERS[i]) / (PARAMETERS[i + 1] - PARAMETERS[i])
        np.testing.assert_allclose(x, xs[i] + share * (xs[i + 1] - xs[i]), atol=1e-9)


@pytest.mark.parametrize("xs", CORNERS)
def test_sign_changes_next_to_a_corner_are_where_they_are(xs):
    beside = np.array([-6e-5, -1e-5, -4e-6, -1e-6, 0.0, 1e-6, 4e-6, 1e-5, 6e-5])
    levels = np.concatenate([corner + beside for corner in xs[1:3]])
    events = [
        BranchEvent(name=f"{i}", kind="level", function=lambda step, level=level: step.x[0] - level)
        for i, level in enumerate(levels)
    ]
    found = [step for step in followed(xs, events=events) if step.kind == "level"]
    assert [step.name for step in found] == [event.name for event in events]
    assert [step.x[0] for step in found] == pytest.approx(levels, abs=1e-9)


def test_what_is_not_located_is_nearest_or_not_there():
    """No solution at all next to 0.5: for a level in there its neighbour stands, or nothing."""

    class Gap(Lines):
        def evaluate(self, x, parameter):
            value = super().evaluate(x, parameter)
            if 0.4999 < x[0] < 0.5001:
                value.residual[:] = np.nan
            return value

    for exact in (False, True):
        event = BranchEvent(name="x", kind="level", function=lambda step: step.x[0] - 0.50005, exact=exact)
        steps = list(continuation(Gap((-2.0, 1.0, 2.0, 5.0)), [-1.97], -1.97, 0.9, events=[event], requested=[0.50005]))
        assert steps[-1].parameter == 0.9
        levels = [step.x[0] for step in steps if step.kind == "level"]
        assert "requested" not in [step.kind for step in steps]
        assert levels == ([] if exact else pytest.approx([0.5001], abs=2e-3))


def test_a_fold_that_is_not_located_says_so():
    """No solution within 1e-6 of the corner in x."""

    class Hole(Lines):
        def evaluate(self, x, parameter):
            value = super().evaluate(x, parameter)
            if abs(x[0] - 1.0) < 1e-6:
                value.residual[:] = np.nan
            return value

    steps = list(continuation(Hole((-2.0, 1.0, 1.1, 5.0)), [-1.97], -1.97, 2.9))
    first, second = (step for step in steps if "turning point" in step.kind)
    assert first.kind == "near turning point"
    assert first.parameter == pytest.approx(1.0, abs=1e-4)
    assert first.parameter == max(step.parameter for step in steps if step.x[0] < 1.1)
    assert second.kind == "turning point"
