from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.cases import oscillator
from helpers.command import slipstick

import slipstick as ss
from slipstick.analysis.road import run as road
from slipstick.case.case import Case
from slipstick.cli.terminal import display
from slipstick.io.lock import FolderLock

CASE = oscillator(
    head='harmonics = "0..5"\nunits = { length = "mm", force = "N", time = "s" }\n', rubbing="velocity = 0.0",
    response="from = 8.0\nto = 12.0\n",
)  # fmt: skip
TRACK = '[track]\nparameter = "damper.normal_load"\nfrom = 600.0\nto = 800\nat = [700.0]\n'
OPTIMAL = '[optimal]\nparameter = "damper.normal_load"\nstart = 500.0\nomega = ["1 Hz", 12.0]\n'


def written(folder: Path, *sections: str) -> Path:
    path = folder / "case.toml"
    path.write_text(CASE + "".join(sections))
    return path


def test_track_leaves_a_folder(tmp_path):
    case, out = written(tmp_path, TRACK, OPTIMAL), tmp_path / "out"
    result = slipstick("track", case, "-o", out)
    assert result.exit_code == 0, result.output
    assert {path.name for path in out.iterdir()} == {"case.toml", "results.nc", "report.html", "response.png"}
    branch = ss.load(out / "results.nc")
    assert branch.dataset.attrs["case_file"] == "case.toml"
    again = ss.track_peak(Case.from_file(case).problem(), "damper.normal_load", (600.0, 800.0), omega=(8.0, 12.0))
    assert branch.dataset.amplitude.values[-1] == pytest.approx(again.dataset.amplitude.values[-1])
    assert 700.0 in branch.dataset.parameter.values
    refused = slipstick("track", case, "-o", out)
    assert (refused.exit_code, "already holds results" in refused.output) == (2, True)
    assert slipstick("track", case, "-o", out, "--force", "--no-figures").exit_code == 0
    assert {path.name for path in out.iterdir()} == {"case.toml", "results.nc", "report.html"}


def test_earlier_results_stay_until_new_ones_are_complete(tmp_path):
    case, out = written(tmp_path, TRACK), tmp_path / "out"
    assert slipstick("track", case, "-o", out, "--no-figures").exit_code == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    lost = slipstick("track", written(tmp_path, TRACK + "omega = [2.0, 3.0]\n"), "-o", out, "--force")
    assert lost.exit_code == 1
    assert "the earlier results in" in lost.output
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_two_do_not_write_into_one_folder(tmp_path):
    case, out = written(tmp_path, OPTIMAL), tmp_path / "out"
    out.mkdir()
    lock = FolderLock(out)
    refused = slipstick("optimal", case, "-o", out)
    lock.release()
    assert (refused.exit_code, "another" in refused.output) == (2, True)
    (out / "case.toml").write_text("of somebody else")
    refused = slipstick("optimal", case, "-o", out)
    assert (refused.exit_code, "already holds case.toml" in refused.output) == (2, True)
    assert (out / "case.toml").read_text() == "of somebody else"


