"""What a run shows while it computes."""

from __future__ import annotations

import pytest

from slipstick.app import progress as module
from slipstick.app.progress import Position, Progress, Silent, duration, progress


def test_turning_back_never_lowers_the_fraction() -> None:
    position = Position(2.0, 12.0)
    for value, fraction in ((2.0, 0.0), (7.0, 0.5), (4.0, 0.5), (12.0, 1.0), (13.0, 1.0)):
        position.update(value)
        assert position.fraction == fraction
    down = Position(12.0, 2.0)
    down.update(7.0)
    assert down.fraction == 0.5


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
    with progress(0.0, 10.0, " rad/s") as shown:
        assert type(shown) is Progress
        for i in range(1, 10):
            now[0] += 1.0
            shown.at(float(i), 0.01, "slip 100 %")
        shown.note("a remark")
    assert capsys.readouterr().out.splitlines() == [
        "  5 rad/s, point 5, step 0.01, slip 100 %, 50%, about 5 s left",
        "a remark",
    ]


def test_quiet_is_quiet(capsys: pytest.CaptureFixture[str]) -> None:
    with progress(0.0, 10.0, "", quiet=True) as shown:
        assert isinstance(shown, Silent)
        shown.at(1.0, 0.1, "")
        shown.note("a remark")
        assert shown.points == 1
    assert capsys.readouterr().out == ""


def test_a_terminal_gets_a_live_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "200")
    with progress(0.0, 10.0, " rad/s") as shown:
        shown.note("start [here]")
        shown.at(5.0, 0.1, "stick 10 % slip 90 %")
    assert "start [here]" in capsys.readouterr().out


@pytest.mark.parametrize("seconds, words", [(0.5, "0.5 s"), (59.0, "59 s"), (61.0, "1 min 1 s"), (7260.0, "2 h 1 min")])
def test_durations(seconds: float, words: str) -> None:
    assert duration(seconds) == words
