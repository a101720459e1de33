"""A small case on a machine that has not compiled anything yet."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from slipstick.balance.kernel.compilation import compile_all
from slipstick.case.case import Case
from slipstick.cli.examples import example
from slipstick.cli.terminal import first_run, guard
from slipstick.io.loading import load_dataset

OSCILLATOR = example("oscillator").path.read_text(encoding="utf-8")


class BeganAgain(BaseException):
    """What stands for the end of the process."""


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[list[str]]:
    """A command line on a machine that has compiled nothing; what it starts."""
    started: list[list[str]] = []

    def again(program: str, arguments: list[str], environment: dict[str, str]) -> None:
        assert environment["NUMBA_DISABLE_JIT"] == "1"
        started.append(arguments)
        raise BeganAgain

    monkeypatch.setattr(guard, "command", ["run", "case.toml", "--quiet"])
    monkeypatch.setattr(first_run, "is_compiled", lambda: False)
    monkeypatch.setattr(first_run, "is_interpreted", lambda: False)
    monkeypatch.setattr(first_run, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(os, "execve", again)
    monkeypatch.setattr(subprocess, "Popen", lambda command, **_: started.append(command))
    return started


@pytest.mark.skipif(os.name != "posix", reason="a process begins again in its place on POSIX only")
def test_a_small_case_begins_again_without_compilation_and_one_process_compiles(fresh: list[list[str]]) -> None:
    case, told = Case.from_text(OSCILLATOR), []
    for _ in range(2):
        with pytest.raises(BeganAgain):
            first_run.start_interpreted(case, told.append)
    compiler, *commands = fresh
    assert "compile_all()" in compiler[-1]
    assert commands == [[sys.executable, "-m", "slipstick", "run", "case.toml", "--quiet"]] * 2
    assert told[0].startswith("the contact kernel is being compiled beside this")


@pytest.mark.parametrize("change", [("0..10", "0..40"), ("[response]", "[response]\nstability = true")])
def test_what_takes_longer_is_compiled_first(fresh: list[list[str]], change: tuple[str, str]) -> None:
    text = OSCILLATOR
    assert change[0] in text
    first_run.start_interpreted(Case.from_text(text.replace(*change)), lambda _: None)
    assert not fresh


def test_scripts_do_not_begin_again(fresh: list[list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "command", None)
    first_run.start_interpreted(Case.from_text(OSCILLATOR), lambda _: None)
    assert not fresh


@pytest.mark.verify
@pytest.mark.skipif(os.name != "posix", reason="a process begins again in its place on POSIX only")
def test_the_first_run_gives_the_numbers_of_later_ones(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(OSCILLATOR)
    compile_all()
    empty = os.environ | {name: str(tmp_path / "cache") for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    told = []
    for name, environment in (("first", empty), ("later", dict(os.environ))):
        command = [sys.executable, "-m", "slipstick", "run", "case.toml", "-o", name, "--no-figures"]
        done = subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
        told.append(done.stdout)
    assert ["runs without it" in text for text in told] == [True, False]
    first, later = (load_dataset(tmp_path / name / "results.nc") for name in ("first", "later"))
    assert np.allclose(first["omega"], later["omega"], rtol=1e-12)
    assert np.allclose(first["amplitude"], later["amplitude"], rtol=1e-9)
