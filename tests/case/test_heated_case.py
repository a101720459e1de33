"""Temperature fields and supports that move in case files: against a heated bar, as a script, their faults."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest
from helpers.command import slipstick

import slipstick as ss
from slipstick.case.script import python_script
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.model_file import load_model, save_model

E, ALPHA, L, AREA, GAP, KN = 2e11, 1.2e-5, 0.2, 1e-4, 5e-5, 3e8
STEEL = ss.Material(young=E, poisson=0.0, density=7800.0)

CASE = """
format = 1
harmonics = "0..3"

[structure]
kind = "fe"
file = "model.h5"
material = { expansion = 1.2e-5, reference = 20.0 }
keep = [KEPT]
modes = 6
loss_factor = 0.01
stress = "all"
temperature = { hot = 120.0, uneven = { all = 20.0, x1 = 220.0 } }
displacement = { jaw = { x0 = [1, 0, 0] } }

[[contact]]
name = "stop"
normal = { NORMAL }
kn = 3e8
gap = 5e-5

[[preload]]
name = "heat"
temperature = "hot"

[[preload]]
name = "push"
displacement = { jaw = 2e-5 }

[[load]]
dof = "FIRST"
cos = 1.0

[response]
from = "1 Hz"
to = "2 Hz"
"""


def text() -> str:
    mesh = bar()
    end = [f"n{label}x" for label in mesh.labels[mesh.surface("x1").nodes]]
    kept, normal = ", ".join(f'"{dof}"' for dof in end), ", ".join(f"{dof} = 0.25" for dof in end)
    return CASE.replace("KEPT", kept).replace("NORMAL", normal).replace("FIRST", end[0])


def bar():
    return box((L, 0.01, 0.01), (10, 1, 1), "hex8i")


def model_file(folder: Path, material: ss.Material = STEEL) -> Path:
    model = assemble_mesh(MeshModel(mesh=bar()), source="bar", material=material, fixed=("x0",))
    return save_model(model, folder / "model.h5")


def read(folder: Path, *pairs: tuple[str, str], material: ss.Material = STEEL) -> ss.Case:
    model_file(folder, material)
    made = text()
    for old, new in pairs:
        assert old in made
        made = made.replace(old, new)
    return ss.Case.from_text(made, folder / "case.toml")


def faults(folder: Path, *pairs: tuple[str, str], material: ss.Material = STEEL) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        read(folder, *pairs, material=material).problem()
    return caught.value.sentences


def pressed(heated: float, moved: float = 0.0) -> float:
    return max(0.0, (ALPHA * heated * L + moved - GAP) / (L / (E * AREA) + 1.0 / KN))


def test_a_case_heats_and_pushes(tmp_path):
    case = read(tmp_path)
    force = case.preloaded.dataset.normal_force.values[:, 0]
    assert force == pytest.approx([pressed(100.0), pressed(100.0, 2e-5)], rel=1e-6)
    stress = ss.steady_response(case.problem(), omega=10.0).stress().stress
    assert stress.sel(component="xx", coefficient="0").values == pytest.approx(-force[1] / AREA, rel=1e-4)


def test_an_uneven_field(tmp_path):
    """The end alone is hot: half of the last element is warmed by its mean."""
    force = read(tmp_path, ('temperature = "hot"', "temperature = { uneven = 1.0 }")).preloaded.dataset.normal_force
    grown = ALPHA * 200.0 * (L / 10.0) / 2.0
    assert force.values[:, 0] == pytest.approx([0.0, 0.0])
    moved = read(tmp_path, ("jaw = 2e-5", "jaw = 4e-5"), ('temperature = "hot"', 'temperature = "uneven"'))
    wanted = (grown + 4e-5 - GAP) / (L / (E * AREA) + 1.0 / KN)
    assert moved.preloaded.dataset.normal_force.values[1, 0] == pytest.approx(wanted, rel=1e-6)


def test_a_case_at_a_temperature(tmp_path):
    """Young's modulus falls by half: the bar gives way more, its stiffness is that of the table."""
    table = ss.Material(young=[(20.0, E), (220.0, 0.5 * E)], poisson=0.0, density=7800.0)
    case = read(tmp_path, ("modes = 6", "modes = 6\nat_temperature = 120.0"), material=table)
    wanted = (ALPHA * 100.0 * L - GAP) / (L / (0.75 * E * AREA) + 1.0 / KN)
    assert case.preloaded.dataset.normal_force.values[0, 0] == pytest.approx(wanted, rel=1e-6)


def test_a_script_computes_the_same(tmp_path):
    case = read(tmp_path, ("modes = 6", "modes = 6\ninitial_temperature = 30.0"))
    changed = text().replace("modes = 6", "modes = 6\ninitial_temperature = 30.0")
    source = python_script(changed, "case.toml", tmp_path)
    path = tmp_path / "script.py"
    path.write_text(source)
    problem = runpy.run_path(str(path), run_name="imported")["problem"]()
    assert problem.loads == case.problem().loads
    assert case.preloaded.dataset.normal_force.values[0, 0] == pytest.approx(pressed(90.0), rel=1e-6)


def test_check_says_it(tmp_path):
    model_file(tmp_path)
    (tmp_path / "case.toml").write_text(text())
    said = slipstick("check", tmp_path / "case.toml").output
    assert "load steps: heat, push" in said
    assert "  heat: temperature hot\n  push: support jaw moved to 2e-05\n" in said
    assert "load shapes: temperature hot, temperature uneven, displacement jaw" in said


