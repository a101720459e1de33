"""Bolts and load steps in case files: what they make, as a script, their faults; the verb."""

import json
import runpy

import numpy as np
import pytest
import xarray as xr

import slipstick as ss
from slipstick.case.script import python_script
from slipstick.errors import InputError

FLANGE = """
format = 1
title = "A flange on a bolt"
harmonics = "0..3"

[structure]
kind = "matrices"
dofs = ["u", "x"]
mass = [[2.0, 0.0], [0.0, 2.0]]
damping = [[50.0, 0.0], [0.0, 50.0]]
stiffness = [[1e4, 0.0], [0.0, 1e6]]

[[contact]]
name = "plates"
tangential = "x"
normal = { u = -1.0 }
kt = 5e8
kn = 7e8
mu = 0.2
gap = 0.0

[[bolt]]
name = "bolt 1"
elongation = { u = 1.0 }
stiffness = 2e8
force = 12e3

[[preload]]
name = "push"
loads = [{ dof = "x", cos = 1500.0 }, { dof = "u", cos = 2000.0 }]

[[load]]
dof = "x"
cos = 200.0

[response]
from = 1000.0
to = 40000.0
"""


def changed(*pairs):
    text = FLANGE
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


def test_a_case_vibrates_from_its_load_steps():
    case = ss.Case.from_text(FLANGE)
    state = case.preloaded
    assert state.dataset.step.values.tolist() == ["tighten", "push"]
    assert state.dataset.joint.values.tolist() == ["plates", "bolt 1"]
    share = 2000.0 * 2e8 / (2e8 + 7e8)
    assert state.dataset.normal_force.values[-1, 1] == pytest.approx(12e3 + share, rel=1e-4)
    problem = case.problem()
    assert problem.contacts[1].contact.gap == pytest.approx(state.gaps[1])
    assert sorted((load.dof, load.harmonic, load.cos) for load in problem.loads) == [
        ("u", 0, 2000.0), ("x", 0, 1500.0), ("x", 1, 200.0)
    ]  # fmt: skip
    branch = ss.steady_response(problem, omega=2000.0)
    mean = branch.dataset.friction_force.isel(point=0).sel(coefficient="0").values[0]
    assert mean == pytest.approx(state.dataset.friction_force.values[-1, 0, 0], rel=1e-6)


def test_parameters_that_change_later_are_told_of():
    assert not ss.Case.from_text(FLANGE).noticed
    swept = FLANGE.replace(
        "from = 1000.0\nto = 40000.0", 'parameter = "plates.mu"\nfrom = 0.2\nto = 0.3\nomega = 900.0'
    )
    assert "load steps are computed once" in ss.Case.from_text(swept).noticed[-1]


def test_the_script_of_a_case_makes_the_same(tmp_path):
    script = tmp_path / "flange.py"
    script.write_text(python_script(FLANGE, "flange.toml", tmp_path), encoding="utf-8")
    made = runpy.run_path(str(script))["problem"]()
    problem = ss.Case.from_text(FLANGE).problem()
    assert made.contacts == problem.contacts
    assert made.loads == problem.loads


def test_faults_stand_at_their_keys():
    text = changed(
        ('force = 12e3', 'force = 12e3\nshortening = 1e-5'), ("stiffness = 2e8", "stiffness = -1.0"),
        ('{ dof = "x", cos = 1500.0 }', '{ dof = "x", harmonic = 2, cos = 1.0 }, { dof = "x" }'),
    )  # fmt: skip
    with pytest.raises(InputError) as error:
        ss.Case.from_text(text)
    said = str(error.value)
    for part in (
        "[[bolt]] 'bolt 1' shortening is given together with force", "[[bolt]] 'bolt 1' stiffness: found -1.0",
        "[[preload]] 'push' loads, number 1.harmonic: found 2", "[[preload]] 'push' loads, number 2",
    ):  # fmt: skip
        assert part in said
    text = changed(('{ dof = "x", cos = 1500.0 }', '{ dof = "xx", cos = 1.0 }'), ("[response]", "[response]"))
    text = text.replace('name = "push"', 'name = "push"\nbolts = { "bolt 2" = 1.0 }')
    with pytest.raises(InputError) as error:
        ss.Case.from_text(text)
    assert "[[preload]] 'push' bolts.bolt 2: there is no bolt 'bolt 2'" in str(error.value)
    assert "[[preload]] 'push' loads, number 1.dof: there is no dof 'xx'" in str(error.value)
    with pytest.raises(InputError, match=r"\[\[bolt\]\] 'bolt 1' elongation: there is no dof 'w'"):
        ss.Case.from_text(changed(("elongation = { u = 1.0 }", "elongation = { w = 1.0 }")))
    case = ss.Case.from_text(changed(("1500.0", "3500.0"), ("[0.0, 1e6]", "[0.0, 1e-9]")))
    with pytest.raises(InputError, match=r"\[\[preload\]\] 'push': no equilibrium beyond 6\d"):
        case.problem()


def test_the_verb_writes_the_steps(tmp_path, monkeypatch, capsys):
    from slipstick.cli.main import app

    monkeypatch.chdir(tmp_path)
    (tmp_path / "flange.toml").write_text(FLANGE, encoding="utf-8")
    app(["preload", "flange.toml", "--json"], standalone_mode=False)
    told = json.loads(capsys.readouterr().out)
    assert [step["step"] for step in told["steps"]] == ["tighten", "push"]
    assert told["steps"][0]["bolt 1"]["normal_resultant"] == pytest.approx(12e3)
    with xr.open_dataset(tmp_path / "flange-preload" / "preload.nc", engine="h5netcdf") as data:
        assert data.attrs["analysis"] == "preload"
        np.testing.assert_allclose(data.normal_force.values[0], 12e3, rtol=1e-4)
    assert (tmp_path / "flange-preload" / "preload.png").exists()


def test_a_case_may_have_bolts_alone():
    start, end = FLANGE.index("[[contact]]"), FLANGE.index("[[bolt]]")
    case = ss.Case.from_text(FLANGE[:start] + FLANGE[end:])
    assert [pair.name for pair in case.problem().contacts] == ["bolt 1"]
    assert case.preloaded.dataset.normal_force.values[0, 0] == pytest.approx(12e3, rel=1e-9)
