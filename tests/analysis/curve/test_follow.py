"""The walk along a branch: a generator of points that can be stepped, stopped and collected."""

import os
import signal

import numpy as np
import pytest
from helpers.oscillator import with_law
from helpers.results import corrected

import slipstick as ss
from slipstick.errors import Outcome
from slipstick.verify.cases import oscillator


def test_points_satisfy_the_balance_and_end_at_the_end():
    branch = ss.forced_response(oscillator(velocity=10.0), omega=(3.0, 8.0))
    d = branch.dataset
    assert branch.outcome is Outcome.COMPLETED
    assert float(d["omega"][0]) == 3.0
    assert float(d["omega"][-1]) == pytest.approx(8.0)
    assert float(corrected(d)["residual"].max()) < 1e-8
    assert d["kind"].to_numpy()[0] == "start"
    assert d["kind"].to_numpy()[-1] == "end"


def test_up_and_down_are_the_same_curve():
    problem = oscillator(velocity=10.0)
    wanted = [4.0, 5.5, 7.0]
    up = ss.forced_response(problem, omega=(3.0, 8.0), at=wanted).dataset
    down = ss.forced_response(problem, omega=(8.0, 3.0), at=wanted).dataset
    for value in wanted:
        a, b = (float(d["amplitude"][np.abs(d["omega"].to_numpy() - value).argmin(), 0]) for d in (up, down))
        assert a == pytest.approx(b, rel=1e-8)


def test_an_interrupted_walk_keeps_what_it_found():
    seen = []

    def stop(event):
        seen.append(event)
        if type(event).__name__ == "PointFound" and event.number == 5:
            raise KeyboardInterrupt

    branch = ss.forced_response(oscillator(velocity=10.0), omega=(3.0, 8.0), listeners=stop)
    assert branch.outcome is Outcome.INTERRUPTED
    assert branch.dataset.sizes["point"] >= 4
    assert type(seen[-1]).__name__ == "Stopped"
    assert "the last of" in branch.message


@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
def test_an_interrupt_waits_for_the_evaluation_under_way() -> None:
    """It used to be raised in the middle of the law, which may be compiled code."""
    calls = {"begun": 0, "ended": 0}

    def force(q, velocity, k):
        calls["begun"] += 1
        if calls["begun"] == 200:
            os.kill(os.getpid(), signal.SIGINT)
        calls["ended"] += 1
        return k * q**3

    problem = with_law(ss.SampledLaw(force=force, parameters={"k": 1.0}))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        branch = ss.forced_response(problem, omega=(2.0, 15.0))
    finally:
        signal.signal(signal.SIGINT, before)
    assert branch.outcome is ss.Outcome.INTERRUPTED
    assert len(branch) > 0
    assert calls["begun"] == calls["ended"]