def test_a_model_at_a_temperature_is_kept(tmp_path):
    table = ss.Material(young=[(20.0, E), (220.0, 0.5 * E)], poisson=0.0, density=7800.0, expansion=ALPHA)
    hot = ss.models.at_temperature(load_model(model_file(tmp_path, table), quiet=True), {"all": 20.0, "x1": 220.0})
    again = load_model(save_model(hot, tmp_path / "hot.h5"), quiet=True)
    assert again.materials == hot.materials
    assert (again.mesh.temperature == hot.mesh.temperature).all()
    assert abs(again.K - hot.K).max() == 0.0


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        (
            ('temperature = "hot"', 'temperature = "hott"'),
            "[[preload]] 'heat' temperature.hott: the structure has no temperature 'hott'; did you mean 'hot'?",
        ),
        (
            ("{ jaw = 2e-5 }", "{ jew = 2e-5 }"),
            "[[preload]] 'push' displacement.jew: the structure has no displacement 'jew'; did you mean 'jaw'?",
        ),
        (
            ('temperature = "hot"', "temperature = 120.0"),
            "[[preload]] 'heat' temperature: found 120.0; expected the name of a temperature field",
        ),
        (("{ jaw = 2e-5 }", '{ jaw = "20 um" }'), "[[preload]] 'push' displacement: found"),
        (("x1 = 220.0", "x9 = 220.0"), "[structure] temperature.uneven.x9: there is no node set 'x9' in the model"),
        (
            ("hot = 120.0", 'hot = "120 C"'),
            "[structure] temperature.hot: found '120 C'; expected a temperature, temperatures by node set",
        ),
        (("x0 = [1, 0, 0]", "x1 = [1, 0, 0]"), "[structure] displacement.jaw: 4 of the dofs that move are not held"),
        (("x0 = [1, 0, 0]", "x0 = [1, 0]"), "[structure] displacement: found"),
        (
            ("material = { expansion = 1.2e-5, reference = 20.0 }\n", ""),
            "expansion is missing, and the temperature changes",
        ),
        (
            ("expansion = 1.2e-5, reference = 20.0", "expansion = 1.2e-5"),
            "reference is missing, and the temperature changes",
        ),
        (
            ("expansion = 1.2e-5", "expansion = [[20.0, 1e-5], [100.0, 2e-5]]"),
            "found a temperature of 120; expected 20 to 100, which its table covers",
        ),
        (("expansion = 1.2e-5", "expansion = [[20.0, 1e-5]]"), "at least two, temperatures ascending"),
        (("modes = 6", "modes = 6\nat_temperature = 300.0"), "no material of bar changes with temperature"),
    ],
)
def test_faults(tmp_path, pair, said):
    found = faults(tmp_path, pair)
    assert any(said in sentence for sentence in found), found


def test_a_temperature_beside_matrices_is_refused():
    """A structure of matrices has no temperature fields unless its load shapes are called so."""
    case = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["u"]
mass = [[2.0]]
stiffness = [[1e4]]
[[contact]]
name = "stop"
normal = "u"
kn = 1e6
gap = 0.0
[[preload]]
temperature = "hot"
[response]
from = 1.0
to = 2.0
"""
    with pytest.raises(InputError) as caught:
        ss.Case.from_text(case).problem()
    assert "the structure has no temperature 'hot'" in str(caught.value)


def test_speed_is_a_load_step_of_a_case(tmp_path):
    model_file(tmp_path)
    spun = text().replace('name = "push"\ndisplacement = { jaw = 2e-5 }', 'name = "spin"\nspeed = "60000 rpm"')
    spun = spun.replace('temperature = "hot"', "temperature = {}").replace(
        "displacement = { jaw = { x0 = [1, 0, 0] } }", "centrifugal = { direction = [0, 0, 1] }"
    )
    case = ss.Case.from_text(spun, tmp_path / "case.toml")
    speed = 60000 * 3.141592653589793 / 30
    free = 7800.0 * speed**2 / E * L**3 / 3
    pressed = (free - GAP) / (L / (E * AREA) + 1 / KN)
    assert pressed > 1e5
    assert case.preloaded.dataset.normal_force.values[-1, 0] == pytest.approx(pressed, rel=1e-3)
    (tmp_path / "case.toml").write_text(spun, encoding="utf-8")
    (tmp_path / "case.py").write_text(python_script(spun, "case.toml", tmp_path), encoding="utf-8")
    made = runpy.run_path(str(tmp_path / "case.py"))["problem"]()
    assert made.contacts[0].contact.gap == case.problem().contacts[0].contact.gap
    assert [load.cos for load in made.loads] == pytest.approx([load.cos for load in case.problem().loads])
    shown = slipstick("check", tmp_path / "case.toml")
    assert "spin: speed 6283.19 rad/s" in shown.output
    wrong = spun.replace("centrifugal = { direction = [0, 0, 1] }", "")
    with pytest.raises(InputError, match=r"\[\[preload\]\] 'spin' speed: the structure has no centrifugal forces"):
        ss.Case.from_text(wrong, tmp_path / "case.toml")
    with pytest.raises(InputError, match=r"speed: found .fast."):
        ss.Case.from_text(spun.replace("60000 rpm", "fast"), tmp_path / "case.toml")
