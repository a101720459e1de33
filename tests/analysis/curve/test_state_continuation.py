"""Temperatures carried from point to point; residuals over the size of their own terms."""

from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.curve import state_continuation
from slipstick.analysis.curve.state_continuation import relative_residual
from slipstick.solve.norm import norm
from slipstick.verify.cases import oscillator


def step(residual, x, terms):
    residual, x = np.asarray(residual), np.asarray(x)
    value = SimpleNamespace(residual=residual, terms=lambda: np.asarray(terms))
    return SimpleNamespace(evaluation=value, x=x, residual_norm=norm(residual))


def test_a_residual_is_over_the_size_of_its_terms():
    assert relative_residual(step([1e-3, 0.0], [1.0, 1.0], [10.0, 1.0])) == pytest.approx(1e-4)
    assert relative_residual(step([1e-3, 2e-3], [1.0, 0.0], [1.0, 1.0])) == pytest.approx(np.hypot(1e-3, 2e-3))


def test_rounding_of_the_motion_is_an_upper_bound():
    assert relative_residual(step([1e-12, 0.0], [2.0, 0.0], [0.0, 0.0])) == pytest.approx(5e-13)
    assert relative_residual(step([0.0], [0.0], [0.0])) == 0.0


def test_a_fault_beside_the_continuation_keeps_the_points_and_is_told(monkeypatch):
    numbers = count()

    def failing(step):
        if next(numbers) == 4:
            raise RuntimeError("beside it")
        return relative_residual(step)

    monkeypatch.setattr(state_continuation, "relative_residual", failing)
    events = []
    branch = ss.forced_response(oscillator(velocity=10.0), omega=(2.0, 15.0), listeners=events.append)
    assert not branch.outcome.ok
    assert len(branch) >= 4
    assert isinstance(events[-1].error, RuntimeError)
