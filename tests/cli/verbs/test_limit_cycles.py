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
from slipstick.case.case import Case
from slipstick.errors import TimeIsUp
from slipstick.runs.folder import OutputFolder
from slipstick.runs.run import CaseRun, RunListener

EXAMPLE = Path(__file__).parents[3] / "examples" / "brake_squeal" / "brake_squeal.toml"
SHORT = EXAMPLE.read_text().replace("0..10", "0..5").replace("at = [0.55, 0.6, 0.7]", "at = [0.6]")
TABLE = "[limit_cycles]" + SHORT.partition("[limit_cycles]")[2].partition("[response]")[0]


def test_the_example_leaves_the_folder_that_python_follows(tmp_path):
    case, out = tmp_path / "brake.toml", tmp_path / "out"
    case.write_text(SHORT)
    result = slipstick("limit-cycles", case, "-o", out, "--json")
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
    assert (slipstick("limit-cycles", case, "-o", out).exit_code, slipstick("check", case).exit_code) == (2, 0)


def test_what_began_nowhere_is_said(tmp_path):
    case = tmp_path / "brake.toml"
    case.write_text(SHORT.replace(TABLE, '[limit_cycles]\nparameter = "pad.mu"\nfrom = 0.6\nto = 0.7\n'))
    result = slipstick("limit-cycles", case, "-o", tmp_path / "out", "--no-figures")
    assert result.exit_code == 1
    assert "begin where it is stable" in " ".join(result.output.split())
    assert (tmp_path / "out" / "results.nc").exists()


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("", "[limit_cycles] is missing; give it"),
        ('[limit_cycles]\nparameter = "pad.mu"\nfrom = 0.3\n', "[limit_cycles] to is missing"),
        ('[limit_cycles]\nparameter = "pad.mu"\nfrom = 0.3\nto = 0.3\n', "[limit_cycles] to is 0.3, the same as from"),
        ('[limit_cycles]\nparameter = "pad.nu"\nfrom = 0.3\nto = 0.4\n', "there is no parameter 'pad.nu'"),
        ('[limit_cycles]\nparameter = "pad.mu"\nfrom = 0.3\nto = 0.4\ndof = "z"\n', "there is no output"),
        ('[limit_cycles]\nparameter = "pad.mu"\nfrom = 0.3\nto = 0.4\nat = [0.5]\n', "0.5"),
        (TABLE + "[[load]]\ndof = 'y'\nsin = 1.0\n", "it excites at harmonic 1 (expected harmonic 0 alone)"),
    ],
)
def test_faults_are_sentences(tmp_path, table, sentence):
    case = tmp_path / "brake.toml"
    case.write_text(SHORT.replace(TABLE, table))
    result = slipstick("limit-cycles", case, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert sentence in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_as_a_script_the_verb_is_named(tmp_path):
    case = tmp_path / "brake.toml"
    case.write_text(SHORT)
    assert slipstick("init", case, "--python").exit_code == 0
    assert "see ss.limit_cycles" in case.with_suffix(".py").read_text()
    old = tmp_path / "before.toml"
    old.write_text(AS_BEFORE)
    assert slipstick("init", old, "--python").exit_code == 0
    assert (
        "# The case has [cycles] too: see ss.limit_cycles, which takes problem()" in old.with_suffix(".py").read_text()
    )


AS_BEFORE = SHORT.replace("[limit_cycles]", "[cycles]")
"""The table by its old name."""


def test_the_old_names_go_on_working_and_say_the_new_ones(tmp_path, monkeypatch):
    """Into the folder of before; hidden in the help; the same numbers, and the same name of the analysis in files."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "new.toml").write_text(SHORT)
    (tmp_path / "old.toml").write_text(AS_BEFORE)
    new, old = (
        slipstick(verb, case, "--json", "--no-figures", "--no-report")
        for verb, case in (("limit-cycles", "new.toml"), ("cycles", "old.toml"))
    )
    assert (new.exit_code, old.exit_code) == (0, 0), old.output
    assert not json.loads(new.stdout)["warnings"]
    assert json.loads(old.stdout)["warnings"] == ["[cycles] is now called [limit_cycles]"]
    assert "warning: 'slipstick cycles' is now called 'slipstick limit-cycles'" in old.stderr
    assert "limit-cycles" in slipstick("--help").output
    assert not re.search(r"^\W*cycles\b", slipstick("--help").output, re.MULTILINE)
    found = [ss.load(tmp_path / folder / "results.nc").dataset for folder in ("new-limit-cycles", "old-cycles")]
    for name in ("parameter", "omega", "amplitude", "kind", "multiplier"):
        np.testing.assert_array_equal(found[0][name], found[1][name])
    assert [data.attrs["analysis"] for data in found] == ["cycles", "cycles"]
    assert "is complete" in slipstick("resume", "old-cycles").output


def test_faults_of_a_table_by_its_old_name_name_it_so(tmp_path):
    case = tmp_path / "brake.toml"
    case.write_text(AS_BEFORE.replace("to = 0.8", "to = 0.3", 1) + '[[load]]\ndof = "y"\nsin = 1.0\n')
    said = " ".join(slipstick("check", case).output.split())
    assert "[cycles] to is 0.3, the same as from" in said
    assert "leave [cycles] out" in said
    assert "[limit_cycles]" not in said
    case.write_text(AS_BEFORE + TABLE)
    result = slipstick("check", case)
    assert result.exit_code == 2
    (sentence,) = " ".join(result.output.split()).split("error: ")[1:]
    assert sentence == "[cycles]: it is the old name of [limit_cycles], and both are given; leave [cycles] out"


class Stopped(RunListener):
    """Its time is up after two points."""

    def point_kept(self, event):
        if event.point.kind != "start":
            raise TimeIsUp


def test_a_run_begun_by_the_old_name_goes_on(tmp_path):
    case, out = tmp_path / "brake.toml", tmp_path / "out"
    case.write_text(AS_BEFORE)
    read = Case.from_file(case)
    run = CaseRun(read, OutputFolder(out, case_path=case, case_text=read.text), table="limit_cycles")
    run.compute(Stopped())
    run.folder.release()
    assert run.outcome.name == "TIME_LIMIT"
    with pytest.warns(ss.SlipstickWarning, match=r"\[cycles\] is now called \[limit_cycles\]"):
        assert ss.resume(out).outcome.ok


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
    result = slipstick("limit-cycles", case, "-o", out, "--json")
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    hopf, (cycle,) = answer["marked"][-1], answer["cycles"]
    assert (hopf["kind"], hopf["parameter"]) == ("Hopf", pytest.approx(0.53125, rel=1e-9))
    line = ss.limit_cycles(brake(harmonics=6), "pad.mu", (0.3, 0.62), at=0.6)
    data = line.dataset.isel(point=line.at(0.6))
    assert cycle["omega"] == pytest.approx(float(data.omega), rel=1e-8)
    assert cycle["amplitude"] == pytest.approx(float(data.amplitude[1]), rel=1e-7)
