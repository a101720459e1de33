"""Standard output that takes nothing: a pipe that is closed, a full disk; warnings in the form of all verbs."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from helpers.command import slipstick

from slipstick.cli.examples import example
from slipstick.errors import SlipstickWarning

POSIX = pytest.mark.skipif(os.name != "posix", reason="pipes and devices of POSIX")
FULL = Path("/dev/full")
CASE = example("oscillator").path


def ended(words: tuple[str, ...], output: object) -> tuple[int, str]:
    """Exit code and standard error of a command whose standard output is this one."""
    command = [sys.executable, "-m", "slipstick", *words]
    with subprocess.Popen(command, stdout=output, stderr=subprocess.PIPE, text=True) as child:  # type: ignore[call-overload]
        said = child.communicate(timeout=600)[1]
    return child.returncode, said


@POSIX
@pytest.mark.parametrize(("words", "code"), [(("--help",), 141), (("run", "--help"), 141), (("init",), 0)])
def test_a_closed_pipe_is_quiet(words: tuple[str, ...], code: int) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        assert ended(words, writing) == (code, "")
    finally:
        os.close(writing)


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize("words", [("--help",), ("--version",), ("init",), ("check", str(CASE))])
def test_a_full_disk_behind_standard_output(words: tuple[str, ...]) -> None:
    with FULL.open("w") as full:
        code, said = ended(words, full)
    reason = "cannot be written (no space left on device); choose another place"
    assert (code, said.splitlines()[-1]) == (2, f"error: standard output: {reason}")
    assert "Traceback" not in said


def test_warnings_have_one_form(monkeypatch: pytest.MonkeyPatch) -> None:
    from slipstick.verify.table import Check

    def doubtful() -> tuple[float, float]:
        for _ in range(2):
            warnings.warn("the truth is near", SlipstickWarning, stacklevel=1)
        return 1.0, 1.0

    checks = (Check(name="C1", what="holds", compute=doubtful),)
    monkeypatch.setattr("slipstick.verify.table.all_checks", lambda: checks)
    result = slipstick("verify")
    assert (result.exit_code, result.stderr) == (0, "warning: the truth is near\n")
