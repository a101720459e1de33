"""What a run and a study show while they compute."""

from __future__ import annotations

import pytest
from rich.console import Console

from slipstick.cli.terminal import display as module
from slipstick.cli.terminal.display import (
    CurveDisplay,
    LiveCurve,
    StudyDisplay,
    curve_display,
    study_display,
)
from slipstick.progress import Position, duration


def test_turning_back_never_lowers_the_fraction() -> None:
    position = Position(2.0, 12.0)
    for value, fraction in ((2.0, 0.0), (7.0, 0.5), (4.0, 0.5), (12.0, 1.0), (13.0, 1.0)):
        position.update(value)
        assert position.fraction == fraction
    down = Position(12.0, 2.0)
    down.update(7.0)
    assert down.fraction == 0.5


def test_a_range_of_one_value_is_at_its_beginning() -> None:
    position = Position(3.0, 3.0)
    position.update(3.0)
    assert position.fraction == 0.0
    assert position.left is None


def test_time_left_is_judged_by_the_pace(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    position = Position(0.0, 10.0)
    assert position.left is None
    now[0] += 30.0
    position.update(2.5)
    assert position.left == pytest.approx(90.0)


def test_plain_lines_come_now_and_then(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    with curve_display(0.0, 10.0, " rad/s") as shown:
        assert type(shown) is CurveDisplay
        for i in range(1, 10):
            now[0] += 1.0
            shown.at(float(i), 0.01, "slip 100 %")
        shown.note("a remark")
    assert capsys.readouterr().out.splitlines() == [
        "  5 rad/s, point 5, step 0.01, slip 100 %, 50%, about 5 s left",
        "a remark",
    ]


def test_quiet_is_quiet(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    with curve_display(0.0, 10.0, "", quiet=True) as shown:
        now[0] += 100.0
        shown.at(1.0, 0.1, "")
        shown.note("a remark")
        assert shown.points == 1
    assert capsys.readouterr().out == ""


def test_a_terminal_gets_a_live_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "200")
    with curve_display(0.0, 10.0, " rad/s") as shown:
        shown.note("start [here]")
        shown.at(5.0, 0.1, "stick 10 % slip 90 %")
    assert "start [here]" in capsys.readouterr().out


@pytest.mark.parametrize("columns", [20, 30, 40, 60, 80, 100, 110, 200])
def test_the_live_line_fits(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """On one line of the terminal, with what matters most on a narrow one."""
    now, lines = [0.0], []
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("TERM", "xterm")
    with curve_display(0.0, 10.0, " rad/s") as shown:
        assert isinstance(shown, LiveCurve)
        for text in ("stick 25 % slip 70 % separation 5 %", ""):
            now[0] += 100.0
            shown.at(4.259352, 0.0352, text)
            plain = Console(width=columns, color_system=None, force_terminal=False)
            with plain.capture() as captured:
                plain.print(shown._bar.make_tasks_table(shown._bar.tasks))
            lines.append([line.rstrip() for line in captured.get().splitlines() if line.strip()])
    assert all(len(line) == 1 and len(line[0]) <= columns for line in lines)
    assert all("43% 4.25935 rad/s" in line[0] for line in lines)
    if columns >= 60:
        assert all("about" in line[0] for line in lines)
    if columns >= 200:
        assert "point 1, step 0.035, stick 25 %" in lines[0][0]


@pytest.mark.parametrize("seconds, words", [(0.5, "0.5 s"), (59.0, "59 s"), (61.0, "1 min 1 s"), (7260.0, "2 h 1 min")])
def test_durations(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_plain_lines_of_cases_now_and_then(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_EVERY", 0.0)
    with study_display(4) as progress:
        progress.case(failed=False)
        progress.case(failed=True)
        progress.note("  a line")
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("  1 of 4 cases, about ")
    assert said[1].startswith("  2 of 4 cases, 1 did not complete, about ")
    assert said[2] == "  a line"


def test_a_quiet_study_says_nothing(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_EVERY", 0.0)
    with study_display(2, quiet=True) as progress:
        progress.case(failed=True)
        progress.note("x")
    assert (progress.done, progress.failed) == (1, 1)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("width", [80, 40])
def test_the_line_of_a_study_fits_its_terminal(width: int) -> None:
    progress = StudyDisplay(1_000_000)
    progress.width = width
    progress.done, progress.failed = 999_999, 123_456
    progress._position.update(999_999.0)
    assert len(progress.text) <= width
    assert progress.text.startswith("999999 of 1000000")


def test_a_long_search_for_the_first_point_is_shown(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The whole on a plain line; on a terminal what has room."""
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    told = ("first point at 1800 rad/s", "load ramp at 40 %", "evaluation 57", "residual 3.0e-04")
    shown = CurveDisplay(Position(0.0, 10.0), " rad/s")
    shown.search(told)
    now[0] += 5.0
    shown.search(told)
    expected = "  first point at 1800 rad/s, load ramp at 40 %, evaluation 57, residual 3.0e-04"
    assert capsys.readouterr().out.splitlines() == [expected]
    with module._moving() as bar:
        bar.console.width = 60
        LiveCurve(Position(0.0, 10.0), " rad/s", bar).search(told)
        assert bar.tasks[-1].description == "first point at 1800 rad/s, load ramp at 40 %"
