"""The verb ``wear``: what it writes, goes on with, and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.command import slipstick
from helpers.wear_case import CASE

import slipstick as ss

WEAR = "[wear]" + CASE.partition("[wear]")[2]


def test_a_case_leaves_the_folder_that_python_computes(tmp_path: Path) -> None:
    case, out = tmp_path / "worn.toml", tmp_path / "out"
    case.write_text(CASE.replace("OMEGA", '"peak"'))
    result = slipstick("wear", case, "-o", out, "--json")
    assert result.exit_code == 0, result.output
    assert {path.name for path in out.iterdir()} == {"worn.toml", "results.nc", "report.html", "wear.png"}
    answer, found = json.loads(result.stdout), ss.load(out / "results.nc").dataset
    problem = ss.load_case(case)
    worn = ss.wear(problem, 8e-4, (0, 300), omega="peak", range=(6.0, 15.0), at=100.0).dataset
    assert answer["outcome"] == "COMPLETED"
    assert answer["points"] == len(found["point"]) == len(worn["point"])
    assert float(found["worn_depth"][-1, 0]) == pytest.approx(float(worn["worn_depth"][-1, 0]), rel=1e-12)
    assert "damper: worn " in result.stderr
    page = (out / "report.html").read_text()
    assert '"analysis":"wear"' in page
    assert '"key":"worn_depth"' in page
    assert '"key":"normal_load"' in page
    again = slipstick("resume", out)
    assert (again.exit_code, "nothing is left to do" in again.output) == (0, True)
    assert slipstick("check", case).exit_code == 0


def test_several_contacts_have_a_figure_of_their_depths(tmp_path: Path) -> None:
    """Which a later run takes away again with the others."""
    case, out = tmp_path / "worn.toml", tmp_path / "out"
    damper = CASE[CASE.index("[[contact]]") : CASE.index("[response]")]
    second = damper.replace('name = "damper"', 'name = "pad"')
    case.write_text(CASE.replace("OMEGA", "10.0").replace(damper, damper + second))
    assert slipstick("wear", case, "-o", out, "--no-report").exit_code == 0
    assert {path.name for path in out.iterdir()} == {"worn.toml", "results.nc", "wear.png", "worn_surface.png"}
    assert slipstick("wear", case, "-o", out, "--no-report", "--no-figures", "--force").exit_code == 0
    assert {path.name for path in out.iterdir()} == {"worn.toml", "results.nc"}


def test_worn_out_is_said(tmp_path: Path) -> None:
    case = tmp_path / "worn.toml"
    case.write_text(CASE.replace("OMEGA", "10.0\ndepth = 50.0"))
    result = slipstick("wear", case, "-o", tmp_path / "out", "--no-figures", "--no-report")
    assert result.exit_code == 1
    assert "a contact reached the largest wear depth allowed" in " ".join(result.output.split())
    assert str(ss.load(tmp_path / "out" / "results.nc").dataset["kind"][-1].item()) == "worn out"


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("", "[wear] is missing; give it"),
        ("[wear]\nkappa = 1e-9\nomega = 9.0\n", "[wear] to is missing"),
        ("[wear]\nkappa = -1.0\nto = 1e6\nomega = 9.0\n", "[wear] kappa: found -1.0; expected a number >= 0"),
        ("[wear]\nkappa = { dumper = 1.0 }\nto = 1e6\nomega = 9.0\n", "there is no contact 'dumper'; did you mean"),
        ("[wear]\nkappa = 0.0\nto = 1e6\nomega = 9.0\n", "no contact wears"),
        ("[wear]\nkappa = 1e-9\nfrom = 2e6\nto = 1e6\nomega = 9.0\n", "[wear] to is 1e+06, not more than from"),
        ("[wear]\nkappa = 1e-9\nto = 1e6\nat = [2e6]\nomega = 9.0\n", "[wear] at, number 1: found 2e+06"),
        ('[wear]\nkappa = 1e-9\nto = 1e6\nomega = "top"\n', "[wear] omega: found"),
        ("[wear]\nkappa = 1e-9\nto = 1e6\nomega = 9.0\nrange = [2.0, 3.0]\n", "[wear] range is for omega"),
        ('[wear]\nkappa = 1e-9\nto = 1e6\nomega = "peak"\ndof = "y"\n', "there is no output 'y'"),
        ("[wear]\nkappa = 1e-9\nto = 1e6\nomega = 9.0\ndepth = 0\n", "[wear] depth"),
    ],
)
def test_a_table_that_cannot_be_computed_is_refused(tmp_path: Path, table: str, sentence: str) -> None:
    case = tmp_path / "worn.toml"
    case.write_text(CASE.replace(WEAR, table))
    result = slipstick("wear", case, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert sentence in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()
