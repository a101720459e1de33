"""Tables of a case computed into a folder: they survive a kill, go on to the same points, and end in time."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from helpers.cases import oscillator
from helpers.command import slipstick

import slipstick as ss
from slipstick.case.case import Case
from slipstick.errors import Outcome, TimeIsUp
from slipstick.io.journal import journal_of, read_journal
from slipstick.runs.folder import OutputFolder
from slipstick.runs.run import CaseRun, PointKept, RunListener

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

CASE = oscillator(
    head='harmonics = "0..5"\nunits = { length = "mm", force = "N", time = "s" }\n', rubbing="velocity = 0.0",
    response="from = 8.0\nto = 12.0\n",
)  # fmt: skip
TABLES = {
    "track": '[track]\nparameter = "damper.normal_load"\nfrom = 400.0\nto = 800\nat = [700.0]\n',
    "optimal": '[optimal]\nparameter = "damper.normal_load"\nstart = 500.0\nomega = [2.0, 12.0]\n',
    "modes": "[modes]\nfrom = 2\nto = 8.0\nload_factors = [1.0]\n",
}
EXAMPLES = Path(__file__).parents[2] / "examples"
BRAKE = (EXAMPLES / "brake_squeal" / "brake_squeal.toml").read_text().replace("0..10", "0..4")


class After(RunListener):
    """Does something after so many points."""

    def __init__(self, count: int, what: object) -> None:
        self._left, self._what = count, what

    def point_kept(self, event: PointKept) -> None:
        self._left -= 1
        if self._left == 0:
            self._what()  # type: ignore[operator]


def kill() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def time_up() -> None:
    raise TimeIsUp


def run(folder: Path, table: str, listener: RunListener | None = None) -> CaseRun:
    path = folder.parent / "case.toml"
    path.write_text(BRAKE if table == "limit_cycles" else CASE + TABLES[table])
    case = Case.from_file(path)
    made = CaseRun(case, OutputFolder(folder, case_path=case.path, case_text=case.text), table=table)
    made.compute(listener)
    made.folder.release()
    return made


def same(one: ss.Branch, other: ss.Branch) -> None:
    assert one.outcome is other.outcome
    assert one.message == other.message
    assert set(one.dataset.variables) == set(other.dataset.variables)
    for name, values in other.dataset.variables.items():
        np.testing.assert_array_equal(one.dataset[name], values, err_msg=str(name))
    work = ("analysis", "evaluations", "linear_solves", "rejected_steps", "factorisations", "warnings")
    assert {n: one.dataset.attrs.get(n) for n in work} == {n: other.dataset.attrs.get(n) for n in work}


@pytest.fixture(scope="module", params=[*TABLES, "limit_cycles"])
def whole(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ss.Branch]:
    table: str = request.param
    folder = tmp_path_factory.mktemp(table) / "whole"
    run(folder, table)
    return table, ss.load(folder / "results.nc")


@pytest.mark.parametrize("count", [4, pytest.param(9, marks=pytest.mark.verify)])
def test_a_killed_run_goes_on_to_the_same_points(whole: tuple[str, ss.Branch], count: int, tmp_path: Path) -> None:
    table, expected = whole
    child = os.fork()
    if child == 0:
        try:
            run(tmp_path / "killed", table, After(count, kill))
        finally:
            os._exit(1)
    assert os.WIFSIGNALED(os.waitpid(child, 0)[1])
    assert len(read_journal(journal_of(tmp_path / "killed" / "results.nc"))) == count
    assert ss.load(tmp_path / "killed" / "results.nc").dataset.attrs["analysis"] == {"limit_cycles": "cycles"}.get(
        table, table
    )
    again = ss.resume(tmp_path / "killed")
    assert isinstance(again, ss.Branch)
    same(again, expected)


def test_a_run_whose_time_is_up_is_resumed_by_the_command(whole: tuple[str, ss.Branch], tmp_path: Path) -> None:
    table, expected = whole
    assert run(tmp_path / "out", table, After(6, time_up)).outcome is Outcome.TIME_LIMIT
    result = slipstick("resume", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    assert (answer["outcome"], answer["points"]) == ("COMPLETED", len(expected))
    assert answer[{"modes": "peaks", "optimal": "kind"}.get(table, "marked")]
    same(ss.load(tmp_path / "out" / "results.nc"), expected)
    files = {path.name for path in (tmp_path / "out").iterdir()}
    drawn = {"modes": ("backbone", "damping"), "limit_cycles": ("response", "stability")}.get(table, ("response",))
    assert files == {"case.toml", "results.nc", "report.html", *(f"{name}.png" for name in drawn)}
    assert "is complete" in slipstick("resume", tmp_path / "out").output


def test_a_limit_that_is_over_at_once_says_so_and_keeps_nothing(whole: tuple[str, ss.Branch], tmp_path: Path) -> None:
    table, _ = whole

    class AtOnce(RunListener):
        def started(self, event: object) -> None:
            raise TimeIsUp

    made = run(tmp_path / "out", table, AtOnce())
    assert (made.outcome, made.nothing) == (Outcome.TIME_LIMIT, True)
