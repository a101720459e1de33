"""Results that are there already: every verb with a folder refuses them in the same words, and replaces them alike."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.command import slipstick
from helpers.study_case import CASE
from typer.testing import Result

import slipstick as ss
from slipstick.io.loading import load_dataset
from slipstick.studies.folder import StudyFolder

RUN_UP = "[run_up]\nfrom = 9.0\nto = 9.4\nrate = 0.05\n"
IDENTIFY = '[identify]\nparameters = { "damper.mu" = 0.2 }\n'
TRACK = '[track]\nparameter = "damper.velocity"\nfrom = 20\nto = 40\n'
LEFT = {
    "run": "results.nc",
    "study": "study.nc",
    "run-up": "run_up.nc",
    "identify": "identify.nc",
    "preload": "preload.nc",
}
BEGUN = {"run": "results.nc.journal", "study": "study.journal", "run-up": "run_up.nc.journal"}
OR_REPLACE = "choose another folder with -o, or --force to replace its results"
BARE = ("-q", "--no-figures", "--no-report")


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(CASE + RUN_UP + IDENTIFY + TRACK)
    return path


def call(verb: str, case: Path, *more: object) -> Result:
    return slipstick(verb, case, *(["data.csv"] if verb == "identify" else []), "-o", case.parent / "out", *more)


def told(result: Result) -> str:
    return " ".join(result.output.split())


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("held", [*LEFT.values(), "report.html"])
@pytest.mark.parametrize("verb", [*LEFT, "track"])
def test_results_of_any_verb_are_refused_by_every_verb(case: Path, verb: str, held: str) -> None:
    if (verb, held) == ("run-up", LEFT["run-up"]):
        return  # it goes on with its own
    out = case.parent / "out"
    out.mkdir()
    for name in (held, "report.html"):
        (out / name).write_bytes(b"earlier")
    before = content(out)
    result = call(verb, case)
    assert (result.exit_code, told(result)) == (2, f"error: {out} already holds {held}; {OR_REPLACE}")
    assert content(out) == before


@pytest.mark.parametrize("verb", [*LEFT, "track"])
def test_what_did_not_end_is_not_orphaned(case: Path, verb: str) -> None:
    words = {"run": "a run", "study": "a study", "run-up": "a run-up"}
    for begun, name in BEGUN.items():
        if begun == verb == "run-up":
            continue
        out = case.parent / "out"
        out.mkdir(exist_ok=True)
        (out / name).write_bytes(b"earlier")
        result = call(verb, case)
        resume = f"already holds {words[begun]} that did not end; go on with it by 'slipstick resume {out}', "
        assert (result.exit_code, resume in told(result)) == (2, True)
        assert OR_REPLACE in told(result)
        assert content(out) == {name: b"earlier"}
        (out / name).unlink()


def test_what_a_verb_would_write_is_refused_and_what_others_keep_there_is_not(case: Path) -> None:
    out = case.parent / "out"
    out.mkdir()
    (out / "map.png").write_bytes(b"of the user")
    assert "out already holds map.png" in told(call("study", case))
    result = call("run-up", case, *BARE)
    assert result.exit_code == 0, told(result)
    assert (out / "map.png").read_bytes() == b"of the user"


def test_another_run_up_is_refused_and_its_own_is_gone_on_with(case: Path) -> None:
    assert call("run-up", case, *BARE).exit_code == 0
    assert call("run-up", case, *BARE).exit_code == 0
    case.write_text(case.read_text().replace("to = 9.4", "to = 9.3"))
    result = call("run-up", case)
    out = case.parent / "out"
    assert (result.exit_code, told(result)) == (
        2,
        f"error: {out} already holds another run-up (run_up.nc); {OR_REPLACE}",
    )
    periods = load_dataset(out / "run_up.nc").sizes["period"]
    assert call("run-up", case, "--force", *BARE).exit_code == 0
    assert load_dataset(out / "run_up.nc").sizes["period"] < periods
    assert [path.name for path in out.iterdir()] == ["run_up.nc"]


@pytest.mark.parametrize("python", [False, True])
def test_a_forced_study_replaces_a_run_once_it_is_complete(
    case: Path, monkeypatch: pytest.MonkeyPatch, python: bool
) -> None:
    out, add = case.parent / "out", StudyFolder.add
    assert call("run", case, "-q", "--figures", "response").exit_code == 0
    (out / "notes.txt").write_text("of the user")
    before = content(out)

    def stop(self: StudyFolder, solved: object) -> None:
        if len(self.cases) == 1:
            raise KeyboardInterrupt
        add(self, solved)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(StudyFolder, "add", stop)
        result = call("study", case, "--force", "--workers", 1)
    assert result.exit_code == 1
    assert f"the earlier results in {out} are untouched; the new ones are not complete" in told(result)
    assert f"go on with: slipstick resume {out}" in told(result)
    assert {name: data for name, data in before.items() if name != "unfinished"} == {
        path.name: path.read_bytes() for path in out.iterdir() if path.is_file()
    }
    if python:
        assert dict(ss.resume(out).sizes)["damper.velocity"] == 3
        left = {"study.nc", "curves.nc"}
    else:
        assert slipstick("resume", out, "--no-figures").exit_code == 0
        left = {"study.nc", "curves.nc"}
    names = {path.name for path in out.iterdir()}
    assert left <= names
    assert not names & {"results.nc", "response.png", "unfinished"}
    assert (out / "notes.txt").read_text() == "of the user"
    assert load_dataset(out / "study.nc").attrs["outcome"] == "COMPLETED"


def test_force_begins_anew_and_shares_go_on(case: Path) -> None:
    for option in (("--missing",), ("--index", 0, "--of", 2)):
        result = call("study", case, "--force", *option)
        assert (result.exit_code, f"--force: begins a study anew, {option[0]} goes on" in told(result)) == (2, True)
