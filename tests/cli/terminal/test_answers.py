"""``--json``: one document on standard output whatever happens, sentences on standard error, the same exit codes."""

from __future__ import annotations

import errno
import io
import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from helpers.command import slipstick
from helpers.gmsh import beam, write_inp

from slipstick.cli.examples import example
from slipstick.cli.terminal.answers import answering

OSCILLATOR = example("oscillator").path.read_text(encoding="utf-8")


def asked(*arguments: object) -> tuple[int, dict[str, Any], str]:
    """Exit code, document, standard error."""
    result = slipstick(*arguments, "--json")
    assert result.stdout.count("\n") == 1
    found = json.loads(result.stdout, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert found["exit_code"] == result.exit_code
    return result.exit_code, found, result.stderr


def case(folder: Path, *changes: tuple[str, str]) -> Path:
    text = OSCILLATOR
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder / "case.toml"


def test_run(tmp_path: Path) -> None:
    code, found, said = asked(
        "run", case(tmp_path, ("to = 15.0", "to = 5.0")), "-o", tmp_path / "out", "--figures", "response"
    )
    assert code == 0
    assert found["outcome"] == "COMPLETED"
    assert found["errors"] == found["warnings"] == []
    (peak,) = found["peaks"]
    assert (peak["dof"], peak["omega"]) == ("x", pytest.approx(4.259, rel=1e-3))
    assert peak["amplitude"] == pytest.approx(4.82, rel=1e-3)
    files = {Path(path).name for path in found["files"]}
    assert {"results.nc", "case.toml", "response.png"} <= files
    assert all(Path(path).is_file() for path in found["files"])
    assert "peak of x" in said


def test_run_that_stops_early_and_one_that_is_refused(tmp_path: Path) -> None:
    path = case(tmp_path, ("to = 15.0", "to = 15.0\nmax_points = 5\noutput_step = 1.0"))
    code, found, _ = asked("run", path, "-o", tmp_path / "out", "--no-figures")
    assert (code, found["points"]) == (1, 5)
    assert found["outcome"] != "COMPLETED"
    code, found, said = asked("run", path, "-o", tmp_path / "out")
    assert code == 2
    assert "already holds results.nc" in found["errors"][0]
    assert f"error: {found['errors'][0]}" in said


def test_check(tmp_path: Path) -> None:
    code, found, _ = asked("check", case(tmp_path, ('harmonics = "0..10"', "harmonics = [0, 1]")))
    assert code == 0
    assert found["natural_frequencies"] == [pytest.approx(40**0.5)]
    assert (found["unknowns"], found["contacts"], found["outputs"]) == (3, ["damper"], ["x"])
    assert any("harmonics [0, 1]" in sentence for sentence in found["warnings"])
    assert found["linear"][0]["amplitude"] == pytest.approx(39.548, rel=2e-3)
    code, found, _ = asked("check", case(tmp_path, ("mu =", "mue ="), ("kt =", "kt_ =")))
    assert code == 2
    assert len(found["errors"]) == 2
    assert "did you mean 'mu'" in " ".join(found["errors"])
    assert {"where", "statement", "found", "expected", "remedy"} == set(found["faults"][0])
    code, found, _ = asked("check", case(tmp_path, ("mu = 0.3", "mu = -1.0")))
    (fault,) = found["faults"]
    assert (fault["where"][0], fault["where"][-1], fault["found"]) == ("contact", "mu", "-1.0")


def test_info_and_verify() -> None:
    code, found, _ = asked("info")
    assert code == 0
    assert {"slipstick", "numpy", "python"} <= set(found["versions"])
    code, found, _ = asked("verify", "--only", "CF3")
    assert code == 0
    assert all(check["ok"] and check["name"] == "CF3" for check in found["checks"])
    code, found, _ = asked("verify", "--only", "nothing")
    assert code == 2
    assert found["errors"]


def test_a_parameter_curve_names_its_values(tmp_path: Path) -> None:
    sweep = ("from = 2.0", 'parameter = "damper.velocity"\nomega = 4.0\nfrom = 10.0')
    _, found, _ = asked("run", case(tmp_path, sweep), "-o", tmp_path / "out", "--no-figures", "-q")
    assert (found["followed"], found["range"], found["omega"]) == ("damper.velocity", [10.0, 15.0], 4.0)


def test_a_full_disk_behind_the_document_is_told_in_a_sentence(monkeypatch, capsys) -> None:
    class Full(io.StringIO):
        def flush(self) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(sys, "stdout", Full())
    with pytest.raises(typer.Exit) as ended, answering(True):
        raise typer.Exit(0)
    assert ended.value.exit_code == 2
    said = "error: standard output: cannot be written (no space left on device); choose another place\n"
    assert capsys.readouterr().err == said


@pytest.mark.skipif(os.name != "posix", reason="links that anyone may make")
def test_links_that_lead_in_a_circle(tmp_path: Path) -> None:
    for name in ("loop.nc", "loop.npy", "loop.inp"):
        (tmp_path / name).symlink_to(name)
    inner = case(tmp_path, ("stiffness = [[40.0]]", 'stiffness = "loop.npy"'))
    deck = tmp_path / "deck.inp"
    deck.write_text("*INCLUDE, INPUT=loop.inp\n")
    why = f"cannot be reached ({os.strerror(errno.ELOOP)})"
    calls = {
        ("report", tmp_path / "loop.nc"): f"results: found '{tmp_path / 'loop.nc'}', which {why}",
        ("check", inner): f'[structure] stiffness: found "loop.npy"; it {why}; put the file itself there',
        ("import", tmp_path / "loop.inp", "-o", tmp_path / "m.h5"): f"{tmp_path / 'loop.inp'}: {why}",
        ("import", deck, "-o", tmp_path / "m.h5"): f"line 1: *INCLUDE: loop.inp {why}",
    }
    for call, words in calls.items():
        result = slipstick(*call)
        assert (result.exit_code, words in " ".join(result.output.split())) == (2, True), result.output
    code, found, said = asked("report", tmp_path / "loop.nc")
    assert code == 2
    assert said == "".join(f"error: {sentence}\n" for sentence in found["errors"])
    assert "loop.nc" in said


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (ZeroDivisionError("oops"), 1, "a fault of slipstick itself (ZeroDivisionError: oops)"),
        (OSError(errno.ENOSPC, "No space left on device"), 2, "the disk is full"),
        (MemoryError(), 2, "there is not enough memory"),
    ],
)
def test_whatever_ends_a_command_is_among_its_errors(
    error: Exception, code: int, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise error

    monkeypatch.setattr("slipstick.case.case.Case.from_file", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    ended, found, said = asked("check", case(tmp_path))
    (sentence,) = found["errors"]
    assert (ended, sentence.startswith(words), said) == (code, True, f"error: {sentence}\n")


def test_init_and_import(tmp_path: Path) -> None:
    code, found, _ = asked("init")
    assert (code, {"name", "about", "case"}) == (0, set(found["examples"][0]))
    assert "oscillator" in [row["name"] for row in found["examples"]]
    code, found, said = asked("init", "oscillator", tmp_path / "new")
    assert (code, found["files"]) == (0, [str(tmp_path / "new" / "oscillator.toml")])
    assert "next: slipstick run" in said
    code, found, said = asked("init", "oscillator", tmp_path / "new")
    assert (code, said) == (2, f"error: {found['errors'][0]}\n")
    write_inp(tmp_path / "m.inp", *beam())
    material = ("--young", "2e11", "--poisson", "0.3", "--density", "7800")
    code, found, said = asked("import", tmp_path / "m.inp", "-o", tmp_path / "m.h5", *material, "--fix", "ROOT")
    assert (code, found["model"]) == (0, str(tmp_path / "m.h5"))
    assert found["notes"]
    assert "units of the model are not stated" in found["warnings"][-1]
    assert f"warning: {found['warnings'][-1]}" in said
    code, found, _ = asked("import", tmp_path / "m.inp", "-o", tmp_path / "m.h5", *material)
    assert (code, "is there already" in found["errors"][0]) == (2, True)
