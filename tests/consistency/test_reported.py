"""What is reported about a computation itself: work, time, progress, what was asked."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.events import PointFound, Stopped
from slipstick.analysis.road import run as road
from slipstick.verify.cases import oscillator


@pytest.mark.parametrize("span", [(4.0, 8.0), (8.0, 4.0)])
def test_progress_time_and_work_of_a_curve(span: tuple[float, float], monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on a second with every point."""
    told: list[Any] = []
    monkeypatch.setattr(road, "time", SimpleNamespace(perf_counter=lambda: 3.0 + found()))

    def found() -> int:
        return sum(isinstance(event, PointFound) for event in told)

    made = ss.forced_response(oscillator(velocity=10.0), omega=span, listeners=told.append)
    points = [event for event in told if isinstance(event, PointFound)]
    progress = np.array([event.progress for event in points])
    done = np.abs(made.dataset["omega"].to_numpy() - span[0]) / 4.0
    np.testing.assert_allclose(progress, done, atol=1e-9)  # it does not turn back
    assert all(0.0 < event.step <= 1.0 for event in points)
    attributes = made.dataset.attrs
    (end,) = (event for event in told if isinstance(event, Stopped))
    assert end.seconds == attributes["seconds"] == len(points)
    assert attributes["parts"] == 1
    assert attributes["linear_solves"] >= int(made.dataset["newton_iterations"].sum()) > 0
    solved = int((made.dataset["kind"] != "interpolated").sum())
    assert attributes["evaluations"] >= solved
    assert "adapt_harmonics" not in attributes


def test_a_step_that_failed_is_counted() -> None:
    """So coarse that the first slip is stepped over: the points are the same, found with steps taken again."""
    easy, hard = (
        ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 8.0), options=options).dataset.attrs
        for options in ({"max_step": 0.01}, {"first_step": 1.0, "max_step": 1.0})
    )
    assert easy["rejected_steps"] == 0
    assert hard["rejected_steps"] > 0


def test_what_was_asked_of_the_harmonics_stays_with_the_results() -> None:
    asked = {"adapt_harmonics": 1e-3, "max_points": 4}
    made = ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 8.0), options=asked)
    assert made.dataset.attrs["adapt_harmonics"] == 1e-3
