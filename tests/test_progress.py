"""The listener that shows how far a computation is, in a notebook and elsewhere."""

from __future__ import annotations

import re
import sys
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick import progress as module


def problem() -> ss.Problem:
    return one_mass(damper())


@pytest.fixture
def pictures(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What the display of a notebook is given, in its order; a new display is marked."""
    shown: list[str] = []
    display = SimpleNamespace(
        HTML=str,
        display=lambda text, display_id: (shown.append("new " + text), SimpleNamespace(update=shown.append))[1],
    )
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell, display=display))
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setattr(module, "_PAUSE", 0.0)
    return shown


def shares(pictures: list[str]) -> list[float]:
    return [float(re.findall(r'value="([\d.]+)"', picture)[0]) for picture in pictures]


def test_a_notebook_shows_one_bar_that_grows(pictures: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    branch = ss.forced_response(problem(), omega=(10.0, 12.0), listeners=ss.Progress())
    assert [picture.startswith("new ") for picture in pictures] == [True] + [False] * (len(pictures) - 1)
    searched = [picture for picture in pictures if "first point: " in picture]  # where that took long
    assert len(pictures) == len(branch) + 2 + len(searched)
    assert shares(pictures) == sorted(shares(pictures))
    assert f"100 %, {len(branch)} points, completed in " in pictures[-1]
    assert "at 12, point" in pictures[-2]
    assert capsys.readouterr().out == ""


def test_a_second_curve_has_a_bar_of_its_own(pictures: list[str]) -> None:
    shown = ss.Progress()
    for _ in range(2):
        ss.forced_response(problem(), omega=(11.0, 12.0), listeners=shown)
    assert sum(picture.startswith("new ") for picture in pictures) == 2
    assert shares(pictures)[-1] == 1.0


def test_a_study_counts_its_cases(pictures: list[str]) -> None:
    ss.study(problem(), {"damper.mu": [0.1, 0.2, 0.3]}, omega=(11.0, 12.0), workers=1, listeners=ss.Progress())
    assert [re.sub(",? about.*", "", re.findall(r"case \d of \d", picture)[0]) for picture in pictures] == [
        "case 1 of 3", "case 2 of 3", "case 3 of 3",
    ]  # fmt: skip
    assert shares(pictures) == [0.3333, 0.6667, 1.0]


def test_elsewhere_there_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    branch = ss.forced_response(problem(), omega=(11.0, 12.0), listeners=ss.Progress())
    assert re.fullmatch(rf"100 %, {len(branch)} points, completed in [\d.]+ m?s\n", capsys.readouterr().out)


def test_a_terminal_writes_over_its_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(module, "_PAUSE", 0.0)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    ss.forced_response(problem(), omega=(11.0, 12.0), listeners=ss.Progress())
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert out.count("\r") > 5


def test_what_stops_early_is_not_full(pictures: list[str]) -> None:
    def stop(event: Any) -> None:
        if getattr(event, "number", 0) == 5:
            raise KeyboardInterrupt

    ss.forced_response(problem(), omega=(10.0, 12.0), listeners=[ss.Progress(), stop])
    assert "interrupted" in pictures[-1]
    assert shares(pictures)[-1] < 1.0
