"""Self-excited vibration from a case file: the same as in Python."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.command import slipstick
from helpers.stability import brake

import slipstick as ss

EXAMPLE = Path(__file__).parents[3] / "examples" / "brake_squeal" / "brake_squeal.toml"
SHORT = EXAMPLE.read_text().replace("0..10", "0..5").replace("at = [0.55, 0.6, 0.7]", "at = [0.6]")
TABLE = "[cycles]" + SHORT.partition("[cycles]")[2].partition("[response]")[0]


def test_the_example_leaves_the_folder_that_python_follows(tmp_path):
    case, out = tmp_path / "brake.toml", tmp_path / "out"
    case.write_text(SHORT)
    result = slipstick("cycles", case, "-o", out, "--json")
    assert result.exit_code == 0, result.output
    files = {"brake.toml", "results.nc", "report.html", "response.png", "stability.png"}
    assert {path.name for path in out.iterdir()} == files
    answer, found = json.loads(result.stdout), ss.load(out / "results.nc")
    branch = ss.limit_cycles(brake(harmonics=6), "pad.mu", (0.3, 0.8), at=0.6)
    np.testing.assert_allclose(found.dataset.amplitude, branch.dataset.amplitude, rtol=1e-9, atol=1e-15)
    assert (answer["outcome"], answer["message"]) == ("COMPLETED", branch.message)
    hopf = answer["marked"][-1]
    assert (hopf["kind"], hopf["before"], hopf["after"]) == ("Hopf", 0, 2)
    assert hopf["parameter"] == pytest.approx(0.53125, rel=1e-12)
    (cycle,) = answer["cycles"]
    data = branch.dataset.isel(point=branch.at(0.6))
    assert (cycle["parameter"], cycle["stable"]) == (0.6, True)
    assert cycle["omega"] == pytest.approx(float(data.omega), rel=1e-9)
    assert cycle["amplitude"] == pytest.approx(float(data.amplitude[1]), rel=1e-9)
    assert (slipstick("cycles", case, "-o", out).exit_code, slipstick("check", case).exit_code) == (2, 0)


def test_what_began_nowhere_is_said(tmp_path):
    case = tmp_path / "brake.toml"
    case.write_text(SHORT.replace(TABLE, '[cycles]\nparameter = "pad.mu"\nfrom = 0.6\nto = 0.7\n'))
    result = slipstick("cycles", case, "-o", tmp_path / "out", "--no-figures")
    assert result.exit_code == 1
    assert "begin where it is stable" in " ".join(result.output.split())
    assert (tmp_path / "out" / "results.nc").exists()


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("", "[cycles] is missing; give it"),
        ('[cycles]\nparameter = "pad.mu"\nfrom = 0.3\n', "[cycles] to is missing"),
        ('[cycles]\nparameter = "pad.mu"\nfrom = 0.3\nto = 0.3\n', "[cycles] to is 0.3, the same as from"),
        ('[cycles]\nparameter = "pad.nu"\nfrom = 0.3\nto = 0.4\n', "there is no parameter 'pad.nu'"),
        ('[cycles]\nparameter = "pad.mu"\nfrom = 0.3\nto = 0.4\ndof = "z"\n', "there is no output"),
        ('[cycles]\nparameter = "pad.mu"\nfrom = 0.3\nto = 0.4\nat = [0.5]\n', "0.5"),
        (TABLE + "[[load]]\ndof = 'y'\nsin = 1.0\n", "it excites at harmonic 1 (expected harmonic 0 alone)"),
    ],
)
def test_faults_are_sentences(tmp_path, table, sentence):
    case = tmp_path / "brake.toml"
    case.write_text(SHORT.replace(TABLE, table))
    result = slipstick("cycles", case, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert sentence in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_as_a_script_the_verb_is_named(tmp_path):
    case = tmp_path / "brake.toml"
    case.write_text(SHORT)
    assert slipstick("init", case, "--python").exit_code == 0
    assert "see ss.limit_cycles" in case.with_suffix(".py").read_text()


@pytest.mark.parametrize(("tangential", "velocity"), [('["x", "z"]', "[1.0, 0.0]"), ('["z", "x"]', "[0.0, 1.0]")])
def test_a_brake_in_the_plane_squeals_like_that_along_a_line(tmp_path, tangential, velocity):
    """Nothing moves across: the same Hopf point and the same cycle, whichever direction is the first."""
    case, out = tmp_path / "brake.toml", tmp_path / "out"
    text = SHORT.replace('dofs = ["x", "y"]', 'dofs = ["x", "y", "z"]').replace("to = 0.8", "to = 0.62")
    for key, across in (("mass", 1.0), ("damping", 0.5), ("stiffness", 75.0)):
        (line,) = re.findall(rf"^{key} = .*$", text, re.MULTILINE)
        text = text.replace(line, line.replace("], [", ", 0.0], [").replace("]]", f", 0.0], [0.0, 0.0, {across}]]"))
    text = text.replace('tangential = "x"', f"tangential = {tangential}").replace(
        "velocity = 1.0", f"velocity = {velocity}"
    )
    case.write_text(text)
    result = slipstick("cycles", case, "-o", out, "--json")
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    hopf, (cycle,) = answer["marked"][-1], answer["cycles"]
    assert (hopf["kind"], hopf["parameter"]) == ("Hopf", pytest.approx(0.53125, rel=1e-9))
    line = ss.limit_cycles(brake(harmonics=6), "pad.mu", (0.3, 0.62), at=0.6)
    data = line.dataset.isel(point=line.at(0.6))
    assert cycle["omega"] == pytest.approx(float(data.omega), rel=1e-8)
    assert cycle["amplitude"] == pytest.approx(float(data.amplitude[1]), rel=1e-7)
