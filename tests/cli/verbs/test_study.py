"""The study verb as a user meets it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
import xarray
from helpers.command import slipstick
from helpers.study_case import CASE
from typer.testing import Result

import slipstick as ss
from slipstick.case.case import Case
from slipstick.errors import TimeIsUp
from slipstick.io.loading import load_dataset
from slipstick.studies import solving, together
from slipstick.studies.folder import StudyFolder
from slipstick.studies.mistuning import mistuning_study

BARE = ("--no-figures", "--workers", "1")


def told(result: Result) -> str:
    return " ".join(result.output.split())


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def result_of(folder: Path) -> xarray.Dataset:
    return load_dataset(folder / "study.nc").drop_vars("seconds").drop_attrs(deep=False)


def whole(case: Path) -> xarray.Dataset:
    assert slipstick("study", case, "-o", case.parent / "whole", *BARE).exit_code == 0
    return result_of(case.parent / "whole")


def test_a_study_leaves_its_results_and_figures(case: Path) -> None:
    out = case.parent / "out"
    result = slipstick("study", case, "-o", out, "--workers", 1)
    assert result.exit_code == 0, told(result)
    assert "oscillator: 3 cases, damper.velocity (3); 3 to compute" in told(result)
    assert "largest peak of x: " in told(result)
    data = load_dataset(out / "study.nc")
    assert data["damper.velocity"].to_numpy().tolist() == [20.0, 30.0, 40.0]
    assert data["outcome"].to_numpy().tolist() == ["COMPLETED"] * 3
    assert data.attrs["case"] == CASE
    names = {path.name for path in out.iterdir()}
    assert names == {"study.nc", "curves.nc", "report.html", "map.png", "map.svg", "curves.png", "curves.svg"}
    with xarray.open_dataset(out / "study.nc", engine="h5netcdf") as opened:
        assert opened["peak_amplitude"].dims == ("damper.velocity", "dof")
    result = slipstick("resume", out)
    assert (result.exit_code, "nothing is left to do" in told(result)) == (0, True)


def test_json(case: Path) -> None:
    result = slipstick("study", case, "-o", case.parent / "out", "--json", "-q", *BARE)
    answer = json.loads(result.stdout)
    assert (answer["exit_code"], answer["cases"], answer["computed"], answer["failed"]) == (0, 3, 3, 0)
    assert answer["outcome"] == "COMPLETED"
    assert [Path(name).name for name in answer["files"]] == ["curves.nc", "report.html", "study.nc"]


@pytest.mark.parametrize("error", [TimeIsUp(), KeyboardInterrupt()])
def test_an_interrupted_study_keeps_its_cases_and_goes_on(
    case: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    add, out = StudyFolder.add, case.parent / "out"

    def stop(self: StudyFolder, solved: solving.CaseSolved) -> None:
        if len(self.cases) == 2:
            raise error
        add(self, solved)

    with monkeypatch.context() as patch:
        patch.setattr(StudyFolder, "add", stop)
        result = slipstick("study", case, "-o", out, *BARE)
    assert result.exit_code == 1
    assert "go on with: slipstick resume" in told(result)
    assert load_dataset(out / "study.nc").attrs["outcome_text"] == "2 of 3 cases are computed"
    refused = slipstick("study", case, "-o", out, *BARE)
    assert refused.exit_code == 2
    assert "already holds a study" in told(refused)
    assert slipstick("resume", out, "--no-figures").exit_code == 0
    assert result_of(out).identical(whole(case))


def test_the_time_limit(case: Path) -> None:
    result = slipstick("study", case, "-o", case.parent / "out", "--time-limit", "1e-6 s", *BARE)
    assert result.exit_code == 1
    assert "stopped at the time limit" in told(result)
    assert load_dataset(case.parent / "out" / "study.nc").attrs["outcome_text"] == "1 of 3 cases are computed"


def test_shares_of_jobs_come_together(case: Path) -> None:
    out = case.parent / "out"
    for index in (1, 0):
        result = slipstick("study", case, "-o", out, "--index", index, "--of", 2)
        assert result.exit_code == 0, told(result)
    assert "share 0 of 2: 2 cases computed, 0 left" in told(result)
    found = ss.resume(out).drop_vars("seconds").drop_attrs(deep=False)
    assert found.identical(whole(case))
    assert found.identical(result_of(out))
    assert not list(out.glob("*.journal"))


def test_a_case_that_fails_is_a_row_and_missing_computes_it(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solved, out = together._together, case.parent / "out"

    def but_one(job: Any, plan: Any, cases: Any) -> dict[int, solving.CaseSolved]:
        return {number: one for number, one in solved(job, plan, cases).items() if number != 1}

    def fails(job: solving.Job, plan: object, number: int) -> solving.CaseSolved:
        return solving.CaseSolved.failed(number, "no luck")

    with monkeypatch.context() as patch:
        patch.setattr(together, "solve", fails)
        patch.setattr(together, "_together", but_one)
        result = slipstick("study", case, "-o", out, *BARE)
    assert result.exit_code == 1
    assert "1 cases did not complete: 1 failed: its message names the fault that ended it case 1: no luck" in told(
        result
    )
    assert load_dataset(out / "study.nc")["outcome"].to_numpy().tolist() == ["COMPLETED", "FAILED", "COMPLETED"]
    assert slipstick("study", case, "-o", out, "--missing", *BARE).exit_code == 0
    assert result_of(out).identical(whole(case))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (('"damper.velocity" = [20, 30, 40]', ""), "[study]: no parameter is given"),
        (('"damper.velocity"', '"damper.velocit"'), "there is no parameter 'damper.velocit'; did you mean 'damper.vel"),
        (("[20, 30, 40]", "[]"), "[study] damper.velocity: found an empty list; expected at least one value"),
        (("[20, 30, 40]", "[20, 20]"), "[study] damper.velocity: found 20 twice"),
        (("[20, 30, 40]", '"fast"'), "[study] damper.velocity: found 'fast'; expected a list of numbers"),
        (("[study]", '[study]\nmethod = "gird"'), "[study] method: found 'gird'; did you mean 'grid'?"),
        (("[study]", "[studi]"), "unknown key 'studi'"),
        (('[study]\n"damper.velocity" = [20, 30, 40]', ""), "[study] is missing; give the parameters"),
        (("[20, 30, 40]", "[20]\n[damper]\nmu = 3"), "unknown key 'damper'"),
    ],
)
def test_bad_input_is_one_clear_sentence(case: Path, change: tuple[str, str], sentence: str) -> None:
    case.write_text(CASE.replace(*change))
    result = slipstick("study", case, "-o", case.parent / "out", *BARE)
    assert result.exit_code == 2, told(result)
    assert sentence in told(result)
    assert "Traceback" not in told(result)
    assert not (case.parent / "out").exists()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--index", 0), "--index and --of go together"),
        (("--index", 3, "--of", 3), "--index: found 3 of 3 shares; expected a number from 0 to 2"),
        (("--workers", 2, "--scheduler", "tcp://x:1"), "--workers and --scheduler are both given"),
        (("--time-limit", "soon"), "--time-limit: found 'soon'"),
    ],
)
def test_options_that_do_not_go_together(case: Path, options: tuple[object, ...], sentence: str) -> None:
    result = slipstick("study", case, "-o", case.parent / "out", *options)
    assert result.exit_code == 2
    assert sentence in told(result)


def test_another_study_in_the_folder_is_refused(case: Path) -> None:
    out = case.parent / "out"
    assert slipstick("study", case, "-o", out, "--index", 0, "--of", 2).exit_code == 0
    case.write_text(CASE.replace("40]", "50]"))
    result = slipstick("study", case, "-o", out, "--index", 1, "--of", 2)
    assert result.exit_code == 2
    assert "another study is in it, or the case has changed since" in told(result)
    result = slipstick("resume", out)
    assert result.exit_code == 2
    assert "case.toml: the case has changed since the run began" in told(result).replace(os.sep, "/")


def test_names_without_quotes_mean_the_same(case: Path) -> None:
    case.write_text(
        CASE.replace('"damper.velocity" = [20, 30, 40]', "damper.velocity = { from = 20, to = 40, count = 3 }")
    )
    assert slipstick("study", case, "-o", case.parent / "out", *BARE).exit_code == 0
    assert load_dataset(case.parent / "out" / "study.nc")["damper.velocity"].to_numpy().tolist() == [20.0, 30.0, 40.0]


def test_run_and_check_say_what_the_table_is_for(case: Path) -> None:
    checked = slipstick("check", case)
    assert "study: 3 cases, damper.velocity (3): 'slipstick study" in told(checked)
    result = slipstick("run", case, "-o", case.parent / "run", "--no-figures", "--no-report")
    assert result.exit_code == 0
    assert "[study] is for 'slipstick study'; this computes the case itself" in told(result)


DISC = """
format = 1
title = "four blades"
harmonics = [0, 1, 3]

