"""Pages of run-ups and fits: their numbers are those of the results, and no text in them becomes part of the page."""

from __future__ import annotations

import re
from base64 import b64decode
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command import slipstick
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.io.store import save_dataset
from slipstick.report.writing import write_fit_report, write_run_up_report
from slipstick.results.run_up import RunUp

HOSTILE = "</style><script>alert(1)</script>"
UNITS = {"length": "mm", "force": "N", "time": "s"}


def problem(**more: Any) -> ss.Problem:
    return one_mass(damper(normal_load=300.0), harmonics=[0, 1, 3], units=UNITS, **more)


@pytest.fixture(scope="module")
def passed() -> RunUp:
    return ss.runs.run_up(problem(title=HOSTILE), (5.0, 9.0), rate=0.5)


@pytest.fixture(scope="module")
def steady() -> ss.Branch:
    return ss.forced_response(problem(), omega=(5.0, 9.0))


class Page(HTMLParser):
    """Elements, all closed in their order, and cells row by row."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)
        if tag not in ("meta", "img"):
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1].append(data)


def test_a_run_up_has_its_peak_lag_and_energy(passed: RunUp, steady: ss.Branch, tmp_path: Path) -> None:
    text = write_run_up_report(passed, tmp_path / "r.html", steady=steady).read_text(encoding="utf-8")
    page = Page(text)
    assert "script" not in page.tags
    assert "script-src 'none'" in unescape(text)
    lag = passed.lag(steady, "x")
    assert ["x", f"{lag.amplitude:.6g} mm", f"{lag.omega:.6g} rad/s", f"{lag.steady_amplitude:.6g} mm",
            f"{lag.steady_omega:.6g} rad/s", f"{lag.shift:.6g} rad/s", f"{lag.ratio:.4f}"] in page.rows  # fmt: skip
    data = passed.dataset
    times = np.diff(data["time"], prepend=0.0)
    energy = float(data["dissipated_power"][:, 0].to_numpy() @ times)
    row = next(row for row in page.rows if row[0] == "damper")
    assert row[1] == f"{energy:.6g}"
    assert sum(float(cell.removesuffix(" %")) for cell in row[2:5]) == pytest.approx(100.0, abs=0.02)
    assert int(row[5]) == data.sizes["change"]
    assert page.rows[page.rows.index(row) - 1][:2] == ["contact", "dissipated energy [mJ]"]
    assert f"at most {float(data['energy_error'].max()):.2g} on the way" in text
    assert f"rate {0.5:.4g} rad/s^2" in text
    pictures = re.findall(r"data:image/png;base64,([\w+/=]+)", text)
    assert len(pictures) == 2  # envelope and spectrogram
    assert all(b64decode(picture).startswith(b"\x89PNG") for picture in pictures)


def test_a_motion_at_one_speed_says_its_kind(tmp_path: Path) -> None:
    run = ss.runs.run_up(problem(), 6.0, periods=70, samples=0)
    page = Page(write_run_up_report(run, tmp_path / "r.html").read_text(encoding="utf-8"))
    assert next(row for row in page.rows if row[0] == "x")[3] == run.motion("x").kind
    assert page.tags.count("img") == 2  # amplitude over time, and the section


def test_a_fit_says_its_values_and_what_cannot_be_separated(tmp_path: Path) -> None:
    measured = ss.steady_response(problem(), omega=np.linspace(5.0, 9.0, 6)).dataset
    starts = {"damper.mu": 0.28, "damper.normal_load": 310.0, "damper.kt": 90.0}
    with pytest.warns(ss.SlipstickWarning, match="cannot be separated"):
        fit = ss.identify(problem(), measured, starts)
    text = write_fit_report(fit.dataset, tmp_path / "r.html", title=HOSTILE).read_text(encoding="utf-8")
    page = Page(text)
    assert "script" not in page.tags
    assert ["damper.mu", f"{fit.values['damper.mu']:.8g}", "not determined", "-"] in page.rows
    assert next(row for row in page.rows if row[0] == "damper.kt")[1] == f"{fit.values['damper.kt']:.8g} N/mm"
    assert f'<p class="warning"><strong>Warning: </strong>{fit.indistinct[0]}</p>' in text
    assert f"{fit.degrees_of_freedom} degrees of freedom" in text
    save_dataset(fit.dataset, tmp_path / "identify.nc")
    assert slipstick("report", tmp_path).exit_code == 0
    assert "the fit converged" in (tmp_path / "report.html").read_text(encoding="utf-8")
    with pytest.raises(ss.InputError, match="not the results of a fit"):
        write_fit_report(fit.dataset.drop_vars("correlation"), tmp_path / "r.html")


def test_the_report_command_knows_run_ups(passed: RunUp, steady: ss.Branch, tmp_path: Path) -> None:
    save_dataset(passed.dataset, tmp_path / "run_up.nc")
    curve = steady.save(tmp_path / "curve.nc")
    result = slipstick("report", tmp_path, curve, "--title", "both")
    assert result.exit_code == 0, result.output
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "beside the steady curve" in text
    assert "<title>both</title>" in text
    for wrong in ((tmp_path, curve, curve), (tmp_path, tmp_path)):
        refused = slipstick("report", *wrong)
        assert (refused.exit_code, "holds one run-up" in refused.output) == (2, True)


def test_a_steady_curve_in_other_units_or_of_other_dofs_is_refused(passed: RunUp, tmp_path: Path) -> None:
    plain = one_mass(damper(normal_load=300.0), harmonics=[0, 1, 3])
    other = ss.forced_response(plain, omega=(5.0, 6.0))
    with pytest.raises(ss.InputError, match="same units"):
        write_run_up_report(passed, tmp_path / "r.html", steady=other)
    load = ss.parameter_response(problem(), "damper.normal_load", (300.0, 320.0), omega=6.0)
    with pytest.raises(ss.InputError, match="a response over a range"):
        write_run_up_report(passed, tmp_path / "r.html", steady=load)
