"""Wear computed into a folder: it survives a kill, goes on to the same points, and comes back with its problem."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.wear_case import CASE

import slipstick as ss
from slipstick.analysis.events import PointFound
from slipstick.case.case import Case
from slipstick.io.journal import packed_notes, unpacked
from slipstick.runs.folder import OutputFolder
from slipstick.runs.run import CaseRun, PointKept, RunListener


class Killed(RunListener):
    """Kills the process after so many points."""

    def __init__(self, count: int) -> None:
        self._left = count

    def point_kept(self, event: PointKept) -> None:
        self._left -= 1
        if self._left == 0:
            os.kill(os.getpid(), signal.SIGKILL)


def run(folder: Path, omega: str, listener: RunListener | None = None) -> None:
    case = Case.from_text(CASE.replace("OMEGA", omega), folder.parent / "case.toml")
    CaseRun(case, OutputFolder(folder, case_path=case.path, case_text=case.text), table="wear").compute(listener)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("omega", ["10.0", '"peak"'])
def test_a_killed_run_goes_on_to_the_same_points(tmp_path: Path, omega: str) -> None:
    run(tmp_path / "whole", omega)
    whole = ss.load(tmp_path / "whole" / "results.nc")
    assert whole.outcome.ok
    child = os.fork()
    if child == 0:
        try:
            run(tmp_path / "killed", omega, Killed(3))
        finally:
            os._exit(1)
    assert os.WIFSIGNALED(os.waitpid(child, 0)[1])
    assert len(ss.load(tmp_path / "killed" / "results.nc")) == 3
    again = ss.resume(tmp_path / "killed")
    assert isinstance(again, ss.Branch)
    assert again.outcome.ok
    for name, values in whole.dataset.data_vars.items():
        np.testing.assert_array_equal(again.dataset[name], values, err_msg=str(name))


def test_results_come_back_with_their_problem(tmp_path: Path) -> None:
    case = Case.from_text(CASE.replace("OMEGA", '"10 rad/s"'), tmp_path / "case.toml")
    branch = ss.Branch.of(case.asks("wear").solutions())
    branch.save(tmp_path / "r.nc")
    again = ss.load(tmp_path / "r.nc")
    assert again.dataset["cycles"].attrs["long_name"] == "cycles of vibration"
    worn = again.problem_at(len(again) - 1)
    depth = float(again.dataset["worn_depth"][-1, 0])
    assert float(worn.parameter("damper.gap")) == pytest.approx(depth - 800.0, rel=1e-15)
    assert not worn.contact_states
    here = again.sensitivity(["damper.mu"])["amplitude"].to_numpy()[0]
    there = ss.steady_response(worn, omega=10.0).sensitivity(["damper.mu"])["amplitude"].to_numpy()[0]
    assert here[-1] == pytest.approx(there[0], rel=1e-9)
    assert abs(here[-1] / here[0] - 1.0) > 0.05
    assert again.check_in_time(len(again) - 1).relative_difference < 1e-3


def test_notes_of_journals_written_before_are_read(tmp_path: Path) -> None:
    """They called what is followed cycles, and said nothing of part and whether a run goes on from there."""
    request = Case.from_text(CASE.replace("OMEGA", "10.0"), tmp_path / "case.toml").asks("wear")
    heard: list[PointFound] = []
    listen = lambda event: heard.append(event) if isinstance(event, PointFound) else None  # noqa: E731
    for _ in replace(request, listeners=(listen,)).run().follow():
        if len(heard) == 3:
            break
    kept = heard[-1].checkpoint
    assert kept is not None
    plain = unpacked(packed_notes(kept.plain()))
    before = {name: value for name, value in plain.items() if name not in ("value", "part", "goes_on")}
    again = request.checkpoint({**before, "cycles": plain["value"]})
    assert again.goes_on
    assert (again.value, again.part, again.seconds) == (kept.value, kept.part, kept.seconds)
    assert {name: repr(value) for name, value in again.own.items()} == {n: repr(v) for n, v in kept.own.items()}
