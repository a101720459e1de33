"""What a study shows while it computes."""

from __future__ import annotations

import pytest

from slipstick.cli.terminal import cases_progress as shown
from slipstick.cli.terminal.cases_progress import CasesProgress, cases_progress


def test_plain_lines_now_and_then(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shown, "_EVERY", 0.0)
    with cases_progress(4) as progress:
        progress.case(failed=False)
        progress.case(failed=True)
        progress.note("  a line")
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("  1 of 4 cases, about ")
    assert said[1].startswith("  2 of 4 cases, 1 did not complete, about ")
    assert said[2] == "  a line"


def test_quiet_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with cases_progress(2, quiet=True) as progress:
        progress.case(failed=True)
        progress.note("x")
    assert (progress.done, progress.failed) == (1, 1)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("width", [80, 40])
def test_a_line_fits_its_terminal(width: int) -> None:
    progress = CasesProgress(1_000_000)
    progress.width = width
    progress.done, progress.failed = 999_999, 123_456
    progress._position.update(999_999.0)
    assert len(progress.text) <= width
    assert progress.text.startswith("999999 of 1000000")