[structure]
kind = "disc"
dofs = ["tip"]
sectors = 4
engine_order = 1
mass = [[1.0]]
stiffness = [[[1.04]], [[-0.02]]]
loss_factor = 4e-3
mistuning = { blade = [[1.0]], spread = 0.5, seed = 9 }

[[load]]
dof = "tip"
cos = 1.0

[[contact]]
name = "shroud"
tangential = { "tip" = 1.0, "tip@next" = -1.0 }
kt = 0.03
mu = 0.3
normal_load = 2.0

[response]
from = 0.99
to = 1.1

[study]
method = "mistuning"
samples = 2
spread = 0.02
seed = 4
"""


def test_discs_whose_blades_differ(tmp_path: Path) -> None:
    """The numbers of the study in Python, on the terminal, in the results, in JSON and in the report."""
    path, out = tmp_path / "disc.toml", tmp_path / "out"
    path.write_text(DISC)
    check = slipstick("check", path)
    assert "2 discs whose blades differ at random (spread 0.02" in told(check)
    assert "whole disc: blades are numbered from 0 to 3, contacts from 1" in told(check)
    first = slipstick("study", path, "-o", out, "--time-limit", "1e-6 s", *BARE)
    assert (first.exit_code, "1 of 3 cases" in load_dataset(out / "study.nc").attrs["outcome_text"]) == (1, True)
    result = slipstick("resume", out, "--workers", 1, "--json")
    answer = json.loads(result.stdout)
    problem, given = Case.from_file(path).problem(), {"omega": (0.99, 1.1), "spread": 0.02, "samples": 2, "seed": 4}
    known = mistuning_study(problem, workers=1, **given)  # type: ignore[arg-type]
    data = load_dataset(out / "study.nc")
    assert data["amplification"].to_numpy().tolist() == known.amplification.to_numpy().tolist()
    assert data["worst"].to_numpy().tolist() == known.worst.to_numpy().tolist()
    found, worst = answer["amplification"], int(known.amplification.argmax("sample"))
    assert (answer["cases"], found["discs"], found["worst"]["case"]) == (3, 2, worst)
    assert found["percentiles"]["50"] == float(known.amplification_percentile[0])
    assert found["worst"]["deviations"] == known.deviation[worst].to_numpy().tolist()
    assert found["worst"]["omega"] == float(known.omega[worst])
    assert {"amplification.png", "percentiles.png", "worst.png"} <= {file.name for file in out.iterdir()}
    assert f"worst disc: case {worst}" in told(result)
    assert f"of {found['worst']['output']} (blades 0 to 3)" in told(result)
