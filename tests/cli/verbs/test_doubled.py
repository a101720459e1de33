"""Motion of twice the period from a case file: the same as in Python."""

from __future__ import annotations

import json

import numpy as np
import pytest
from helpers.command import slipstick
from helpers.stability import stops

import slipstick as ss
from slipstick.case.case import Case

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

CASE = """\
format = 1
harmonics = "0..6"
[structure]
kind = "matrices"
dofs = ["t", "y"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.1, 0.0], [0.0, 0.1]]
stiffness = [[1.0, 0.0], [0.0, 1.0]]
[[load]]
dof = "y"
sin = 1.0
[[contact]]
name = "up"
tangential = "t"
normal = "y"
kt = 1.0
mu = 0.0
kn = 10.0
gap = -0.1
[output]
dofs = ["y"]
[response]
from = 2.49
to = 2.52
"""
FOLLOW = 'follow = "subharmonic"\n'


def test_run_writes_what_python_follows(tmp_path):
    case, out = tmp_path / "case.toml", tmp_path / "out"
    case.write_text(CASE + FOLLOW)
    result = slipstick("run", case, "-o", out, "--json", "--no-report")
    assert result.exit_code == 0, result.output
    branch = ss.forced_response(stops(gap=-0.1, harmonics=7), omega=(2.49, 2.52), follow="subharmonic")
    (exact,) = branch.subharmonics
    (said,) = json.loads(result.stdout)["subharmonics"]
    assert (said["file"], said["outcome"], said["points"]) == ("subharmonic_1.nc", exact.outcome.name, len(exact))
    found = ss.load(out / "subharmonic_1.nc")
    np.testing.assert_allclose(found.dataset.omega, exact.dataset.omega, rtol=1e-9)
    np.testing.assert_allclose(found.dataset.amplitude, exact.dataset.amplitude, rtol=1e-7)
    assert "stable" in ss.load(out / "results.nc").dataset
    (again,) = Case.from_file(case).run().subharmonics
    np.testing.assert_array_equal(again.dataset.omega, exact.dataset.omega)
    # results without it replace those with it as a whole
    case.write_text(CASE)
    assert slipstick("run", case, "-o", out, "--force", "--no-report").exit_code == 0
    assert {path.name for path in out.iterdir()} == {"case.toml", "results.nc"}


def test_where_no_period_doubles_that_is_said(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE.replace("to = 2.52", "to = 2.495") + FOLLOW)
    result = slipstick("run", case, "-o", tmp_path / "out", "--no-report")
    assert result.exit_code == 0, result.output
    assert "the period doubles nowhere" in result.output


def test_another_word_is_a_fault_and_the_script_has_the_same(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE + 'follow = "doubled"\n')
    result = slipstick("check", case)
    assert (result.exit_code, "[response] follow" in result.output) == (2, True)
    case.write_text(CASE + FOLLOW)
    assert slipstick("init", case, "--python").exit_code == 0
    assert "follow='subharmonic'" in case.with_suffix(".py").read_text().replace('"', "'")
