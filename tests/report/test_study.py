"""The page of a study: its cases, peaks and curves, in one file that asks for nothing."""

from __future__ import annotations

import base64
import json
import re
import zlib
from pathlib import Path

import numpy as np
import pytest
from helpers.command import slipstick
from helpers.pages import NODE, opened
from helpers.reports import branch, decoded
from helpers.study_case import CASE

import slipstick as ss
from slipstick.io.loading import load_dataset
from slipstick.report.study import study_content
from slipstick.report.writing import write_study_report

GRID = CASE.replace('"damper.velocity" = [20, 30, 40]', '"damper.velocity" = [20, 30, 40]\n"load" = [0.5, 1.0]')


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    own = tmp_path_factory.mktemp("study")
    (own / "case.toml").write_text(GRID)
    done = slipstick("study", own / "case.toml", "-o", own / "out", "--no-figures", "--workers", 1, "-q")
    assert done.exit_code == 0, done.output
    return own / "out"


def content_of(path: Path) -> tuple[dict, bytes]:
    text = path.read_text(encoding="utf-8")
    plain = re.search(r'<script type="application/json" id="content">(.*?)</script>', text, re.S)
    numbers = re.search(r'<script type="text/plain" id="numbers">(.*?)</script>', text, re.S)
    assert plain
    assert numbers
    return json.loads(plain[1]), zlib.decompress(base64.b64decode(numbers[1]))


def values(packed: dict, store: bytes) -> np.ndarray:
    return decoded(packed | {"bytes": store[slice(*packed["bytes"])]})


def test_a_study_leaves_its_report(folder: Path) -> None:
    content, store = content_of(folder / "report.html")
    study, curves = load_dataset(folder / "study.nc"), load_dataset(folder / "curves.nc")
    assert content["title"] == "oscillator"
    assert content["outcome"] == {"name": "COMPLETED", "ok": True, "text": "6 of 6 cases are computed"}
    assert [p["name"] for p in content["parameters"]] == ["damper.velocity", "load"]
    assert values(content["parameters"][0]["values"], store).tolist() == [20, 20, 30, 30, 40, 40]
    assert values(content["parameters"][1]["values"], store).tolist() == [0.5, 1.0] * 3
    peaks = study["peak_amplitude"].sel(dof="x").to_numpy().ravel()
    np.testing.assert_array_equal(values(content["dofs"][0]["peak"], store), peaks)
    at = study["peak_omega"].sel(dof="x").to_numpy().ravel()
    np.testing.assert_array_equal(values(content["dofs"][0]["at"], store), at)
    assert content["seconds"] == pytest.approx(study["seconds"].to_numpy().sum())
    assert [case["points"] for case in content["cases"]] == study["points"].to_numpy().ravel().tolist()
    own = content["curves"][3]
    assert own["case"] == 3
    of_case = curves["case"].to_numpy() == 3
    np.testing.assert_array_equal(values(own["x"], store), curves["omega"].to_numpy()[of_case])
    np.testing.assert_allclose(values(own["y"][0], store), curves["amplitude"].to_numpy()[of_case, 0], rtol=1e-6)


def test_cases_followed_in_lockstep_have_no_time_of_their_own(folder: Path) -> None:
    study = load_dataset(folder / "study.nc").load()
    shape = study["seconds"].shape
    alone = np.arange(float(study["seconds"].size)).reshape(shape)
    study["seconds"] = study["seconds"].copy(data=np.where(alone < 2, 0.5, alone))
    heads = """return IDS.cases.querySelectorAll("th").map((cell) => cell.textContent.trim())"""
    for together, times in ((np.ones(shape), [None] * 6), (alone < 2, [None, None, 2.0, 3.0, 4.0, 5.0])):
        study["lockstep"] = study["lockstep"].copy(data=together.astype(int))
        content = study_content(study, None, dofs=1)
        assert [case["seconds"] for case in content["cases"]] == times
        assert content["seconds"] == 15.0
        if NODE is not None:
            assert any("time [s]" in head for head in opened(content, heads, study=True)) == any(times)


