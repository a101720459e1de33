"""The page that a run leaves, and the ``report`` verb."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.cases import oscillator
from helpers.command import slipstick as called

import slipstick as ss
import slipstick.report.content
import slipstick.report.writing
from slipstick.cli.verbs.report import labels
from slipstick.errors import InputError
from slipstick.io.loading import load_dataset

CASE = oscillator(
    head='title = "oscillator <b>rubbed</b>"\nharmonics = "0..3"\nunits = { length = "mm", force = "N", time = "s" }\n',
    rubbing="velocity = 10.0",
    response='from = "0.8 Hz"\nto = "1 Hz"\n',
)


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def command(*words: object) -> tuple[int, str]:
    found = called(*words)
    return found.exit_code, found.output


def test_a_run_leaves_a_report_in_its_units(case: Path, tmp_path: Path) -> None:
    assert command("run", case, "-o", tmp_path / "out", "-q", "--no-figures")[0] == 0
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<title>oscillator &lt;b&gt;rubbed&lt;/b&gt;</title>" in text
    assert '"units":"mW","after":" mW"' in text
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


def test_a_folder_stands_for_its_results(case: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert command("run", case, "-o", out, "-q", "--no-figures", "--no-report")[0] == 0
    assert command("report", out)[0] == 0
    assert (out / "report.html").exists()
    assert command("report", out, out / "results.nc", "-o", tmp_path / "both.html")[0] == 0
    (tmp_path / "empty").mkdir()
    code, said = command("report", tmp_path / "empty")
    assert code == 2
    assert "empty: found a folder without results.nc, study.nc, run_up.nc or identify.nc" in said


STUDY = CASE + '[study]\n"damper.velocity" = [5, 10, 20]\n'


def test_one_case_of_a_study_is_computed_again(case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its report is of the curve that the case alone has."""
    shown: list[ss.Branch] = []
    content_of = slipstick.report.content.content_of
    monkeypatch.setattr(
        slipstick.report.content,
        "content_of",
        lambda branch, *a, **k: shown.append(branch) or content_of(branch, *a, **k),
    )
    case.write_text(STUDY)
    out = tmp_path / "out"
    assert command("study", case, "-o", out, "--workers", "1", "--no-figures")[0] == 0
    code, said = command("report", out, "--case", "2")
    assert code == 0, said
    text = (out / "case-2.html").read_text(encoding="utf-8")
    assert "damper.velocity = 20" in text
    alone = ss.Case.from_text(STUDY.partition("[study]")[0].replace("velocity = 10.0", "velocity = 20.0")).run()
    (found,) = shown
    for name in ("omega", "amplitude", "dissipated_power"):
        np.testing.assert_allclose(found.dataset[name].values, alone.dataset[name].values, rtol=1e-9, atol=1e-12)
    assert len(ss.Branch.of(found).states(0)["damper"]) == len(alone.states(0)["damper"])  # which a study does not keep
    for words, why in {
        (out, "--case", 3): "found 3; expected a case of the study, from 0 to 2",
        (out, out, "--case", 1): "--case is a case of a study",
    }.items():
        code, said = command("report", *words)
        assert code == 2
        assert why in said
    study = load_dataset(out / "study.nc")
    study.attrs["case"] = ""  # as one made in Python
    study.to_netcdf(tmp_path / "python.nc", engine="h5netcdf")
    code, said = command("report", tmp_path / "python.nc", "--case", 0)
    assert code == 2
    assert "the study was made in Python" in said


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
