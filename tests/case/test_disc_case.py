"""``[structure] kind = "disc"``: the case file, the script it becomes, and what is wrong with one."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.rings import BLADE, pairs, wave_problem
from typer.testing import CliRunner

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.cli.main import app
from slipstick.errors import InputError


def rows(matrix: np.ndarray) -> str:
    """As the file writes them."""
    return str(matrix.tolist())


MATRICES = {name: f"[{rows(pair[0])}, {rows(pair[1])}]" for name, pair in pairs().items()}
WAVE = f"""
format = 1
harmonics = "0..5"

[structure]
kind = "disc"
dofs = ["tip", "left", "right"]
sectors = 6
engine_order = -2
mass = {MATRICES["M"]}
stiffness = {MATRICES["K"]}
damping = {MATRICES["C"]}
loss_factor = 0.003

[[load]]
dof = "tip"
cos = 1.0
sin = 6.0

[[contact]]
name = "shroud"
tangential = {{ right = 0.8, tip = 0.6, "left@next" = -0.8, "tip@next" = -0.6 }}
normal = {{ right = -0.6, tip = 0.8, "left@next" = 0.6, "tip@next" = -0.8 }}
kt = 50.0
mu = 0.4
kn = 60.0
gap = -0.1

[[contact]]
name = "casing"
tangential = "tip"
kt = 30.0
mu = 0.3
normal_load = 0.8
rubbing = {{ velocity = 0.3 }}

[response]
from = 7.9
to = 8.0
"""
MISTUNED = WAVE.replace(
    "loss_factor = 0.003", f"loss_factor = 0.003\nmistuning = {{ spread = 0.02, seed = 3, blade = {rows(BLADE)} }}"
)


def test_it_is_the_problem_of_python() -> None:
    """To the last bit."""
    case = Case.from_text(WAVE)
    given = wave_problem(6, -2, pairs(), 1 - 6j, 0.3)
    one, other = (ss.steady_response(p, omega=[7.9]).dataset.displacement for p in (case.problem(), given))
    np.testing.assert_array_equal(one.to_numpy(), other.to_numpy())


@pytest.mark.parametrize("text", [WAVE, MISTUNED], ids=["wave", "mistuned"])
def test_its_script_says_the_same(text: str, tmp_path: Path) -> None:
    """The same numbers."""
    script = tmp_path / "disc.py"
    script.write_text(python_script(text, "disc.toml", tmp_path), encoding="utf-8")
    known: dict[str, Any] = {"__file__": str(script), "__name__": "disc"}
    exec(compile(script.read_text(), str(script), "exec"), known)
    one, other = known["problem"](), Case.from_text(text).problem()
    assert one.structure.dofs == other.structure.dofs
    assert one.elements == other.elements
    assert one.outputs == other.outputs
    at = [ss.steady_response(p, omega=[7.9]).dataset.displacement.to_numpy() for p in (one, other)]
    np.testing.assert_array_equal(*at)


def test_a_mistuned_case_is_the_whole_disc() -> None:
    """Outputs by sector, deviations by name."""
    text = MISTUNED.replace("[response]", '[output]\ndofs = ["tip", "left@3"]\n\n[response]\npeaks_of = "tip@4"')
    case = Case.from_text(text)
    problem = case.problem()
    assert problem.outputs == (*(f"tip@{s}" for s in range(6)), "left@3")
    assert problem.elements[:2] == ("shroud.1", "shroud.2")
    expected = np.random.default_rng(3).normal(0.0, 0.02, 6)
    assert problem.parameter("stiffness@5") == expected[5]


def test_run_and_check(tmp_path: Path) -> None:
    """Verbs: the table of harmonics, results with their problem."""
    path = tmp_path / "disc.toml"
    path.write_text(WAVE, encoding="utf-8")
    checked = CliRunner().invoke(app, ["check", str(path)])
    assert checked.exit_code == 0, checked.output
    assert re.search(r"wave of engine order -2 on 6 sectors", checked.output)
    assert re.search(r" 1  2 backward\n +2  2 forward\n +3  0 standing", checked.output)
    run = CliRunner().invoke(app, ["run", str(path), "-o", str(tmp_path / "out"), "--no-figures"])
    assert run.exit_code == 0, run.output
    branch = ss.load(tmp_path / "out" / "results.nc")
    assert branch.on_disc("tip").sizes["sector"] == 6
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.parametrize(
    ("old", "new", "fragments"),
    [
        ("sectors = 6", "sectors = 1", ("[structure] sectors",)),
        ("sectors = 6", "sektors = 6", ("unknown key 'sektors'", "did you mean 'sectors'")),
        ("engine_order = -2", "engine_order = 1.5", ("[structure] engine_order",)),
        ('"left@next" = -0.8', '"lift@next" = -0.8', ("lift@next", "did you mean 'left@next'")),
        (f"mass = {MATRICES['M']}", "mass = [[[1.0, 0.0], [0.0, 1.0]], [[0.0]]]", ("[structure] mass", "(3, 3)")),
        (f"mass = {MATRICES['M']}", "mass = [[[1.0, 0.0], [0.0]], [[0.0]]]", ("[structure] mass", "row 2")),
        (f"stiffness = {MATRICES['K']}", f"stiffness = [{rows(np.eye(3))}, {rows(-np.eye(3))}]", ("stiffness", "ND")),
        ("seed = 3", "seed = 3, stiffness = [1.0]", ("mistuning", "together with stiffness")),
        ("spread = 0.02, seed = 3", "stiffness = [0.1]", ("mistuning.stiffness", "(6,)")),
        ("seed = 3, blade", "seed = 3, families = 9, blade", ("mistuning.families", "1 to 3")),
        ("from = 7.9\nto = 8.0", 'from = 0.0\nto = 1.0\nparameter = "stiffness@6"\nomega = 7.9', ("stiffness@",)),
    ],
)
def test_faults(old: str, new: str, fragments: tuple[str, ...]) -> None:
    """By key."""
    text = MISTUNED if (old in MISTUNED and old not in WAVE) or "stiffness@" in new else WAVE
    assert old in text
    with pytest.raises(InputError) as raised:
        Case.from_text(text.replace(old, new, 1))
    for fragment in fragments:
        expected = "nodal diameter" if fragment == "ND" else fragment
        assert expected in str(raised.value)
