"""One case of a study is the curve of its problem, and a row whatever happens."""

from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.curve.follow import CurveRequest
from slipstick.errors import Outcome
from slipstick.studies.plan import StudyPlan, make_plan
from slipstick.studies.solving import CaseSolved, Job, solve
from slipstick.verify.cases import oscillator


@pytest.fixture(scope="module")
def job() -> Job:
    return Job(problem=oscillator(velocity=10.0), span=(4.0, 8.0))


@pytest.fixture(scope="module")
def plan(job: Job) -> StudyPlan:
    return make_plan(job.problem, {"damper.velocity": [10.0, 20.0], "damper.mu": [0.2, 0.3]})


def test_a_case_is_the_curve_of_its_problem(job: Job, plan: StudyPlan) -> None:
    solved = solve(job, plan, 2)
    problem = job.problem.with_parameter("damper.velocity", 20.0).with_parameter("damper.mu", 0.2)
    branch = ss.forced_response(problem, omega=(4.0, 8.0))
    curve = job.curve_layout.unpack(solved.curve)
    for name in ("omega", "amplitude", "mean", "dissipated_power", "peak_dof"):
        np.testing.assert_array_equal(curve[name], branch.dataset[name].to_numpy())
    assert set(curve["case"].tolist()) == {2}
    peaks = branch.peaks("x")
    assert (solved.row["peak_omega"][0], solved.row["peak_amplitude"][0]) == max(peaks, key=lambda peak: peak[1])
    assert solved.row["peak_located"][0] == 1
    assert solved.outcome is Outcome.COMPLETED


def test_the_largest_amplitude_at_an_end_is_no_peak(job: Job) -> None:
    ends = Job(problem=job.problem, span=(9.9, 15.0))
    solved = solve(ends, make_plan(job.problem, {"damper.velocity": [100.0]}), 0)
    assert solved.row["peak_located"][0] == 0
    assert solved.row["peak_omega"][0] == 9.9


def test_a_followed_parameter(job: Job) -> None:
    follows = Job(problem=job.problem, span=(5.0, 15.0), parameter="damper.velocity", omega=6.0)
    solved = solve(follows, make_plan(job.problem, {"damper.mu": [0.3]}), 0)
    assert 5.0 <= solved.row["peak_parameter"][0] <= 15.0
    assert "parameter" in follows.curve_layout.variables


def test_a_curve_that_stops_early_keeps_its_outcome(job: Job, plan: StudyPlan) -> None:
    short = Job(problem=job.problem, span=job.span, options={"max_points": 5})
    solved = solve(short, plan, 0)
    assert solved.outcome is Outcome.POINT_LIMIT
    assert len(solved.curve) >= 5


@pytest.mark.parametrize("error", [ValueError("a\nb"), ss.InputError("not together"), MemoryError()])
def test_a_fault_is_a_row(job: Job, plan: StudyPlan, monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def broken(*_: object) -> None:
        raise error

    monkeypatch.setattr(CurveRequest, "solutions", broken)
    solved = solve(job, plan, 1)
    assert (solved.outcome, solved.row["points"], solved.curve.size) == (Outcome.FAILED, 0, 0)
    assert "not together" in solved.message or "a fault of slipstick itself" in solved.message
    assert isinstance(solved, CaseSolved)


def test_an_interrupt_goes_on_to_the_caller(job: Job, plan: StudyPlan, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = CurveRequest.solutions

    def interrupted(request: CurveRequest) -> object:
        branch = whole(request)
        branch.outcome = Outcome.INTERRUPTED
        return branch

    monkeypatch.setattr(CurveRequest, "solutions", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solve(job, plan, 0)
