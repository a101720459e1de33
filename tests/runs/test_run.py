"""A run in Python: what it tells its listener is what it keeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.cases import oscillator

from slipstick.case.case import Case
from slipstick.errors import Outcome, TimeIsUp
from slipstick.io.loading import load_dataset
from slipstick.runs.folder import FolderOfRun, OutputFolder
from slipstick.runs.resume import begun_run
from slipstick.runs.run import CaseRun, GoingOn, PointKept, RunListener

CASE = oscillator(
    head='harmonics = "0..3"\n', rubbing="velocity = 10.0", response="from = 5.0\nto = 6.0\nmax_step = 4e-2\n"
)


class Kept(RunListener):
    """Keeps what it hears, and ends the run at a number of points."""

    def __init__(self, most: int = 10**9) -> None:
        self.most, self.omega, self.before = most, list[float](), list[GoingOn]()

    def going_on(self, event: GoingOn) -> None:
        self.before.append(event)

    def point_kept(self, event: PointKept) -> None:
        self.omega.append(float(event.values["omega"]))
        if len(self.omega) == self.most:
            raise TimeIsUp


def test_a_listener_hears_every_point_once_it_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "case.toml").write_text(CASE)
    case, out, first, rest = Case.from_file(tmp_path / "case.toml"), tmp_path / "out", Kept(4), Kept()
    folder = OutputFolder(out, case_path=case.path, case_text=case.text)
    run = CaseRun(case, folder)
    run.compute(first)
    run.finish()
    folder.release()
    assert (run.outcome, run.points, run.unfinished) == (Outcome.TIME_LIMIT, 4, True)
    place, doubts = FolderOfRun(out), list[str]()
    again = begun_run(place, doubts.append)
    assert isinstance(again, CaseRun)
    again.compute(rest)
    place.release()
    assert again.complete
    (before,) = rest.before
    kept = first.omega[: before.points]  # a located point, from which nothing goes on, is located again
    assert (before.points > 0, before.value) == (True, kept[-1])
    np.testing.assert_array_equal(load_dataset(out / "results.nc")["omega"], [*kept, *rest.omega])
    assert doubts == []
    assert capsys.readouterr() == ("", "")
