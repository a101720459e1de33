"""``slipstick verify RESULTS``: points of a results file against time integration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.command import slipstick
from helpers.oscillator import with_law
from typer.testing import Result

import slipstick as ss
from slipstick.cli.examples import example

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def verify(*arguments: object) -> Result:
    result = slipstick("verify", *arguments)
    assert "Traceback" not in result.output
    return result


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    text = example("oscillator").path.read_text(encoding="utf-8").replace('"0..10"', '"0..4"')
    folder = tmp_path_factory.mktemp("results")
    ss.Case.from_text(text).run().save(folder / "results.nc")
    return folder / "results.nc"


def test_the_highest_peaks_of_a_file_or_its_folder(results: Path) -> None:
    result = verify(results)
    assert result.exit_code == 0
    assert "2 of 2 points agree within 0.01" in result.output
    assert result.output == verify(results.parent).output
    assert max(map(len, result.output.splitlines())) < 80


def test_named_points_are_the_branch_s_own_checks(results: Path) -> None:
    branch = ss.load(results)
    at = branch.at(6.0)
    expected = branch.check_in_time(at)
    result = verify(results, "--at", "6", "--point", at - len(branch), "--tolerance", 1e-12)
    assert result.exit_code == 1
    assert f"{expected.amplitude_in_time[0]:.5g}, {expected.relative_difference:.1e}, differs" in result.output
    assert "0 of 1 points agree" in result.output
    assert "the harmonics left out would add about as much" in result.output
    hertz = verify(results, "--at", f"{6 / 6.283185307179586} Hz", "--tolerance", 1e-12)
    assert hertz.output == result.output


def test_a_case_may_be_checked_in_time(tmp_path: Path) -> None:
    text = example("oscillator").path.read_text(encoding="utf-8").replace('"0..10"', '"0..4"')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    result = slipstick("check", tmp_path / "case.toml", "--in-time")
    assert result.exit_code == 0
    assert "can start" in result.output
    assert "2 of 2 points agree within 0.01" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["case.toml"]
    (tmp_path / "case.toml").write_text(text.replace("to = 15.0", "to = 15.0\nmax_points = 3"), encoding="utf-8")
    stopped = slipstick("check", tmp_path / "case.toml", "--in-time")
    assert stopped.exit_code == 1
    assert "1 of 1 points agree" in stopped.output


def test_wrong_arguments(results: Path, tmp_path: Path) -> None:
    for arguments, words in (
        ((results, "--point", 100000), "--point: found 100000; expected a whole number from"),
        ((results, "--at", "fast"), "--at: found 'fast'; expected a frequency such as"),
        (
            (results, "--at", "60"),
            "--at: found '60', which lies outside the range computed; expected a value from 2 to 15",
        ),
        ((results, "--at", "60 Hz"), "--at: found '60 Hz', which lies outside the range computed"),
        ((results, "--only", "CF1"), "--only: chooses rows of the installation's table"),
        (("--point", 3), "--point, --at: found no RESULTS"),
        ((tmp_path / "none.nc",), "there is no such file"),
        ((tmp_path,), "found a folder without results.nc, study.nc, run_up.nc or identify.nc"),
    ):
        result = verify(*arguments)
        assert result.exit_code == 2
        assert words in result.output


def test_results_without_their_problem(tmp_path: Path) -> None:
    problem = with_law(ss.SampledLaw(force=lambda x, v, k: k * x**3, parameters={"k": 1.0}), name="cubic")
    ss.forced_response(problem, omega=(2.0, 2.1)).save(tmp_path / "r.nc")
    result = verify(tmp_path / "r.nc")
    assert result.exit_code == 2
    assert "cannot be integrated in time: the law of contact 'cubic'" in result.output


def test_a_contact_in_a_plane_is_checked_in_time_with_its_stability(tmp_path: Path) -> None:
    text = example("sliding_in_the_plane").path.read_text(encoding="utf-8")
    text = text.replace("from = 6.0", "from = 8.3").replace("to = 14.0", "to = 8.36\nstability = true")
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    result = slipstick("check", tmp_path / "case.toml", "--in-time")
    assert result.exit_code == 0, result.output
    assert "1 of 1 points agree within 0.01" in result.output
    branch = ss.Case.from_text(text).run()
    largest = branch.dataset["multiplier_max"].to_numpy()
    assert (branch.dataset["stable"] == 1).all()
    assert 0.0 < np.nanmax(largest) < 1.0