def test_optimal_says_the_value(tmp_path):
    case = written(tmp_path, OPTIMAL)
    result = slipstick("optimal", case, "-o", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "the peak of x is lowest at damper.normal_load = " in result.output
    answer = json.loads(slipstick("optimal", case, "-o", tmp_path / "other", "--json").stdout)
    found = ss.optimal(Case.from_file(case).problem(), "damper.normal_load", omega=(6.0, 12.0), start=500.0)
    assert answer["value"] == pytest.approx(found.value, rel=1e-8)
    assert (answer["kind"], answer["outcome"]) == ("lowest", "COMPLETED")
    peaks = ss.load(tmp_path / "out" / "results.nc").dataset  # among the peaks of other values, marked
    least = int(np.flatnonzero(peaks["kind"].values == "optimum")[0])
    assert peaks["parameter"].values[least] == pytest.approx(found.value, rel=1e-6)
    assert peaks["omega"].values[least] == pytest.approx(found.omega, rel=1e-6)
    assert peaks["amplitude"].values.min() == pytest.approx(found.amplitude, rel=1e-9)
    assert peaks["parameter"].values[[0, -1]] == pytest.approx([found.value / 4, found.value * 4])
    assert (tmp_path / "out" / "response.png").exists()


def test_modes_leave_a_folder(tmp_path):
    case, out = written(tmp_path, "[modes]\nfrom = 2\nto = 8.0\nload_factors = [1.0]\n"), tmp_path / "out"
    result = slipstick("modes", case, "-o", out, "--json")
    assert result.exit_code == 0, result.output
    assert {path.name for path in out.iterdir()} == {
        "case.toml",
        "results.nc",
        "report.html",
        "backbone.png",
        "damping.png",
    }
    answer, branch = json.loads(result.stdout), ss.load(out / "results.nc")
    (peak,), data = answer["peaks"], branch.dataset
    assert answer["points"] == len(branch)
    ends = {point["kind"]: point for point in answer["marked"]}
    assert [ends[name]["amplitude"] for name in ("first", "last")] == pytest.approx(data.amplitude.values[[0, -1], 0])
    assert ends["most damped"]["damping"] == pytest.approx(float(data.modal_damping.max()))
    assert ends["last"]["omega"] == pytest.approx(float(data.omega[-1]))
    k = int((branch.dataset.kind.values == "requested").argmax())
    assert peak["omega"] == pytest.approx(float(branch.dataset.omega[k]))
    assert peak["load_factor"] == pytest.approx(1.0)
    wrong = slipstick("modes", written(tmp_path, "[modes]\nfrom = 2.0\nto = 2.0\n"), "-o", tmp_path / "other")
    assert (wrong.exit_code, "[modes] to is 2, the same as from" in wrong.output) == (2, True)


def test_what_is_not_found_ends_with_one(tmp_path):
    case = written(tmp_path, TRACK + "omega = [2.0, 3.0]\n")
    result = slipstick("track", case, "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "no peak of x was found from 2 to 3 rad/s" in result.output
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("sections", "sentence"),
    [
        ("", "[track] is missing; give it"),
        ("[track]\nparameter = 'damper.mu'\nfrom = 0.1\n", "[track] to is missing"),
        ("[track]\nparameter = 'damper.nu'\nfrom = 0.1\nto = 0.2\n", "there is no parameter 'damper.nu'"),
        ("[track]\nparameter = 'damper.mu'\nfrom = 0.1\nto = 0.1\n", "[track] to is 0.1, the same as from"),
        ("[track]\nparameter = 'damper.mu'\nfrom = 0.1\nto = 0.2\ndof = 'y'\n", "there is no output"),
        ("[track]\nparameter = 'damper.mu'\nfrom = 0.1\nto = 0.2\nomega = 3\n", "expected two frequencies"),
        ("[track]\nparameter = 'damper.mu'\nfrom = 0.1\nto = 0.2\nstep = 3\n", "unknown key 'step' in [track]"),
        ("track = 3\n", "found 3"),
    ],
)
def test_faults_are_sentences(tmp_path, sections, sentence):
    path = tmp_path / "case.toml"
    path.write_text(f"{sections}{CASE}" if sections.startswith("track") else CASE + sections)
    result = slipstick("track", path, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert sentence in " ".join(result.output.split())


def test_over_a_parameter_the_range_has_to_be_given(tmp_path):
    path = tmp_path / "case.toml"
    swept = 'from = 0.1\nto = 0.3\nparameter = "damper.mu"\nomega = 9.0\n'
    path.write_text(CASE.replace("from = 8.0\nto = 12.0\n", swept) + TRACK)
    result = slipstick("track", path, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "[track] omega is missing; give the range of frequencies of the peak" in " ".join(result.output.split())


def test_as_a_script_the_tables_are_named(tmp_path):
    result = slipstick("init", written(tmp_path, TRACK, OPTIMAL), "--python")
    assert result.exit_code == 0, result.output
    text = "".join(path.read_text() for path in tmp_path.glob("*.py"))
    assert "ss.track_peak" in text
    assert "ss.optimal" in text


MODES = '[modes]\ndof = "x"\nfrom = 3.0\nto = 5.0\n'


@pytest.mark.parametrize(("verb", "table"), [("track", TRACK), ("optimal", OPTIMAL), ("modes", MODES)])
def test_what_takes_long_says_how_far_it_is(tmp_path, monkeypatch, verb, table):
    monkeypatch.setattr(road, "_SILENCE", 0.0)
    monkeypatch.setattr(display, "_EVERY", 0.0)
    case = written(tmp_path, table)
    result = slipstick(verb, case, "-o", tmp_path / "out", "--no-figures")
    assert result.exit_code == 0, result.output
    assert re.search(r"looking for the .*, evaluation \d+", result.output)
    assert re.search(r"point 1, .*\d+%", result.output)
    quiet = slipstick(verb, case, "-o", tmp_path / "out", "--no-figures", "--force", "--quiet")
    assert "evaluation" not in quiet.output


def test_an_analysis_ends_when_its_time_is_up(tmp_path):
    case, out = written(tmp_path, TRACK), tmp_path / "out"
    result = slipstick("track", case, "-o", out, "--time-limit", "1e-6 s")
    assert result.exit_code == 1, result.output
    assert "stopped at the time limit; no point was found" in result.output