def test_cases_that_failed_are_told(folder: Path, tmp_path: Path) -> None:
    study = load_dataset(folder / "study.nc").load().copy(deep=True)
    study["outcome"] = study["outcome"].astype("U40")
    study["message"] = study["message"].astype("U200")
    study["outcome"][1, 0], study["message"][1, 0] = "NO_FIRST_POINT", "nothing </script><script>alert(1)</script>"
    study["peak_amplitude"][1, 0] = np.nan
    path = write_study_report(study, None, tmp_path / "r.html")
    content, store = content_of(path)
    assert content["cases"][2]["outcome"] == "NO_FIRST_POINT"
    assert "</script><script>alert" in content["cases"][2]["message"]
    assert "<script>alert" not in path.read_text()
    assert np.isnan(values(content["dofs"][0]["peak"], store)[2])
    assert content["curves"] == []
    assert "not beside the study" in content["left_out"]


def test_many_curves_are_thinned_and_that_is_said(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.report.study.MOST_CURVES", 4)
    monkeypatch.setattr("slipstick.report.study.MOST_POINTS", 10)
    study, curves = load_dataset(folder / "study.nc"), load_dataset(folder / "curves.nc")
    content = study_content(study, curves, dofs=12)
    assert content["left_out"] == "4 of 6 curves are in this page"
    assert [own["case"] for own in content["curves"]] == [0, 1, 3, 5]
    peaks = int(np.sum(curves["peak_dof"].to_numpy()[curves["case"].to_numpy() == 5] >= 0))
    assert content["curves"][3]["x"]["shape"][0] <= 10 + peaks


def test_the_report_verb_takes_a_study(folder: Path, tmp_path: Path) -> None:
    done = slipstick("report", folder / "study.nc", "-o", tmp_path / "page.html", "--title", "mine")
    assert done.exit_code == 0, done.output
    assert "<title>mine</title>" in (tmp_path / "page.html").read_text()
    several = slipstick("report", folder / "study.nc", folder / "study.nc", "-o", tmp_path / "two.html")
    assert several.exit_code == 2
    assert "give a study by itself" in " ".join(several.output.split())
    branch().save(tmp_path / "r.nc")
    mixed = slipstick("report", tmp_path / "r.nc", folder / "study.nc", "-o", tmp_path / "two.html")
    assert mixed.exit_code == 2
    assert "give a study by itself" in " ".join(mixed.output.split())


def test_no_report_where_none_is_wanted(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(CASE)
    bare = ("--no-figures", "--no-report", "--workers", 1, "-q")
    assert slipstick("study", tmp_path / "case.toml", "-o", tmp_path / "out", *bare).exit_code == 0
    assert not (tmp_path / "out" / "report.html").exists()


def test_what_is_no_study_is_refused(folder: Path, tmp_path: Path) -> None:
    study = load_dataset(folder / "study.nc")
    with pytest.raises(ss.InputError, match="not the results of a study"):
        write_study_report(study.drop_vars("message"), None, tmp_path / "r.html")
    assert not (tmp_path / "r.html").exists()


def test_the_page_of_discs_shows_their_scatter() -> None:
    """One dof, the largest; the histogram holds every disc, the worst one is the largest."""
    sector = ss.CyclicStructure(M=[[1.0]], K=([[1.04]], [[-0.02]]), dofs=["tip"], sectors=3, loss_factor=4e-3)
    friction = ss.FrictionContact(kt=0.03, mu=0.3, normal_load=2.0)
    shroud = ss.ContactPair(name="shroud", contact=friction, tangential={"tip": 1.0, "tip@next": -1.0})
    load = ss.Load(dof="tip", cos=1.0)
    wave = ss.Problem(sector.travelling_wave(1), contacts=shroud, loads=load, harmonics=[0, 1, 3])
    found = ss.study(
        sector.mistuned(blade=[[1.0]]).problem(wave), method="mistuning", omega=(0.97, 1.12), spread=0.02, samples=9,
        seed=1, workers=1,
    )  # fmt: skip
    content = study_content(found, None, dofs=4)
    scatter = content["scatter"]
    assert [dof["name"] for dof in content["dofs"]] == ["largest"]
    assert sum(scatter["bins"]["counts"]) == scatter["discs"] == 9
    assert scatter["worst"]["case"] == int(found.amplification.argmax("case"))
    assert scatter["tuned"] == found.attrs["tuned_amplitude"]
    assert scatter["outputs"] == found.worst.to_numpy().tolist()
    ax, bars = ss.plots.amplification_histogram(found), ss.plots.worst_disc(found)
    assert sum(patch.get_height() for patch in ax.patches) == 9
    assert [patch.get_height() for patch in bars.patches] == scatter["worst"]["deviations"]
    assert all(float(tick).is_integer() for tick in bars.get_xticks())
    assert bars.get_xlabel() == f"Blade (0 to {len(bars.patches) - 1})"
