"""Reports in files: complete or not at all, and never in the place of something else."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass
from helpers.reports import branch

import slipstick as ss
from slipstick.report import writing
from slipstick.report.writing import labelled, write_report


@pytest.fixture(scope="module")
def made() -> ss.Branch:
    return branch("a <b>title</b>")


def test_a_report_is_one_file(made: ss.Branch, tmp_path: Path) -> None:
    path = made.report(tmp_path / "r.html")
    assert [p.name for p in tmp_path.iterdir()] == ["r.html"]
    text = path.read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>")
    assert "<title>a &lt;b&gt;title&lt;/b&gt;</title>" in text
    assert made.report(path, title="another") == path
    assert "<title>another</title>" in path.read_text(encoding="utf-8")


def test_a_branch_from_a_file_gives_the_same_page(made: ss.Branch, tmp_path: Path) -> None:
    stored = ss.load(made.save(tmp_path / "r.nc"))
    one, other = (b.report(tmp_path / f"{i}.html").read_text() for i, b in enumerate((made, stored)))
    part = '"results":'
    assert one.partition(part)[2] == other.partition(part)[2]


def test_results_with_other_axes_or_units_are_refused(made: ss.Branch, tmp_path: Path) -> None:
    """A load of 1.3 N is no frequency: nothing is laid over something else."""
    units = {"length": "mm", "force": "N", "time": "s"}

    def oscillator(**more: Any) -> ss.Problem:
        return one_mass(damper(normal_load=300.0), harmonics=[0, 1, 3], **more)

    problem = oscillator(units=units)
    response = ss.forced_response(problem, omega=(5.0, 6.0))
    load = ss.parameter_response(problem, "damper.normal_load", (300.0, 400.0), omega=6.0)
    friction = ss.parameter_response(problem, "damper.mu", (0.3, 0.35), omega=6.0)
    peaks = ss.track_peak(problem, "damper.normal_load", (300.0, 310.0), omega=(2.0, 15.0))
    plain = ss.forced_response(oscillator(), omega=(5.0, 6.0))
    for one, other in ((response, load), (load, friction), (load, peaks), (response, plain)):
        with raises_fault("report", expected="results with the same axes and units"):
            write_report({"one": one, "other": other}, tmp_path / "r.html")
    assert not (tmp_path / "r.html").exists()
    free = ss.Problem(problem.structure, loads=problem.loads, harmonics=[0, 1], units=units)
    for other in (ss.forced_response(problem, omega=(6.0, 7.0)), ss.linear_response(free, omega=[5.0, 6.0])):
        write_report({"one": response, "other": other}, tmp_path / "r.html")
    assert "<title>one, other</title>" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_another_file_is_not_replaced(made: ss.Branch, tmp_path: Path) -> None:
    path = tmp_path / "results.nc"
    path.write_bytes(b"numbers")
    with pytest.raises(ss.InputError, match=r"results\.nc: .* a file that is no report"):
        made.report(path)
    assert path.read_bytes() == b"numbers"


def test_a_failure_leaves_the_earlier_report(made: ss.Branch, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = made.report(tmp_path / "r.html")
    before = path.read_bytes()

    def full(self: Path, *args: object, **options: object) -> None:
        raise OSError(28, "No space left on device", str(self))

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(ss.InputError, match=r"r\.html: .* \(no space left on device\)"):
        made.report(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["r.html"]


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="needs a folder that refuses its owner")
def test_a_folder_that_cannot_be_written(made: ss.Branch, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(ss.InputError, match="permission denied"):
        made.report(tmp_path / "r.html")
    tmp_path.chmod(0o700)


def test_places_that_are_none(made: ss.Branch, tmp_path: Path) -> None:
    with pytest.raises(ss.InputError, match="cannot be written"):
        made.report(tmp_path)
    with pytest.raises(ss.InputError, match="cannot be written"):
        made.report(tmp_path / "no" / "such" / "r.html")


def test_labels_are_told_apart(made: ss.Branch) -> None:
    assert [label for label, _ in labelled([made, made])] == ["a <b>title</b> (1)", "a <b>title</b> (2)"]
    assert [label for label, _ in labelled({"v = 0": made, "v = 1": made})] == ["v = 0", "v = 1"]
    with pytest.raises(ss.InputError, match="no branch was given"):
        labelled([])
    with raises_fault("report, branch", expected="an ss.Branch"):
        write_report(made.dataset, "r.html")


def test_every_file_of_the_page_is_used() -> None:
    folder = Path(writing.__file__).parent / "page"
    own = {path.name for path in folder.iterdir() if path.is_file()}
    used = {*writing.STYLES, *writing.SCRIPTS, *writing.STUDY_STYLES, *writing.STUDY_SCRIPTS, *writing.PLAIN_STYLES}
    assert own == {name for name in used if "/" not in name} | {"page.html", "study.html", "plain.html"}
