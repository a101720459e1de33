"""Ctrl-C and the time limit before anything is found: nothing is said to be kept."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.command import slipstick

import slipstick as ss
from slipstick.analysis.road.events import Listener
from slipstick.runs.run import Clock
from slipstick.studies.folder import StudyFolder

CASE = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[contact]]
name = "foot"
tangential = "x"
kt = 100.0
mu = 0.3
kn = 100.0
gap = -0.1
[[load]]
dof = "x"
cos = 5.0
[response]
from = 4.0
to = 14.0
[wear]
kappa = { foot = 1e-5 }
to = 1e4
omega = 9.0
[track]
parameter = "foot.mu"
from = 0.1
to = 0.3
[optimal]
parameter = "foot.mu"
[modes]
from = 0.01
to = 1.0
[run_up]
from = 4.0
to = 6.0
rate = 0.1
[study]
"foot.mu" = [0.1, 0.2]
"""


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def interrupting(*_: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("verb", ["run", "wear", "track", "optimal", "modes"])
@pytest.mark.parametrize("stop", ["Ctrl-C", "time limit"])
def test_no_point(case: Path, verb: str, stop: str, monkeypatch: pytest.MonkeyPatch) -> None:
    out, limit = case.parent / "out", ()
    if stop == "Ctrl-C":
        monkeypatch.setattr(Clock, "_check_time", interrupting)
        code, words = 130, "interrupted by the user; no point was found"
    else:
        limit, code, words = ("--time-limit", "1e-6 s"), 1, "stopped at the time limit; no point was found"
    result = slipstick(verb, case, "-o", out, "-q", "--json", *limit)
    assert result.exit_code == code, result.output
    answer = json.loads(result.stdout)
    assert (answer["exit_code"], answer["points"]) == (code, 0)
    assert answer["message"].startswith(words)
    assert words in result.stderr
    assert "is kept" not in result.output
    assert out.exists() == (verb == "run")  # resume goes on with a run, whose first point may be long in coming


def test_no_period_and_no_case(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Clock, "_check_time", interrupting)
    monkeypatch.setattr(StudyFolder, "add", interrupting)
    passed = slipstick("run-up", case, "-o", case.parent / "passed", "-q")
    assert (passed.exit_code, "0 of 15 periods are integrated" in passed.output) == (130, True)
    study = slipstick("study", case, "-o", case.parent / "study", "-q", "--workers", 1, "--no-figures")
    assert (study.exit_code, "interrupted by the user; no point was found" in study.output) == (130, True)
    assert "go on with: slipstick resume" in study.output


class Impatient(Listener):
    def started(self, event: object) -> None:
        raise KeyboardInterrupt


def test_no_point_in_python(case: Path) -> None:
    interrupting = Impatient()
    problem = ss.Case.from_file(case).problem()
    curve = ss.forced_response(problem, (4.0, 5.0), listeners=interrupting)
    assert curve.message == "interrupted by the user; no point was found at 4 rad/s"
    points = ss.steady_response(problem, omega=[4.0, 5.0], listeners=interrupting)
    assert points.message == "interrupted by the user; no point was found"
