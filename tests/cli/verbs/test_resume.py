"""Runs that are gone on with: the same results as if nothing had happened, and one clear sentence where they cannot."""

from __future__ import annotations

import errno
import json
import os
import shutil
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray
from helpers.counting import ticking
from typer.testing import CliRunner, Result

import slipstick as ss
from slipstick.cli import options
from slipstick.cli.main import app
from slipstick.errors import TimeIsUp
from slipstick.io.loading import load_dataset
from slipstick.io.store import ResultStore
from slipstick.runs import run
from slipstick.runs.run import UNFINISHED

CASE = """
format = 1
title = "oscillator"
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x"]
mass = "mass.npz"
damping = [[0.4]]
stiffness = [[40.0]]
[[load]]
dof = "x"
sin = 100.0
[[contact]]
name = "damper"
tangential = "x"
kt = 100.0
mu = 0.3
normal_load = 800.0
rubbing = { velocity = 10.0 }
[response]
from = 4.0
to = 8.0
first_step = 0.04
max_step = 0.04
"""
BARE = ("--no-figures", "--no-report")
STOPPED_AT = 12


def slipstick(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def told(result: Result) -> str:
    return " ".join((result.output + (result.stderr if result.stderr_bytes else "")).split())


@pytest.fixture
def case(tmp_path: Path) -> Path:
    return written(tmp_path)


def written(folder: Path) -> Path:
    np.savez(folder / "mass.npz", mass=np.array([[1.0]]))
    path = folder / "case.toml"
    path.write_text(CASE)
    return path


def stopped(case: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException | None = None, *more: str) -> Result:
    """A run that ends by ``error`` (by default as at the time limit) instead of storing its 13th point."""
    append = ResultStore.append

    def full(self: ResultStore, *point: object) -> None:
        if len(self) == STOPPED_AT:
            raise error or TimeIsUp
        append(self, *point)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(ResultStore, "append", full)
        return slipstick("run", case, "-o", case.parent / "out", *BARE, *more)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> xarray.Dataset:
    """What a run finds that nobody disturbs."""
    folder = tmp_path_factory.mktemp("whole")
    assert slipstick("run", written(folder), "-o", folder / "whole", *BARE).exit_code == 0
    return load_dataset(folder / "whole" / "results.nc")


@pytest.mark.parametrize("error", [None, KeyboardInterrupt(), OSError(errno.ENOSPC, "No space"), ValueError("a fault")])
def test_a_run_gone_on_with_ends_as_if_nothing_had_happened(
    case: Path, whole: xarray.Dataset, monkeypatch: pytest.MonkeyPatch, error: BaseException | None
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(case.parent))
    result = stopped(case, monkeypatch, error)
    assert result.exit_code == 1
    assert "go on with: slipstick resume" in told(result)
    out = case.parent / "out"
    assert load_dataset(out / "results.nc").sizes["point"] == STOPPED_AT
    result = slipstick("resume", out, *BARE)
    assert result.exit_code == 0, told(result)
    assert "completed" in told(result)
    found = load_dataset(out / "results.nc")
    assert found.drop_attrs(deep=False).identical(whole.drop_attrs(deep=False))
    assert sorted(p.name for p in out.iterdir()) == ["case.toml", "results.nc"]
    assert {**found.attrs, "seconds": 0} == {**whole.attrs, "seconds": 0}


def test_python_goes_on_too(
    case: Path, whole: xarray.Dataset, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stopped(case, monkeypatch)
    branch = ss.resume(case.parent / "out")
    assert isinstance(branch, ss.Branch)
    assert branch.outcome is ss.Outcome.COMPLETED
    assert branch.problem is not None
    assert branch.dataset.drop_attrs(deep=False).identical(whole.drop_attrs(deep=False))
    assert capsys.readouterr() == ("", "")
    with pytest.raises(ss.InputError, match="there is no run or study in it"):
        ss.resume(case.parent / "out" / "..")


def test_python_warns_of_another_numpy_and_prints_nothing(
    case: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where the command says it on standard error."""
    stopped(case, monkeypatch)
    from slipstick.results import schema

    other = {**schema.versions(), "numpy_version": "9.9"}
    monkeypatch.setattr(schema, "versions", lambda: other)
    before = sys.stdout
    with pytest.warns(ss.SlipstickWarning, match="this is 9.9: last digits may differ"):
        ss.resume(case.parent / "out")
    assert sys.stdout is before
    assert capsys.readouterr() == ("", "")


def test_a_complete_run_says_so_and_figures_are_left_alone(case: Path) -> None:
    out = case.parent / "out"
    assert slipstick("run", case, "-o", out, *BARE).exit_code == 0
    before = (out / "results.nc").read_bytes()
    result = slipstick("resume", out)
    assert (result.exit_code, "nothing is left to do" in told(result)) == (0, True)
    assert (out / "results.nc").read_bytes() == before


def test_a_run_that_ended_by_itself_says_how(case: Path) -> None:
    case.write_text(CASE + "max_points = 5\n")
    assert slipstick("run", case, "-o", case.parent / "out", *BARE).exit_code == 1
    result = slipstick("resume", case.parent / "out")
    assert result.exit_code == 1
    assert "largest number of points was reached" in told(result)


def test_the_time_limit_ends_a_run_with_what_was_found(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on a second with every point and whatever else is found."""
    ticking(monkeypatch, options, run)
    result = slipstick("run", case, "-o", case.parent / "out", *BARE, "--time-limit", "15 s")
    assert result.exit_code == 1
    assert "stopped at the time limit; every point found is kept" in told(result)
    found = load_dataset(case.parent / "out" / "results.nc")
    assert found.attrs["outcome"] == "TIME_LIMIT"
    assert 0 < found.sizes["point"] < 15
    assert slipstick("resume", case.parent / "out", *BARE, "--time-limit", "5").exit_code == 1
    more = load_dataset(case.parent / "out" / "results.nc").sizes["point"]
    assert found.sizes["point"] < more < found.sizes["point"] + 5


@pytest.mark.parametrize("text", ["soon", "0", "-1 h", "3 weeks"])
def test_a_time_limit_that_is_none(case: Path, text: str) -> None:
    result = slipstick("run", case, "--time-limit", text)
    assert result.exit_code == 2
    assert f"--time-limit: found '{text}'; expected a time" in told(result)


def test_a_forced_run_gone_on_with_replaces_the_earlier_results(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = case.parent / "out"
    assert slipstick("run", case, "-o", out, *BARE).exit_code == 0
    case.write_text(CASE.replace("to = 8.0", "to = 7.0"))
    assert stopped(case, monkeypatch, None, "--force").exit_code == 1
    assert (out / "unfinished").is_dir()
    assert slipstick("resume", out, *BARE).exit_code == 0
    assert float(load_dataset(out / "results.nc")["omega"][-1]) == 7.0
    assert not (out / "unfinished").exists()


def test_a_case_that_is_gone_is_read_from_the_results(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped(case, monkeypatch)
    case.unlink()
    assert slipstick("resume", case.parent / "out", *BARE).exit_code == 0


def other_version(case: Path) -> None:
    path = case.parent / "out" / "results.nc.journal"
    line, _, rest = path.read_bytes().partition(b"\n")
    header = json.loads(line[9:])
    header["attributes"]["slipstick_version"] = "0.0.1"
    text = json.dumps(header).encode()
    path.write_bytes(b"%08x " % zlib.crc32(text) + text + b"\n" + rest)


REFUSED: dict[str, tuple[Callable[[Path], object], str]] = {
    "case": (lambda case: case.write_text(CASE + "\n"), "case.toml: the case has changed since the run began; put it"),
    "copy": (lambda case: (case.parent / "out" / "case.toml").write_text(""), "out/case.toml: the case has changed"),
    "file": (lambda case: np.savez(case.parent / "mass.npz", mass=[[1.01]]), "a file that the case names"),
    "version": (other_version, "the run was begun by slipstick 0.0.1, this is "),
    "journal": (lambda case: (case.parent / "out/results.nc.journal").unlink(), "results.nc.journal, from which"),
    "garbage": (lambda case: (case.parent / "out/results.nc.journal").write_bytes(b"x"), "not a journal of slipstick"),
    "empty": (
        lambda case: [p.unlink() for p in (case.parent / "out").iterdir()],
        "there is no run or study in it; expected",
    ),
    "missing": (lambda case: shutil.rmtree(case.parent / "out"), "there is no such folder; expected a folder that"),
}


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_gone_on_with_is_refused_in_one_sentence(
    case: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    stopped(case, monkeypatch)
    change, sentence = REFUSED[name]
    change(case)
    before = {p.name: p.read_bytes() for p in sorted(case.parent.glob("out/*"))}
    result = slipstick("resume", case.parent / "out")
    assert result.exit_code == 2, told(result)
    assert sentence in told(result).replace(os.sep, "/")
    assert "Traceback" not in told(result)
    assert {p.name: p.read_bytes() for p in sorted(case.parent.glob("out/*"))} == before


def test_another_numpy_is_told(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped(case, monkeypatch)
    from slipstick.results import schema

    other = {**schema.versions(), "numpy_version": "9.9"}
    monkeypatch.setattr(schema, "versions", lambda: other)
    result = slipstick("resume", case.parent / "out", *BARE)
    assert result.exit_code == 0
    assert "this is 9.9: last digits may differ" in told(result)


def test_run_names_resume_where_a_run_did_not_end(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped(case, monkeypatch)
    result = slipstick("run", case, "-o", case.parent / "out")
    assert result.exit_code == 2
    assert "already holds a run that did not end; go on with it by 'slipstick resume" in told(result)


def test_the_module_says_which_outcomes_can_be_gone_on_with() -> None:
    assert {outcome.name for outcome in UNFINISHED} == {"INTERRUPTED", "TIME_LIMIT"}
