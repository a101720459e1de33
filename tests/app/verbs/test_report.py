"""The page that a run leaves, and the ``report`` verb."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

import slipstick.report.writing
from slipstick.app.cli import app
from slipstick.app.verbs.report import labels
from slipstick.errors import InputError

CASE = """
format = 1
title = "oscillator <b>rubbed</b>"
harmonics = "0..3"
units = { length = "mm", force = "N", time = "s" }
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
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
from = "0.8 Hz"
to = "1 Hz"
"""


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def command(*words: object) -> tuple[int, str]:
    found = CliRunner().invoke(app, [str(word) for word in words])
    return found.exit_code, found.output


def test_a_run_leaves_a_report_in_its_units(case: Path, tmp_path: Path) -> None:
    assert command("run", case, "-o", tmp_path / "out", "-q", "--no-figures")[0] == 0
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<title>oscillator &lt;b&gt;rubbed&lt;/b&gt;</title>" in text
    assert '"units":"N mm/s","after":" N mm/s"' in text
    assert '"frequency":{"unit":"Hz"' in text
    assert "normal_load = 800.0" in text  # the case, as it was


def test_a_run_without_a_report(case: Path, tmp_path: Path) -> None:
    assert command("run", case, "-o", tmp_path / "out", "-q", "--no-figures", "--no-report")[0] == 0
    assert not (tmp_path / "out" / "report.html").exists()


@pytest.mark.parametrize("fault", [InputError("out/report.html: cannot be written"), RuntimeError("a fault")])
def test_a_run_whose_report_fails_keeps_its_results(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception
) -> None:
    def fail(*args: object, **options: object) -> None:
        raise fault

    monkeypatch.setattr(slipstick.report.writing, "write_report", fail)
    code, said = command("run", case, "-o", tmp_path / "out", "-q", "--no-figures")
    assert code == 0
    assert str(fault) in said
    assert (tmp_path / "out" / "results.nc").exists()


def test_results_are_laid_over_each_other(case: Path, tmp_path: Path) -> None:
    for name in ("v0", "v10"):
        assert command("run", case, "-o", tmp_path / name, "-q", "--no-figures", "--no-report")[0] == 0
    files = [tmp_path / name / "results.nc" for name in ("v0", "v10")]
    code, said = command("report", *files, "-o", tmp_path / "both.html", "--title", "two runs")
    assert code == 0
    assert "both.html" in said
    text = (tmp_path / "both.html").read_text(encoding="utf-8")
    assert '"label":"v0"' in text
    assert '"label":"v10"' in text
    assert command("report", files[0])[0] == 0
    assert (tmp_path / "v0" / "report.html").exists()


def test_faults_are_sentences(case: Path, tmp_path: Path) -> None:
    code, said = command("report", tmp_path / "no.nc")
    assert code == 2
    assert "no.nc: there is no such file; expected a results file" in said
    code, said = command("report", case)
    assert code == 2
    assert "not a results file" in said
    command("run", case, "-o", tmp_path / "out", "-q", "--no-figures")
    code, said = command("report", tmp_path / "out" / "results.nc", "-o", case)
    assert code == 2
    assert "there is a file that is no report" in said
    assert case.read_text() == CASE


def test_files_have_short_names() -> None:
    assert labels([Path("a/results.nc"), Path("b/results.nc")]) == ["a", "b"]
    assert labels([Path("a/x.nc"), Path("b/x.nc"), Path("a/y.nc")]) == ["a/x", "b/x", "a/y"]
    assert len(set(labels([Path("a/x.nc"), Path("a/x.nc")]))) == 2
