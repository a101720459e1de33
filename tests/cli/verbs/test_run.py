"""What ``run`` tells at its end."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from helpers.cases import oscillator
from helpers.command import slipstick
from helpers.reports import branch

from slipstick.cli.terminal.guard import report_or_warn, say_results
from slipstick.cli.verbs.run import peak_lines
from slipstick.errors import InputError
from slipstick.results.peaks import peak_points


def test_peaks_are_told_the_largest_first() -> None:
    made = branch().dataset
    at = peak_points(branch().table)
    dofs = made["peak_dof"].to_numpy()[at]
    truth = sorted(
        ((float(made["amplitude"][p, d]), "abz"[d], float(made["omega"][p])) for p, d in zip(at, dofs, strict=True)),
        reverse=True,
    )
    text = "\n".join(peak_lines(branch().table, most=2 * len(truth)))
    found = re.findall(r"peak of (\w+): amplitude ([\d.e+-]+).* at ([\d.e+-]+)", text)
    assert [(dof, f"{size:.6g}") for size, dof, _ in truth] == [(dof, size) for dof, size, _ in found]
    np.testing.assert_allclose([float(where) for *_, where in found], [where for *_, where in truth], rtol=1e-4)


def test_the_last_lines_name_the_results_and_the_page_to_open(tmp_path: Path) -> None:
    case, out = tmp_path / "case.toml", tmp_path / "out"
    text = oscillator(head='harmonics = "0..3"\n', rubbing="velocity = 0.0", response="from = 8.0\nto = 9.0\n")
    case.write_text(text)
    said = slipstick("run", case, "-o", out).stdout.splitlines()
    assert said[-2:] == [f"results in {out}/", f"open {out / 'report.html'} in a browser"]
    assert (out / "report.html").exists()
    again = slipstick("report", out).stdout.splitlines()
    assert again[-1] == said[-1]
    without = slipstick("run", case, "-o", tmp_path / "none", "--no-report").stdout.splitlines()
    assert without[-1] == f"results in {tmp_path / 'none'}/"


def test_a_report_that_is_not_written_is_not_to_be_opened(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Two faults of it are one line, without a line break spelt out."""

    def refuse() -> None:
        raise InputError(["dofs: found 0", "contacts: found -1"])

    say_results(tmp_path, reported=report_or_warn(refuse))
    said = capsys.readouterr()
    assert said.out == f"results in {tmp_path}/\n"
    assert said.err == "warning: dofs: found 0; contacts: found -1\n"
