"""What a shell is offered."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from slipstick.cli.main import app
from slipstick.cli.options import case_files, example_names, results_files


def completed(words: str, shell: str = "bash") -> list[str]:
    """What the completion script of a shell gets for the last of some words."""
    environment = {"_SLIPSTICK_COMPLETE": f"complete_{shell}"}
    environment |= {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split(" ")) - 1)} if shell == "bash" else {}
    environment |= {"_TYPER_COMPLETE_ARGS": words, "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    return CliRunner().invoke(app, [], env=environment, prog_name="slipstick").stdout.splitlines()


def test_verbs_and_examples() -> None:
    assert completed("slipstick ver") == ["verify"]
    assert {"blade", "blade_reduced", "blade/study"} <= set(completed("slipstick init bla"))
    assert completed("slipstick init shak", "fish") == ["shaken\tOne mass on a support that shakes; relative motion"]
    assert "--json" in completed("slipstick run --j")
    assert all(len(about) <= 50 for _, about in example_names(""))


def test_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs" / "deep").mkdir(parents=True)
    for name in ("case.toml", "r.nc", "note.txt", ".hidden.toml", "runs/other.toml", "runs/results.nc"):
        (tmp_path / name).write_text("")
    assert case_files("") == ["case.toml", "runs/"]
    assert case_files("c") == ["case.toml"]
    assert case_files(".h") == [".hidden.toml"]
    assert results_files("runs/") == ["runs/deep/", "runs/results.nc"]
    assert case_files(f"{tmp_path}/runs/o") == [f"{tmp_path}/runs/other.toml"]
    assert case_files("nowhere/x") == []
    assert completed("slipstick check ca") == ["case.toml"]
    assert completed("slipstick verify runs/r") == ["runs/results.nc"]
    assert completed("slipstick report r.nc runs/r") == ["runs/results.nc"]
